// Tables 6.1 and 6.2: one Bezier patch through 54 stripes, by the six nested loops and by restricted bases.
#include "bench/literal_matching.hpp"
#include "bench/stopwatch.hpp"
#include "bench/thesis.hpp"
#include "bench/thesis_simulated_plate.hpp"
#include "geometry/splines/bernstein_form.hpp"
#include "geometry/stripes/bezier_surface_fit.hpp"
#include "geometry/stripes/stripe_matching.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <fmt/core.h>

#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

namespace moldloft::bench {

using namespace geometry;
using Eigen::MatrixX3d, Eigen::MatrixXd;

namespace {

constexpr int stripes_all = 54;

struct Published61 {
  int control;  // along one axis
  double definition_s, recurrence_s;
};
constexpr std::array published_6_1{Published61{8, 15.2, 16.8}, Published61{10, 37.5, 47.8},
                                   Published61{15, 335.8, 607.3}, Published61{20, 1983.1, 4664.6},
                                   Published61{25, 8304.1, 24003.4}};

struct Published62 {
  int control;
  double rms, max;
};
// The exponent of the first figure for 64 is lost in print; its maximum tells that it is e-11.
constexpr std::array published_6_2{Published62{4, 4.324e-13, 1.252e-12}, Published62{8, 1.456e-11, 4.770e-11},
                                   Published62{10, 2.228e-9, 8.070e-9}, Published62{15, 3.791e-9, 1.376e-8}};

std::vector<BezierStripe> bezier_stripes() {
  std::vector<BezierStripe> stripes;
  const auto knots = uniform_clamped_knots(1);
  for (const SampledStripe& stripe : plate_stripes(stripes_all, 200, {height_noise_mm, 0}, 61)) {
    const auto curve = fit_stripe(stripe.points, stripe.uv, knots, StripeParameter::consistent);
    if (!curve) continue;
    BezierStripe bezier{MatrixX3d(4, 3), stripe.uv.front(), stripe.uv.back()};
    for (int i = 0; i < 4; ++i) bezier.control.row(i) = curve->curve.control[i].transpose();
    stripes.push_back(bezier);
  }
  return stripes;
}

struct LiteralMatrix {
  MatrixXd rows;       // of the first `stripes`
  double seconds = 0;  // for all stripes, from those that were formed
};

template <typename Bernstein>
LiteralMatrix literal_matrix(int degree, std::span<const BezierStripe> stripes, int formed) {
  const Eigen::Index block = 2 * degree + 1;
  LiteralMatrix matrix{MatrixXd(block * formed, (degree + 1) * (degree + 1)), 0};
  const auto start = std::chrono::steady_clock::now();
  for (int s = 0; s < formed; ++s)
    matrix.rows.middleRows(s * block, block) =
        literal_rows<Bernstein>(degree, degree, stripes[s].from, stripes[s].to);
  const double taken = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  matrix.seconds = taken * static_cast<double>(stripes.size()) / formed;
  return matrix;
}

// The largest distance in height between a Bezier surface and the plate, on 50 x 50 points.
double worst_height(const MatrixX3d& control, int degree) {
  double worst = 0;
  for (int i = 0; i < 50; ++i) {
    const Eigen::VectorXd bu = bernstein_basis(degree, i / 49.0);
    for (int j = 0; j < 50; ++j) {
      const Eigen::VectorXd bv = bernstein_basis(degree, j / 49.0);
      Eigen::RowVector3d point = Eigen::RowVector3d::Zero();
      for (int k = 0; k <= degree; ++k)
        point += bu[k] * (bv.transpose() * control.middleRows(k * (degree + 1), degree + 1));
      worst =
          std::max(worst, std::abs(point.z() - plate_height(plate_size_mm * i / 49, plate_size_mm * j / 49)));
    }
  }
  return worst;
}

std::string seconds(std::optional<double> s) {
  if (!s) return "-";
  return *s >= 0.1 ? fmt::format("{:.1f}", *s) : fmt::format("{:.4f}", *s);
}

Json or_null(std::optional<double> value) { return value ? Json(*value) : Json(nullptr); }

Json table_6_1(std::span<const BezierStripe> stripes, const Options& options) {
  if (!options.quiet) {
    fmt::print(
        "\nTable 6.1: one Bezier patch through 54 stripes, seconds. Literal: the six loops (a number in "
        "brackets: formed for so\n");
    fmt::print(
        "many of the 54 stripes, extrapolated). Ours: restricted bases; the matrix, then the whole fit.\n");
    fmt::print("{:>7} {:>9} {:>9} {:>14} {:>14} {:>9} {:>6} {:>6} {:>9} {:>9} {:>9} {:>10} {:>9} {:>9}\n",
               "control", "(2.27)", "(2.31)", "(2.27)", "(2.31)", "matrix", "x", "x", "largest", "condition",
               "normal eq", "error", "QR", "error");
    fmt::print("{:>7} {:>9} {:>9} {:>14} {:>14} {:>9} {:>6} {:>6} {:>9} {:>9} {:>9} {:>10} {:>9} {:>9}\n",
               "points", "thesis s", "thesis s", "literal s", "literal s", "ours s", "2.27", "2.31",
               "differ.", "", "s", "mm", "s", "mm");
  }
  Json table = Json::array();
  for (const auto& published : published_6_1) {
    const int n = published.control, degree = n - 1;
    // The recurrence at 625 control points takes seconds a stripe.
    const int formed = options.quick ? (n <= 10 ? 3 : 1) : (n <= 15 ? stripes_all : n == 20 ? 5 : 2);
    const auto definition = literal_matrix<ByDefinition>(degree, stripes, formed);
    std::optional<double> recurrence_s;
    MatrixXd ours;
    const double matrix_s = time_of(7, [&] { matching_matrix(degree, degree, stripes, ours); }).least;
    double largest = (ours.topRows(definition.rows.rows()) - definition.rows).cwiseAbs().maxCoeff();
    if (!options.quick || n < 25) {
      const auto recurrence = literal_matrix<ByRecurrence>(degree, stripes, formed);
      recurrence_s = recurrence.seconds;
      largest =
          std::max(largest, (ours.topRows(recurrence.rows.rows()) - recurrence.rows).cwiseAbs().maxCoeff());
    }
    const auto fit_by = [&](LeastSquares method) {
      std::optional<BezierSurfaceFit> fit;
      double condition = 0;
      const double taken = time_of(1, [&] {
                             auto result = fit_bezier_surface(
                                 stripes, {.degree_u = degree, .degree_v = degree, .method = method});
                             fit = result ? std::optional(*result) : std::nullopt;
                             condition = result ? result->condition : result.error().condition;
                           }).least;
      return std::tuple{fit, taken, condition};
    };
    const auto [normal, normal_s, normal_condition] = fit_by(LeastSquares::normal_equations);
    const auto [qr, qr_s, condition] = fit_by(LeastSquares::qr);
    const auto error_of = [&](const std::optional<BezierSurfaceFit>& fit) {
      return fit ? std::optional(worst_height(fit->control, degree)) : std::nullopt;
    };
    const auto normal_error = error_of(normal), qr_error = error_of(qr);
    const double by_definition = definition.seconds / matrix_s;
    const auto by_recurrence = recurrence_s ? std::optional(*recurrence_s / matrix_s) : std::nullopt;
    table.push_back(
        {{"control_points", n * n},
         {"published", {{"definition_s", published.definition_s}, {"recurrence_s", published.recurrence_s}}},
         {"literal",
          {{"definition_s", definition.seconds},
           {"recurrence_s", or_null(recurrence_s)},
           {"stripes_formed", formed}}},
         {"ours",
          {{"matrix_s", matrix_s},
           {"largest_difference", largest},
           {"normal_equations_s", normal_s},
           {"normal_equations_solved", normal.has_value()},
           {"normal_equations_error_mm", or_null(normal_error)},
           {"qr_s", qr_s},
           {"qr_error_mm", or_null(qr_error)},
           {"condition", condition}}},
         {"faster_than_definition", by_definition},
         {"faster_than_recurrence", or_null(by_recurrence)}});
    if (options.quiet) continue;
    const auto literal = [&](std::optional<double> s) {
      return formed == stripes_all || !s ? seconds(s) : seconds(s) + fmt::format(" ({})", formed);
    };
    const auto error = [](std::optional<double> e) {
      return e ? fmt::format("{:.3g}", *e) : std::string("singular");
    };
    fmt::print(
        "{:7} {:9.1f} {:9.1f} {:>14} {:>14} {:9.4f} {:6.0f} {:>6} {:9.1e} {:>9} {:9.4f} {:>10} {:9.4f} "
        "{:>9}\n",
        n * n, published.definition_s, published.recurrence_s, literal(definition.seconds),
        literal(recurrence_s), matrix_s, by_definition,
        by_recurrence ? fmt::format("{:.0f}", *by_recurrence) : "-", largest,
        fmt::format("{:.1e}", condition), normal_s, error(normal_error), qr_s, error(qr_error));
  }
  return table;
}

// Control points by normal equations and Cholesky, as the thesis solves.
std::optional<MatrixX3d> solve_normal(const MatrixXd& matrix, const MatrixX3d& side) {
  const Eigen::LLT<MatrixXd> llt(matrix.transpose() * matrix);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return MatrixX3d(llt.solve(matrix.transpose() * side));
}

Json table_6_2(std::span<const BezierStripe> stripes, const Options& options) {
  if (!options.quiet) {
    fmt::print(
        "\nTable 6.2: distance between the control points that the two literal variants give, mm, rms / "
        "max\n");
    fmt::print("{:>14} {:>22} {:>22} {:>22} {:>22}\n", "control points", "thesis", "ours, normal eq.",
               "ours, QR", "(2.31) to ours, QR");
  }
  Json table = Json::array();
  for (const auto& published : published_6_2) {
    const int n = published.control, degree = n - 1;
    if (options.quick && n > 10) continue;
    const auto a = literal_matrix<ByDefinition>(degree, stripes, stripes_all).rows;
    const auto b = literal_matrix<ByRecurrence>(degree, stripes, stripes_all).rows;
    MatrixXd c;
    matching_matrix(degree, degree, stripes, c);
    MatrixX3d side(a.rows(), 3);
    for (std::size_t s = 0; s < stripes.size(); ++s)
      side.middleRows(static_cast<Eigen::Index>(s) * (2 * degree + 1), 2 * degree + 1) =
          literal_side(stripes[s].control, 2 * degree);
    const auto apart = [](const MatrixX3d& p, const MatrixX3d& q) {
      const Eigen::VectorXd distance = (p - q).rowwise().norm();
      return std::pair{std::sqrt(distance.squaredNorm() / static_cast<double>(distance.size())),
                       distance.maxCoeff()};
    };
    const auto normal_a = solve_normal(a, side), normal_b = solve_normal(b, side);
    const auto by_normal = normal_a && normal_b ? std::optional(apart(*normal_a, *normal_b)) : std::nullopt;
    const MatrixX3d qr_a = a.householderQr().solve(side), qr_b = b.householderQr().solve(side),
                    qr_c = c.householderQr().solve(side);
    const auto by_qr = apart(qr_a, qr_b), to_ours = apart(qr_b, qr_c);
    const auto pair_json = [](const std::pair<double, double>& p) {
      return Json{{"rms", p.first}, {"max", p.second}};
    };
    table.push_back({{"control_points", n * n},
                     {"published", {{"rms", published.rms}, {"max", published.max}}},
                     {"normal_equations", by_normal ? pair_json(*by_normal) : Json(nullptr)},
                     {"qr", pair_json(by_qr)},
                     {"literal_to_ours_qr", pair_json(to_ours)}});
    if (options.quiet) continue;
    const auto text = [](const std::pair<double, double>& p) {
      return fmt::format("{:.1e} / {:.1e}", p.first, p.second);
    };
    fmt::print("{:14} {:>22} {:>22} {:>22} {:>22}\n", n * n, text({published.rms, published.max}),
               by_normal ? text(*by_normal) : "singular", text(by_qr), text(to_ours));
  }
  return table;
}

}  // namespace

Json thesis_bezier_tables(const Options& options) {
  const auto stripes = bezier_stripes();
  return {{"table_6_1", table_6_1(stripes, options)}, {"table_6_2", table_6_2(stripes, options)}};
}

}  // namespace moldloft::bench
