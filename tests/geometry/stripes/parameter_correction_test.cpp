#include "geometry/stripes/parameter_correction.hpp"

#include "geometry/polynomial_surface.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>

using namespace moldloft;
using namespace moldloft::geometry;
using Eigen::Vector2d, Eigen::Vector3d;

namespace {

// Waves in the manner of the thesis (section 6.2.1): 11 x 11 control points over eight spans, x and y of
// their own so that x depends on u alone and y on v alone.
enum class Wave { egg_crate, diagonal, strong };

BSplineSurface wave(Wave kind) {
  constexpr int n = 11;
  BSplineSurface s{uniform_clamped_knots(8), uniform_clamped_knots(8), {}, {}, {}};
  s.x.resize(n, n), s.y.resize(n, n), s.z.resize(n, n);
  constexpr double turn = 2 * std::numbers::pi;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double g = greville(s.knots_u, i), h = greville(s.knots_v, j);
      const bool inside = i > 0 && j > 0 && i < n - 1 && j < n - 1;
      const bool uneven = kind == Wave::strong;
      s.x(i, j) = g + (uneven ? 0.1 * std::sin(turn * g) : 0.0);
      s.y(i, j) = h - (uneven ? 0.1 * std::sin(turn * h) : 0.0);
      switch (kind) {
        case Wave::egg_crate:
          s.z(i, j) = inside ? 0.3 * std::sin(2 * turn * g) * std::sin(2 * turn * h) : 0.0;
          break;
        case Wave::diagonal:
          s.z(i, j) = 0.147 * std::sin(turn * (g + h));
          break;
        case Wave::strong:
          s.z(i, j) = inside ? 0.3 * ((i + j) % 2 == 1 ? 1 : -1) : 0.0;
          break;
      }
    }
  }
  return s;
}

// Points with the parameters that one would start from.
struct Stripes {
  std::vector<Vector3d> points;
  std::vector<Vector2d> parameters;
  void add(const BSplineSurface& truth, const Vector2d& from, const Vector2d& to, double bow = 0) {
    std::vector<Vector3d> stripe;
    const Vector2d across = bow * Vector2d(-(to - from).y(), (to - from).x());
    for (int k = 0; k <= 80; ++k) {
      const double t = k / 80.0;
      const Vector2d uv = from + t * (to - from) + 4 * t * (1 - t) * across;
      stripe.push_back(truth.at(uv.x(), uv.y()).value);
    }
    const auto start = chord_length_parameters(stripe, from, to);
    points.insert(points.end(), stripe.begin(), stripe.end());
    parameters.insert(parameters.end(), start.begin(), start.end());
  }
};

Stripes parallel_stripes(const BSplineSurface& truth, double bow = 0) {
  Stripes all;
  for (int s = 0; s < 16; ++s) all.add(truth, {(s + 0.5) / 16, 0}, {(s + 0.5) / 16, 1}, bow);
  return all;
}

// At 25 degrees to v; 14 of 16 meet the square by more than a sliver.
Stripes oblique_stripes(const BSplineSurface& truth) {
  Stripes all;
  const double slope = std::tan(25 * std::numbers::pi / 180);
  for (int s = 0; s < 16; ++s) {
    const double middle = -0.3 + 1.6 * (s + 0.5) / 16;
    const double low = std::max(0.0, (0 - middle) / slope + 0.5),
                 high = std::min(1.0, (1 - middle) / slope + 0.5);
    if (high - low < 0.02) continue;
    const auto u = [&](double v) { return std::clamp(middle + slope * (v - 0.5), 0.0, 1.0); };
    all.add(truth, {u(low), low}, {u(high), high});
  }
  return all;
}

double inverse(const auto& increasing, double value) {
  double low = 0, high = 1;
  for (int k = 0; k < 60; ++k) (increasing(0.5 * (low + high)) < value ? low : high) = 0.5 * (low + high);
  return 0.5 * (low + high);
}

// Mean over 50 x 50 points of the height of the fitted surface above the true one at the same place: the
// truth is a graph whose x depends on u alone, so no projection is needed. The distance is no larger.
double mean_height_off(const BSplineSurface& fitted, const BSplineSurface& truth) {
  double sum = 0;
  for (int i = 0; i < 50; ++i) {
    for (int j = 0; j < 50; ++j) {
      const Vector3d p = fitted.at(i / 49.0, j / 49.0).value;
      const double u = inverse([&](double t) { return truth.at(t, 0.5).value.x(); }, p.x());
      const double v = inverse([&](double t) { return truth.at(0.5, t).value.y(); }, p.y());
      sum += std::abs(truth.at(u, v).value.z() - p.z());
    }
  }
  return sum / 2500;
}

