#include "tasks/planning/flaw_words.hpp"

#include "geometry/edges/outline_search.hpp"

#include <doctest/doctest.h>

#include <array>
#include <string>

using namespace moldloft;
using geometry::Error;

namespace {

const geometry::OutlineSearch nothing_found{16, {}, {}, {}};
const std::array<Eigen::Vector2d, 2> edge_points{Eigen::Vector2d(100, 20), {300, 40}};

std::string words(Error error) {
  return std::string(tasks::flaw_words(error, nothing_found, edge_points).view());
}

}  // namespace

TEST_CASE("no word of the geometry reaches an operator, whatever it could not do") {
  for (int i = 0; i <= static_cast<int>(Error::singular_parametrization); ++i) {
    const auto error = static_cast<Error>(i);
    const std::string text = words(error), raw{geometry::to_string(error)};
    CAPTURE(raw);
    CHECK(text.size() > 40);
    CHECK(text.size() < 160);  // whole: nothing is cut off at a message's end
    CHECK(text.find(raw) == std::string::npos);
    CHECK(text.find(": ") != std::string::npos);  // what to do
  }
}

TEST_CASE("an edge that makes no sides is said with how much of it was seen and where") {
  CHECK(words(Error::collinear) ==
        "2 edge points about (200, 30) make no four sides: clear the plate's edge, clean it and run again");
  CHECK(words(Error::too_few_points) == words(Error::collinear));
}
