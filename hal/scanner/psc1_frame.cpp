// FRAME of PSC1: descriptor, stripe table, columns. Points are decoded in the slack of the ticks, so the loops over
// them are written in blocks of a constant size, which the compiler turns into vector code at -O2.
#include "hal/base/crc32c.hpp"
#include "hal/base/little_endian.hpp"
#include "hal/scanner/psc1.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace moldloft::hal::psc1 {
namespace {

constexpr std::size_t head_size = 48;
constexpr std::size_t stripe_size = 12;
constexpr std::size_t block = 16;         // points; a multiple of every vector width in use
constexpr std::int16_t missing = -32768;  // the one value that no coordinate has
constexpr float largest = 32767;          // of a coordinate in int16
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

constexpr std::size_t value_size(Encoding encoding) { return encoding == Encoding::int16 ? 2 : 4; }

// In 64 bits: the counts come from the wire, and their product must not wrap.
constexpr std::uint64_t payload_size(std::uint64_t stripes, std::uint64_t points, Encoding encoding,
                                     bool intensity) {
  return head_size + stripes * stripe_size + points * (3 * value_size(encoding) + (intensity ? 1 : 0));
}

// Three columns as they lie in the payload.
template <typename T>
struct Columns {
  const std::byte* x;
  const std::byte* y;
  const std::byte* z;

  Columns(const std::byte* begin, std::size_t points)
      : x{begin}, y{begin + points * sizeof(T)}, z{begin + 2 * points * sizeof(T)} {}
};

template <typename T, std::size_t count>
std::array<T, count> load(const std::byte* at) noexcept {
  std::array<T, count> values;
  std::memcpy(values.data(), at, sizeof values);
  return values;
}

template <std::size_t count>
struct Points {
  std::array<float, count> x, y, z;

  void store(Frame& frame, std::size_t first) const noexcept {
    std::memcpy(frame.x.data() + first, x.data(), sizeof x);
    std::memcpy(frame.y.data() + first, y.data(), sizeof y);
    std::memcpy(frame.z.data() + first, z.data(), sizeof z);
  }
};

// Points first .. first + count - 1. A point that misses one coordinate is missing as a whole. The results go
// through locals: stores through three pointers that might overlap would keep the compiler from vector code.
template <std::size_t count>
void decode_block(const Columns<std::int16_t>& from, std::size_t first, const FrameHead& head,
                  Frame& frame) noexcept {
  const auto x = load<std::int16_t, count>(from.x + first * 2);
  const auto y = load<std::int16_t, count>(from.y + first * 2);
  const auto z = load<std::int16_t, count>(from.z + first * 2);
  const auto [scale_x, scale_y, scale_z] = head.scale;
  const auto [offset_x, offset_y, offset_z] = head.offset;
  Points<count> points;
  for (std::size_t i = 0; i < count; ++i) {
    // Without a branch: the loop is to become vector instructions.
    const int missing_axes = int{x[i] == missing} | int{y[i] == missing} | int{z[i] == missing};
    const float hole = missing_axes != 0 ? nan : 0.0f;
    points.x[i] = hole + (offset_x + scale_x * static_cast<float>(x[i]));
    points.y[i] = hole + (offset_y + scale_y * static_cast<float>(y[i]));
    points.z[i] = hole + (offset_z + scale_z * static_cast<float>(z[i]));
  }
  points.store(frame, first);
}

template <std::size_t count>
void decode_block(const Columns<float>& from, std::size_t first, const FrameHead&, Frame& frame) noexcept {
  const auto x = load<float, count>(from.x + first * 4);
  const auto y = load<float, count>(from.y + first * 4);
  const auto z = load<float, count>(from.z + first * 4);
  Points<count> points;
  for (std::size_t i = 0; i < count; ++i) {
    // 0 * v is 0 for a number and NaN for what is none (infinity or NaN).
    const float hole = 0.0f * x[i] + 0.0f * y[i] + 0.0f * z[i];
    points.x[i] = hole + x[i];
    points.y[i] = hole + y[i];
    points.z[i] = hole + z[i];
  }
  points.store(frame, first);
}

template <typename T>
void decode_columns(const std::byte* begin, const FrameHead& head, std::size_t first, std::size_t end,
                    Frame& frame) noexcept {
  const Columns<T> from{begin, head.point_count};
  std::size_t i = first;
  for (; i + block <= end; i += block) decode_block<block>(from, i, head, frame);
  for (; i < end; ++i) decode_block<1>(from, i, head, frame);
}

// Stripes come in ascending index, their points in the columns in the same order and inside them.
std::expected<void, Flaw> decode_stripes(ByteReader& from, const FrameHead& head, Frame& frame) noexcept {
  std::uint64_t end_before = 0;
  for (std::size_t i = 0; i < head.stripe_count; ++i) {
    Stripe& stripe = frame.stripes[i];
    stripe.index = from.get<std::uint16_t>();
    from.get<std::uint16_t>();
    stripe.first = from.get<std::uint32_t>();
    stripe.count = from.get<std::uint32_t>();
    const std::uint64_t end = std::uint64_t{stripe.first} + stripe.count;
    const bool in_order = i == 0 || stripe.index > frame.stripes[i - 1].index;
    if (!in_order || stripe.first < end_before || end > head.point_count)
      return std::unexpected{Flaw::content};
    end_before = end;
  }
  return {};
}

// A coordinate beyond the extent is as good as not measured: it must not be clipped to a wrong place.
std::array<std::int16_t, 3> to_int16(const std::array<float, 3>& point,
                                     const std::array<float, 3>& steps_per_mm) {
  std::array<std::int16_t, 3> steps{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float exact = point[axis] * steps_per_mm[axis];
    if (!(std::abs(exact) <= largest)) return {missing, missing, missing};
    steps[axis] = static_cast<std::int16_t>(exact + (exact < 0 ? -0.5f : 0.5f));
  }
  return steps;
}

void encode_columns_int16(const Frame& frame, const std::array<float, 3>& scale, std::byte* begin) noexcept {
  const std::size_t points = frame.point_count;
  const std::array<float, 3> steps_per_mm{1 / scale[0], 1 / scale[1], 1 / scale[2]};
  for (std::size_t i = 0; i < points; ++i) {
    const auto steps = to_int16({frame.x[i], frame.y[i], frame.z[i]}, steps_per_mm);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::memcpy(begin + (axis * points + i) * 2, &steps[axis], 2);
    }
  }
}