void check_falls(const CorrectionReport& report) {
  CHECK(static_cast<int>(report.sums_mm2.size()) == report.accepted + 2);
  for (std::size_t k = 1; k < report.sums_mm2.size(); ++k) {
    if (k == 1) CHECK(report.sums_mm2[k] <= report.sums_mm2[k - 1]);
    if (k > 1) CHECK(report.sums_mm2[k] < report.sums_mm2[k - 1]);
  }
  CHECK(report.rms_mm <= report.start_rms_mm);
}

// A strip rolled up so far that it hangs over itself: no plan view.
BSplineSurface rolled_strip() {
  return test::polynomial_surface(
      [](double u, double v) {
        const double t = 2 * u - 1;
        return Vector3d(60 * (t * t * t - 0.45 * t), 120 * v + 10 * u * v * v, 60 * t * t + 8 * v * v * v);
      },
      uniform_clamped_knots(5), {0, 0, 0, 0, 0.3, 0.4, 0.8, 1, 1, 1, 1});
}

std::vector<Vector2d> scattered(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vector2d> all;
  for (int k = 0; k < count; ++k) all.emplace_back(unit(random), unit(random));
  return all;
}

}  // namespace

TEST_CASE("points with their own parameters give their surface back, ring kept or free") {
  const BSplineSurface truth = rolled_strip();
  const auto parameters = scattered(700, 1);
  std::vector<Vector3d> points;
  for (const Vector2d& uv : parameters) points.push_back(truth.at(uv.x(), uv.y()).value);
  for (const bool keep : {false, true}) {
    const auto fit = fit_with_parameter_correction(points, parameters, truth, {.keep_border = keep});
    REQUIRE(fit.has_value());
    // 1e-9 of the extent, as the header says.
    CHECK(fit->report.max_mm <= 1e-9 * 150);
    CHECK((fit->surface.x - truth.x).cwiseAbs().maxCoeff() < 1e-9 * 150);
    CHECK((fit->surface.y - truth.y).cwiseAbs().maxCoeff() < 1e-9 * 150);
    CHECK((fit->surface.z - truth.z).cwiseAbs().maxCoeff() < 1e-9 * 150);
    CHECK_FALSE(fit->report.faired);
    if (keep) {
      for (const auto member : {&BSplineSurface::x, &BSplineSurface::y, &BSplineSurface::z}) {
        CHECK((fit->surface.*member).row(0) == (truth.*member).row(0));
        CHECK((fit->surface.*member).col(0) == (truth.*member).col(0));
        CHECK((fit->surface.*member).bottomRows(1) == (truth.*member).bottomRows(1));
        CHECK((fit->surface.*member).rightCols(1) == (truth.*member).rightCols(1));
      }
    }
  }
}

TEST_CASE("the thesis's wave is found from chord-length parameters, where point-distance steps crawl") {
  // Other programs of this method reached 3e-10..8e-6 (egg crate) and 4e-9..9e-6 (diagonal) in 30 corrections.
  for (const Wave kind : {Wave::egg_crate, Wave::diagonal}) {
    const BSplineSurface truth = wave(kind);
    for (const auto& stripes : {parallel_stripes(truth), oblique_stripes(truth)}) {
      CAPTURE(static_cast<int>(kind));
      CAPTURE(stripes.points.size());
      const auto fit =
          fit_with_parameter_correction(stripes.points, stripes.parameters, truth,
                                        {.most_rounds = 30, .enough_mm = 1e-13, .keep_border = true});
      REQUIRE(fit.has_value());
      check_falls(fit->report);
      CHECK(fit->report.start_rms_mm > 9e-4);
      const double off = mean_height_off(fit->surface, truth);
      MESSAGE("mean " << off << " after " << fit->report.accepted << " steps, "
                      << std::string(to_string(fit->report.end)));
      CHECK(off < 8e-6);

      const auto point_steps = fit_with_parameter_correction(
          stripes.points, stripes.parameters, truth,
          {.step = CorrectionStep::point_distance, .most_rounds = 100, .keep_border = true});
      REQUIRE(point_steps.has_value());
      check_falls(point_steps->report);
      CHECK(mean_height_off(point_steps->surface, truth) > 10 * off);
    }
  }
}

TEST_CASE("the strong wave never gets worse, and where the stripes carry it, it is found") {
  const BSplineSurface truth = wave(Wave::strong);
  for (const auto& stripes : {parallel_stripes(truth), oblique_stripes(truth)}) {
    for (const auto step : {CorrectionStep::tangent_distance, CorrectionStep::point_distance}) {
      const auto fit = fit_with_parameter_correction(stripes.points, stripes.parameters, truth,
                                                     {.step = step, .most_rounds = 60, .keep_border = true});
      REQUIRE(fit.has_value());
      check_falls(fit->report);
      CHECK(fit->report.rms_mm < 0.5 * fit->report.start_rms_mm);
      CHECK(fit->surface.z.allFinite());
      for (const Vector2d& uv : fit->parameters) CHECK((uv.minCoeff() >= 0 && uv.maxCoeff() <= 1));
    }
  }
  const auto stripes = parallel_stripes(truth);
  const auto fit = fit_with_parameter_correction(stripes.points, stripes.parameters, truth,
                                                 {.enough_mm = 1e-12, .keep_border = true});
  CHECK(mean_height_off(fit->surface, truth) < 1e-9);
  CHECK(fit->report.end == CorrectionEnd::close_enough);
}

