#include "geometry/fit/fit_surface.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "geometry/fit/robust_weights.hpp"
#include "geometry/splines/band_condition.hpp"

namespace moldloft::geometry {

namespace {

constexpr int fewest_spans = 4;

// A net is tried when it has at least this many points for every unknown.
constexpr double points_an_unknown = 4;

bool chooses(const FitSettings& settings) { return settings.control_u == 0 && settings.knots_u.empty(); }

std::vector<double> stretched(int spans, double begin, double end) {
  std::vector<double> knots = uniform_clamped_knots(spans);
  for (double& knot : knots) knot = knot == 1 ? end : begin + knot * (end - begin);
  return knots;
}

// One net over the same points: its cells' moments and its equations.
struct Candidate {
  SplineNet net;
  std::vector<double> knots_u, knots_v;
  std::vector<double> coefficients;
  NetResult result;
};

std::expected<void, FitFailure> check(const FitSettings& settings) {
  if (!settings.knots_u.empty() || !settings.knots_v.empty()) {
    for (const auto* knots : {&settings.knots_u, &settings.knots_v}) {
      if (const auto good = check_knots(*knots); !good) return good;
    }
  }
  const FitDomain& d = settings.domain;
  if (!(d.min_u < d.max_u && d.min_v < d.max_v) || !std::isfinite(d.max_u - d.min_u) ||
      !std::isfinite(d.max_v - d.min_v)) {
    return std::unexpected(FitFailure{Error::outside_domain});
  }
  return {};
}

Candidate candidate(const FitSettings& settings, int spans_u, int spans_v) {
  if (!settings.knots_u.empty()) {
    return {SplineNet(settings.knots_u, settings.knots_v), settings.knots_u, settings.knots_v, {}, {}};
  }
  const FitDomain& d = settings.domain;
  auto knots_u = stretched(spans_u, d.min_u, d.max_u), knots_v = stretched(spans_v, d.min_v, d.max_v);
  // The net lives on [0, 1]: only differences of knots matter to it.
  return {SplineNet(spans_u, spans_v), std::move(knots_u), std::move(knots_v), {}, {}};
}

NetTask task_for(const Candidate& candidate, const MomentGrid& moments, const FitSettings& settings,
                 const PointTotals& totals, std::span<const double> boundary) {
  NetTask task;
  task.net = &candidate.net, task.moments = &moments, task.totals = totals;
  // Over given knots the integrals are in the columns' own unit.
  if (settings.knots_u.empty()) {
    task.length_u_mm = settings.domain.max_u - settings.domain.min_u;
    task.length_v_mm = settings.domain.max_v - settings.domain.min_v;
  }
  task.fairing = settings.fairing.everywhere;
  task.sparse_fairing = settings.fairing.where_sparse;
  task.sparse_points = std::max(1u, settings.fairing.sparse_points);
  task.boundary = boundary, task.boundary_weight = settings.boundary.weight;
  return task;
}

std::size_t first_empty_cell(const MomentGrid& grid) {
  for (int i = 0; i < grid.cells_u(); ++i) {
    for (int j = 0; j < grid.cells_v(); ++j) {
      if (grid.points(i, j) == 0) return static_cast<std::size_t>(i) * grid.cells_v() + j;
    }
  }
  return static_cast<std::size_t>(grid.cells_u()) * grid.cells_v();
}

// The control point (row, column) of an unknown.
std::pair<int, int> control_of(const SplineNet& net, int unknown) {
  const int fast = net.v_is_fast() ? net.control_v() : net.control_u();
  return net.v_is_fast() ? std::pair(unknown / fast, unknown % fast) : std::pair(unknown % fast, unknown / fast);
}

FittedSurface assemble(const Candidate& chosen, double datum) {
  FittedSurface out;
  const SplineNet& net = chosen.net;
  BSplineSurface& s = out.surface;
  s.knots_u = chosen.knots_u, s.knots_v = chosen.knots_v;
  s.x.resize(net.control_u(), net.control_v());
  s.y = s.z = s.x;
  for (int i = 0; i < net.control_u(); ++i) {
    for (int j = 0; j < net.control_v(); ++j) {
      s.x(i, j) = greville(s.knots_u, i), s.y(i, j) = greville(s.knots_v, j);
      s.z(i, j) = chosen.coefficients[net.index(i, j)] + datum;
    }
  }
  return out;
}

// All nets of one fit, and room for the largest of their systems.
class Fitter {
 public:
  Fitter(const FitSettings& settings, const MomentAccumulator& finest) : settings_(settings), finest_(finest) {
    int u = finest.grid().cells_u(), v = finest.grid().cells_v();
    candidates_.push_back(candidate(settings, u, v));
    while (chooses(settings) && (u > fewest_spans || v > fewest_spans)) {
      u = std::max(u / 2, fewest_spans), v = std::max(v / 2, fewest_spans);
      candidates_.push_back(candidate(settings, u, v));
      merged_.emplace_back(u, v);
    }
  }

