#include "geometry/stripes/bspline_surface_fit.hpp"

#include "geometry/splines/bernstein_form.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace moldloft::geometry;
using Eigen::MatrixX3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d;
using Ring = MatchingSystem::Ring;

namespace {

const std::vector<double> one_span = uniform_clamped_knots(1);

struct Stripes {
  std::vector<StripeTrack> tracks;
  std::vector<SpaceCurve> curves;
};

void add(Stripes& stripes, const std::vector<double>& knots, const Preimage& preimage,
         const MatrixX3d& control) {
  stripes.tracks.push_back({knots, preimage});
  SpaceCurve& curve = stripes.curves.emplace_back();
  curve.knots = knots;
  for (Eigen::Index i = 0; i < control.rows(); ++i) curve.control.emplace_back(control.row(i).transpose());
}

BSplineSurface random_surface(std::vector<double> u, std::vector<double> v, int seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto net = [&] {
    return MatrixXd::NullaryExpr(u.size() - 4, v.size() - 4, [&] { return unit(random); });
  };
  BSplineSurface surface{u, v, net(), net(), net()};
  return surface;
}

// The stripe on a surface along u = `at` or v = `at` is a B-spline curve over the surface's
// own knots, exactly.
void add_isoline(const BSplineSurface& surface, bool along_v, double at, Stripes& stripes) {
  const std::vector<double>& across = along_v ? surface.knots_u : surface.knots_v;
  const int k = find_span(across, at);
  const auto basis = cubic_basis(across, k, at).value;
  const MatrixXd* nets[3] = {&surface.x, &surface.y, &surface.z};
  MatrixX3d control(along_v ? surface.control_v() : surface.control_u(), 3);
  for (int axis = 0; axis < 3; ++axis) {
    control.col(axis).setZero();
    for (int i = 0; i < 4; ++i) {
      if (along_v)
        control.col(axis) += basis[i] * nets[axis]->row(k - 3 + i).transpose();
      else
        control.col(axis) += basis[i] * nets[axis]->col(k - 3 + i);
    }
  }
  add(stripes, along_v ? surface.knots_v : surface.knots_u,
      along_v ? straight_preimage({at, 0}, {at, 1}) : straight_preimage({0, at}, {1, at}), control);
}

Stripes isolines(const BSplineSurface& surface, int count) {
  Stripes stripes;
  for (int s = 0; s < count; ++s) add_isoline(surface, true, s / (count - 1.0), stripes);
  return stripes;
}

// Oblique cubic stripes of random control points: data that no surface fits.
Stripes random_stripes(int count, int seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  Stripes stripes;
  for (int s = 0; s < count; ++s) {
    const std::vector<double> knots = uniform_clamped_knots(1 + s % 4);
    const bool along_v = s % 2 == 0;
    const double from = unit(random), to = unit(random);
    add(stripes, knots,
        along_v ? straight_preimage({from, 0}, {to, 1}) : straight_preimage({1, from}, {0, to}),
        MatrixX3d::NullaryExpr(static_cast<int>(knots.size()) - 4, 3, [&] { return unit(random); }));
  }
  return stripes;
}

double net_distance(const BSplineSurface& a, const BSplineSurface& b) {
  return std::max({(a.x - b.x).cwiseAbs().maxCoeff(), (a.y - b.y).cwiseAbs().maxCoeff(),
                   (a.z - b.z).cwiseAbs().maxCoeff()});
}

// The same equations with nothing of the code under test but the cuts: the coefficients of every basis
// function along every piece by interpolation in seven points, one dense matrix, QR.
struct Equations {
  MatrixXd matrix, side;
};
Equations dense_equations(const std::vector<double>& u, const std::vector<double>& v, const Stripes& stripes,
                          PieceWeight weight) {
  const int nu = static_cast<int>(u.size()) - 4, nv = static_cast<int>(v.size()) - 4;
  Eigen::Matrix<double, 7, 7> values;
  for (int n = 0; n < 7; ++n) values.row(n) = bernstein_basis(6, n / 6.0);
  const Eigen::PartialPivLU<Eigen::Matrix<double, 7, 7>> interpolate(values);
  std::vector<Eigen::VectorXd> rows;
  std::vector<Vector3d> data;
  for (std::size_t s = 0; s < stripes.tracks.size(); ++s) {
    std::vector<TrackPiece> pieces;
    cut_stripe(stripes.tracks[s].preimage, stripes.tracks[s].knots, u, v, pieces);
    for (const TrackPiece& piece : pieces) {
      MatrixXd samples = MatrixXd::Zero(7, nu * nv), points = MatrixXd::Zero(7, 3);
      for (int n = 0; n < 7; ++n) {
        const double share = n / 6.0, t = (1 - share) * piece.t0 + share * piece.t1;
        const Vector2d uv = (1 - share) * piece.uv0 + share * piece.uv1;
        const auto bu = cubic_basis(u, piece.span_u, uv.x()).value,
                   bv = cubic_basis(v, piece.span_v, uv.y()).value;
        const auto bt = cubic_basis(stripes.tracks[s].knots, piece.stripe_span, t).value;
        for (int i = 0; i < 4; ++i) {
          for (int j = 0; j < 4; ++j)
            samples(n, (piece.span_u - 3 + i) * nv + piece.span_v - 3 + j) = bu[i] * bv[j];
          points.row(n) += bt[i] * stripes.curves[s].control[piece.stripe_span - 3 + i].transpose();
        }
      }
      const double root = weight == PieceWeight::length ? std::sqrt(piece.length()) : 1.0;
      const MatrixXd forms = root * interpolate.solve(samples), sides = root * interpolate.solve(points);
      for (int p = 0; p < 7; ++p) rows.push_back(forms.row(p)), data.push_back(sides.row(p));
    }
  }
  MatrixXd matrix(rows.size(), nu * nv), side(rows.size(), 3);
  for (std::size_t r = 0; r < rows.size(); ++r) matrix.row(r) = rows[r], side.row(r) = data[r];
  return {matrix, side};
}

BSplineSurface dense_fit(const std::vector<double>& u, const std::vector<double>& v, const Stripes& stripes,
                         PieceWeight weight, const BSplineSurface* base) {
  const int nu = static_cast<int>(u.size()) - 4, nv = static_cast<int>(v.size()) - 4;
  const auto [matrix, side] = dense_equations(u, v, stripes, weight);
  std::vector<int> unknown;
  MatrixXd net = MatrixXd::Zero(nu * nv, 3);
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      if (base == nullptr || (i > 0 && i + 1 < nu && j > 0 && j + 1 < nv))
        unknown.push_back(i * nv + j);
      else
        net.row(i * nv + j) << base->x(i, j), base->y(i, j), base->z(i, j);
    }
  }
  const MatrixXd moved = side - matrix * net;
  net(unknown, Eigen::all) = MatrixXd(matrix(Eigen::all, unknown)).colPivHouseholderQr().solve(moved);
  BSplineSurface surface{u, v, MatrixXd(nu, nv), MatrixXd(nu, nv), MatrixXd(nu, nv)};
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j)
      surface.x(i, j) = net(i * nv + j, 0), surface.y(i, j) = net(i * nv + j, 1),
                   surface.z(i, j) = net(i * nv + j, 2);
  return surface;
}

