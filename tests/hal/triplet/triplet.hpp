// A second make of scanner, as little like PSC1 as it can be: every point is a triplet of float32, there is no word
// between trigger and frame, and no frame is kept. Little-endian.
//
//     message   magic "TRIP" u32, type u32, body's size u32, CRC-32C of the body u32, body
//     hello     (1) host: empty; scanner: name 16 bytes, stripes u32, points of a stripe u32, field x, y, depth f32 mm
//     shot      (2) host: id u32
//     scan      (3) scanner: id u32, stripes u32, time of exposure u64 ns; of each stripe: index u16, points u16, then
//               x, y, z f32 of each point, mm; a missing point is three NaN
#pragma once

#include "hal/scanner/frame_codec.hpp"

#include <array>
#include <optional>

namespace moldloft::triplet {

inline constexpr std::uint32_t magic = 0x50495254;
inline constexpr std::size_t head_size = 16, scan_head_size = 16, stripe_head_size = 4, point_size = 12;

enum class Type : std::uint32_t { hello = 1, shot = 2, scan = 3 };

struct Head {
  Type type{};
  std::uint32_t body_size = 0, crc = 0;
};

struct Info {
  std::array<char, 16> name{};
  std::uint32_t stripes = 0, points = 0;
  float field_x_mm = 0, field_y_mm = 0, depth_mm = 0;
};

constexpr std::size_t largest_scan(std::size_t stripes, std::size_t points) {
  return head_size + scan_head_size + stripes * stripe_head_size + points * point_size;
}

std::optional<Head> decode_head(std::span<const std::byte> bytes) noexcept;
// Head in front of the body that stands at head_size; the whole message's size.
std::size_t finish(Type, std::size_t body_size, std::span<std::byte> message) noexcept;

// The lines of a scan into the frame, without its points; false for a body that contradicts itself or does not fit.
bool begin_scan(std::span<const std::byte> body, hal::Frame&) noexcept;
// Points first .. last - 1.
void decode_points(std::span<const std::byte> body, std::size_t first, std::size_t last,
                   hal::Frame&) noexcept;

extern const hal::FrameCodec codec;

}  // namespace moldloft::triplet