TEST_CASE("stripes whose pre-images are bent are corrected from straight ones") {
  const BSplineSurface truth = wave(Wave::egg_crate);
  const auto stripes =
      parallel_stripes(truth, 0.02);  // a fiftieth of their length, a third of their distance
  const auto fit =
      fit_with_parameter_correction(stripes.points, stripes.parameters, truth, {.keep_border = true});
  REQUIRE(fit.has_value());
  check_falls(fit->report);
  CHECK(fit->report.start_rms_mm > 1e-3);
  CHECK(fit->report.rms_mm < 1e-9);
  CHECK(mean_height_off(fit->surface, truth) < 8e-6);
}

TEST_CASE("a strip without a plan view is fitted from parameters that are off by a tenth of a span") {
  const BSplineSurface truth = rolled_strip();
  const auto exact = scattered(1500, 2);
  std::mt19937 random(3);
  std::normal_distribution<double> off(0, 0.02);
  std::vector<Vector3d> points;
  std::vector<Vector2d> rough;
  for (const Vector2d& uv : exact) {
    points.push_back(truth.at(uv.x(), uv.y()).value);
    rough.push_back((uv + Vector2d(off(random), off(random))).cwiseMax(0).cwiseMin(1));
  }
  for (const bool keep : {true, false}) {
    const auto fit = fit_with_parameter_correction(points, rough, truth, {.keep_border = keep});
    REQUIRE(fit.has_value());
    check_falls(fit->report);
    CHECK(fit->report.start_rms_mm > 0.5);
    CHECK(fit->report.rms_mm < (keep ? 1e-9 : 1e-6) * 150);
  }
}

TEST_CASE(
    "a noisy strip is fitted closer than the truth lies, at true feet, and the fit goes with the part") {
  const BSplineSurface truth = rolled_strip();
  const auto exact = scattered(2000, 5);
  constexpr double sigma = 0.025;
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0, sigma), off(0, 0.01);
  std::vector<Vector3d> points;
  std::vector<Vector2d> rough;
  double along_normal = 0;
  for (const Vector2d& uv : exact) {
    const SurfacePoint p = truth.at(uv.x(), uv.y());
    const Vector3d e(noise(random), noise(random), noise(random));
    points.push_back(p.value + e);
    rough.push_back((uv + Vector2d(off(random), off(random))).cwiseMax(0).cwiseMin(1));
    along_normal += std::pow(p.normal().dot(e), 2);
  }
  const auto fit = fit_with_parameter_correction(points, rough, truth);
  REQUIRE(fit.has_value());
  check_falls(fit->report);
  // The truth is one of the candidates, so the least sum is not above its own; and no fit can eat more of the
  // noise than its unknowns: one direction of 2,000 points against 8 x 7 control points of three coordinates.
  const double truth_rms = std::sqrt(along_normal / 2000);
  CHECK(fit->report.rms_mm <= truth_rms);
  CHECK(fit->report.rms_mm >= truth_rms * std::sqrt(1 - 3 * 56 / 2000.0) * 0.95);
  CHECK(fit->report.end != CorrectionEnd::most_rounds);
  CHECK(fit->report.max_mm < 6 * sigma);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vector2d& uv = fit->parameters[k];
    const SurfacePoint p = fit->surface.at(uv.x(), uv.y());
    const Vector3d r = p.value - points[k];
    if (uv.x() > 0 && uv.x() < 1) CHECK(std::abs(r.dot(p.du)) < 1e-9 * p.du.norm());
    if (uv.y() > 0 && uv.y() < 1) CHECK(std::abs(r.dot(p.dv)) < 1e-9 * p.dv.norm());
  }

  const Eigen::Isometry3d motion =
      Eigen::Translation3d(300, -200, 80) * Eigen::AngleAxisd(1.1, Vector3d(1, 2, -1).normalized());
  for (Vector3d& p : points) p = motion * p;
  const auto moved = fit_with_parameter_correction(points, rough, truth);
  REQUIRE(moved.has_value());
  CHECK(moved->report.rms_mm ==
        doctest::Approx(fit->report.rms_mm).epsilon(1e-4));  // each ends on its own least_gain
}