const std::vector<double> uneven{0, 0, 0, 0, 0.15, 0.4, 0.5, 0.8, 1, 1, 1, 1};
const std::vector<double> even = uniform_clamped_knots(4);

// The header's bound, for control points of size 1 and somewhat more.
double rounding_of(const BSplineSurfaceFit& fit) { return 4 * fit.half_band() * 2.3e-16 * fit.condition(); }

MatchingFailure what_is_wrong(const Stripes& stripes, std::vector<SampledTrack> samples = {}) {
  const auto fit = BSplineSurfaceFit::assemble(even, even, stripes.tracks, samples);
  REQUIRE(!fit.has_value());
  return fit.error();
}

}  // namespace

TEST_CASE("isolines of a surface give the surface back, whatever it is") {
  for (const Ring ring : {Ring::given, Ring::unknown}) {
    for (const PieceWeight weight : {PieceWeight::one, PieceWeight::length}) {
      const BSplineSurface truth = random_surface(uneven, even);
      const Stripes stripes = isolines(truth, 16);
      const auto fit = BSplineSurfaceFit::assemble(uneven, even, stripes.tracks, {}, {weight, ring});
      REQUIRE(fit.has_value());
      const auto surface = fit->solve(stripes.curves, {}, truth);
      REQUIRE(surface.has_value());
      CHECK(net_distance(*surface, truth) < rounding_of(*fit));
      CHECK(fit->residual(stripes.curves, {}, *surface).max_mm < 1e-13);
    }
  }
}

