#include "firmware_like/process/whole_file.hpp"

#include "hal/base/clock.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <optional>
#include <poll.h>
#include <string>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr hal::Duration longest_wait_for_a_reader = 10s;

std::unexpected<Failure> cannot(const fs::path& path, int error) {
  const auto why = [&]() -> std::string {
    switch (error) {
      case ENOSPC:
      case EDQUOT:
        return "the disk is full; free some space";
      case EFBIG:
        return "larger than this user's files may be (ulimit -f)";
      case EROFS:
        return "the disk is read-only; give another place";
      case EACCES:
      case EPERM:
        return "no permission; give another place";
      case ENOENT:
        return path.has_parent_path()
                   ? fmt::format("there is no folder {}; make it first", path.parent_path().string())
                   : "the folder that the program runs in has been removed";
      case ENOTDIR:
        return fmt::format("{} is no folder", path.parent_path().string());
      case EISDIR:
        return "is a folder; give the name of a file";
      case EEXIST:
        return "is there already and holds something else; give another name, or --force to replace it";
      case ENXIO:
      case EPIPE:
      case EAGAIN:
        return "nobody reads from it";
      default:
        return strerrordesc_np(error);
    }
  }();
  return std::unexpected{Failure{fmt::format("{}: cannot be written: {}", path.string(), why)}};
}

// An open file of our own; 0 or the errno of what failed.
class OpenFile {
 public:
  explicit OpenFile(int file) : file_{file}, error_{file < 0 ? errno : 0} {}
  ~OpenFile() {
    if (file_ > STDERR_FILENO) ::close(file_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  int error() const { return error_; }
  int number() const { return file_; }

  void write(std::string_view text) {
    hal::SteadyClock clock;
    while (error_ == 0 && !text.empty()) {
      const ssize_t count = ::write(file_, text.data(), text.size());
      if (count > 0) {
        text.remove_prefix(static_cast<std::size_t>(count));
      } else if (count == 0 || (errno != EINTR && (errno != EAGAIN || !waits_for_reader()))) {
        error_ = count == 0 ? EIO : errno;
      }
    }
  }
  void close() {
    if (::close(std::exchange(file_, -1)) != 0 && error_ == 0) error_ = errno;
  }

 private:
  bool waits_for_reader() const {
    pollfd look{.fd = file_, .events = POLLOUT, .revents = 0};
    const bool ready = ::poll(&look, 1, static_cast<int>(longest_wait_for_a_reader / 1ms)) > 0;
    errno = EAGAIN;
    return ready;
  }
  int file_;
  int error_;
};

bool says_already(const fs::path& file, std::string_view content) {
  std::error_code failed;
  if (fs::file_size(file, failed) != content.size() || failed) return false;
  std::string there(content.size(), '\0');
  std::ifstream in{file, std::ios::binary};
  in.read(there.data(), static_cast<std::streamsize>(there.size()));
  return in && there == content;
}

// Where a chain of links ends; the file itself need not be there.
fs::path behind_links(fs::path path) {
  std::error_code failed;
  constexpr int longest_chain = 40;  // as the kernel has it
  for (int i = 0; i < longest_chain && fs::is_symlink(fs::symlink_status(path, failed)); ++i) {
    const fs::path next = fs::read_symlink(path, failed);
    if (failed) break;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return path;
}

std::expected<void, Failure> write_into(const fs::path& path, std::string_view content) {
  const bool shown = is_standard_output(path);
  // A file of standard output already holds what was written before; its place in it is kept.
  OpenFile file{shown ? STDOUT_FILENO : ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)};
  file.write(content);
  if (file.error() != 0) return cannot(path, file.error());
  return {};
}

// Beside it, so that it can take its place at once; under a name of its own, so that two writers never share it.
std::pair<std::string, int> new_file_beside(const fs::path& path) {
  static std::atomic<unsigned> number{0};
  constexpr int most_left_behind = 1000;  // by writers that were killed, with our process id
  for (int i = 0;; ++i) {
    const fs::path beside = path.parent_path() / fmt::format(".moldloft-{}-{}", ::getpid(), ++number);
    const int file = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file >= 0 || errno != EEXIST || i == most_left_behind) return {beside.string(), file};
  }
}

std::expected<void, Failure> replace(const fs::path& path, std::string_view content,
                                     std::optional<mode_t> mode) {
  const auto [beside, opened] = new_file_beside(path);
  OpenFile file{opened};
  if (file.error() != 0) return cannot(path, file.error());
  file.write(content);
  if (mode) ::fchmod(file.number(), *mode);
  file.close();
  const int error = file.error() != 0                             ? file.error()
                    : ::rename(beside.c_str(), path.c_str()) != 0 ? errno
                                                                  : 0;
  if (error == 0) return {};
  ::unlink(beside.c_str());
  return cannot(path, error);
}

}  // namespace

bool is_standard_output(const fs::path& path) {
  struct stat there {
  }, output{};
  return ::stat(path.c_str(), &there) == 0 && ::fstat(STDOUT_FILENO, &output) == 0 &&
         there.st_dev == output.st_dev && there.st_ino == output.st_ino;
}

std::expected<void, Failure> write_file(const fs::path& path, std::string_view content, Existing existing) {
  struct stat there {};
  const bool exists = ::stat(path.c_str(), &there) == 0;
  if (!exists && errno != ENOENT) return cannot(path, errno);
  if (!exists) return replace(behind_links(path), content, std::nullopt);
  if (S_ISDIR(there.st_mode)) return cannot(path, EISDIR);
  if (!S_ISREG(there.st_mode) || is_standard_output(path)) return write_into(path, content);
  if (existing == Existing::kept && there.st_size > 0) {
    if (says_already(path, content)) return {};
    return cannot(path, EEXIST);
  }
  if (::access(path.c_str(), W_OK) != 0) return cannot(path, errno);
  return replace(behind_links(path), content, there.st_mode & 07777);
}

}  // namespace moldloft::firmware_like
