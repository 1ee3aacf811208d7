// The second make's codec believes nothing that its bytes do not bear out.
#include "hal/triplet/triplet.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <vector>

using namespace moldloft;

namespace {

// Two stripes: one point, then two, the last of them missing.
std::vector<std::byte> scan() {
  std::vector<std::byte> message(triplet::largest_scan(2, 3));
  std::size_t at = triplet::head_size;
  const auto put = [&](auto value) {
    std::memcpy(message.data() + at, &value, sizeof value);
    at += sizeof value;
  };
  put(std::uint32_t{77}), put(std::uint32_t{2}), put(std::uint64_t{123456789});
  put(std::uint16_t{4}), put(std::uint16_t{1});
  put(1.5f), put(2.5f), put(3.5f);
  put(std::uint16_t{9}), put(std::uint16_t{2});
  put(-1.5f), put(-2.5f), put(-3.5f);
  put(NAN), put(NAN), put(NAN);
  REQUIRE(triplet::finish(triplet::Type::scan, at - triplet::head_size, message) == message.size());
  return message;
}

}  // namespace

TEST_CASE("a scan of triplets is read point by point, missing ones too") {
  const auto frame = triplet::codec.decode(scan());
  REQUIRE(frame.has_value());
  CHECK(frame->shot_id == 77);
  CHECK(frame->exposed_sensor_ns == 123456789);
  CHECK(frame->stripe_count == 2);
  CHECK(frame->point_count == 3);
  CHECK(frame->stripes[1].index == 9);
  CHECK(frame->stripes[1].first == 1);
  CHECK(frame->stripes[1].count == 2);
  CHECK(frame->z[0] == 3.5f);
  CHECK(frame->x[1] == -1.5f);
  CHECK(std::isnan(frame->z[2]));
}

TEST_CASE("a scan of triplets with one bit flipped, or cut anywhere, is no scan") {
  const auto good = scan();
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    auto bad = good;
    bad[bit / 8] ^= std::byte{1} << (bit % 8);
    CAPTURE(bit);
    CHECK_FALSE(triplet::codec.decode(bad).has_value());
  }
  for (std::size_t size = 0; size < good.size(); ++size)
    CHECK_FALSE(triplet::codec.decode(std::span{good}.first(size)).has_value());
}

TEST_CASE("a scan of triplets that contradicts itself is refused, though its sum is right") {
  for (const auto& [at, value] :
       {std::pair{4, 3u}, {4, 1u}, {4, 0xFFFFFFFFu}, {16, 0xFFFF0004u}, {16, 0x00000004u}}) {
    auto bad = scan();
    std::memcpy(bad.data() + triplet::head_size + at, &value, sizeof value);
    triplet::finish(triplet::Type::scan, bad.size() - triplet::head_size, bad);
    CAPTURE(at);
    CAPTURE(value);
    CHECK_FALSE(triplet::codec.decode(bad).has_value());
  }
}