void encode_columns_float(const Frame& frame, std::byte* begin) noexcept {
  const std::size_t column = frame.point_count * sizeof(float);
  if (column == 0) return;
  std::memcpy(begin, frame.x.data(), column);
  std::memcpy(begin + column, frame.y.data(), column);
  std::memcpy(begin + 2 * column, frame.z.data(), column);
}

void encode_head(const FrameHead& head, ByteWriter& to) noexcept {
  to.put(head.shot_id);
  to.put(head.session_id);
  to.put(head.stripe_count);
  to.put(static_cast<std::uint8_t>(head.encoding));
  to.put(static_cast<std::uint8_t>(head.intensity));
  to.put(head.point_count);
  for (const float scale : head.scale) to.put(scale);
  for (const float offset : head.offset) to.put(offset);
  to.put(std::uint64_t{0});
}

bool fits(const Frame& frame) noexcept {
  return frame.stripe_count <= std::min<std::size_t>(frame.stripes.size(), 0xFFFF) &&
         frame.point_count <=
             std::min({frame.x.size(), frame.y.size(), frame.z.size(), frame.intensity.size()});
}

}  // namespace

std::size_t encoded_frame_size(const Frame& frame, Encoding encoding, bool intensity) noexcept {
  return header_size + payload_size(frame.stripe_count, frame.point_count, encoding, intensity) +
         payload_crc_size;
}

std::size_t encode_frame(std::uint32_t request_id, const Frame& frame, Encoding encoding, bool intensity,
                         const std::array<float, 3>& half_extent_mm, std::span<std::byte> out) noexcept {
  const std::uint64_t payload = payload_size(frame.stripe_count, frame.point_count, encoding, intensity);
  const bool extent_good =
      std::ranges::all_of(half_extent_mm, [](float half) { return half > 0 && half < 1e6f; });
  if (!fits(frame) || payload > max_payload || out.size() < header_size + payload + payload_crc_size)
    return 0;
  if (encoding == Encoding::int16 && !extent_good) return 0;

  FrameHead head{.shot_id = frame.shot_id, .session_id = frame.session_id};
  head.stripe_count = static_cast<std::uint16_t>(frame.stripe_count);
  head.encoding = encoding;
  head.intensity = intensity;
  head.point_count = frame.point_count;
  head.scale = {1, 1, 1};
  if (encoding == Encoding::int16) {
    std::ranges::transform(half_extent_mm, head.scale.begin(), [](float half) { return half / largest; });
  }
  encode_header({.type = Type::frame,
                 .payload_length = static_cast<std::uint32_t>(payload),
                 .request_id = request_id,
                 .acquired_ns = frame.exposed_sensor_ns},
                out.first<header_size>());
  const auto body = out.subspan(header_size, payload);
  ByteWriter to{body};
  encode_head(head, to);
  for (const Stripe& stripe : frame.lines()) {
    to.put(stripe.index);
    to.put(std::uint16_t{0});
    to.put(stripe.first);
    to.put(stripe.count);
  }
  std::byte* columns = body.data() + to.used();
  if (encoding == Encoding::int16) {
    encode_columns_int16(frame, head.scale, columns);
  } else {
    encode_columns_float(frame, columns);
  }
  if (intensity && frame.point_count > 0) {
    std::memcpy(columns + 3 * value_size(encoding) * frame.point_count, frame.intensity.data(),
                frame.point_count);
  }
  ByteWriter{out.subspan(header_size + payload)}.put(crc32c(body));
  return header_size + payload + payload_crc_size;
}