  std::expected<void, FitFailure> run() {
    totals_ = finest_.totals();
    const auto unknowns = [&](std::size_t k) { return static_cast<double>(candidates_[k].net.unknowns()); };
    const double needed = chooses(settings_) ? points_an_unknown : settings_.fairing.everywhere > 0 ||
                                                                           settings_.fairing.where_sparse > 0
                                                                       ? 0
                                                                       : 1;
    first_ = 0;
    while (first_ < candidates_.size() && static_cast<double>(totals_.points) < needed * unknowns(first_)) ++first_;
    if (first_ == candidates_.size() || totals_.points == 0) {
      return std::unexpected(FitFailure{Error::too_few_points, totals_.points});
    }
    for (std::size_t k = 1; k < candidates_.size(); ++k) {
      for (int i = 0; i < merged_[k - 1].cells_u(); ++i) merged_[k - 1].merge_row(i, grid(k - 1));
    }
    solver_.emplace(candidates_[first_].net.unknowns(), candidates_[first_].net.half_band());
    solver_->want_norm(settings_.condition);
    set_boundary();
    scores_.clear();
    for (std::size_t k = first_; k < candidates_.size(); ++k) {
      if (const auto good = solve(k); !good) return good;
    }
    chosen_ = choose_net(scores_, settings_.criterion, settings_.tolerance);
    // The solver still holds the last net's factor.
    if (settings_.condition && first_ + chosen_ + 1 < candidates_.size()) {
      const std::vector<NetScore> kept = scores_;
      if (const auto good = solve(first_ + chosen_); !good) return good;
      scores_ = kept;
    }
    return {};
  }

  const Candidate& chosen() const { return candidates_[first_ + chosen_]; }
  const PointTotals& totals() const { return totals_; }

  FittedSurface result() const {
    FittedSurface out = assemble(chosen(), finest_.datum());
    const NetResult& result = chosen().result;
    FitReport& report = out.report;
    report.totals = totals_;
    report.rms_residual = std::sqrt(result.squares / totals_.weight);
    report.sigma = scores_[chosen_].sigma;
    report.empty_cells = result.empty_cells, report.sparse_cells = result.sparse_cells;
    report.smallest_pivot = result.smallest_pivot;
    std::tie(report.smallest_pivot_i, report.smallest_pivot_j) =
        control_of(chosen().net, result.smallest_pivot_unknown);
    if (settings_.condition) report.condition = solver_->norm_one() * estimated_inverse_norm(solver_->factor());
    report.nets = scores_, report.chosen = chosen_;
    report.bytes = finest_.bytes() + solver_->bytes() + sizeof(PointBlock);
    for (const Candidate& c : candidates_) {
      report.bytes += c.net.bytes() + c.coefficients.capacity() * sizeof(double);
    }
    for (const MomentGrid& m : merged_) report.bytes += m.bytes();
    report.bytes += 3 * static_cast<std::size_t>(out.surface.z.size()) * sizeof(double);
    return out;
  }

 private:
  const MomentGrid& grid(std::size_t k) const { return k == 0 ? finest_.grid() : merged_[k - 1]; }

