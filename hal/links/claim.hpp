// One process at a time has a device or a folder. A claim is a unix socket in the abstract namespace. It has
// no file and belongs to no user. It ends with its process, however that ends, so no claim is ever stale. The
// kernel knows whose it is. Processes in other network namespaces (containers) do not see it. What they can
// reach too, a serial port or a folder, is locked by the kernel as well (serial_link.hpp, run_folder.hpp).
//
// Thread       any
// Blocking     never
// Failure      one line that names the thing and the process that has it
#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <sys/types.h>
#include <utility>

namespace moldloft::hal {

class Claim {
 public:
  Claim() = default;
  // `name` means the same thing in every process, in a hundred characters at most; `words` name it to a person.
  static std::expected<Claim, std::string> take(const std::string& name, const std::string& words);
  Claim(Claim&& other) noexcept : socket_{std::exchange(other.socket_, -1)} {}
  Claim& operator=(Claim&& other) noexcept {
    std::swap(socket_, other.socket_);
    return *this;
  }
  ~Claim();  // gives it back

 private:
  explicit Claim(int socket) : socket_{socket} {}
  int socket_ = -1;
};

// The scanner at an address; spellings of one address are one claim.
std::expected<Claim, std::string> claim_address(const std::string& host, std::uint16_t port);
// The port behind a device's name, also by way of symbolic links. Nothing is claimed where there is
// no device yet.
std::expected<Claim, std::string> claim_serial(const std::string& device);
std::expected<Claim, std::string> claim_folder(const std::string& path);

// Whether a device's number (st_rdev) is that of a pseudo-terminal's near end.
bool is_pseudo_terminal(dev_t device) noexcept;

// The process that holds a flock() on this open file, as far as the kernel tells; 0: unknown.
int process_with_lock(int file) noexcept;

}  // namespace moldloft::hal
