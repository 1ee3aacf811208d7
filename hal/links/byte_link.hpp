// A byte link: bytes to and from one device, never waiting.
//
// Thread       the control thread only
// Blocking     never; read and write move what they can now
// Allocation   none after open()
// Failure      a lost link stays lost until open() is called again; why() says what happened
#pragma once

#include "hal/base/realtime.hpp"

#include <cstddef>
#include <span>
#include <string_view>

namespace moldloft::hal {

enum class LinkState { closed, opening, open, lost };

class ByteLink {
 public:
  virtual ~ByteLink() = default;

  virtual void open() MOLDLOFT_NONBLOCKING = 0;  // starts to open; state() tells when it is done
  virtual void close() noexcept MOLDLOFT_NONBLOCKING = 0;

  // Moves bytes that have arrived into `out`; returns how many, 0 if none are there now.
  virtual std::size_t read(std::span<std::byte> out) noexcept MOLDLOFT_NONBLOCKING = 0;

  // Takes what fits into the send buffer; returns how many bytes were taken. The rest is the caller's to keep.
  virtual std::size_t write(std::span<const std::byte> in) noexcept MOLDLOFT_NONBLOCKING = 0;

  // Looks at the link again (a pending connect may have ended, a peer may have hung up) and returns its
  // state. Two looks may get two answers, so a caller that decides by the state asks once.
  virtual LinkState state() noexcept MOLDLOFT_NONBLOCKING = 0;
  virtual std::string_view why() const noexcept MOLDLOFT_NONBLOCKING = 0;
};

}  // namespace moldloft::hal