TEST_CASE("the banded system has the dense matrix's least squares solution") {
  const BSplineSurface base = random_surface(uneven, even, 4);
  const Stripes stripes = random_stripes(30, 11);
  for (const PieceWeight weight : {PieceWeight::one, PieceWeight::length}) {
    for (const Ring ring : {Ring::given, Ring::unknown}) {
      const auto fit = BSplineSurfaceFit::assemble(uneven, even, stripes.tracks, {}, {weight, ring});
      REQUIRE(fit.has_value());
      const auto surface = fit->solve(stripes.curves, {}, base);
      REQUIRE(surface.has_value());
      const BSplineSurface dense =
          dense_fit(uneven, even, stripes, weight, ring == Ring::given ? &base : nullptr);
      // The residual here is as large as the data.
      CHECK(net_distance(*surface, dense) < rounding_of(*fit));
      if (ring == Ring::given) {
        CHECK(surface->z.row(0) == base.z.row(0));
        CHECK(surface->x.bottomRows(1) == base.x.bottomRows(1));
        CHECK(surface->y.col(0) == base.y.col(0));
        CHECK(surface->z.rightCols(1) == base.z.rightCols(1));
      }
    }
  }
}

TEST_CASE("the next measuring phase is solved on the stored factor") {
  const BSplineSurface first = random_surface(uneven, even, 2), second = random_surface(uneven, even, 3);
  const Stripes then = isolines(first, 16), now = isolines(second, 16);
  const auto fit = BSplineSurfaceFit::assemble(uneven, even, then.tracks);
  REQUIRE(fit.has_value());
  const double bound = rounding_of(*fit);
  CHECK(net_distance(*fit->solve(now.curves, {}, second), second) < bound);
  CHECK(net_distance(*fit->solve(then.curves, {}, first), first) < bound);
}

TEST_CASE("a stripe with a bent pre-image is matched on each of its straight parts") {
  // x, y and z are cubics in (u, v) together, so that every straight line carries a cubic; at t = 0.4
  // the stripe bends.
  const auto position = [](const Vector2d& p) {
    const double u = p.x(), v = p.y();
    return Vector3d(u, v + 0.1 * u * u, u * u * v - 0.5 * v * v * v + u * v);
  };
  const std::vector<double> knots{0, 0, 0, 0, 0.4, 0.4, 0.4, 1, 1, 1, 1};
  Stripes stripes;
  for (int s = 0; s < 14; ++s) {
    const double at = s / 13.0, middle = 0.5 + 0.3 * (at - 0.5);
    const Preimage preimage{{0, 0.4, 1}, {{at, 0}, {middle, 0.45}, {at, 1}}};
    MatrixX3d control(7, 3);
    for (int half = 0; half < 2; ++half) {
      MatrixXd values(4, 4), points(4, 3);
      for (int n = 0; n < 4; ++n) {
        values.row(n) = bernstein_basis(3, n / 3.0);
        points.row(n) = position((1 - n / 3.0) * preimage.uv[half] + n / 3.0 * preimage.uv[half + 1]);
      }
      control.middleRows<4>(3 * half) = values.partialPivLu().solve(points);
    }
    add(stripes, knots, preimage, control);
  }
  const auto fit = BSplineSurfaceFit::assemble(uneven, even, stripes.tracks, {}, {.ring = Ring::unknown});
  REQUIRE(fit.has_value());
  const auto surface = fit->solve(stripes.curves, {}, {});
  REQUIRE(surface.has_value());
  for (double u = 0; u <= 1; u += 0.09)
    for (double v = 0; v <= 1; v += 0.07)
      CHECK((surface->at(u, v).value - position({u, v})).norm() < rounding_of(*fit));
}