TEST_CASE("where no point lies the net is faired, or refused if fairing is forbidden") {
  const BSplineSurface truth = wave(Wave::diagonal);
  Stripes stripes;
  for (int s = 0; s < 16; ++s) {
    if (s < 4 || s > 11) stripes.add(truth, {(s + 0.5) / 16, 0}, {(s + 0.5) / 16, 1});
  }
  const auto fit = fit_with_parameter_correction(stripes.points, stripes.parameters, truth,
                                                 {.fairing = 1e-9, .keep_border = true});
  REQUIRE(fit.has_value());
  check_falls(fit->report);
  CHECK(fit->report.faired);
  CHECK(fit->surface.z.cwiseAbs().maxCoeff() < 1);
  CHECK(fit_with_parameter_correction(stripes.points, stripes.parameters, truth,
                                      {.fairing = 0, .keep_border = true})
            .error() == Error::singular);
}

TEST_CASE("data that cannot be fitted are refused by name") {
  const BSplineSurface frame = rolled_strip();
  const auto parameters = scattered(100, 9);
  std::vector<Vector3d> points;
  for (const Vector2d& uv : parameters) points.push_back(frame.at(uv.x(), uv.y()).value);
  const auto error = [](const auto& p, const auto& uv, const BSplineSurface& f,
                        CorrectionSettings settings = {}) {
    const auto fit = fit_with_parameter_correction(p, uv, f, settings);
    REQUIRE_FALSE(fit.has_value());
    return fit.error();
  };
  const std::vector<Vector3d> none;
  CHECK(error(none, std::vector<Vector2d>{}, frame) == Error::too_few_points);
  auto few = points;
  few.resize(55);  // of 8 x 7 control points
  CHECK(error(few, std::vector<Vector2d>(parameters.begin(), parameters.begin() + 55), frame) ==
        Error::too_few_points);
  CHECK(error(points, std::vector<Vector2d>(99, Vector2d(0.5, 0.5)), frame) == Error::too_few_points);

  auto bad_points = points;
  bad_points[17].y() = NAN;
  CHECK(error(bad_points, parameters, frame) == Error::not_finite);
  auto bad = parameters;
  bad[3].x() = INFINITY;
  CHECK(error(points, bad, frame) == Error::not_finite);
  bad = parameters, bad[3].x() = 1.0001;
  CHECK(error(points, bad, frame) == Error::outside_domain);
  bad = parameters, bad[3].y() = -1e-9;
  CHECK(error(points, bad, frame) == Error::outside_domain);
  for (std::size_t k = 0; k < bad.size(); ++k) bad[k] = {0.01 * k, 0.5};
  CHECK(error(points, bad, frame) == Error::collinear);

  for (const std::vector<double>& knots : {std::vector<double>{0, 0, 0, 0, 0.6, 0.4, 1, 1, 1, 1},
                                           {0, 0, 0, 1, 1, 1},
                                           {0, 0, 0, 0.1, 0.5, 1, 1, 1, 1},
                                           {0, 0, 0, 0, 0.5, 0.5, 0.5, 0.5, 1, 1, 1, 1},
                                           {0, 0, 0, 0, NAN, 1, 1, 1, 1},
                                           {1, 1, 1, 1, 1, 1, 1, 1}}) {
    BSplineSurface other = frame;
    other.knots_v = knots;
    CHECK(error(points, parameters, other) == Error::knots_not_increasing);
  }
  BSplineSurface ring = frame;
  ring.z(0, 2) = NAN;
  CHECK(error(points, parameters, ring, {.keep_border = true}) == Error::not_finite);
  CHECK(fit_with_parameter_correction(points, parameters, ring, {}).has_value());  // not looked at
}

TEST_CASE("chord length places a stripe's points by the way along it") {
  const std::vector<Vector3d> stripe{{0, 0, 0}, {3, 4, 0}, {3, 4, 5}, {3, 4, 15}};  // 5, 5 and 10 mm
  const auto uv = chord_length_parameters(stripe, {0, 1}, {1, 0});
  REQUIRE(uv.size() == 4);
  CHECK(uv[0] == Vector2d(0, 1));
  CHECK(uv[1] == Vector2d(0.25, 0.75));
  CHECK(uv[2] == Vector2d(0.5, 0.5));
  CHECK(uv[3] == Vector2d(1, 0));
  CHECK(chord_length_parameters({}, {0, 0}, {1, 1}).empty());
  const std::vector<Vector3d> still(3, Vector3d(1, 1, 1));
  for (const Vector2d& p : chord_length_parameters(still, {0.2, 0}, {1, 1})) CHECK(p == Vector2d(0.2, 0));
}

TEST_CASE("every way in which a correction ends has its own words") {
  std::set<std::string_view> words;
  for (const auto end : {CorrectionEnd::close_enough, CorrectionEnd::settled, CorrectionEnd::no_descent,
                         CorrectionEnd::most_rounds})
    words.insert(to_string(end));
  CHECK(words.size() == 4);
}
