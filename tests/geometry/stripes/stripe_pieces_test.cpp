#include "geometry/stripes/stripe_pieces.hpp"

#include "geometry/splines/bspline.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace moldloft::geometry;
using Eigen::Vector2d;

namespace {

std::vector<TrackPiece> cut(const Preimage& preimage, const std::vector<double>& stripe,
                            const std::vector<double>& u, const std::vector<double>& v) {
  REQUIRE(check_preimage(preimage, stripe, u, v).has_value());
  std::vector<TrackPiece> pieces;
  cut_stripe(preimage, stripe, u, v, pieces);
  return pieces;
}

Error what_is_wrong(const Preimage& preimage, const std::vector<double>& stripe = uniform_clamped_knots(1)) {
  const auto knots = uniform_clamped_knots(4);
  return check_preimage(preimage, stripe, knots, knots).error();
}

}  // namespace

TEST_CASE("sixteen stripes of twenty control points are 272 Bezier curves before the surface cuts them") {
  // Thesis section 6.2.1; a surface of one span cuts nothing.
  const auto stripe = uniform_clamped_knots(17), surface = uniform_clamped_knots(1);
  std::size_t pieces = 0;
  for (int s = 0; s < 16; ++s)
    pieces += cut(straight_preimage({0, s / 16.0}, {1, (s + 1) / 16.0}), stripe, surface, surface).size();
  CHECK(pieces == 272);
}

TEST_CASE("a straight pre-image is cut where it crosses the knot lines and at the stripe's knots") {
  // u = t meets 1/4, 1/2, 3/4; v = 0.1 + t / 2 meets 1/4 at t = 0.3 and 1/2 at t = 0.8; the stripe breaks
  // at 1/3, 2/3.
  const auto pieces = cut(straight_preimage({0, 0.1}, {1, 0.6}), uniform_clamped_knots(3),
                          uniform_clamped_knots(4), uniform_clamped_knots(4));
  const double cuts[] = {0, 0.25, 0.3, 1.0 / 3, 0.5, 2.0 / 3, 0.75, 0.8, 1};
  const int span_u[] = {3, 4, 4, 4, 5, 5, 6, 6}, span_v[] = {3, 3, 4, 4, 4, 4, 4, 5};
  const int stripe_span[] = {3, 3, 3, 4, 4, 5, 5, 5};
  REQUIRE(pieces.size() == 8);
  for (int p = 0; p < 8; ++p) {
    CHECK(std::abs(pieces[p].t0 - cuts[p]) < 1e-15);
    CHECK(std::abs(pieces[p].t1 - cuts[p + 1]) < 1e-15);
    CHECK((pieces[p].uv1 - Vector2d(cuts[p + 1], 0.1 + cuts[p + 1] / 2)).norm() < 1e-15);
    CHECK(pieces[p].span_u == span_u[p]);
    CHECK(pieces[p].span_v == span_v[p]);
    CHECK(pieces[p].stripe_span == stripe_span[p]);
  }
}

TEST_CASE(
    "a cut that both directions share is one cut, and a pre-image on a knot line is cut only across it") {
  const auto one = uniform_clamped_knots(1), eight = uniform_clamped_knots(8);
  CHECK(cut(straight_preimage({0, 0}, {1, 1}), one, eight, eight).size() == 8);
  CHECK(cut(straight_preimage({1, 0}, {0, 1}), eight, eight, eight).size() == 8);
  CHECK(cut(straight_preimage({0.375, 0}, {0.375, 1}), one, eight, eight).size() == 8);
  CHECK(cut(straight_preimage({0, 1}, {1, 1}), one, eight, eight).size() == 8);
  const std::vector<double> doubled{0, 0, 0, 0, 0.5, 0.5, 1, 1, 1, 1};
  CHECK(cut(straight_preimage({0, 0.2}, {1, 0.3}), doubled, doubled, doubled).size() == 2);
}

TEST_CASE("pieces follow one another without a gap and each lies in its own cell") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  const std::vector<double> u{0, 0, 0, 0, 0.1, 0.35, 0.36, 0.8, 1, 1, 1, 1};
  const auto v = uniform_clamped_knots(7), stripe = uniform_clamped_knots(5);
  for (int trial = 0; trial < 500; ++trial) {
    Preimage preimage;
    const int vertices = 2 + trial % 4;
    for (int i = 0; i < vertices; ++i) {
      preimage.t.push_back(static_cast<double>(i) / (vertices - 1));
      preimage.uv.emplace_back(unit(random), unit(random));
    }
    double t = 0, length = 0, whole = 0;
    for (const TrackPiece& piece : cut(preimage, stripe, u, v)) {
      CHECK(piece.t0 == t);
      CHECK(piece.t1 > piece.t0);
      for (const double share : {1e-3, 0.5, 1 - 1e-3}) {
        const double at = piece.t0 + share * (piece.t1 - piece.t0);
        const Vector2d uv = (1 - share) * piece.uv0 + share * piece.uv1;
        CHECK((uv - preimage.at(at)).norm() < 1e-14);
        CHECK(find_span(u, uv.x()) == piece.span_u);
        CHECK(find_span(v, uv.y()) == piece.span_v);
        CHECK(find_span(stripe, at) == piece.stripe_span);
      }
      t = piece.t1, length += piece.length();
    }
    CHECK(t == 1);
    for (int i = 1; i < vertices; ++i) whole += (preimage.uv[i] - preimage.uv[i - 1]).norm();
    CHECK(std::abs(length - whole) < 1e-13);
  }
}

TEST_CASE("what is wrong with a pre-image or with knots has a name") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(what_is_wrong(straight_preimage({0.2, 0.3}, {0.2, 0.3})) == Error::no_length);
  CHECK(what_is_wrong(straight_preimage({0.2, 0.3}, {0.2, 1.001})) == Error::preimage_outside);
  CHECK(what_is_wrong(straight_preimage({-0.001, 0.3}, {0.2, 0.5})) == Error::preimage_outside);
  CHECK(what_is_wrong(straight_preimage({0.1, nan}, {0.2, 0.5})) == Error::not_finite);
  CHECK(what_is_wrong({{0.0}, {{0.1, 0.1}}}) == Error::too_few_points);
  CHECK(what_is_wrong({{0.0, 0.7, 0.6, 1.0}, {{0, 0}, {0.1, 0}, {0.2, 0}, {0.3, 0}}}) ==
        Error::knots_not_increasing);
  CHECK(what_is_wrong({{0.0, 0.5}, {{0, 0}, {0.1, 0}}}) ==
        Error::preimage_outside);  // the stripe goes on to t = 1
}
