#include "hal/links/claim.hpp"

#include "hal/links/tcp_link.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <optional>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/un.h>
#include <unistd.h>

namespace moldloft::hal {
namespace {

struct Address {
  sockaddr_un name{};
  socklen_t size = 0;
  const sockaddr* generic() const { return reinterpret_cast<const sockaddr*>(&name); }
};

// A name that begins with a zero byte is no file.
std::optional<Address> address_of(const std::string& name) {
  const std::string whole = "moldloft/" + name;
  Address a;
  if (whole.size() >= sizeof a.name.sun_path) return std::nullopt;
  a.name.sun_family = AF_UNIX;
  whole.copy(a.name.sun_path + 1, whole.size());
  a.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + whole.size());
  return a;
}

int new_socket() { return ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0); }

int process_that_listens(const Address& address) {
  const int asking = new_socket();
  ucred who{};
  socklen_t size = sizeof who;
  const bool known = ::connect(asking, address.generic(), address.size) == 0 &&
                     ::getsockopt(asking, SOL_SOCKET, SO_PEERCRED, &who, &size) == 0;
  if (asking >= 0) ::close(asking);
  return known ? who.pid : 0;
}

}  // namespace

std::expected<Claim, std::string> Claim::take(const std::string& name, const std::string& words) {
  const auto address = address_of(name);
  if (!address) return std::unexpected{words + ": its name is too long"};
  Claim claim{new_socket()};
  if (claim.socket_ >= 0 && ::bind(claim.socket_, address->generic(), address->size) == 0 &&
      ::listen(claim.socket_, SOMAXCONN) == 0)
    return claim;
  const int error = errno;
  if (error != EADDRINUSE) return std::unexpected{fmt::format("{}: {}", words, strerrordesc_np(error))};
  const int process = process_that_listens(*address);
  return std::unexpected{
      fmt::format("{} is in use by {}: one controller at a time; wait for its end, or stop it", words,
                  process > 0 ? fmt::format("process {}", process) : "another process")};
}

Claim::~Claim() {
  if (socket_ >= 0) ::close(socket_);
}

std::expected<Claim, std::string> claim_address(const std::string& host, std::uint16_t port) {
  const std::string where = tcp_address(host);
  if (where.empty()) return Claim{};  // cannot be reached either
  return Claim::take(fmt::format("scanner/{}/{}", where, port), fmt::format("scanner {}:{}", host, port));
}

bool is_pseudo_terminal(dev_t device) noexcept {
  constexpr unsigned first = 136, last = 143;  // major numbers of Linux
  return major(device) >= first && major(device) <= last;
}

std::expected<Claim, std::string> claim_serial(const std::string& device) {
  struct stat port {};
  if (::stat(device.c_str(), &port) != 0 || !S_ISCHR(port.st_mode)) return Claim{};
  // A pseudo-terminal's number is given away again as soon as it is gone, while a process that had it
  // may still live. The time of its making tells the two apart. It is not asked of a real port, whose
  // owner may change.
  std::string name = fmt::format("serial/{}:{}", major(port.st_rdev), minor(port.st_rdev));
  if (is_pseudo_terminal(port.st_rdev))
    name += fmt::format(":{}.{:09}", port.st_ctim.tv_sec, port.st_ctim.tv_nsec);
  return Claim::take(name, "robot's port " + device);
}

std::expected<Claim, std::string> claim_folder(const std::string& path) {
  struct stat folder {};
  if (::stat(path.c_str(), &folder) != 0)
    return std::unexpected{fmt::format("{}: {}", path, strerrordesc_np(errno))};
  return Claim::take(
      fmt::format("folder/{}:{}:{}", major(folder.st_dev), minor(folder.st_dev), folder.st_ino), path);
}

// A line of /proc/locks: "1: FLOCK  ADVISORY  WRITE 29454 fe:00:11010177 0 EOF".
int process_with_lock(int file) noexcept {
  struct stat what {};
  if (::fstat(file, &what) != 0) return 0;
  std::FILE* locks = std::fopen("/proc/locks", "re");
  if (locks == nullptr) return 0;
  int found = 0;
  char line[256];
  while (found == 0 && std::fgets(line, sizeof line, locks) != nullptr) {
    int process = 0;
    unsigned device_major = 0, device_minor = 0;
    unsigned long inode = 0;
    if (std::sscanf(line, "%*d: FLOCK %*s %*s %d %x:%x:%lu", &process, &device_major, &device_minor,
                    &inode) == 4 &&
        device_major == major(what.st_dev) && device_minor == minor(what.st_dev) && inode == what.st_ino)
      found = process;
  }
  std::fclose(locks);
  return found;
}

}  // namespace moldloft::hal
