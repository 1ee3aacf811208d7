#include "geometry/stripes/stripe_joining.hpp"

#include "geometry/splines/curve_fit.hpp"
#include "geometry/splines/spline_samples.hpp"
#include "geometry/stripes/lofting.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace moldloft::geometry;
using samples::Numbers;

namespace {

double height(double x, double y) { return 10 * std::sin(x / 90) * std::cos(y / 70); }

// Stripes that run along x from `from` to `to`, 20 mm apart in y, as a scanner at this place would see them;
// `bend` is how far they leave their y over 100 mm.
StripesOfShot shot(double from, double to, int stripes, double offset_y = 0, double bend = 0) {
  StripesOfShot seen;
  for (int s = 0; s < stripes; ++s) {
    Stripe stripe;
    for (double x = from; x <= to + 1e-9; x += 0.5) {
      const double y = 20 * s + offset_y + bend * (x - from) / 100;
      stripe.emplace_back(x, y, height(x, y));
    }
    seen.push_back(stripe);
  }
  return seen;
}

}  // namespace

TEST_CASE("stripes of three shots side by side become lines across the plate") {
  std::vector<StripesOfShot> shots{shot(0, 100, 5), shot(101, 200, 5), shot(201, 300, 5)};
  std::ranges::reverse(shots[1]);                              // numbered the other way
  for (auto& stripe : shots[2]) std::ranges::reverse(stripe);  // recorded the other way
  const auto joined = join_stripes(shots);
  REQUIRE(joined.has_value());
  REQUIRE(joined->lines.size() == 5);
  CHECK(joined->left_over == 0);
  for (int s = 0; s < 5; ++s) {
    const JoinedLine& line = joined->lines[s];
    CHECK(line.points.size() == shots[0][0].size() + shots[1][0].size() + shots[2][0].size());
    for (std::size_t i = 1; i < line.points.size(); ++i) CHECK(line.points[i].x() > line.points[i - 1].x());
    for (const auto& p : line.points) CHECK(p.y() == 20 * s);
    REQUIRE(line.joints.size() == 2);
    CHECK(line.joints[0].stripe == s);
    CHECK(line.joints[0].next == 4 - s);
    CHECK(line.joints[1].next == s);
    CHECK(line.joints[0].gap_mm == doctest::Approx(1).epsilon(0.01));  // the plate slopes a little
    CHECK(line.joints[0].kink_rad < 0.02);
    CHECK(line.joints[0].dropped_points == 0);
  }
}

TEST_CASE("a scan that goes the other way extends its lines over their starts") {
  const std::vector<StripesOfShot> shots{shot(201, 300, 3), shot(101, 200, 3), shot(0, 100, 3)};
  const auto joined = join_stripes(shots);
  REQUIRE(joined.has_value());
  REQUIRE(joined->lines.size() == 3);
  const auto& points = joined->lines[1].points;
  CHECK(points.front().x() == 300);
  CHECK(points.back().x() == 0);
  for (std::size_t i = 1; i < points.size(); ++i) CHECK(points[i].x() < points[i - 1].x());
}

TEST_CASE("where shots overlap the next stripe goes on from the end of the last") {
  const std::vector<StripesOfShot> shots{shot(0, 100, 4), shot(90.25, 200, 4, 0.3)};
  const auto joined = join_stripes(shots);
  REQUIRE(joined.has_value());
  REQUIRE(joined->lines.size() == 4);
  for (const JoinedLine& line : joined->lines) {
    CHECK(line.joints[0].dropped_points == 20);  // 90.25 ... 99.75
    CHECK(line.joints[0].gap_mm == doctest::Approx(0.3).epsilon(0.02));
    CHECK(line.joints[0].step_mm == doctest::Approx(0.3).epsilon(0.02));
    for (std::size_t i = 1; i < line.points.size(); ++i) CHECK(line.points[i].x() > line.points[i - 1].x());
  }
}

TEST_CASE("a joint tells its kink and its step") {
  std::vector<StripesOfShot> shots(2);
  for (int i = 0; i <= 20; ++i) shots[0].resize(1), shots[0][0].emplace_back(i, 0, 0);
  const double turn = 0.2;
  for (int i = 0; i <= 20; ++i)
    shots[1].resize(1), shots[1][0].emplace_back(21 + i * std::cos(turn), 0.5 + i * std::sin(turn), 0);
  const auto joined = join_stripes(shots);
  REQUIRE(joined.has_value());
  const StripeJoint& joint = joined->lines.at(0).joints.at(0);
  CHECK(joint.kink_rad == doctest::Approx(turn).epsilon(1e-12));
  CHECK(joint.step_mm == doctest::Approx(0.5).epsilon(1e-12));
  CHECK(joint.gap_mm == doctest::Approx(std::hypot(1, 0.5)).epsilon(1e-12));
}

