#include "hal/triplet/triplet.hpp"

#include "hal/base/crc32c.hpp"

#include <cstring>

namespace moldloft::triplet {
namespace {

template <typename T>
T get(std::span<const std::byte> from, std::size_t at) noexcept {
  T value;
  std::memcpy(&value, from.data() + at, sizeof value);
  return value;
}

template <typename T>
void put(std::span<std::byte> to, std::size_t at, T value) noexcept {
  std::memcpy(to.data() + at, &value, sizeof value);
}

std::expected<hal::Frame, std::string_view> decode(std::span<const std::byte> message) {
  const auto head = decode_head(message);
  if (!head || head->type != Type::scan) return std::unexpected{"no scan"};
  const auto body = message.subspan(head_size);
  if (body.size() != head->body_size || hal::crc32c(body) != head->crc) return std::unexpected{"damaged"};
  // Every point takes its bytes, so their number is bounded by what is there.
  hal::Frame frame{body.size() / stripe_head_size, body.size() / point_size};
  if (!begin_scan(body, frame)) return std::unexpected{"contradicts itself"};
  decode_points(body, 0, frame.point_count, frame);
  return frame;
}

}  // namespace

std::optional<Head> decode_head(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < head_size || get<std::uint32_t>(bytes, 0) != magic) return std::nullopt;
  return Head{get<Type>(bytes, 4), get<std::uint32_t>(bytes, 8), get<std::uint32_t>(bytes, 12)};
}

std::size_t finish(Type type, std::size_t body_size, std::span<std::byte> message) noexcept {
  put(message, 0, magic);
  put(message, 4, type);
  put(message, 8, static_cast<std::uint32_t>(body_size));
  put(message, 12, hal::crc32c(message.subspan(head_size, body_size)));
  return head_size + body_size;
}

bool begin_scan(std::span<const std::byte> body, hal::Frame& frame) noexcept {
  if (body.size() < scan_head_size) return false;
  frame.shot_id = get<std::uint32_t>(body, 0);
  frame.exposed_sensor_ns = get<std::uint64_t>(body, 8);
  const auto stripes = get<std::uint32_t>(body, 4);
  if (stripes > frame.stripes.size()) return false;
  std::size_t at = scan_head_size;
  frame.stripe_count = frame.point_count = 0;
  for (; frame.stripe_count < stripes; ++frame.stripe_count) {
    if (body.size() - at < stripe_head_size) return false;
    const auto count = get<std::uint16_t>(body, at + 2);
    at += stripe_head_size;
    if ((body.size() - at) / point_size < count || frame.x.size() - frame.point_count < count) return false;
    frame.stripes[frame.stripe_count] = {get<std::uint16_t>(body, at - stripe_head_size), frame.point_count,
                                         count};
    frame.point_count += count;
    at += count * point_size;
  }
  return at == body.size();
}

void decode_points(std::span<const std::byte> body, std::size_t first, std::size_t last,
                   hal::Frame& frame) noexcept {
  std::size_t line = 0;
  for (std::size_t i = first; i < last; ++i) {
    while (i >= frame.stripes[line].first + frame.stripes[line].count) ++line;
    const std::size_t at = scan_head_size + (line + 1) * stripe_head_size + i * point_size;
    frame.x[i] = get<float>(body, at);
    frame.y[i] = get<float>(body, at + 4);
    frame.z[i] = get<float>(body, at + 8);
    frame.intensity[i] = 0;
  }
}

const hal::FrameCodec codec{.name = "triplet", .head_bytes = head_size, .decode = decode};

}  // namespace moldloft::triplet
