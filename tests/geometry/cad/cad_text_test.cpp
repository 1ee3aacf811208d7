#include "geometry/cad/cad_text.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>

using namespace moldloft::geometry;

TEST_CASE("numbers always carry a point, and their exponent is E in STEP and D in IGES") {
  CHECK(step_real(0) == "0.");
  CHECK(step_real(-12.5) == "-12.5");
  CHECK(step_real(300) == "300.");
  CHECK(step_real(0.1) == "0.1");
  CHECK(step_real(1e-5) == "1.E-05");
  CHECK(step_real(-1.25e300) == "-1.25E+300");
  CHECK(iges_real(1e-5) == "1.D-05");
  CHECK(iges_real(2.5e-7) == "2.5D-07");
}

TEST_CASE("every double reads back to the same bits") {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const double x = std::bit_cast<double>(random());
    if (!std::isfinite(x)) continue;
    CHECK(std::bit_cast<std::uint64_t>(std::strtod(step_real(x).c_str(), nullptr)) ==
          std::bit_cast<std::uint64_t>(x));
    std::string iges = iges_real(x);
    CHECK(iges.size() <= 25);
    std::ranges::replace(iges, 'D', 'E');
    CHECK(std::bit_cast<std::uint64_t>(std::strtod(iges.c_str(), nullptr)) ==
          std::bit_cast<std::uint64_t>(x));
  }
}

TEST_CASE("STEP text: quotes and backslashes doubled, other letters by their code points") {
  CHECK(step_string("") == "''");
  CHECK(step_string("it's C:\\x") == "'it''s C:\\\\x'");
  CHECK(step_string("K\xC3\xB6ln") == "'K\\X2\\00F6\\X0\\ln'");
  CHECK(step_string("\xE6\x9D\xBF") == "'\\X2\\677F\\X0\\'");          // U+677F, board
  CHECK(step_string("\xF0\x9F\x9A\xA2") == "'\\X4\\0001F6A2\\X0\\'");  // U+1F6A2, ship
  CHECK(step_string("a\nb") == "'a\\X2\\000A\\X0\\b'");
}

TEST_CASE("what is not UTF-8 becomes the replacement character, byte by byte, and never runs over the end") {
  const std::string sign = "\\X2\\FFFD\\X0\\";
  CHECK(step_string("\xFF") == "'" + sign + "'");
  CHECK(step_string("a\xC3") == "'a" + sign + "'");            // cut off
  CHECK(step_string("\xC3(") == "'" + sign + "('");            // not continued
  CHECK(step_string("\xC0\xAF") == "'" + sign + sign + "'");   // overlong slash
  CHECK(step_string("\xED\xA0\x80") == "'" + sign + "'");      // a surrogate
  CHECK(step_string("\xF4\x90\x80\x80") == "'" + sign + "'");  // beyond U+10FFFF
}

TEST_CASE("IGES text is counted, and printable ASCII") {
  CHECK(iges_string("plate") == "5Hplate");
  CHECK(iges_string("") == "");
  CHECK(iges_string("K\xC3\xB6ln, a;b") == "9HK?ln, a;b");
}
