// How the frames of one make of scanner lie in the bytes of its link. A run's store keeps those bytes and the
// codec's name; a stored run is decoded by it, without any driver.
//
// Thread       any; pure functions
// Blocking     never
// Allocation   the frame that is returned
// Failure      one phrase: what is wrong with the bytes. No size that they state is trusted beyond
//              their own number
#pragma once

#include "hal/scanner/frame.hpp"

#include <cstddef>
#include <expected>
#include <span>
#include <string_view>

namespace moldloft::hal {

struct FrameCodec {
  std::string_view name;
  // Bytes of a message in front of its payload. A stored shot names the payload (ShotRecord::payload_offset).
  std::size_t head_bytes = 0;
  // `message`: head and payload as they came on the link, whole.
  std::expected<Frame, std::string_view> (*decode)(std::span<const std::byte> message) = nullptr;
};

}  // namespace moldloft::hal
