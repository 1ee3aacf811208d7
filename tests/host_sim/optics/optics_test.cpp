#include "host_sim/optics/optics.hpp"

#include "host_sim/plates/plate_shape.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace moldloft;
using namespace moldloft::host_sim;

namespace {

OpticsSettings without_noise() {
  OpticsSettings s;
  s.noise_mm = s.drop_out = s.slope_drop_out = s.gloss = s.outliers = 0;
  return s;
}

PlateInstance resting(Shape shape, double x = 0, double y = 0, double turn = 0, double thickness = 6) {
  PlateDescription d;
  d.shape = shape;
  d.thickness_mm = thickness;
  return resting_on_table(*make_plate(d), x, y, turn);
}

hal::Frame exposed(const OpticsSettings& settings, const PlateInstance& plate,
                   const geometry::RigidMotion& at, std::uint64_t seed = 1) {
  hal::Frame frame(100, 50000);
  Random random(seed, Stream::optics, 1);
  Optics(settings).expose(plate, at, random, {}, frame);
  return frame;
}

geometry::RigidMotion looking_at(double x, double y, double z, double turn = 0) {
  return geometry::turned_about_z(turn, {x, y, z});
}

}  // namespace

TEST_CASE("a flat plate is seen as a plane of 100 stripes with 500 points each") {
  const auto frame = exposed(without_noise(), resting(Shape::flat), looking_at(10, -20, 4));
  REQUIRE(frame.stripe_count == 100);
  REQUIRE(frame.point_count == 50000);
  for (std::uint32_t k = 0; k < frame.point_count; ++k) CHECK(frame.z[k] == doctest::Approx(2).epsilon(1e-5));
  const auto& stripe = frame.stripes[99];
  CHECK(stripe.index == 99);
  CHECK(frame.x[stripe.first] ==
        doctest::Approx(50.49 * 498 / 500));  // the last plane, nearer to the projector
  CHECK(frame.y[stripe.first + 499] == doctest::Approx(50.898 * 498 / 500));
}

TEST_CASE("points on a cylinder lie on it, to float precision, from any pose") {
  const auto plate = resting(Shape::cylinder, 30, 12, 0.4);
  const auto at = looking_at(35, 5, 12, 1.1);
  const auto frame = exposed(without_noise(), plate, at);
  const auto plate_from_world = plate.world_from_plate().inverse();
  double worst = 0;
  for (std::uint32_t k = 0; k < frame.point_count; ++k) {
    const Eigen::Vector3d p = plate_from_world * (at * Eigen::Vector3d{frame.x[k], frame.y[k], frame.z[k]});
    worst = std::max(worst, std::abs(std::hypot(p.x(), p.z() + 1000) - 1000));
  }
  CHECK(worst < 2e-5);
}

TEST_CASE("the plate's height throws the triangulation shadow that the camera's base gives") {
  // Edge at x = 100 (left side of the plate), top at 20, table 20 below; camera at (+200, 0, 500)
  // over the field.
  const auto plate = resting(Shape::flat, 100 + 152.5, 0, 0, 20);
  const auto frame = exposed(without_noise(), plate, looking_at(100, 0, 20));
  // In scanner coordinates the edge is at (0, 0): a sight line over it falls by 500 on 200, 20 below it is
  // 8 mm left.
  int missing = 0;
  double last_seen = -100, first_top = 100;
  for (const auto& stripe : frame.lines()) {
    const std::uint32_t k = stripe.first + 250;
    if (std::isnan(frame.x[k])) {
      ++missing;
    } else if (frame.z[k] < -10) {
      last_seen = std::max(last_seen, static_cast<double>(frame.x[k]));
    } else {
      first_top = std::min(first_top, static_cast<double>(frame.x[k]));
    }
  }
  const double pitch = 1.02 * 520 / 500;  // of stripes on the table
  CHECK(last_seen < -8);
  CHECK(last_seen > -8 - pitch);
  CHECK(first_top > 0);
  CHECK(first_top < 1.02);
  CHECK(missing == doctest::Approx(8 / pitch).epsilon(0.15));
}

TEST_CASE("a second camera on the other side sees into the first one's shadow") {
  auto settings = without_noise();
  settings.cameras.push_back({-200, 0, 500});
  const auto frame = exposed(settings, resting(Shape::flat, 252.5, 0, 0, 20), looking_at(100, 0, 20));
  for (std::uint32_t k = 0; k < frame.point_count; ++k) CHECK_FALSE(std::isnan(frame.x[k]));
}

