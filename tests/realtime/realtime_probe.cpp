// Breaks the promise of a real-time section on purpose, in the way that its argument names, so that tests can see each
// guard fail. `all` does everything that the preloaded guard knows, each thing at least once; `allowed` what the
// control thread may do; `outside` everything, but beside the section.
#include "hal/base/clock.hpp"
#include "hal/base/realtime.hpp"
#include "hal/base/realtime_section.hpp"

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <dlfcn.h>
#include <fcntl.h>
#include <malloc.h>
#include <netdb.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <string_view>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>
#include <vector>

// What a hardened program calls instead, when the compiler knows how large the buffer is.
extern "C" {
ssize_t __read_chk(int fd, void* to, std::size_t n, std::size_t room);
ssize_t __pread_chk(int fd, void* to, std::size_t n, off_t at, std::size_t room);
ssize_t __recv_chk(int fd, void* to, std::size_t n, std::size_t room, int flags);
ssize_t __recvfrom_chk(int fd, void* to, std::size_t n, std::size_t room, int flags, sockaddr* from,
                       socklen_t* size);
int __poll_chk(pollfd* fds, nfds_t n, int timeout, std::size_t room);
int __ppoll_chk(pollfd* fds, nfds_t n, const timespec* timeout, const sigset_t* mask, std::size_t room);
std::size_t __fread_chk(void* to, std::size_t room, std::size_t size, std::size_t n, FILE* file);
int __open_2(const char* path, int flags);
int __open64_2(const char* path, int flags);
int __openat_2(int at, const char* path, int flags);
int __printf_chk(int flag, const char* pattern, ...);
int __fprintf_chk(FILE* file, int flag, const char* pattern, ...);
}