  void set_boundary() {
    boundary_.clear();
    const Eigen::MatrixXd& given = settings_.boundary.control;
    if (given.size() == 0) return;
    const SplineNet& net = candidates_.front().net;
    assert(!chooses(settings_) && given.rows() == net.control_u() && given.cols() == net.control_v());
    boundary_.resize(static_cast<std::size_t>(net.unknowns()));
    for (int i = 0; i < net.control_u(); ++i) {
      for (int j = 0; j < net.control_v(); ++j) boundary_[net.index(i, j)] = given(i, j) - finest_.datum();
    }
  }

  std::expected<void, FitFailure> solve(std::size_t k) {
    Candidate& c = candidates_[k];
    const bool fair = settings_.fairing.everywhere > 0 || settings_.fairing.where_sparse > 0;
    if (!fair) {
      const std::size_t empty = first_empty_cell(grid(k));
      if (empty < static_cast<std::size_t>(c.net.cells_u()) * c.net.cells_v()) {
        return std::unexpected(FitFailure{Error::empty_cells, empty});
      }
    }
    solver_->start(task_for(c, grid(k), settings_, totals_, boundary_), nullptr);
    if (const auto solved = solver_->solve(); !solved) {
      const int at = solver_->singular_unknown() >= 0 ? solver_->singular_unknown()
                                                      : solver_->factor().smallest_column();
      const auto [i, j] = control_of(c.net, at);
      return std::unexpected(FitFailure{solved.error(), static_cast<std::size_t>(i) * c.net.control_v() + j});
    }
    c.result = solver_->result();
    c.coefficients.assign(solver_->coefficients().begin(), solver_->coefficients().end());
    const double n = static_cast<double>(totals_.points);
    scores_.push_back({.spans_u = c.net.cells_u(),
                       .spans_v = c.net.cells_v(),
                       .gcv = generalized_cross_validation(totals_, c.result),
                       .bic = bayesian_information(totals_, c.result),
                       .sigma = std::sqrt(c.result.squares / std::max(1.0, n - c.result.freedom)),
                       .smallest_pivot = c.result.smallest_pivot,
                       .empty_cells = c.result.empty_cells});
    return {};
  }