TEST_CASE("points with parameters of their own fill in where no stripe went") {
  const BSplineSurface truth = random_surface(uneven, even, 6);
  Stripes stripes;
  for (const double at : {0.05, 0.1, 0.2, 0.3}) add_isoline(truth, true, at, stripes);
  SampledTrack track;
  SampledPoints points(400);
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int n = 0; n < 400; ++n) {
    track.uv.emplace_back(unit(random), unit(random));
    track.weight.push_back(n % 10 == 0 ? 0.0 : 0.5 + unit(random));
    points[n] = truth.at(track.uv[n].x(), track.uv[n].y()).value;
    if (n % 10 == 0) points[n].array() += 100;  // of weight zero: must not be seen
  }
  const std::vector<SampledTrack> tracks{track};
  const std::vector<SampledPoints> data{points};
  CHECK(!BSplineSurfaceFit::assemble(uneven, even, stripes.tracks).has_value());
  for (const Ring ring : {Ring::given, Ring::unknown}) {
    const auto fit = BSplineSurfaceFit::assemble(uneven, even, stripes.tracks, tracks, {.ring = ring});
    REQUIRE(fit.has_value());
    const auto surface = fit->solve(stripes.curves, data, truth);
    REQUIRE(surface.has_value());
    CHECK(net_distance(*surface, truth) < rounding_of(*fit));
    CHECK(fit->report().samples == 400);
    CHECK(fit->residual(stripes.curves, data, *surface).max_mm < rounding_of(*fit));
  }
}

TEST_CASE("the residual bounds the distance of every point of every stripe") {
  const BSplineSurface base = random_surface(uneven, even, 4);
  const Stripes stripes = random_stripes(30, 13);
  const auto fit = BSplineSurfaceFit::assemble(uneven, even, stripes.tracks);
  REQUIRE(fit.has_value());
  const auto surface = fit->solve(stripes.curves, {}, base);
  const double bound = fit->residual(stripes.curves, {}, *surface).max_mm;
  double most = 0;
  for (std::size_t s = 0; s < stripes.tracks.size(); ++s) {
    for (double t = 0; t <= 1; t += 1.0 / 64) {
      const Vector3d point = stripes.curves[s].at(t).value;
      const Vector2d uv = stripes.tracks[s].preimage.at(t);
      most = std::max(most, (surface->at(uv.x(), uv.y()).value - point).norm());
    }
  }
  CHECK(most <= bound);
  CHECK(most > 0.3 * bound);  // and not by far: a coefficient is near the value
}

TEST_CASE("the condition is that of the normal equations, from half of it to eight times") {
  const auto knots = uniform_clamped_knots(2);
  for (const int count : {4, 6, 20}) {
    const Stripes stripes = random_stripes(count, 20 + count);
    const auto fit = BSplineSurfaceFit::assemble(knots, knots, stripes.tracks, {}, {.ring = Ring::unknown});
    REQUIRE(fit.has_value());
    const MatrixXd dense = dense_equations(knots, knots, stripes, PieceWeight::length).matrix;
    const Eigen::VectorXd values = Eigen::JacobiSVD<MatrixXd>(dense).singularValues();
    const double truth = std::pow(values[0] / values[values.size() - 1], 2);
    CHECK(fit->condition() > 0.5 * truth);
    CHECK(fit->condition() < 8 * truth);
  }
}

TEST_CASE("eight parallel stripes do not determine nine rows of control points, and one of them is named") {
  const auto knots = uniform_clamped_knots(8);
  const BSplineSurface truth = random_surface(knots, knots);
  const auto assemble = [&](int count) {
    Stripes stripes;
    for (int s = 0; s < count; ++s) add_isoline(truth, true, (s + 0.5) / count, stripes);
    return BSplineSurfaceFit::assemble(knots, knots, stripes.tracks);
  };
  const auto eight = assemble(8);
  REQUIRE(!eight.has_value());
  CHECK(eight.error().error == Error::singular);
  CHECK(eight.error().control.i >= 1);
  CHECK(eight.error().control.i <= 9);
  CHECK(assemble(9).has_value());
  CHECK(assemble(16).value().report().pivot.smallest > 1e-3);
}

TEST_CASE("one point too few is singular, whichever way the last pivot is rounded") {
  // Sixteen equations on 4 x 4 control points, but two of them are the same: what is left of the last pivot
  // is rounding, above zero as often as below.
  for (int seed = 1; seed <= 2000; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    SampledTrack track;
    for (int n = 0; n < 15; ++n) track.uv.emplace_back(unit(random), unit(random));
    track.uv.push_back(track.uv.front());
    const std::vector<SampledTrack> tracks{track};
    const auto fit = BSplineSurfaceFit::assemble(one_span, one_span, {}, tracks, {.ring = Ring::unknown});
    REQUIRE(!fit.has_value());
    CHECK(fit.error().error == Error::singular);
  }
}