namespace {

using namespace moldloft::hal;

void* volatile sink = nullptr;  // what goes through it cannot be left out by the compiler

void use_the_heap() {
  sink = std::malloc(10);
  sink = std::realloc(sink, 10'000);
  std::free(sink);
  sink = std::calloc(3, 4);
  std::free(sink);
  sink = memalign(64, 64);
  std::free(sink);
  sink = std::aligned_alloc(64, 64);
  std::free(sink);
  void* aligned = nullptr;
  if (posix_memalign(&aligned, 64, 64) == 0) sink = aligned;
  std::free(sink);
  constexpr std::size_t page = 4096;
  void* const memory = mmap(nullptr, page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  mprotect(memory, page, PROT_READ);
  madvise(memory, page, MADV_NORMAL);
  munmap(memory, page);
}

int one() { return getpid(); }
void once() {}

// Somebody who signals for as long as somebody waits.
struct Signaller {
  pthread_cond_t condition = PTHREAD_COND_INITIALIZER;
  std::atomic<bool> done{false};
  pthread_t thread{};
};
void* signal_on(void* with) {
  auto& s = *static_cast<Signaller*>(with);
  while (!s.done) pthread_cond_signal(&s.condition);
  return nullptr;
}

void use_locks() {
  pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  pthread_rwlock_t rw = PTHREAD_RWLOCK_INITIALIZER;
  pthread_spinlock_t spin{};
  pthread_spin_init(&spin, PTHREAD_PROCESS_PRIVATE);
  pthread_once_t said = PTHREAD_ONCE_INIT;
  pthread_barrier_t barrier;
  pthread_barrier_init(&barrier, nullptr, 1);
  sem_t semaphore;
  sem_init(&semaphore, 0, 2);
  const timespec past{.tv_sec = 1, .tv_nsec = 0};

  pthread_rwlock_rdlock(&rw);
  pthread_rwlock_unlock(&rw);
  pthread_rwlock_wrlock(&rw);
  pthread_rwlock_unlock(&rw);
  pthread_spin_lock(&spin);
  pthread_spin_unlock(&spin);
  pthread_once(&said, once);
  pthread_barrier_wait(&barrier);
  sem_wait(&semaphore);
  sem_timedwait(&semaphore, &past);
  pthread_mutex_trylock(&mutex);
  pthread_mutex_unlock(&mutex);
  pthread_mutex_timedlock(&mutex, &past);
  pthread_mutex_unlock(&mutex);
  pthread_mutex_lock(&mutex);
  Signaller signaller;
  pthread_cond_timedwait(&signaller.condition, &mutex, &past);
  pthread_cond_clockwait(&signaller.condition, &mutex, CLOCK_MONOTONIC, &past);
  pthread_create(&signaller.thread, nullptr, signal_on, &signaller);
  pthread_cond_wait(&signaller.condition, &mutex);
  signaller.done = true;
  pthread_join(signaller.thread, nullptr);
  pthread_mutex_unlock(&mutex);
  static const int first_time = one();  // behind a guard that locks
  sink = const_cast<int*>(&first_time);
  syscall(SYS_getpid);
  sched_yield();
}

void use_sleeps() {
  const timespec moment{.tv_sec = 0, .tv_nsec = 1};
  timeval moment_us{.tv_sec = 0, .tv_usec = 1};
  nanosleep(&moment, nullptr);
  usleep(1);
  sleep(0);
  clock_nanosleep(CLOCK_MONOTONIC, 0, &moment, nullptr);  // relative
  poll(nullptr, 0, 1);
  ppoll(nullptr, 0, &moment, nullptr);
  select(0, nullptr, nullptr, nullptr, &moment_us);
  pselect(0, nullptr, nullptr, nullptr, &moment, nullptr);
  const int set = epoll_create1(0);
  epoll_event event;
  epoll_wait(set, &event, 1, 1);
  close(set);
}

// Bytes are there each time: what counts is that the descriptor would wait if there were none.
void use_descriptors() {
  int pair[2], closed_port = socket(AF_INET, SOCK_STREAM, 0);
  if (socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0) std::abort();
  char bytes[16] = {};
  iovec part{bytes, 2};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  (void)!write(pair[0], bytes, 2);
  (void)!writev(pair[0], &part, 1);
  (void)!pwrite(pair[0], bytes, 2, 0);  // fails, and would have waited
  send(pair[0], bytes, 2, 0);
  sendto(pair[0], bytes, 2, 0, nullptr, 0);
  sendmsg(pair[0], &message, 0);
  (void)!read(pair[1], bytes, 2);
  (void)!readv(pair[1], &part, 1);
  (void)!pread(pair[1], bytes, 2, 0);
  recv(pair[1], bytes, 2, 0);
  recvfrom(pair[1], bytes, 2, 0, nullptr, nullptr);
  recvmsg(pair[1], &message, 0);
  accept(pair[0], nullptr, nullptr);
  sockaddr nowhere{};
  connect(closed_port, &nowhere, sizeof nowhere);
  for (const int fd : {pair[0], pair[1], closed_port}) close(fd);
}

void use_files() {
  close(open("/dev/null", O_RDWR));
  close(open64("/dev/null", O_RDWR));
  const int null = openat(AT_FDCWD, "/dev/null", O_RDWR);
  fsync(null);
  fdatasync(null);
  close(null);
  FILE* file = fopen("/dev/null", "r+");
  FILE* other = fopen64("/dev/null", "r+");
  char byte = 0;
  (void)!fread(&byte, 1, 1, file);
  fwrite(&byte, 1, 1, file);
  fputs("x", file);
  fprintf(file, "%d", 1);
  fflush(file);
  fclose(file);
  fclose(other);
  puts("probe");
  printf("%s\n", "probe");
  addrinfo hint{}, *found = nullptr;
  hint.ai_flags = AI_NUMERICHOST;
  if (getaddrinfo("127.0.0.1", nullptr, &hint, &found) == 0) freeaddrinfo(found);
  sink = dlopen(nullptr, RTLD_NOW);
}

// Each once, under the name that hardening gives it; each counts as what it is.
void use_checked_names() {
  const int zero = __open_2("/dev/zero", O_RDONLY);
  close(__open64_2("/dev/zero", O_RDONLY));
  close(__openat_2(AT_FDCWD, "/dev/zero", O_RDONLY));
  char bytes[16] = {};
  (void)!__read_chk(zero, bytes, 2, sizeof bytes);
  (void)!__pread_chk(zero, bytes, 2, 0, sizeof bytes);
  (void)!__recv_chk(zero, bytes, 2, sizeof bytes, 0);  // no socket: these two fail, and would have waited
  (void)!__recvfrom_chk(zero, bytes, 2, sizeof bytes, 0, nullptr, nullptr);
  pollfd look{.fd = zero, .events = POLLIN, .revents = 0};
  const timespec moment{.tv_sec = 0, .tv_nsec = 1};
  __poll_chk(&look, 1, 1, sizeof look);
  __ppoll_chk(&look, 1, &moment, nullptr, sizeof look);
  (void)!__fread_chk(bytes, sizeof bytes, 1, 1, stdin);
  __printf_chk(1, "%s\n", "probe");
  __fprintf_chk(stdout, 1, "%s\n", "probe");
  close(zero);
}

void do_what_is_allowed() {
  int pair[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, pair) != 0) std::abort();
  char bytes[16] = {};
  answered_at_once([&] {
    pollfd look{.fd = pair[0], .events = POLLIN, .revents = 0};
    poll(&look, 1, 0);
    (void)!read(pair[0], bytes, 2);
    send(pair[0], bytes, 2, 0);
    recv(pair[1], bytes, 2, MSG_DONTWAIT);
  });
  SteadyClock clock;
  clock.sleep_until(clock.now() + 1us);
}

// For the sanitizer, which stops at the first thing: one at a time.
void break_the_rule(std::string_view how) {
  if (how == "heap") use_the_heap();
  if (how == "new") {
    std::vector<int> grows;
    grows.resize(1000);
    sink = grows.data();
  }
  if (how == "lock") use_locks();
  if (how == "sleep") use_sleeps();
  if (how == "read") use_descriptors();
  if (how == "file") use_files();
  if (how == "checked") use_checked_names();
}

void in_a_section(std::string_view how) noexcept MOLDLOFT_NONBLOCKING {
  // On purpose: the compiler must not see what the guards shall catch.
  checked_at_run_time([&] { break_the_rule(how); });
}

}  // namespace

int main(int count, char** words) {
  const std::string_view how = count > 1 ? words[1] : "";
  std::array<char, 4096> own_buffer;
  setvbuf(stdout, own_buffer.data(), _IOFBF, own_buffer.size());
  if (how == "outside" || how == "suspended") {
    if (how == "suspended") RealtimeSection::begin();
    const PromiseSuspended while_this_lasts;
    for (const auto each : {"heap", "new", "lock", "sleep", "read", "file"}) break_the_rule(each);
    return 0;
  }
  RealtimeSection::begin();
  if (how == "all")
    for (const auto each : {"heap", "new", "lock", "sleep", "read", "file"}) in_a_section(each);
  else if (how == "allowed")
    do_what_is_allowed();
  else
    in_a_section(how);
  RealtimeSection::end();
  return 0;
}
