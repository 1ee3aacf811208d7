#include "host_sim/devices/pty_link.hpp"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <poll.h>
#include <stdlib.h>
#include <system_error>
#include <termios.h>
#include <unistd.h>

// A simulated device: its descriptors do not wait either, but it promises nothing.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::host_sim {

using hal::LinkState;

namespace {

namespace fs = std::filesystem;

// Bytes as they are, no echo, no line editing. The device is opened and closed once: before its first opening
// a master shows no hang-up, and one could not tell that nobody is there.
bool make_raw(const char* device) {
  const int slave = ::open(device, O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (slave < 0) return false;
  termios settings{};
  const bool good = ::tcgetattr(slave, &settings) == 0;
  ::cfmakeraw(&settings);
  const bool set = good && ::tcsetattr(slave, TCSANOW, &settings) == 0;
  ::close(slave);
  return set;
}

}  // namespace

std::expected<std::unique_ptr<PtyLink>, SimError> PtyLink::create(const std::string& link_path) {
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  const auto refused = [&](std::string_view why) {
    if (master >= 0) ::close(master);
    return std::unexpected(SimError{fmt::format("robot terminal {}: {}", link_path, why)});
  };
  std::array<char, 128> device{};
  if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0 ||
      ::ptsname_r(master, device.data(), device.size()) != 0 || !make_raw(device.data())) {
    return refused(std::strerror(errno));
  }
  std::error_code error;
  const fs::path path = fs::absolute(link_path, error);
  // A link left behind by an earlier run is ours to replace; anything else under that name is not.
  if (fs::is_symlink(fs::symlink_status(path, error))) fs::remove(path, error);
  fs::create_symlink(device.data(), path, error);
  if (error) return refused(error.message() + "; choose another name with --robot-pty");
  return std::unique_ptr<PtyLink>(new PtyLink(master, path.string()));
}

PtyLink::~PtyLink() {
  ::close(master_);
  std::error_code ignored;
  fs::remove(path_, ignored);
}

void PtyLink::open() {
  ::tcflush(master_, TCIOFLUSH);  // what an earlier host left unread
  state_ = LinkState::opening;
  why_ = "nobody has opened the device";
}

void PtyLink::close() noexcept {
  state_ = LinkState::closed;
  why_ = "closed";
}

std::size_t PtyLink::read(std::span<std::byte> out) noexcept {
  if (state_ != LinkState::open || out.empty()) return 0;
  const auto count = ::read(master_, out.data(), out.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

std::size_t PtyLink::write(std::span<const std::byte> in) noexcept {
  if (state_ != LinkState::open || in.empty()) return 0;
  const auto count = ::write(master_, in.data(), in.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

LinkState PtyLink::state() noexcept {
  if (state_ != LinkState::opening && state_ != LinkState::open) return state_;
  pollfd look{.fd = master_, .events = 0, .revents = 0};
  const bool hung_up = ::poll(&look, 1, 0) > 0 && (look.revents & POLLHUP) != 0;
  if (state_ == LinkState::opening && !hung_up) {
    state_ = LinkState::open;
    why_ = "";
  } else if (state_ == LinkState::open && hung_up) {
    state_ = LinkState::lost;
    why_ = "the host has closed the device";
  }
  return state_;
}

}  // namespace moldloft::host_sim
