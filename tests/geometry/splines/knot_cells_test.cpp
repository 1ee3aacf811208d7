#include "geometry/splines/knot_cells.hpp"

#include <doctest/doctest.h>

#include <vector>

using moldloft::geometry::KnotCells;

TEST_CASE("a cell is located as a walk over the knots would find it") {
  const std::vector<double> knots{-2, -2, -2, -2, -1.5, 0.1, 0.1, 0.1, 0.1000001, 3, 7, 7, 7, 7};
  const KnotCells cells(knots);
  const std::vector<double> breaks{-2, -1.5, 0.1, 0.1000001, 3, 7};
  REQUIRE(cells.count() == 5);
  std::vector<double> places = breaks;
  for (double t = -2; t <= 7; t += 0.0037) places.push_back(t);
  for (const double t : places) {
    int expected = 0;
    while (expected + 1 < 5 && t >= breaks[static_cast<std::size_t>(expected) + 1]) ++expected;
    CHECK(cells.locate(t) == expected);
  }
}
