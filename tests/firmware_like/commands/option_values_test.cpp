#include "firmware_like/commands/option_values.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <limits>

using namespace moldloft::firmware_like;

TEST_CASE("a number on the command line is the whole word and lies within its limits") {
  const Limits<double> share{-1, 1};
  double value = 7;
  CHECK(read_number("0.25", share, value));
  CHECK(value == 0.25);
  CHECK(read_number("-1", share, value));
  CHECK(read_number("1e-3", share, value));
  for (const char* wrong : {"", " ", "nan", "-nan", "inf", "-inf", "1.0000001", "1e400", "0.5 ", " 0.5",
                            "0,5", "0.5mm", "--1", "0x1"}) {
    CAPTURE(wrong);
    CHECK_FALSE(read_number(wrong, share, value));
  }
}

TEST_CASE("a whole number keeps all its digits, and a minus sign is no way round the limit") {
  const Limits<std::uint64_t> any{0, std::numeric_limits<std::uint64_t>::max()};
  std::uint64_t seed = 7;
  CHECK(read_number("18446744073709551615", any, seed));
  CHECK(seed == std::numeric_limits<std::uint64_t>::max());
  for (const char* wrong : {"-1", "18446744073709551616", "1.0", "1e3", "a"}) {
    CAPTURE(wrong);
    CHECK_FALSE(read_number(wrong, any, seed));
  }
}
