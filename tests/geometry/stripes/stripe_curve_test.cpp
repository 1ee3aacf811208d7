#include "geometry/stripes/stripe_curve.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace moldloft::geometry;
using Eigen::Vector2d, Eigen::Vector3d;

namespace {

struct Stripe {
  std::vector<Vector3d> points;
  std::vector<Vector2d> uv;
};

// On z = (2 u)^3 over the unit square, from (0.1, 0.2) to (0.9, 0.6): it climbs more and more steeply.
Stripe climbing(int count) {
  Stripe stripe;
  for (int i = 0; i < count; ++i) {
    const double t = i / (count - 1.0), u = 0.1 + 0.8 * t, v = 0.2 + 0.4 * t;
    stripe.uv.emplace_back(u, v);
    stripe.points.emplace_back(u, v, 8 * u * u * u);
  }
  return stripe;
}

}  // namespace

TEST_CASE("with consistent parameters a cubic stripe on a cubic surface is where its pre-image says") {
  const Stripe stripe = climbing(50);
  const auto curve =
      fit_stripe(stripe.points, stripe.uv, uniform_clamped_knots(1), StripeParameter::consistent);
  REQUIRE(curve.has_value());
  CHECK(curve->max_mm < 1e-13);
  for (const double t : {0.0, 0.25, 0.6, 1.0}) {
    const Vector2d uv = curve->track.preimage.at(t);
    CHECK((curve->curve.at(t).value - Vector3d(uv.x(), uv.y(), 8 * std::pow(uv.x(), 3))).norm() < 1e-13);
  }
}

TEST_CASE("with chord lengths it is elsewhere, as far as the climb is uneven") {
  const Stripe stripe = climbing(50);
  const auto curve =
      fit_stripe(stripe.points, stripe.uv, uniform_clamped_knots(8), StripeParameter::chord_length);
  REQUIRE(curve.has_value());
  CHECK(curve->max_mm < 0.02);  // the curve passes by the points all the same, to a tenth of what follows
  // The stripe climbs from 0 to 5.8, so that half of its length lies beyond u = 0.7, its pre-image's
  // middle at 0.5.
  const Vector2d uv = curve->track.preimage.at(0.5);
  const Vector3d point = curve->curve.at(0.5).value;
  CHECK(point.x() > uv.x() + 0.1);
}

TEST_CASE("consistent parameters are the feet on the pre-image, and end with it") {
  const std::vector<Vector2d> uv{{0, 0}, {0.3, 0.1}, {0.5, 0.7}, {1, 1}, {1.2, 1.2}};
  const auto t = consistent_parameters(uv, {0, 0}, {1, 1});
  CHECK(t[0] == 0);
  CHECK(std::abs(t[1] - 0.2) < 1e-15);
  CHECK(std::abs(t[2] - 0.6) < 1e-15);
  CHECK(t[3] == 1);
  CHECK(t[4] == 1);
}

TEST_CASE("a stripe without a pre-image or that goes back on it is refused by name") {
  Stripe stripe = climbing(20);
  const auto knots = uniform_clamped_knots(2);
  auto uv = stripe.uv;
  uv.back() = uv.front();
  CHECK(fit_stripe(stripe.points, uv, knots, StripeParameter::consistent).error().error == Error::no_length);
  uv = stripe.uv;
  std::swap(uv[7], uv[12]);
  CHECK(fit_stripe(stripe.points, uv, knots, StripeParameter::consistent).error().error ==
        Error::repeated_points);
  uv.front().x() = NAN;
  CHECK(fit_stripe(stripe.points, uv, knots, StripeParameter::consistent).error().error == Error::not_finite);
  stripe.points[4] = stripe.points[3];
  CHECK(fit_stripe(stripe.points, stripe.uv, knots, StripeParameter::chord_length).error().error ==
        Error::repeated_points);
  CHECK(fit_stripe({}, {}, knots, StripeParameter::chord_length).error().error == Error::too_few_points);
}
