#include "firmware_like/run/surface_file.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::firmware_like;

TEST_CASE("a surface as JSON: unit, frame, degree, knots, and the net row by row along u") {
  geometry::BSplineSurface s;
  s.knots_u = geometry::uniform_clamped_knots(2);
  s.knots_v = geometry::uniform_clamped_knots(1);
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(5, 4);
  for (int i = 0; i < 5; ++i) {
    for (int k = 0; k < 4; ++k) {
      s.x(i, k) = i;
      s.y(i, k) = 10 * k;
      s.z(i, k) = 0.1 * i + k / 3.0;
    }
  }
  const Json j = Json::parse(surface_json(s).dump());
  CHECK(j["schema"] == 1);
  CHECK(j["unit"] == "mm");
  CHECK(j["frame"] == "world");
  CHECK(j["degree"] == Json({3, 3}));
  CHECK(j["knots_u"] == Json({0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0}));
  CHECK(j["knots_v"].size() == 8);
  REQUIRE(j["control"].size() == 5);
  REQUIRE(j["control"][0].size() == 4);
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      const auto point = j["control"][i][k];
      CHECK(point[0].get<double>() == static_cast<double>(i));
      CHECK(point[1].get<double>() == 10.0 * static_cast<double>(k));
      CHECK(point[2].get<double>() ==
            s.z(static_cast<int>(i), static_cast<int>(k)));  // no digit is lost on the way
    }
  }
}
