// The scanner's wire, PSC1, as pure functions on bytes. The specification is PROTOCOLS.md; this is its code.
//
// Both sides use these functions: the driver of the cell and the device server of the simulation. Little-endian.
// Every message is a header of 32 bytes, a payload, and the payload's CRC-32C (absent when the payload is empty).
//
// Thread       any: no state
// Allocation   none; encoders write into the caller's buffer
// Failure      encoders return 0 when the buffer is too small; decoders say what is wrong
#pragma once

#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/scanner/frame_codec.hpp"

#include <array>
#include <cstdint>
#include <expected>
#include <optional>
#include <span>
#include <string_view>

namespace moldloft::hal::psc1 {

constexpr std::size_t header_size = 32;
constexpr std::size_t payload_crc_size = 4;
constexpr std::uint32_t max_payload = 8u
                                      << 20;  // a length beyond this is refused even under a valid header CRC
constexpr std::uint8_t protocol_version = 1;
constexpr std::uint16_t default_port = 4014;

enum class Type : std::uint8_t {
  hello = 1,
  config = 2,
  trigger = 3,
  exposed = 4,
  frame = 5,
  status = 6,
  ping = 7,
  error = 8,
  reset = 9
};

enum class Status : std::uint16_t {
  ok = 0,
  bad_state = 1,
  bad_argument = 2,
  unsupported = 3,
  busy = 4,
  sensor_fault = 5,
  timeout = 6
};

enum class Encoding : std::uint8_t { int16 = 0, float32 = 1 };

enum class Flaw {
  none,
  too_short,
  magic,
  header_crc,
  version,
  type,
  length,
  payload_crc,
  payload_size,
  content
};
std::string_view to_string(Flaw) MOLDLOFT_NONBLOCKING;
std::string_view to_string(Status) MOLDLOFT_NONBLOCKING;  // its name in PROTOCOLS.md
std::string_view to_string(Encoding) MOLDLOFT_NONBLOCKING;
std::optional<Encoding> encoding_named(std::string_view) MOLDLOFT_NONBLOCKING;

struct Header {
  Type type{};
  std::uint16_t flags = 0;
  std::uint32_t payload_length = 0;
  std::uint32_t request_id = 0;
  std::uint64_t acquired_ns = 0;  // sensor clock; 0 where nothing was acquired
};

struct HelloRequest {
  std::uint8_t version_min = protocol_version, version_max = protocol_version;
};
struct HelloReply {
  Status status = Status::ok;
  std::uint8_t version = protocol_version;
  std::uint32_t session_id = 0;  // new at each power-up of the sensor
  std::uint16_t max_stripes = 0, max_points_per_stripe = 0;
  float field_x_mm = 0, field_y_mm = 0, depth_mm = 0;
  std::uint32_t exposure_us = 0, processing_us = 0;
  std::array<char, 16> sensor{};
};
struct Config {  // asked and, with a status, granted
  Status status = Status::ok;
  Encoding encoding = Encoding::int16;
  bool intensity = true;
  std::uint16_t stripes = 0, points_per_stripe = 0;  // 0: as many as the sensor has
};
struct Trigger {
  std::uint32_t shot_id = 0;
};
struct Exposed {
  std::uint32_t shot_id = 0, session_id = 0;
  bool repeated = false;  // the shot had been exposed before: the stored frame follows
};
struct StatusReply {
  Status status = Status::ok;
  std::uint32_t session_id = 0, last_shot_id = 0;
  float temperature_c = 0;
};
struct ErrorReply {
  Status status = Status::ok;
  std::uint32_t shot_id = 0;  // 0 when the error belongs to no shot
  FixedText<100> text{};      // decoded: printable, whatever the bytes were
};

// How a FRAME's payload begins; the stripe table and the columns follow (PROTOCOLS.md, "FRAME").
struct FrameHead {
  std::uint32_t shot_id = 0, session_id = 0;
  std::uint16_t stripe_count = 0;
  Encoding encoding = Encoding::int16;
  bool intensity = true;
  std::uint32_t point_count = 0;
  std::array<float, 3> scale{}, offset{};  // int16: mm = offset + scale * value; -32768 is a missing point
};

// ---- headers
void encode_header(const Header&, std::span<std::byte, header_size> out) noexcept;
std::expected<Header, Flaw> decode_header(std::span<const std::byte, header_size> in) noexcept
    MOLDLOFT_NONBLOCKING;

// ---- whole messages: header, payload, payload CRC into `out`; returns the bytes written, 0 if `out` is too small
std::size_t encode(std::uint32_t request_id, const HelloRequest&,
                   std::span<std::byte> out) noexcept MOLDLOFT_NONBLOCKING;
std::size_t encode(std::uint32_t request_id, const HelloReply&, std::span<std::byte> out) noexcept;
std::size_t encode(std::uint32_t request_id, const Config&,
                   std::span<std::byte> out) noexcept MOLDLOFT_NONBLOCKING;
std::size_t encode(std::uint32_t request_id, const Trigger&,
                   std::span<std::byte> out) noexcept MOLDLOFT_NONBLOCKING;
std::size_t encode(std::uint32_t request_id, const Exposed&, std::uint64_t acquired_ns,
                   std::span<std::byte> out) noexcept;
std::size_t encode(std::uint32_t request_id, const StatusReply&, std::span<std::byte> out) noexcept;
std::size_t encode(std::uint32_t request_id, const ErrorReply&, std::span<std::byte> out) noexcept;
std::size_t encode_empty(std::uint32_t request_id, Type,
                         std::span<std::byte> out) noexcept
    MOLDLOFT_NONBLOCKING;  // PING, RESET, STATUS request

// A frame as it goes over the wire. int16 takes scale and offset from the extent that `field` gives
// (+-x, +-y, +-depth).
std::size_t encoded_frame_size(const Frame&, Encoding, bool intensity) noexcept;
std::size_t encode_frame(std::uint32_t request_id, const Frame&, Encoding, bool intensity,
                         const std::array<float, 3>& half_extent_mm, std::span<std::byte> out) noexcept;

// ---- payloads
std::expected<HelloRequest, Flaw> decode_hello_request(std::span<const std::byte> payload) noexcept;
std::expected<HelloReply, Flaw> decode_hello_reply(std::span<const std::byte> payload) noexcept
    MOLDLOFT_NONBLOCKING;
std::expected<Config, Flaw> decode_config(std::span<const std::byte> payload) noexcept MOLDLOFT_NONBLOCKING;
std::expected<Trigger, Flaw> decode_trigger(std::span<const std::byte> payload) noexcept MOLDLOFT_NONBLOCKING;
std::expected<Exposed, Flaw> decode_exposed(std::span<const std::byte> payload) noexcept MOLDLOFT_NONBLOCKING;
std::expected<StatusReply, Flaw> decode_status(std::span<const std::byte> payload) noexcept
    MOLDLOFT_NONBLOCKING;
std::expected<ErrorReply, Flaw> decode_error(std::span<const std::byte> payload) noexcept
    MOLDLOFT_NONBLOCKING;
// The most bytes that a FRAME of so many stripes and points takes, with header, CRC and intensity.
std::size_t largest_message(std::size_t stripes, std::size_t points, Encoding) noexcept;

// FRAME messages as a run's store keeps them.
extern const FrameCodec frame_codec;

std::expected<FrameHead, Flaw> decode_frame_head(std::span<const std::byte> payload) noexcept
    MOLDLOFT_NONBLOCKING;

// Fills `frame` (its arrays must be large enough) from a FRAME payload; NaN where a point is missing.
std::expected<void, Flaw> decode_frame(std::span<const std::byte> payload,
                                       Frame& frame) noexcept MOLDLOFT_NONBLOCKING;
// The same in pieces: everything but the points, and so everything that can be wrong, ...
std::expected<FrameHead, Flaw> begin_frame(std::span<const std::byte> payload,
                                           Frame& frame) noexcept MOLDLOFT_NONBLOCKING;
// ... then the coordinates of points `first` to `end` - 1 of the same payload, 2 ns a point, ...
void decode_points(std::span<const std::byte> payload, const FrameHead&, std::size_t first, std::size_t end,
                   Frame& frame) noexcept MOLDLOFT_NONBLOCKING;
// ... and the intensities of all points, 0 where none are sent.
void decode_intensities(std::span<const std::byte> payload, const FrameHead&,
                        Frame& frame) noexcept MOLDLOFT_NONBLOCKING;
// For a payload that is still on its way: how many points, from the first, have all coordinates among its
// first `have` bytes. No byte before those of these points is missing then.
std::size_t points_within(std::size_t have, const FrameHead&) noexcept MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::hal::psc1
