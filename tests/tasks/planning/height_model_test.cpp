#include "tasks/planning/height_model.hpp"

#include <doctest/doctest.h>

#include <cmath>

using moldloft::tasks::HeightModel;

TEST_CASE("a quadric plate is found from points round its border") {
  HeightModel model;
  const auto z = [](double x, double y) {
    return 12 + 0.02 * x + 4e-4 * x * x - 4e-4 * y * y + 1e-4 * x * y;
  };
  for (double t = 0; t < 6.28; t += 0.05) {
    const double x = 500 + 150 * std::cos(t), y = 20 + 150 * std::sin(t);
    model.add({x, y, z(x - 500, y - 20)});
  }
  for (double x = 420; x < 580; x += 40) model.add({x, 20, z(x - 500, 0)});
  model.solve();
  CHECK(std::abs(model.at(540, -30) - z(40, -50)) < 0.5);
}

TEST_CASE("points along one line leave the rest level instead of wild") {
  HeightModel model;
  for (double x = 0; x < 300; x += 5) {
    const double noise =
        std::fmod(x, 15) < 5 ? 0.05 : -0.025;  // whose slope across the line would be 5 mm a millimetre
    model.add({x, 0.2 * noise, 10 + 0.01 * x + noise});
  }
  model.solve();
  CHECK(std::abs(model.at(150, 200) - 11.5) < 5);
}