TEST_CASE("a control point that no stripe reaches is named") {
  const auto knots = uniform_clamped_knots(8);
  const BSplineSurface truth = random_surface(knots, knots);
  Stripes stripes;  // nothing beyond u = 0.5: basis functions 8 to 10 vanish there
  for (int s = 0; s < 16; ++s) add_isoline(truth, true, s / 32.0, stripes);
  const auto fit = BSplineSurfaceFit::assemble(knots, knots, stripes.tracks);
  REQUIRE(!fit.has_value());
  CHECK(fit.error().error == Error::singular);
  CHECK(fit.error().control.i >= 7);
  CHECK(describe(fit.error()).starts_with("the data do not determine the surface: control point ("));
}

TEST_CASE("a stripe that is wrong is named with what is wrong") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const BSplineSurface truth = random_surface(even, even);
  const Stripes good = isolines(truth, 12);
  const auto with = [&](auto&& change) {
    Stripes stripes = good;
    change(stripes);
    return what_is_wrong(stripes);
  };
  auto failure = with([](Stripes& s) { s.tracks[3].preimage.uv[1] = s.tracks[3].preimage.uv[0]; });
  CHECK(failure.error == Error::no_length);
  CHECK(failure.stripe == 3);
  failure = with([](Stripes& s) { s.tracks[5].preimage.uv[1].x() = 1.5; });
  CHECK(failure.error == Error::preimage_outside);
  CHECK(failure.stripe == 5);
  failure = with([&](Stripes& s) { s.tracks[2].preimage.uv[0].y() = nan; });
  CHECK(failure.error == Error::not_finite);
  CHECK(failure.stripe == 2);
  failure = with([](Stripes& s) { std::swap(s.tracks[4].knots[4], s.tracks[4].knots[5]); });
  CHECK(failure.error == Error::knots_not_increasing);
  CHECK(failure.stripe == 4);
  failure = with([](Stripes& s) {
    s.tracks[9].preimage = straight_preimage({2 / 11.0, 1}, {2 / 11.0, 1e-10});
  });
  CHECK(failure.error == Error::coincident_stripes);  // with the third, walked the other way
  CHECK(failure.stripe == 9);
  CHECK(failure.other == 2);
  CHECK(describe(failure) ==
        "two stripes lie on the same line of the surface: stripe 9, which is where stripe 2 is");
  failure = what_is_wrong(good, {{{{0.5, 0.5}}, {}}, {{{0.5, 1.5}}, {}}});
  CHECK(failure.error == Error::preimage_outside);
  CHECK(failure.stripe == 13);
  CHECK(what_is_wrong({}).error == Error::too_few_stripes);
  Stripes one = good;
  one.tracks.resize(1);
  one.tracks[0].knots = one_span;
  one.tracks[0].preimage = straight_preimage({0.3, 0.3}, {0.4, 0.4});  // one piece, seven equations
  CHECK(what_is_wrong(one).error == Error::too_few_stripes);
  CHECK(BSplineSurfaceFit::assemble({0, 0, 0, 0, 2, 1, 3, 3, 3, 3}, even, good.tracks).error().error ==
        Error::knots_not_increasing);

  const auto fit = BSplineSurfaceFit::assemble(even, even, good.tracks);
  REQUIRE(fit.has_value());
  auto data = good.curves;
  data[7].control[2].y() = nan;
  CHECK(fit->solve(data, {}, truth).error().error == Error::not_finite);
  CHECK(fit->solve(data, {}, truth).error().stripe == 7);
  data[7].control.pop_back();
  CHECK(fit->solve(data, {}, truth).error().error == Error::too_few_points);
  data = good.curves;
  data[6].knots[4] += 0.01;
  CHECK(fit->solve(data, {}, truth).error().error == Error::curves_not_compatible);
  CHECK(fit->solve(data, {}, truth).error().stripe == 6);
  data.pop_back();
  CHECK(fit->solve(data, {}, truth).error().error == Error::too_few_points);
  CHECK(fit->solve(good.curves, {}, random_surface(uneven, even)).error().error == Error::too_few_points);
}
