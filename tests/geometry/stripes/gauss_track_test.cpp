#include "geometry/stripes/gauss_track.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace moldloft::geometry;
using Eigen::Vector2d, Eigen::Vector3d;

TEST_CASE("a Gauss rule integrates powers up to twice its nodes exactly") {
  for (const int nodes : {1, 2, 3, 5, 12}) {
    const GaussRule rule = gauss_rule(nodes);
    for (int power = 0; power < 2 * nodes; ++power) {
      double integral = 0;
      for (int n = 0; n < nodes; ++n) integral += rule.weight[n] * std::pow(rule.node[n], power);
      CHECK(std::abs(integral - 1.0 / (power + 1)) < 16 * 2.3e-16);
    }
    for (int n = 1; n < nodes; ++n) CHECK(rule.node[n] > rule.node[n - 1]);
  }
  CHECK(std::abs(gauss_rule(2).node[0] - (0.5 - 0.5 / std::sqrt(3.0))) < 4e-16);
}

TEST_CASE("nodes lie between the knots of both curves and weigh the length of the pre-image") {
  PlanCurve preimage;  // straight and even: from (0.1, 0.2) to (0.5, 0.5), length 0.5
  preimage.knots = uniform_clamped_knots(2);
  for (int i = 0; i < 5; ++i) {
    const double g = greville(preimage.knots, i);
    preimage.control.push_back({0.1 + 0.4 * g, 0.2 + 0.3 * g});
  }
  const GaussTrack gauss = gauss_track(preimage, uniform_clamped_knots(3), 4);  // spans 0, 1/3, 1/2, 2/3, 1
  REQUIRE(gauss.t.size() == 16);
  double length = 0, centre = 0;
  for (std::size_t n = 0; n < gauss.t.size(); ++n) {
    length += gauss.track.weight[n], centre += gauss.track.weight[n] * gauss.track.uv[n].x();
    CHECK((gauss.track.uv[n] - Vector2d(0.1 + 0.4 * gauss.t[n], 0.2 + 0.3 * gauss.t[n])).norm() < 1e-15);
  }
  CHECK(std::abs(length - 0.5) < 1e-14);
  CHECK(std::abs(centre - 0.5 * 0.3) < 1e-14);
}

TEST_CASE("stripes with curved pre-images give the surface back where straight ones would bend it") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto knots = uniform_clamped_knots(5);
  const auto net = [&] { return Eigen::MatrixXd::NullaryExpr(8, 8, [&] { return unit(random); }); };
  const BSplineSurface truth{knots, knots, net(), net(), net()};

  std::vector<SampledTrack> tracks;
  std::vector<SampledPoints> data;
  for (int s = 0; s < 16; ++s) {
    const double at = (s + 0.5) / 16, bulge = 0.3 * at * (1 - at);
    PlanCurve preimage;
    preimage.knots = uniform_clamped_knots(3);
    for (int i = 0; i < 6; ++i) {
      const double g = greville(preimage.knots, i);
      preimage.control.push_back({at + bulge * std::sin(5 * g), g});
    }
    const GaussTrack gauss = gauss_track(preimage, uniform_clamped_knots(4));
    SampledPoints points;
    for (const Vector2d& uv : gauss.track.uv) points.push_back(truth.at(uv.x(), uv.y()).value);
    tracks.push_back(gauss.track), data.push_back(points);
  }
  const auto fit = BSplineSurfaceFit::assemble(knots, knots, {}, tracks);
  REQUIRE(fit.has_value());
  const auto surface = fit->solve({}, data, truth);
  REQUIRE(surface.has_value());
  CHECK((surface->z - truth.z).cwiseAbs().maxCoeff() < 4 * fit->half_band() * 2.3e-16 * fit->condition());
  CHECK((surface->x - truth.x).cwiseAbs().maxCoeff() < 4 * fit->half_band() * 2.3e-16 * fit->condition());
}

TEST_CASE("points of a stripe are taken where its nodes are") {
  SpaceCurve stripe;
  stripe.knots = uniform_clamped_knots(1);
  for (int i = 0; i < 4; ++i) stripe.control.emplace_back(i / 3.0, 0, 1);  // x = t
  const auto points = points_at(stripe, std::vector<double>{0.0, 0.3, 1.0});
  REQUIRE(points.size() == 3);
  CHECK((points[1] - Vector3d(0.3, 0, 1)).norm() < 1e-15);
}
