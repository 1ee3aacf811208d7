#include "hal/scanner/psc1.hpp"

#include "hal/base/crc32c.hpp"
#include "hal/sample_frame.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

using namespace moldloft::hal;
using namespace moldloft::hal::psc1;

namespace {

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span{text}); }

// The definition, bit by bit: slow and simple.
std::uint32_t crc32c_by_bits(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::byte byte : bytes) {
    crc ^= std::to_integer<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) ? 0x82F63B78u : 0u);
  }
  return ~crc;
}

std::vector<std::byte> random_bytes(std::mt19937& random, std::size_t count) {
  std::vector<std::byte> bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::byte>(random() & 0xFF);
  return bytes;
}

template <typename M>
std::vector<std::byte> encoded(const M& message) {
  std::vector<std::byte> out(256);
  out.resize(encode(7, message, out));
  return out;
}

std::span<const std::byte> payload_of(const std::vector<std::byte>& message) {
  return std::span{message}.subspan(header_size, message.size() - header_size - payload_crc_size);
}

}  // namespace

TEST_CASE("CRC-32C gives the published values of RFC 3720") {
  CHECK(crc32c(bytes_of("123456789")) == 0xE3069283);
  CHECK(crc32c(std::vector<std::byte>(32, std::byte{0x00})) == 0x8A9136AA);
  CHECK(crc32c(std::vector<std::byte>(32, std::byte{0xFF})) == 0x62A8AB43);
  std::vector<std::byte> ascending(32);
  for (int i = 0; i < 32; ++i) ascending[i] = static_cast<std::byte>(i);
  CHECK(crc32c(ascending) == 0x46DD794E);
}

TEST_CASE(
    "table, instruction and definition of CRC-32C agree at every length and alignment, whole or in pieces") {
  std::mt19937 random{1};
  const auto bytes = random_bytes(random, 300);
  for (std::size_t begin = 0; begin < 9; ++begin) {
    for (std::size_t size = 0; size < 70; ++size) {
      const auto part = std::span{bytes}.subspan(begin, size);
      const auto truth = crc32c_by_bits(part);
      REQUIRE(crc32c_by_table(part) == truth);
      REQUIRE(crc32c_by_instruction(part) == truth);
      const std::size_t cut = size / 3;
      REQUIRE(crc32c(part.subspan(cut), crc32c(part.first(cut))) == truth);
      REQUIRE(crc32c_by_table(part.subspan(cut), crc32c_by_table(part.first(cut))) == truth);
    }
  }
}