TEST_CASE("a wall that faces the projector is hit between top and underside, and nowhere else") {
  // The plate's right edge stands 40 mm left of the field's centre: rays lean onto its wall. Camera
  // left of it.
  auto settings = without_noise();
  settings.cameras = {{200, 0, 500}};
  const auto plate = resting(Shape::flat, -152.5, 0, 0, 20);
  const auto at = looking_at(40, 0, 20);
  const auto frame = exposed(settings, plate, at);
  int on_wall = 0;
  for (std::uint32_t k = 0; k < frame.point_count; ++k) {
    if (std::isnan(frame.x[k]) || frame.z[k] > -1e-4 || frame.z[k] < -20 + 1e-4) continue;
    ++on_wall;
    CHECK(frame.x[k] == doctest::Approx(-40).epsilon(1e-5));
  }
  // The wall's foot is seen along the ray through x = -40 * 500 / 520 = -38.46 at z = 0, its top along the
  // one through -40: between the two there is one plane, at -39.27.
  CHECK(on_wall == 500);
}

TEST_CASE(
    "a raised edge's wall is as high as the plate is thick, and under it the ray goes on to the table") {
  const auto plate = resting(Shape::saddle);  // raised by 20 at the middle of its left and right edges
  auto settings = without_noise();
  settings.cameras = {{0, 0, 500}};  // where the projector is: nothing that is lit is hidden
  int on_wall = 0, under = 0;
  for (const double off : {50.0, 50.3}) {  // planes meet the edge's line 5.4, 16, 8.4 below its top
    const auto at = looking_at(152.5 + off, 0, plate.z_mm + 10);
    const auto frame = exposed(settings, plate, at);
    for (std::uint32_t k = 0; k < frame.point_count; ++k) {
      const Eigen::Vector3d p = at * Eigen::Vector3d{frame.x[k], frame.y[k], frame.z[k]};
      const double below_edge = plate.z_mm + plate.plate->height(152.5, p.y()) - p.z();
      if (std::abs(p.x() - 152.5) < 1e-3) {
        ++on_wall;
        CHECK(below_edge > -1e-3);
        CHECK(below_edge < 6 + 1e-3);
      }
      under += p.x() < 152.4 && std::abs(p.z()) < 1e-3;
    }
  }
  CHECK(on_wall == 500);
  CHECK(under >= 1000);
}

TEST_CASE("nothing is measured beyond the depth range") {
  const auto frame = exposed(without_noise(), resting(Shape::flat), looking_at(0, 0, 6 + 61));
  for (std::uint32_t k = 0; k < frame.point_count; ++k) CHECK(std::isnan(frame.z[k]));
}

TEST_CASE("noise has its sigma along the ray, drop-outs and outliers their shares") {
  OpticsSettings s;
  s.slope_drop_out = s.gloss = 0;
  const auto frame = exposed(s, resting(Shape::flat), looking_at(0, 0, 6));
  double squares = 0;
  int seen = 0, far = 0;
  for (std::uint32_t k = 0; k < frame.point_count; ++k) {
    if (std::isnan(frame.x[k])) continue;
    ++seen;
    const double along = Eigen::Vector3d(frame.x[k], frame.y[k], frame.z[k] - 500).norm() *
                         (1 - 500 / (500 - static_cast<double>(frame.z[k])));
    if (std::abs(along) > 0.4) {
      ++far;
    } else {
      squares += along * along;
    }
  }
  CHECK(seen / 50000.0 == doctest::Approx(0.99).epsilon(0.002));
  CHECK(std::sqrt(squares / (seen - far)) == doctest::Approx(0.051).epsilon(0.01).scale(0));
  CHECK(far > 25);  // 0.1 %, of which 92 % lie beyond 0.4 mm: 45 expected
  CHECK(far < 70);
}

TEST_CASE("the same seed gives the same frame, another seed another one") {
  const auto plate = resting(Shape::wave, 3, 4, 0.3);
  const auto a = exposed({}, plate, looking_at(100, 80, 10, 0.2), 5);
  const auto b = exposed({}, plate, looking_at(100, 80, 10, 0.2), 5);
  const auto c = exposed({}, plate, looking_at(100, 80, 10, 0.2), 6);
  const auto same = [](const hal::Frame& p, const hal::Frame& q) {
    return std::equal(p.z.begin(), p.z.end(), q.z.begin(),
                      [](float u, float v) { return u == v || (std::isnan(u) && std::isnan(v)); });
  };
  CHECK(same(a, b));
  CHECK_FALSE(same(a, c));
}

TEST_CASE("a coarser raster takes every n-th plane and ray and says which planes") {
  hal::Frame frame(100, 50000);
  Random random(1, Stream::optics);
  Optics(without_noise()).expose(resting(Shape::flat), looking_at(0, 0, 6), random, {10, 5}, frame);
  CHECK(frame.stripe_count == 10);
  CHECK(frame.point_count == 1000);
  CHECK(frame.stripes[3].index == 30);
  CHECK(frame.stripes[3].first == 300);
}
