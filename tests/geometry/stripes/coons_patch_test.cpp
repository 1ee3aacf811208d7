#include "geometry/stripes/coons_patch.hpp"

#include "geometry/splines/refinement.hpp"
#include "geometry/splines/spline_samples.hpp"

#include <doctest/doctest.h>

using namespace moldloft::geometry;
using samples::eps, samples::Numbers;

namespace {

// Four random curves of different degrees and knots whose ends meet at random corners.
CoonsSides random_sides(Numbers& numbers, const std::array<int, 4>& degrees, double size) {
  const auto corner = [&] {
    return Eigen::Vector3d::NullaryExpr([&] { return numbers.in(-size, size); }).eval();
  };
  const Eigen::Vector3d c00 = corner(), c10 = corner(), c01 = corner(), c11 = corner();
  const auto side = [&](int degree, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    auto curve = numbers.curve<3>(degree, numbers.of(0, 5), size);
    curve.control.front() = from, curve.control.back() = to;
    return curve;
  };
  return {side(degrees[0], c00, c10), side(degrees[1], c01, c11), side(degrees[2], c00, c01),
          side(degrees[3], c10, c11)};
}

}  // namespace

TEST_CASE("the net of a Coons patch is the patch, at any degrees and knots") {
  Numbers numbers;
  for (const std::array<int, 4>& degrees :
       {std::array{3, 3, 3, 3}, {1, 3, 2, 2}, {5, 2, 1, 4}, {1, 1, 1, 1}}) {
    for (int trial = 0; trial < 3; ++trial) {
      const auto patch = CoonsPatch::through(random_sides(numbers, degrees, 1));
      REQUIRE(patch.has_value());
      const BSplineSurface net = patch->net();
      CHECK(check(net).has_value());
      CHECK(net.degree_u == std::max(degrees[0], degrees[1]));
      CHECK(net.degree_v == std::max(degrees[2], degrees[3]));
      const int p = net.degree_u, q = net.degree_v;
      const double bound = 16 * (p + q + static_cast<double>(net.knots_u.size() + net.knots_v.size())) * eps;
      for (double u = 0; u <= 1; u += 0.23) {
        for (double v = 0.02; v <= 1; v += 0.19) {
          const SurfacePoint a = patch->at(u, v), b = net.at(u, v);
          CHECK((a.value - b.value).cwiseAbs().maxCoeff() <= bound);
          // Derivatives agree as far as their own size says: knots here lie as close as they fell.
          const auto close = [](const Eigen::Vector3d& one, const Eigen::Vector3d& other, double size) {
            return (one - other).norm() <= 1e-9 * (1 + size);
          };
          CHECK(close(a.du, b.du, a.du.norm()));
          CHECK(close(a.dv, b.dv, a.dv.norm()));
          CHECK(close(a.duv, b.duv, a.duv.norm() + a.du.norm() + a.dv.norm()));
        }
      }
    }
  }
}

TEST_CASE("a Coons patch keeps its four sides and has the second derivatives of its differences") {
  Numbers numbers;
  const auto patch = CoonsPatch::through(random_sides(numbers, {3, 4, 5, 3}, 1));
  REQUIRE(patch.has_value());
  const CoonsSides& s = patch->sides();
  for (double t = 0; t <= 1; t += 0.13) {
    CHECK((patch->at(t, 0).value - s.low_v.value(t)).norm() < 20 * eps);
    CHECK((patch->at(t, 1).value - s.high_v.value(t)).norm() < 20 * eps);
    CHECK((patch->at(0, t).value - s.low_u.value(t)).norm() < 20 * eps);
    CHECK((patch->at(1, t).value - s.high_u.value(t)).norm() < 20 * eps);
  }
  const double u = 0.31, v = 0.57, h = 1e-5;
  const SurfacePoint p = patch->at(u, v);
  CHECK((p.du - (patch->at(u + h, v).value - patch->at(u - h, v).value) / (2 * h)).norm() < 1e-5);
  CHECK((p.dv - (patch->at(u, v + h).value - patch->at(u, v - h).value) / (2 * h)).norm() < 1e-5);
  CHECK((p.duu - (patch->at(u + h, v).du - patch->at(u - h, v).du) / (2 * h)).norm() < 1e-3);
  CHECK((p.duv - (patch->at(u, v + h).du - patch->at(u, v - h).du) / (2 * h)).norm() < 1e-3);
  CHECK((p.dvv - (patch->at(u, v + h).dv - patch->at(u, v - h).dv) / (2 * h)).norm() < 1e-3);
}

TEST_CASE("the boundary of a bilinear surface gives the bilinear surface") {
  const Eigen::Vector3d c00(0, 0, 0), c10(300, 10, 5), c01(-5, 200, 8), c11(310, 220, -20);
  const auto straight = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return elevate(SpaceCurve{{2, 2, 5, 5}, {a, b}, 1}, 3);  // any domain is stretched to [0, 1]
  };
  const auto patch =
      CoonsPatch::through({straight(c00, c10), straight(c01, c11), straight(c00, c01), straight(c10, c11)});
  REQUIRE(patch.has_value());
  const BSplineSurface net = patch->net();
  CHECK(net.control_u() == 4);
  for (double u = 0; u <= 1; u += 0.2) {
    for (double v = 0; v <= 1; v += 0.25) {
      const Eigen::Vector3d exact = (1 - u) * ((1 - v) * c00 + v * c01) + u * ((1 - v) * c10 + v * c11);
      CHECK((patch->at(u, v).value - exact).norm() <= 16 * 14 * eps * 310);
      CHECK((net.at(u, v).value - exact).norm() <= 16 * 14 * eps * 310);
    }
  }
}

TEST_CASE("ends that do not meet are named with their corner") {
  Numbers numbers;
  const CoonsSides good = random_sides(numbers, {3, 3, 3, 3}, 100);
  CoonsSides apart = good;
  apart.high_u.control.front() += Eigen::Vector3d(0, 0, 2.5);
  const auto refused = CoonsPatch::through(apart);
  REQUIRE(!refused.has_value());
  CHECK(refused.error().error == Error::corners_apart);
  CHECK(refused.error().where == 1);
  CHECK(CoonsPatch::through(apart, 3).has_value());
  CHECK((CoonsPatch::through(apart, 3)->corners()[1] - good.low_v.control.back()).z() ==
        doctest::Approx(1.25));

  CoonsSides wrong = good;
  wrong.low_u.control[1].x() = std::nan("");
  CHECK(CoonsPatch::through(wrong).error().error == Error::not_finite);
  CHECK(CoonsPatch::through(wrong).error().where == 2);
  wrong = good;
  std::ranges::reverse(wrong.high_v.knots);
  CHECK(CoonsPatch::through(wrong).error().error == Error::knots_not_increasing);
  CHECK(CoonsPatch::through(wrong).error().where == 1);
}