TEST_CASE("a header survives the way there and back") {
  std::array<std::byte, header_size> wire;
  encode_header({.type = Type::frame,
                 .flags = 3,
                 .payload_length = 350'000,
                 .request_id = 0xDEADBEEF,
                 .acquired_ns = 0x0123456789ABCDEF},
                wire);
  const auto header = decode_header(wire);
  REQUIRE(header);
  CHECK(header->type == Type::frame);
  CHECK(header->flags == 3);
  CHECK(header->payload_length == 350'000);
  CHECK(header->request_id == 0xDEADBEEF);
  CHECK(header->acquired_ns == 0x0123456789ABCDEF);
}

TEST_CASE("every single bit that flips in a header is caught") {
  std::array<std::byte, header_size> wire;
  encode_header({.type = Type::frame, .payload_length = 1234, .request_id = 99, .acquired_ns = 5'000'000'000},
                wire);
  for (std::size_t bit = 0; bit < 8 * header_size; ++bit) {
    auto flipped = wire;
    flipped[bit / 8] ^= static_cast<std::byte>(1 << (bit % 8));
    CAPTURE(bit);
    REQUIRE_FALSE(decode_header(flipped));
  }
}

TEST_CASE("a header that is whole but not allowed says what is wrong with it") {
  std::array<std::byte, header_size> wire;
  encode_header({.type = Type::frame, .payload_length = max_payload}, wire);
  CHECK(decode_header(wire));
  encode_header({.type = Type::frame, .payload_length = max_payload + 1}, wire);
  CHECK(decode_header(wire).error() == Flaw::length);
  encode_header({.type = static_cast<Type>(10)}, wire);
  CHECK(decode_header(wire).error() == Flaw::type);
  encode_header({.type = static_cast<Type>(0)}, wire);
  CHECK(decode_header(wire).error() == Flaw::type);
  wire[0] = std::byte{'Q'};
  CHECK(decode_header(wire).error() == Flaw::magic);
}

TEST_CASE("every message survives the way there and back") {
  const auto hello =
      decode_hello_request(payload_of(encoded(HelloRequest{.version_min = 1, .version_max = 4})));
  REQUIRE(hello);
  CHECK(hello->version_max == 4);

  HelloReply reply{.session_id = 77,
                   .max_stripes = 100,
                   .max_points_per_stripe = 500,
                   .field_x_mm = 102,
                   .field_y_mm = 101,
                   .depth_mm = 40,
                   .exposure_us = 100,
                   .processing_us = 100'000,
                   .sensor = {"4DI"}};
  const auto reply_back = decode_hello_reply(payload_of(encoded(reply)));
  REQUIRE(reply_back);
  CHECK(reply_back->session_id == 77);
  CHECK(reply_back->max_points_per_stripe == 500);
  CHECK(reply_back->depth_mm == 40);
  CHECK(reply_back->processing_us == 100'000);
  CHECK(std::string{reply_back->sensor.data()} == "4DI");

  const Config config{.status = Status::unsupported,
                      .encoding = Encoding::float32,
                      .intensity = false,
                      .stripes = 50,
                      .points_per_stripe = 250};
  const auto config_back = decode_config(payload_of(encoded(config)));
  REQUIRE(config_back);
  CHECK(config_back->status == Status::unsupported);
  CHECK(config_back->encoding == Encoding::float32);
  CHECK_FALSE(config_back->intensity);
  CHECK(config_back->points_per_stripe == 250);

  CHECK(decode_trigger(payload_of(encoded(Trigger{.shot_id = 1234567})))->shot_id == 1234567);

  std::vector<std::byte> wire(256);
  wire.resize(encode(7, Exposed{.shot_id = 5, .session_id = 77, .repeated = true}, 12345, wire));
  CHECK(decode_header(std::span{wire}.first<header_size>())->acquired_ns == 12345);
  CHECK(decode_exposed(payload_of(wire))->repeated);
  CHECK(decode_exposed(payload_of(wire))->session_id == 77);

  const auto status = decode_status(
      payload_of(encoded(StatusReply{.session_id = 77, .last_shot_id = 9, .temperature_c = 31.5f})));
  REQUIRE(status);
  CHECK(status->last_shot_id == 9);
  CHECK(status->temperature_c == 31.5f);

  const auto error = decode_error(
      payload_of(encoded(ErrorReply{.status = Status::busy, .shot_id = 3, .text = "computing"})));
  REQUIRE(error);
  CHECK(error->status == Status::busy);
  CHECK(error->text.view() == "computing");

  std::array<std::byte, header_size> ping;
  CHECK(encode_empty(1, Type::ping, ping) == header_size);
}

TEST_CASE("an encoder that finds too little room writes nothing that counts") {
  std::vector<std::byte> out(header_size + 4 + payload_crc_size);
  CHECK(encode(1, Trigger{.shot_id = 1}, out) == out.size());
  for (std::size_t size = 0; size < out.size(); ++size) {
    CHECK(encode(1, Trigger{.shot_id = 1}, std::span{out}.first(size)) == 0);
  }
}

TEST_CASE(
    "a frame in int16 comes back within half a step, holes as holes, a point beyond the field as a hole") {
  Frame frame = sample_frame(3, 7);
  frame.x[2] = frame.y[2] = frame.z[2] = NAN;
  frame.z[5] = 40.1f;  // the depth is 40
  std::vector<std::byte> wire(encoded_frame_size(frame, Encoding::int16, true));
  CHECK(wire.size() == 32 + 48 + 3 * 12 + 21 * 7 + 4);
  REQUIRE(encode_frame(8, frame, Encoding::int16, true, {51, 51, 40}, wire) == wire.size());

  Frame back{3, 21};
  REQUIRE(decode_frame(payload_of(wire), back));
  CHECK(back.shot_id == frame.shot_id);
  CHECK(back.session_id == frame.session_id);
  CHECK(back.stripe_count == 3);
  CHECK(back.point_count == 21);
  CHECK(back.stripes[2].index == frame.stripes[2].index);
  CHECK(back.stripes[2].first == 14);
  CHECK(back.stripes[2].count == 7);
  for (std::size_t i = 0; i < 21; ++i) {
    CAPTURE(i);
    if (i == 2 || i == 5) {
      CHECK(std::isnan(back.x[i]));
      CHECK(std::isnan(back.y[i]));
      CHECK(std::isnan(back.z[i]));
    } else {
      CHECK(std::abs(back.x[i] - frame.x[i]) <= 0.501f * 51 / 32767);
      CHECK(std::abs(back.y[i] - frame.y[i]) <= 0.501f * 51 / 32767);
      CHECK(std::abs(back.z[i] - frame.z[i]) <= 0.501f * 40 / 32767);
    }
    CHECK(back.intensity[i] == frame.intensity[i]);
  }
}

TEST_CASE("of a payload that is on its way, exactly the points that are whole can be decoded") {
  for (const Encoding encoding : {Encoding::int16, Encoding::float32}) {
    for (const bool intensity : {true, false}) {
      const Frame frame = sample_frame(3, 7);
      std::vector<std::byte> wire(encoded_frame_size(frame, encoding, intensity));
      REQUIRE(encode_frame(8, frame, encoding, intensity, {51, 51, 40}, wire) == wire.size());
      const auto payload = payload_of(wire);
      Frame whole{3, 21};
      REQUIRE(decode_frame(payload, whole));
      const std::size_t size = encoding == Encoding::int16 ? 2 : 4,
                        before_heights = 48 + 3 * 12 + 2 * 21 * size;
      for (std::size_t have = 48 + 3 * 12; have <= payload.size(); ++have) {
        CAPTURE(have);
        std::vector<std::byte> arrived(payload.begin(), payload.end());
        std::fill(arrived.begin() + static_cast<std::ptrdiff_t>(have), arrived.end(), std::byte{0x3f});
        Frame part{3, 21};
        const auto head = begin_frame(arrived, part);
        REQUIRE(head);
        const std::size_t points = points_within(have, *head);
        CHECK(points ==
              (have < before_heights ? 0 : std::min<std::size_t>(21, (have - before_heights) / size)));
        decode_points(arrived, *head, 0, points, part);
        for (std::size_t i = 0; i < points; ++i) {
          CHECK(part.x[i] == whole.x[i]);
          CHECK(part.y[i] == whole.y[i]);
          CHECK(part.z[i] == whole.z[i]);
        }
      }
    }
  }
}

TEST_CASE("a frame in float32 comes back exactly, a point with one coordinate missing is missing") {
  Frame frame = sample_frame(2, 40);
  frame.z[9] = NAN;
  frame.y[77] = INFINITY;
  std::vector<std::byte> wire(encoded_frame_size(frame, Encoding::float32, false));
  REQUIRE(encode_frame(8, frame, Encoding::float32, false, {}, wire) == wire.size());
  Frame back{2, 80};
  back.intensity.assign(80, 99);
  REQUIRE(decode_frame(payload_of(wire), back));
  for (std::size_t i = 0; i < 80; ++i) {
    CAPTURE(i);
    const bool hole = i == 9 || i == 77;
    CHECK(std::isnan(back.x[i]) == hole);
    CHECK(std::isnan(back.y[i]) == hole);
    if (!hole) CHECK(back.x[i] == frame.x[i]);
    if (!hole) CHECK(back.z[i] == frame.z[i]);
    CHECK(back.intensity[i] == 0);
  }
}

TEST_CASE(
    "the three extreme values of int16: the largest, the smallest, and the sentinel between them and "
    "nothing") {
  Frame frame{1, 3};
  frame.stripe_count = 1;
  frame.point_count = 3;
  frame.stripes[0] = {.index = 0, .first = 0, .count = 3};
  frame.x = {51.0f, -51.0f, 51.01f};
  std::vector<std::byte> wire(encoded_frame_size(frame, Encoding::int16, false));
  REQUIRE(encode_frame(1, frame, Encoding::int16, false, {51, 51, 40}, wire) == wire.size());
  std::array<std::int16_t, 3> x;
  std::memcpy(x.data(), payload_of(wire).data() + 48 + 12, sizeof x);
  CHECK(x[0] == 32767);
  CHECK(x[1] == -32767);
  CHECK(x[2] == -32768);
}

TEST_CASE("a sentinel in one column alone makes the whole point missing, in the blocks as in the rest") {
  const Frame frame = sample_frame(1, 40);
  std::vector<std::byte> wire(encoded_frame_size(frame, Encoding::int16, false));
  REQUIRE(encode_frame(8, frame, Encoding::int16, false, {51, 51, 40}, wire) == wire.size());
  for (const std::size_t point : {3u, 15u, 16u, 39u}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      CAPTURE(point);
      CAPTURE(axis);
      auto damaged = wire;
      const std::int16_t missing = -32768;
      std::memcpy(damaged.data() + header_size + 48 + 12 + 2 * (40 * axis + point), &missing, 2);
      Frame back{1, 40};
      REQUIRE(decode_frame(payload_of(damaged), back));
      for (std::size_t i = 0; i < 40; ++i) {
        CHECK(std::isnan(back.x[i]) == (i == point));
        CHECK(std::isnan(back.y[i]) == (i == point));
        CHECK(std::isnan(back.z[i]) == (i == point));
      }
    }
  }
}

TEST_CASE("a frame payload that contradicts itself is refused whole") {
  const Frame frame = sample_frame(3, 7);
  std::vector<std::byte> wire(encoded_frame_size(frame, Encoding::int16, true));
  REQUIRE(encode_frame(8, frame, Encoding::int16, true, {51, 51, 40}, wire) == wire.size());
  const std::vector<std::byte> good{payload_of(wire).begin(), payload_of(wire).end()};
  Frame back{3, 21};
  const auto flaw_with = [&](std::size_t offset, auto value) {
    auto bad = good;
    std::memcpy(bad.data() + offset, &value, sizeof value);
    const auto decoded = decode_frame(bad, back);
    return decoded ? Flaw::none : decoded.error();
  };
  CHECK(flaw_with(12, std::uint32_t{20}) == Flaw::payload_size);  // point count
  CHECK(flaw_with(12, std::uint32_t{0xFFFFFFFF}) == Flaw::payload_size);
  CHECK(flaw_with(10, std::uint8_t{2}) == Flaw::content);  // encoding
  CHECK(flaw_with(16, std::nanf("")) == Flaw::content);    // scale of x
  CHECK(flaw_with(16, 0.0f) == Flaw::content);
  CHECK(flaw_with(16, 1e36f) == Flaw::content);     // its largest steps would lie at infinity
  CHECK(flaw_with(28, INFINITY) == Flaw::content);  // offset of x
  CHECK(flaw_with(48 + 12 + 4, std::uint32_t{6}) == Flaw::content);  // stripe 1 begins inside stripe 0
  CHECK(flaw_with(48 + 24 + 8, std::uint32_t{8}) == Flaw::content);  // stripe 2 ends beyond the points
  CHECK(flaw_with(48 + 24 + 8, std::uint32_t{0xFFFFFFFF}) == Flaw::content);
  CHECK(flaw_with(48 + 12, std::uint16_t{0}) == Flaw::content);  // stripe indices not ascending
  CHECK(back.stripe_count == 0);
  Frame small{2, 21};
  CHECK(decode_frame(good, small).error() == Flaw::length);
  CHECK(decode_frame(std::span{good}.first(47), back).error() == Flaw::payload_size);
}

TEST_CASE("random bytes never crash a decoder, and never pass for a header") {
  std::mt19937 random{2};
  Frame frame{64, 4096};
  int headers = 0;
  for (int i = 0; i < 20'000; ++i) {
    auto bytes = random_bytes(random, random() % 200);
    if (bytes.size() >= 48 && i % 2 == 0) {  // small counts and sane scales: deeper into the frame decoder
      bytes[10] = bytes[11] = std::byte{0};
      bytes[9] = bytes[13] = bytes[14] = bytes[15] = std::byte{0};
      const std::array<float, 6> scale_offset{1, 1, 1, 0, 0, 0};
      std::memcpy(bytes.data() + 16, scale_offset.data(), sizeof scale_offset);
      bytes[8] = static_cast<std::byte>(random() % 4);
      const auto stripes = std::to_integer<std::size_t>(bytes[8]);
      if (bytes.size() >= 48 + 12 * stripes)
        bytes[12] = static_cast<std::byte>((bytes.size() - 48 - 12 * stripes) / 6);
    }
    if (bytes.size() >= header_size)
      headers += decode_header(std::span{bytes}.first<header_size>()).has_value();
    (void)decode_hello_request(bytes);
    (void)decode_hello_reply(bytes);
    (void)decode_config(bytes);
    (void)decode_trigger(bytes);
    (void)decode_exposed(bytes);
    (void)decode_status(bytes);
    (void)decode_error(bytes);
    (void)decode_frame(bytes, frame);
  }
  CHECK(headers == 0);
}