  const FitSettings& settings_;
  const MomentAccumulator& finest_;
  std::vector<Candidate> candidates_;  // from fine to coarse
  std::vector<MomentGrid> merged_;     // of all but the finest
  std::optional<NetSolver> solver_;
  std::vector<double> boundary_;
  std::vector<NetScore> scores_;
  PointTotals totals_;
  std::size_t first_ = 0, chosen_ = 0;
};

// Reweighting rests when neither the coefficients nor the scale move by more than this share of the scale.
constexpr double robust_rest = 0.01;

double difference(const Candidate& a, const Candidate& b) {
  if (a.coefficients.size() != b.coefficients.size()) return std::numeric_limits<double>::infinity();
  double worst = 0;
  for (std::size_t k = 0; k < a.coefficients.size(); ++k) {
    worst = std::max(worst, std::abs(a.coefficients[k] - b.coefficients[k]));
  }
  return worst;
}

// One pass over the points: their residuals against a surface, given by its cells' Bezier coefficients.
struct ResidualPass {
  AbsoluteMedian median;
  double largest = 0;
};

// On the cells of `grid`, which the net's cells are made of.
std::vector<std::array<double, 16>> bezier_cells(const Candidate& c, const MomentGrid& grid) {
  const int share_u = grid.cells_u() / c.net.cells_u(), share_v = grid.cells_v() / c.net.cells_v();
  const auto part = [](int k, int share) {
    const auto r = restriction<3>(double(k % share) / share, double(k % share + 1) / share);
    std::array<std::array<double, 4>, 4> turned;  // coefficients go the other way than moments
    for (int p = 0; p < 4; ++p) {
      for (int l = 0; l < 4; ++l) turned[l][p] = r[p][l];
    }
    return turned;
  };
  std::vector<std::array<double, 16>> cells(static_cast<std::size_t>(grid.cells_u()) * grid.cells_v());
  for (int i = 0; i < grid.cells_u(); ++i) {
    for (int j = 0; j < grid.cells_v(); ++j) {
      const CellVector whole = c.net.bezier(c.coefficients, i / share_u, j / share_v);
      add_restricted<3>(part(i, share_u), part(j, share_v), whole, cells[static_cast<std::size_t>(i) * grid.cells_v() + j]);
    }
  }
  return cells;
}

// Residuals of all points; with `weights_into`, the points are folded into it anew with Tukey's weights.
ResidualPass residual_pass(const PointColumns& columns, const MomentAccumulator& cells_of, const Candidate& fitted,
                           double scale, MomentAccumulator* weights_into) {
  const auto bezier = bezier_cells(fitted, cells_of.grid());
  PointColumns plain = columns;
  plain.weight = {};
  PointBlock block;
  block.shot_rows_wanted = true;
  alignas(64) double height[PointBlock::capacity];
  ResidualPass pass;
  for (std::size_t first = 0; first < columns.size(); first += PointBlock::capacity) {
    (void)cells_of.read(plain, first, block);  // was read without complaint before
    moment_kernel().heights(block, bezier.data(), height);
    for (int k = 0; k < block.count; ++k) {
      const double residual = block.height[k] - height[k];
      pass.largest = std::max(pass.largest, std::abs(residual));
      pass.median.add(residual);
      block.weight[k] = tukey_weight(residual, scale);
      if (!columns.weight.empty()) block.weight[k] *= columns.weight[first + static_cast<std::size_t>(k)];
    }
    if (weights_into != nullptr) weights_into->fold(block);
  }
  return pass;
}

}  // namespace

std::expected<MomentAccumulator, FitFailure> accumulator_for(const FitSettings& settings, double datum) {
  if (const auto good = check(settings); !good) return std::unexpected(good.error());
  if (!settings.knots_u.empty()) {
    return MomentAccumulator(SplineNet(settings.knots_u, settings.knots_v), datum);
  }
  assert(chooses(settings) || (settings.control_u >= 4 && settings.control_v >= 4));
  assert(!chooses(settings) || (std::has_single_bit(static_cast<unsigned>(settings.finest_spans)) &&
                                settings.finest_spans >= fewest_spans));
  const int u = chooses(settings) ? settings.finest_spans : settings.control_u - cubic;
  const int v = chooses(settings) ? settings.finest_spans : settings.control_v - cubic;
  return MomentAccumulator(u, v, settings.domain, datum);
}

std::expected<FittedSurface, FitFailure> fit_moments(const MomentAccumulator& moments, const FitSettings& settings) {
  if (const auto good = check(settings); !good) return std::unexpected(good.error());
  Fitter fitter(settings, moments);
  if (const auto good = fitter.run(); !good) return std::unexpected(good.error());
  return fitter.result();
}

std::expected<FittedSurface, FitFailure> fit_surface(const PointColumns& columns, const FitSettings& settings) {
  if (columns.size() == 0) return std::unexpected(FitFailure{Error::too_few_points});
  const double datum = columns.z[0];
  if (!std::isfinite(datum)) return std::unexpected(FitFailure{Error::not_finite, 0});
  auto moments = accumulator_for(settings, datum);
  if (!moments) return std::unexpected(moments.error());
  if (const auto added = moments->add(columns); !added) return std::unexpected(added.error());
  Fitter fitter(settings, *moments);
  if (const auto good = fitter.run(); !good) return std::unexpected(good.error());
  FittedSurface out = fitter.result();
  Candidate fitted = fitter.chosen();

  double scale = out.report.sigma;
  for (int pass = 0; pass < settings.robust_passes; ++pass) {
    MomentAccumulator weighted = *accumulator_for(settings, datum);
    const ResidualPass residuals = residual_pass(columns, *moments, fitted, scale, &weighted);
    Fitter again(settings, weighted);
    if (const auto good = again.run(); !good) return std::unexpected(good.error());
    const double before = scale;
    scale = residuals.median.scale();
    const double moved = difference(fitted, again.chosen());
    out = again.result();
    fitted = again.chosen();
    out.report.robust_passes = pass + 1, out.report.robust_sigma = scale;
    if (pass > 0 && moved < robust_rest * scale && std::abs(scale - before) < robust_rest * scale) break;
  }
  if (settings.residual_pass) {
    out.report.max_residual = residual_pass(columns, *moments, fitted, 1, nullptr).largest;
  }
  return out;
}

}  // namespace moldloft::geometry