TEST_CASE("the nearest pairs are joined first, and what is too far away stays alone") {
  // The second shot lies 9 mm off in y: nearer to the neighbour's line at -11 mm is nobody, 9 mm are too
  // many at 5.
  const std::vector<StripesOfShot> shots{shot(0, 100, 3), shot(101, 200, 3, 9)};
  const auto strict = join_stripes(shots);
  REQUIRE(strict.has_value());
  CHECK(strict->lines.empty());
  CHECK(strict->left_over == 6);
  const auto loose = join_stripes(shots, {.most_gap_mm = 12});
  REQUIRE(loose.has_value());
  REQUIRE(loose->lines.size() == 3);
  for (int s = 0; s < 3; ++s) CHECK(loose->lines[s].joints[0].next == s);
  // The other way round, and numbered from the other side: the first pair that is near enough is
  // not the nearest.
  std::vector<StripesOfShot> turned{shot(0, 100, 3), shot(101, 200, 3, -9)};
  std::ranges::reverse(turned[1]);
  const auto nearest = join_stripes(turned, {.most_gap_mm = 12});
  REQUIRE(nearest->lines.size() == 3);
  for (int s = 0; s < 3; ++s) CHECK(nearest->lines[s].joints[0].next == 2 - s);

  // One stripe fewer in the second shot: the line without a partner does not run through.
  auto fewer = shots;
  fewer[1] = shot(101, 200, 3);
  fewer[1].erase(fewer[1].begin() + 1);
  const auto partial = join_stripes(fewer);
  CHECK(partial->lines.size() == 2);
  CHECK(partial->left_over == 1);
}

TEST_CASE("what is wrong with stripes is named, and where") {
  const std::vector<StripesOfShot> good{shot(0, 100, 3), shot(101, 200, 3)};
  const auto error = [](const std::vector<StripesOfShot>& shots) {
    const auto joined = join_stripes(shots);
    return joined ? Flaw{Error::capacity} : joined.error();
  };
  CHECK((error({}) == Flaw{Error::too_few_points, 0}));
  auto bad = good;
  bad[1].clear();
  CHECK((error(bad) == Flaw{Error::too_few_points, 3}));
  bad = good, bad[1][2].resize(1);
  CHECK((error(bad) == Flaw{Error::too_few_points, 3 + 2}));
  bad = good, bad[0][1][4].z() = std::nan("");
  CHECK((error(bad) == Flaw{Error::not_finite, 1}));
  bad = good, bad[1][0][7] = bad[1][0][6];
  CHECK((error(bad) == Flaw{Error::repeated_points, 3}));
  CHECK(join_stripes(std::span{good}.first(1))->lines.size() == 3);  // one shot is all lines
}

TEST_CASE("a plate is lofted from the stripes of its shots") {
  // 3 x 1 shots without overlap, 11 stripes each, every shot off by a little, as after registration.
  const std::vector<StripesOfShot> shots{shot(0, 100, 11, 0.00), shot(100.5, 200, 11, 0.05),
                                         shot(200.5, 300, 11, -0.05)};
  const auto joined = join_stripes(shots);
  REQUIRE(joined.has_value());
  REQUIRE(joined->lines.size() == 11);
  std::vector<SpaceCurve> curves;
  for (const JoinedLine& line : joined->lines) {
    const auto fit = fit_curve<3>(line.points, uniform_clamped_knots(12));
    REQUIRE(fit.has_value());
    curves.push_back(fit->curve);
  }
  const auto through = loft(curves), near = loft(curves, {.control_points = 7});
  REQUIRE(through.has_value());
  REQUIRE(near.has_value());
  // The truth is explicit, so a surface point says itself where it should be. A registration error of 0.05 mm
  // at slopes below 0.15, and what cubics miss of this wave over spans of 25 and 50 mm: h^4 / 384 max |f''''|
  // < 0.025 mm.
  for (const Loft* lofted : {&*through, &*near}) {
    for (double u = 0; u <= 1; u += 0.04) {
      for (double v = 0; v <= 1; v += 0.05) {
        const Eigen::Vector3d p = lofted->surface.at(u, v).value;
        CHECK(std::abs(p.z() - height(p.x(), p.y())) < 0.05);
      }
    }
  }
}
