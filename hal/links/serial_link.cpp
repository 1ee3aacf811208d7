#include "hal/links/serial_link.hpp"

#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/base/realtime_section.hpp"
#include "hal/links/claim.hpp"

#include <libserialport.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace moldloft::hal {
namespace {

// libserialport 0.1.1 takes names in /dev only, and looks up what follows "/dev/" a second time under
// /sys/class/tty. Three steps up lead to the root from both places, so any path can be written as one in
// /dev. The second look-up wants a symbolic link, which a pseudo-terminal's name in /tmp or /run is.
std::string name_for_libserialport(const std::string& device) {
  std::error_code ignored;
  const std::string path = std::filesystem::absolute(device, ignored).lexically_normal();
  return path.starts_with("/dev/") ? path : "/dev/../../.." + path;
}

class SerialLink final : public ByteLink {
 public:
  SerialLink(std::string device, int baud) : device_{std::move(device)}, baud_{baud} {}
  ~SerialLink() override { release(); }
  SerialLink(const SerialLink&) = delete;
  SerialLink& operator=(const SerialLink&) = delete;

  void open() override {
    const PromiseSuspended opening;
    checked_at_run_time([this] { open_port(); });
  }

  void close() noexcept override {
    release();
    state_ = LinkState::closed;
    why_ = "closed";
  }

  // libserialport has opened the port so that it does not wait, and these two calls do nothing but ask it.
  std::size_t read(std::span<std::byte> out) noexcept override {
    if (state_ != LinkState::open || out.empty()) return 0;
    return moved(
        answered_at_once([&] { return answer_of(sp_nonblocking_read(port_, out.data(), out.size())); }));
  }

  std::size_t write(std::span<const std::byte> in) noexcept override {
    if (state_ != LinkState::open || in.empty()) return 0;
    return moved(
        answered_at_once([&] { return answer_of(sp_nonblocking_write(port_, in.data(), in.size())); }));
  }

  // A port that is gone reads as 0 bytes, like a silent one: only the hang-up on its handle tells
  // the two apart.
  LinkState state() noexcept override {
    if (state_ != LinkState::open) return state_;
    const bool hung_up = answered_at_once([&] {
      pollfd look{.fd = handle_, .events = 0, .revents = 0};
      return ::poll(&look, 1, 0) > 0 && (look.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
    });
    if (hung_up) lose("{} has hung up (adapter pulled out, or the far end closed)", device_);
    return state_;
  }

  std::string_view why() const noexcept override { return why_; }

 private:
  void open_port() {
    close();
    if (!can_be_opened()) return;
    if (sp_get_port_by_name(name_for_libserialport(device_).c_str(), &port_) != SP_OK) {
      lose("{} is not a serial port", device_);
      return;
    }
    if (sp_open(port_, SP_MODE_READ_WRITE) != SP_OK) {
      const int error = sp_last_error_code();
      lose("{} cannot be opened: {}", device_,
           error == EBUSY ? "another program has it for itself"
           : error == 0   ? "not a serial port"
                          : strerrordesc_np(error));
      return;
    }
    is_open_ = true;
    int handle = -1;
    if (sp_get_port_handle(port_, &handle) != SP_OK || handle < 0) {
      lose("{} gives no handle", device_);
      return;
    }
    handle_ = handle;
    if (!is_ours_alone() || !configure()) return;
    sp_flush(port_, SP_BUF_BOTH);  // what lay in the buffers belongs to an earlier life
    state_ = LinkState::open;
    why_ = "";
  }

  // Two programs on one line garble each other's commands. The lock is for those who ask for one; the exclusive mode
  // keeps out those who do not. It would outlive us on a pseudo-terminal, whose other end stays open.
  bool is_ours_alone() {
    if (::flock(handle_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      lose("{} is in use by another program (process {}): end it there", device_, process_with_lock(handle_));
      return false;
    }
    struct stat port {};
    if (::fstat(handle_, &port) == 0 && !is_pseudo_terminal(port.st_rdev)) ::ioctl(handle_, TIOCEXCL);
    return true;
  }

  // libserialport says "device not found" for whatever it dislikes; the file system knows better.
  bool can_be_opened() {
    if (::access(device_.c_str(), F_OK) != 0) {
      lose("{} does not exist: is the robot's cable plugged in, is the name right?", device_);
    } else if (::access(device_.c_str(), R_OK | W_OK) != 0) {
      lose("no permission for {}: the user must be in the group that owns it (often dialout)", device_);
    } else {
      return true;
    }
    return false;
  }

  bool configure() {
    const bool framed = sp_set_bits(port_, 8) == SP_OK && sp_set_parity(port_, SP_PARITY_NONE) == SP_OK &&
                        sp_set_stopbits(port_, 1) == SP_OK &&
                        sp_set_flowcontrol(port_, SP_FLOWCONTROL_NONE) == SP_OK;
    if (!framed) {
      lose("{} does not take 8N1 without flow control", device_);
    } else if (sp_set_baudrate(port_, baud_) != SP_OK) {
      lose("{} does not take {} baud", device_, baud_);
    } else {
      return true;
    }
    return false;
  }

  struct Answer {
    int count, error;
  };
  static Answer answer_of(int result) noexcept { return {result, result < 0 ? errno : 0}; }

  std::size_t moved(const Answer& answer) noexcept {
    if (answer.count >= 0) return static_cast<std::size_t>(answer.count);
    // A table of constants.
    lose("{}: {}", device_, checked_at_run_time([&] { return strerrordesc_np(answer.error); }));
    return 0;
  }

  void release() noexcept MOLDLOFT_NONBLOCKING {
    if (port_ == nullptr) return;
    const PromiseSuspended closing;
    checked_at_run_time([this] { give_back(); });
  }

  void give_back() noexcept {
    if (is_open_) sp_close(port_);
    sp_free_port(port_);
    port_ = nullptr;
    is_open_ = false;
    handle_ = -1;
  }

  template <typename... Args>
  void lose(TextPattern<Args...> pattern, Args&&... args) noexcept {
    why_ = Message::format(pattern, std::forward<Args>(args)...);
    state_ = LinkState::lost;
    release();
  }

  std::string device_;
  int baud_;
  sp_port* port_ = nullptr;
  bool is_open_ = false;
  int handle_ = -1;
  LinkState state_ = LinkState::closed;
  Message why_ = "not opened yet";
};

}  // namespace

std::unique_ptr<ByteLink> make_serial_link(std::string device, int baud) {
  return std::make_unique<SerialLink>(std::move(device), baud);
}

}  // namespace moldloft::hal
