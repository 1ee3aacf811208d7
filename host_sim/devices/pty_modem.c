/* Answers the modem-control requests that a pseudo-terminal refuses, so that libserialport takes it for a serial port.
 *
 * Preloaded into the program that opens the port. Where the kernel says ENOTTY to TIOCMGET, TIOCMSET, TIOCMBIS or
 * TIOCMBIC on a terminal, the answer is that all lines are up; everything else is the kernel's. For simulation only. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdarg.h>
#include <sys/ioctl.h>
#include <unistd.h>

int ioctl(int handle, unsigned long request, ...) {
  static int (*kernel)(int, unsigned long, ...);
  if (!kernel) *(void**)&kernel = dlsym(RTLD_NEXT, "ioctl");

  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);

  const int result = kernel(handle, request, argument);
  if (result == 0 || errno != ENOTTY) return result;
  const int is_modem_control =
      request == TIOCMGET || request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC;
  if (!is_modem_control || !isatty(handle)) {
    errno = ENOTTY; /* isatty() may have set its own */
    return result;
  }
  if (request == TIOCMGET) *(int*)argument = TIOCM_DTR | TIOCM_RTS | TIOCM_CTS | TIOCM_DSR | TIOCM_CAR;
  errno = 0;
  return 0;
}
