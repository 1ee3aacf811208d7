#include "firmware_like/process/console.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <mutex>
#include <optional>
#include <poll.h>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;

constexpr hal::Duration patience_with_a_reader = 1s;

// What a descriptor that is ready surely takes at once when it must be left as it is: a part of a pipe's page.
constexpr std::size_t small_piece = 256;

std::array<bool, 3> was_closed{};

// A descriptor written to without waiting. Its open file is shared with the shell and with others, so it is
// not made non-blocking itself. A terminal or a pipe is opened a second time; a socket is asked not to block
// at each write.
class Outlet {
 public:
  explicit Outlet(int descriptor) : file_{descriptor} {
    struct stat what {};
    if (::fstat(descriptor, &what) != 0) return;
    device_ = what.st_dev;
    inode_ = what.st_ino;
    is_socket_ = S_ISSOCK(what.st_mode);
    // A file's second opening would have a place of its own in it; a file does not keep its writers waiting.
    never_waits_ = S_ISREG(what.st_mode);
    if (is_socket_ || never_waits_) return;
    const std::string same = fmt::format("/proc/self/fd/{}", descriptor);
    const int again = ::open(same.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (again < 0) return;  // somebody else's terminal, or no reader
    file_ = again;
    never_waits_ = true;
  }
  ~Outlet() {
    if (file_ > STDERR_FILENO) ::close(file_);
  }
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;

  // Whether the descriptor still leads where it led: it may have been redirected since.
  bool leads_to(int descriptor) const noexcept {
    struct stat what {};
    return ::fstat(descriptor, &what) == 0 && what.st_dev == device_ && what.st_ino == inode_;
  }

  // Whether all of it was written; otherwise errno says why not.
  bool write(std::string_view text, hal::Duration patience) noexcept {
    hal::SteadyClock clock;
    const hal::Instant end = clock.now() + patience;
    while (!text.empty()) {
      const ssize_t count = put(text);
      if (count > 0) {
        text.remove_prefix(static_cast<std::size_t>(count));
      } else if (count < 0 && errno == EAGAIN) {
        const hal::Duration left = end - clock.now();
        if (left <= 0ns || !is_ready(left)) return false;
      } else if (count == 0 || errno != EINTR) {
        return false;
      }
    }
    return true;
  }

 private:
  ssize_t put(std::string_view text) noexcept {
    if (is_socket_) return ::send(file_, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (never_waits_) return ::write(file_, text.data(), text.size());
    if (!is_ready(0ns)) return -1;
    return ::write(file_, text.data(), std::min(text.size(), small_piece));
  }
  bool is_ready(hal::Duration limit) noexcept {
    pollfd look{.fd = file_, .events = POLLOUT, .revents = 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(limit).count();
    if (::poll(&look, 1, static_cast<int>(ms)) > 0) return true;
    errno = EAGAIN;
    return false;
  }

  int file_;
  bool is_socket_ = false, never_waits_ = false;
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

class StandardError {
 public:
  void say(std::string_view text) noexcept {
    const std::lock_guard one_at_a_time{mutex_};
    if (text.empty()) return;
    if (!outlet_ || !outlet_->leads_to(STDERR_FILENO)) {
      outlet_.emplace(STDERR_FILENO);
      clogged_ = cut_ = false;
    }
    const hal::Duration patience = clogged_ ? 0ns : patience_with_a_reader;
    // What was cut off in the middle of a line is not gone on with.
    const bool written = !was_closed[STDERR_FILENO] && (!cut_ || outlet_->write("\n", patience)) &&
                         outlet_->write(text, patience);
    cut_ = clogged_ = !written;
    if (!written) ++unsaid_;
  }
  std::uint64_t unsaid() const noexcept { return unsaid_; }

 private:
  std::mutex mutex_;
  std::optional<Outlet> outlet_;
  bool clogged_ = false, cut_ = false;
  std::atomic<std::uint64_t> unsaid_{0};
};

StandardError& standard_error() {
  static StandardError only;
  return only;
}

int output_error = 0;  // the first errno of standard output; 0: none

bool keep_error(bool written) noexcept {
  if (!written && output_error == 0) output_error = errno == 0 ? EIO : errno;
  return written;
}

bool can_show() noexcept {
  errno = EBADF;
  return keep_error(!was_closed[STDOUT_FILENO]) && output_error == 0;
}

}  // namespace

void open_console() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) >= 0) continue;
    was_closed[static_cast<std::size_t>(descriptor)] = true;
    // The lowest free number is the one that is missing: those below it are open by now.
    [[maybe_unused]] const int opened = ::open("/dev/null", O_RDWR);
  }
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

void say(std::string_view text) noexcept { standard_error().say(text); }
std::uint64_t unsaid() noexcept { return standard_error().unsaid(); }

void show(std::string_view text) noexcept {
  if (text.empty() || !can_show()) return;
  keep_error(std::fwrite(text.data(), 1, text.size(), stdout) == text.size());
}

void flush_shown() noexcept { keep_error(std::fflush(stdout) == 0); }

bool show_within(hal::Duration limit, std::string_view text) noexcept {
  return !was_closed[STDOUT_FILENO] && Outlet{STDOUT_FILENO}.write(text, limit);
}

int end_of_output(int exit_code, std::string_view program) noexcept {
  flush_shown();
  if (output_error == 0) return exit_code;
  const char* why = output_error == EPIPE    ? "its reader has gone"
                    : output_error == EBADF  ? "it is closed"
                    : output_error == ENOSPC ? "the disk is full"
                    : output_error == EAGAIN ? "nobody reads it"
                                             : strerrordesc_np(output_error);
  say(fmt::format("{}: standard output cannot be written: {}\n", program, why));
  return exit_code == 0 ? 1 : exit_code;
}

}  // namespace moldloft::firmware_like