std::expected<FrameHead, Flaw> decode_frame_head(std::span<const std::byte> payload) noexcept {
  if (payload.size() < head_size) return std::unexpected{Flaw::payload_size};
  ByteReader from{payload};
  FrameHead head;
  head.shot_id = from.get<std::uint32_t>();
  head.session_id = from.get<std::uint32_t>();
  head.stripe_count = from.get<std::uint16_t>();
  const auto encoding = from.get<std::uint8_t>();
  const auto intensity = from.get<std::uint8_t>();
  head.encoding = static_cast<Encoding>(encoding);
  head.intensity = intensity != 0;
  head.point_count = from.get<std::uint32_t>();
  for (float& scale : head.scale) scale = from.get<float>();
  for (float& offset : head.offset) offset = from.get<float>();
  const auto good_scale = [](float scale) { return std::isfinite(scale) && scale > 0; };
  const auto good_offset = [](float offset) { return std::isfinite(offset); };
  // The farthest that a value can stand for must be a number too, or points that were sent would be at infinity.
  bool in_reach = true;
  for (std::size_t axis = 0; axis < 3; ++axis)
    in_reach = in_reach && std::isfinite(std::abs(head.offset[axis]) + (largest + 1) * head.scale[axis]);
  if (encoding > 1 || intensity > 1 || !std::ranges::all_of(head.scale, good_scale) ||
      !std::ranges::all_of(head.offset, good_offset) || !in_reach) {
    return std::unexpected{Flaw::content};
  }
  return head;
}

std::expected<FrameHead, Flaw> begin_frame(std::span<const std::byte> payload, Frame& frame) noexcept {
  const auto head = decode_frame_head(payload);
  if (!head) return head;
  if (payload.size() !=
      payload_size(head->stripe_count, head->point_count, head->encoding, head->intensity)) {
    return std::unexpected{Flaw::payload_size};
  }
  frame.shot_id = head->shot_id;
  frame.session_id = head->session_id;
  frame.stripe_count = head->stripe_count;
  frame.point_count = head->point_count;
  if (!fits(frame)) {
    frame.stripe_count = frame.point_count = 0;
    return std::unexpected{Flaw::length};
  }
  ByteReader from{payload.subspan(head_size)};
  if (const auto stripes = decode_stripes(from, *head, frame); !stripes) {
    frame.stripe_count = frame.point_count = 0;
    return std::unexpected{stripes.error()};
  }
  return head;
}

void decode_points(std::span<const std::byte> payload, const FrameHead& head, std::size_t first,
                   std::size_t end, Frame& frame) noexcept {
  const auto columns = payload.subspan(head_size + std::size_t{head.stripe_count} * stripe_size);
  if (head.encoding == Encoding::int16) {
    decode_columns<std::int16_t>(columns.data(), head, first, end, frame);
  } else {
    decode_columns<float>(columns.data(), head, first, end, frame);
  }
}

void decode_intensities(std::span<const std::byte> payload, const FrameHead& head, Frame& frame) noexcept {
  const auto intensities = std::span{frame.intensity}.first(head.point_count);
  if (!head.intensity) return std::ranges::fill(intensities, std::uint8_t{0}), void();
  if (!intensities.empty())
    std::memcpy(intensities.data(), payload.last(head.point_count).data(), intensities.size());
}

std::size_t points_within(std::size_t have, const FrameHead& head) noexcept {
  const std::size_t size = value_size(head.encoding), points = head.point_count;
  const std::size_t heights =
      head_size + head.stripe_count * stripe_size + 2 * points * size;  // where they begin
  return have <= heights ? 0 : std::min(points, (have - heights) / size);
}

std::expected<void, Flaw> decode_frame(std::span<const std::byte> payload, Frame& frame) noexcept {
  const auto head = begin_frame(payload, frame);
  if (!head) return std::unexpected{head.error()};
  decode_points(payload, *head, 0, head->point_count, frame);
  decode_intensities(payload, *head, frame);
  return {};
}

std::size_t largest_message(std::size_t stripes, std::size_t points, Encoding encoding) noexcept {
  return header_size + payload_size(stripes, points, encoding, true) + payload_crc_size;
}

namespace {

std::expected<Frame, std::string_view> decode_message(std::span<const std::byte> message) {
  const auto flawed = [](Flaw flaw) { return std::unexpected{to_string(flaw)}; };
  if (message.size() < header_size) return flawed(Flaw::too_short);
  const auto header = decode_header(message.first<header_size>());
  if (!header) return flawed(header.error());
  const auto payload = message.subspan(header_size);
  const auto head = decode_frame_head(payload);
  if (!head) return flawed(head.error());
  if (head->point_count > payload.size() || head->stripe_count > payload.size())
    return flawed(Flaw::payload_size);
  Frame frame{head->stripe_count, head->point_count};
  if (const auto decoded = decode_frame(payload, frame); !decoded) return flawed(decoded.error());
  frame.exposed_sensor_ns = header->acquired_ns;
  return frame;
}

}  // namespace

const FrameCodec frame_codec{.name = "psc1", .head_bytes = header_size, .decode = decode_message};

}  // namespace moldloft::hal::psc1
