#include "geometry/fit/fit_surface.hpp"

#include "geometry/fit/fit_checks.hpp"
#include "geometry/fit/robust_weights.hpp"
#include "geometry/splines/band_condition.hpp"
#include "geometry/tukey.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::geometry {

namespace {

// A net is tried when it has at least this many points for every unknown.
constexpr double points_an_unknown = 4;

bool chooses(const FitSettings& settings) {
  return settings.control_u == 0 && settings.control_v == 0 && settings.knots_u.empty();
}

std::vector<double> stretched(int spans, double begin, double end) {
  std::vector<double> knots = uniform_clamped_knots(spans);
  for (double& knot : knots) knot = knot == 1 ? end : begin + knot * (end - begin);
  return knots;
}

// One net over the same points: its cells' moments and its equations.
struct Candidate {
  SplineNet net;
  std::vector<double> knots_u, knots_v;   // of the surface; the net may live on [0, 1]
  std::optional<MomentGrid> merged = {};  // nothing: the points' own cells
  std::vector<double> coefficients = {};
  NetResult result = {};
};

Candidate candidate(const FitSettings& settings, int spans_u, int spans_v) {
  if (!settings.knots_u.empty()) {
    return {SplineNet(settings.knots_u, settings.knots_v), settings.knots_u, settings.knots_v};
  }
  const FitDomain& d = settings.domain;
  auto knots_u = stretched(spans_u, d.min_u, d.max_u), knots_v = stretched(spans_v, d.min_v, d.max_v);
  // The net lives on [0, 1]: only differences of knots matter to it.
  return {SplineNet(spans_u, spans_v), std::move(knots_u), std::move(knots_v)};
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
  return net.v_is_fast() ? std::pair(unknown / fast, unknown % fast)
                         : std::pair(unknown % fast, unknown / fast);
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

// Where `spans` nearly equal spans begin and end on a grid of `cells`.
std::vector<int> nearly_equal(int cells, int spans) {
  std::vector<int> bounds;
  for (int k = 0; k <= spans; ++k) bounds.push_back((2 * k * cells + spans) / (2 * spans));
  return bounds;
}

std::vector<double> knots_at(const std::vector<int>& bounds) {
  std::vector<double> knots(cubic, 0.0);
  for (const int b : bounds) knots.push_back(double(b) / bounds.back());
  knots.insert(knots.end(), cubic, 1.0);
  return knots;
}

// All nets of one fit, and room for the largest of their systems.
class Fitter {
 public:
  Fitter(const FitSettings& settings, const MomentAccumulator& finest)
      : settings_(settings), finest_(finest) {
    candidates_.push_back(candidate(settings, finest.grid().cells_u(), finest.grid().cells_v()));
    spread_ = check_spread(candidates_.front().net, finest.grid());
  }

  std::expected<void, FitFailure> run() {
    totals_ = finest_.totals();
    const bool fair = settings_.fairing.everywhere > 0 || settings_.fairing.where_sparse > 0;
    const double needed = chooses(settings_) ? points_an_unknown : fair ? 0 : 1;
    const auto determined = [&](const Candidate& c) {
      return static_cast<double>(totals_.points) >= needed * c.net.unknowns();
    };
    if (chooses(settings_)) halve_down();
    std::erase_if(candidates_, [&](const Candidate& c) { return !determined(c); });
    if (candidates_.empty() || totals_.points == 0) {
      return std::unexpected(FitFailure{Error::too_few_points, totals_.points});
    }
    if (!(totals_.weight > 0)) return std::unexpected(FitFailure{Error::too_few_points, totals_.points});
    set_boundary();
    if (boundary_.empty()) {
      if (const auto good = spread_; !good) return good;
    }
    for (Candidate& c : candidates_) {
      if (const auto good = solve(c); !good) return good;
    }
    chosen_ = choose();
    if (chooses(settings_)) {
      if (const auto good = try_between(); !good) return good;
    }
    // The solver holds the factor of the net that came last, whichever was chosen.
    if (settings_.condition && candidates_.size() > 1) return solve(candidates_[chosen_]);
    return {};
  }

  const Candidate& chosen() const { return candidates_[chosen_]; }
  // Whether the choice is none of the nested, evenly spaced nets.
  bool chose_between() const {
    const auto whole_share = [](int finest, int spans) { return finest % spans == 0; };
    return chooses(settings_) && !(whole_share(finest_.grid().cells_u(), chosen().net.cells_u()) &&
                                   whole_share(finest_.grid().cells_v(), chosen().net.cells_v()));
  }

  FittedSurface result() const {
    FittedSurface out = assemble(chosen(), finest_.datum());
    const NetResult& result = chosen().result;
    FitReport& report = out.report;
    report.totals = totals_;
    report.rms_residual = std::sqrt(result.squares / totals_.weight);
    report.sigma = score(chosen()).sigma;
    report.empty_cells = result.empty_cells, report.sparse_cells = result.sparse_cells;
    report.smallest_pivot = result.smallest_pivot;
    std::tie(report.smallest_pivot_i, report.smallest_pivot_j) =
        control_of(chosen().net, result.smallest_pivot_unknown);
    if (settings_.condition)
      report.condition = solver_->norm_one() * estimated_inverse_norm(solver_->factor());
    for (const Candidate& c : candidates_) report.nets.push_back(score(c));
    report.chosen = chosen_;
    report.freedom = result.freedom;
    report.bytes = finest_.bytes() + solver_->bytes() + sizeof(PointBlock);
    for (const Candidate& c : candidates_) {
      report.bytes += c.net.bytes() + c.coefficients.capacity() * sizeof(double);
      if (c.merged) report.bytes += c.merged->bytes();
    }
    report.bytes += 3 * static_cast<std::size_t>(out.surface.z.size()) * sizeof(double);
    return out;
  }

 private:
  const MomentGrid& grid(const Candidate& c) const { return c.merged ? *c.merged : finest_.grid(); }

  void halve_down() {
    int u = finest_.grid().cells_u(), v = finest_.grid().cells_v();
    while (u > fewest_spans || v > fewest_spans) {
      u = std::max(u / 2, fewest_spans), v = std::max(v / 2, fewest_spans);
      Candidate c = candidate(settings_, u, v);
      c.merged.emplace(u, v);
      c.merged->merge_cells(0, u * v, grid(candidates_.back()));
      candidates_.push_back(std::move(c));
    }
  }

  // Between the best net and its neighbours, of half and twice its spans, lie others whose knots are knots
  // of the finest grid too, only not quite evenly spaced; their moments follow from the same sums.
  std::expected<void, FitFailure> try_between() {
    const FitDomain& d = settings_.domain;
    const int u = candidates_[chosen_].net.cells_u(), v = candidates_[chosen_].net.cells_v();
    const MomentGrid& finest = finest_.grid();
    for (const double share : {0.75, 0.875, 1.25, 1.5}) {
      const int spans_u = static_cast<int>(share * u), spans_v = static_cast<int>(share * v);
      if (std::min(spans_u, spans_v) < fewest_spans || spans_u > finest.cells_u() / 2 ||
          spans_v > finest.cells_v() / 2) {
        continue;
      }
      const std::vector<int> at_u = nearly_equal(finest.cells_u(), spans_u),
                             at_v = nearly_equal(finest.cells_v(), spans_v);
      std::vector<double> knots_u = knots_at(at_u), knots_v = knots_at(at_v);
      SplineNet net(knots_u, knots_v);
      if (static_cast<double>(totals_.points) < points_an_unknown * net.unknowns()) continue;
      for (double& knot : knots_u) knot = knot == 1 ? d.max_u : d.min_u + knot * (d.max_u - d.min_u);
      for (double& knot : knots_v) knot = knot == 1 ? d.max_v : d.min_v + knot * (d.max_v - d.min_v);
      Candidate c{std::move(net), std::move(knots_u), std::move(knots_v)};
      c.merged.emplace(spans_u, spans_v);
      c.merged->merge_blocks(finest, at_u, at_v);
      if (const auto good = solve(c); !good) return good;
      const auto coarser = std::ranges::find_if(
          candidates_, [&](const Candidate& other) { return other.net.unknowns() < c.net.unknowns(); });
      candidates_.insert(coarser, std::move(c));
    }
    chosen_ = choose();
    return {};
  }

  NetScore score(const Candidate& c) const {
    const double n = static_cast<double>(totals_.points);
    return {.spans_u = c.net.cells_u(),
            .spans_v = c.net.cells_v(),
            .gcv = generalized_cross_validation(totals_, c.result),
            .bic = bayesian_information(totals_, c.result),
            .sigma = std::sqrt(c.result.squares / std::max(1.0, n - c.result.freedom)),
            .smallest_pivot = c.result.smallest_pivot,
            .empty_cells = c.result.empty_cells};
  }

  std::size_t choose() const {
    std::vector<NetScore> scores;
    for (const Candidate& c : candidates_) scores.push_back(score(c));
    return choose_net(scores, settings_.criterion, settings_.tolerance);
  }

  void set_boundary() {
    boundary_.clear();
    const Eigen::MatrixXd& given = settings_.boundary.control;
    if (given.size() == 0) return;
    const SplineNet& net = candidates_.front().net;
    boundary_.resize(static_cast<std::size_t>(net.unknowns()));
    for (int i = 0; i < net.control_u(); ++i) {
      for (int j = 0; j < net.control_v(); ++j) boundary_[net.index(i, j)] = given(i, j) - finest_.datum();
    }
  }

  std::expected<void, FitFailure> solve(Candidate& c) {
    if (settings_.fairing.everywhere <= 0 && settings_.fairing.where_sparse <= 0) {
      const std::size_t empty = first_empty_cell(grid(c));
      if (empty < static_cast<std::size_t>(c.net.cells_u()) * c.net.cells_v()) {
        return std::unexpected(FitFailure{Error::empty_cells, empty});
      }
    }
    // The nets between are larger than the nested ones that the points determined.
    if (!solver_ || !solver_->holds(c.net)) {
      solver_.emplace(c.net.unknowns(), c.net.half_band());
      solver_->want_norm(settings_.condition);
    }
    solver_->start(task_for(c, grid(c), settings_, totals_, boundary_), nullptr);
    if (const auto solved = solver_->solve(); !solved) {
      const int at = solver_->singular_unknown() >= 0 ? solver_->singular_unknown()
                                                      : solver_->factor().smallest_column();
      const auto [i, j] = control_of(c.net, at);
      return std::unexpected(FitFailure{solved.error(), static_cast<std::size_t>(i) * c.net.control_v() + j});
    }
    c.result = solver_->result();
    c.coefficients.assign(solver_->coefficients().begin(), solver_->coefficients().end());
    return {};
  }

  const FitSettings& settings_;
  const MomentAccumulator& finest_;
  std::vector<Candidate> candidates_;  // from fine to coarse
  std::optional<NetSolver> solver_;    // has held every net that was solved
  std::expected<void, FitFailure> spread_;
  std::vector<double> boundary_;
  PointTotals totals_;
  std::size_t chosen_ = 0;
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

// On the cells of `grid`, whose knots hold the net's.
std::vector<std::array<double, 16>> bezier_cells(const Candidate& c, const MomentGrid& grid) {
  struct Part {
    int cell;
    std::array<std::array<double, 4>, 4> turned;  // coefficients go the other way than moments
  };
  const auto parts = [](const SpanTable& table, int fine) {
    const double begin = table[0].begin, step = (table[table.spans() - 1].end - begin) / fine;
    std::vector<Part> all(static_cast<std::size_t>(fine));
    for (int k = 0, cell = 0; k < fine; ++k) {
      while (cell + 1 < table.spans() && begin + (k + 0.5) * step > table[cell].end) ++cell;
      const double length = table[cell].end - table[cell].begin;
      const auto r = fine == table.spans()
                         ? restriction<3>(0, 1)
                         : restriction<3>((begin + k * step - table[cell].begin) / length,
                                          (begin + (k + 1) * step - table[cell].begin) / length);
      Part& part = all[static_cast<std::size_t>(k)];
      part.cell = fine == table.spans() ? k : cell;
      for (int p = 0; p < 4; ++p) {
        for (int l = 0; l < 4; ++l) part.turned[l][p] = r[p][l];
      }
    }
    return all;
  };
  const std::vector<Part> u = parts(c.net.spans_u(), grid.cells_u()),
                          v = parts(c.net.spans_v(), grid.cells_v());
  std::vector<std::array<double, 16>> cells;
  for (const Part& a : u) {
    for (const Part& b : v) {
      add_restricted<3>(a.turned, b.turned, c.net.bezier(c.coefficients, a.cell, b.cell),
                        cells.emplace_back());
    }
  }
  return cells;
}

// Residuals of all points; with `weights_into`, the points are folded into it anew with Tukey's weights.
ResidualPass residual_pass(const PointColumns& columns, const MomentAccumulator& cells_of,
                           const Candidate& fitted, double scale, MomentAccumulator* weights_into) {
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
  if (const auto good = check_settings(settings); !good) return std::unexpected(good.error());
  if (!settings.knots_u.empty()) {
    return MomentAccumulator(SplineNet(settings.knots_u, settings.knots_v), datum);
  }
  const int u = chooses(settings) ? settings.finest_spans : settings.control_u - cubic;
  const int v = chooses(settings) ? settings.finest_spans : settings.control_v - cubic;
  return MomentAccumulator(u, v, settings.domain, datum);
}

namespace {

bool has_cells_of(const MomentAccumulator& moments, const FitSettings& settings) {
  const int u = moments.grid().cells_u(), v = moments.grid().cells_v();
  if (!settings.knots_u.empty()) {
    const SplineNet net(settings.knots_u, settings.knots_v);
    return u == net.cells_u() && v == net.cells_v();
  }
  if (moments.domain() != settings.domain) return false;
  if (!chooses(settings)) return u == settings.control_u - cubic && v == settings.control_v - cubic;
  return u == settings.finest_spans && v == settings.finest_spans;
}

}  // namespace

std::expected<FittedSurface, FitFailure> fit_moments(const MomentAccumulator& moments,
                                                     const FitSettings& settings) {
  if (const auto good = check_settings(settings); !good) return std::unexpected(good.error());
  if (!has_cells_of(moments, settings)) return std::unexpected(FitFailure{Error::sizes_differ});
  Fitter fitter(settings, moments);
  if (const auto good = fitter.run(); !good) return std::unexpected(good.error());
  return fitter.result();
}

std::expected<FittedSurface, FitFailure> fit_surface(const PointColumns& columns,
                                                     const FitSettings& settings) {
  if (columns.size() == 0) return std::unexpected(FitFailure{Error::too_few_points});
  const double datum = columns.z[0];
  if (!std::isfinite(datum)) return std::unexpected(FitFailure{Error::not_finite, 0});
  auto moments = accumulator_for(settings, datum);
  if (!moments) return std::unexpected(moments.error());
  if (const auto added = moments->add(columns); !added) return std::unexpected(added.error());
  if (const auto good = check_sums(columns, moments->totals(), datum); !good)
    return std::unexpected(good.error());
  std::optional<Fitter> fitter;
  fitter.emplace(settings, *moments);
  if (const auto good = fitter->run(); !good) return std::unexpected(good.error());
  FittedSurface out = fitter->result();

  std::optional<MomentAccumulator> weighted;
  double scale = out.report.sigma;
  // Heights that are met to rounding have no spread to weigh them by.
  const double rounding = 1e-14 * std::sqrt(out.report.totals.squares / out.report.totals.weight);
  for (int pass = 0; pass < settings.robust_passes && scale > rounding; ++pass) {
    const Candidate before = fitter->chosen();
    weighted.emplace(*accumulator_for(settings, datum));
    const ResidualPass residuals = residual_pass(columns, *moments, before, scale, &*weighted);
    fitter.emplace(settings, *weighted);
    if (const auto good = fitter->run(); !good) return std::unexpected(good.error());
    out = fitter->result();
    const double scale_before = scale;
    scale = residuals.median.scale();
    out.report.robust_passes = pass + 1, out.report.robust_sigma = scale;
    const double moved = difference(before, fitter->chosen());
    if (pass > 0 && moved < robust_rest * scale && std::abs(scale - scale_before) < robust_rest * scale)
      break;
  }
  if (fitter->chose_between()) {
    // The points are at hand: once more, with the chosen number of spans at even distances.
    FitSettings even = settings;
    even.control_u = out.surface.control_u(), even.control_v = out.surface.control_v();
    fitter.reset();
    moments = std::unexpected(FitFailure{});
    weighted.reset();
    auto again = fit_surface(columns, even);
    if (!again) return again;
    again->report.nets = out.report.nets, again->report.chosen = out.report.chosen;
    again->report.bytes = std::max(again->report.bytes, out.report.bytes);
    return again;
  }
  if (settings.residual_pass) {
    out.report.max_residual = residual_pass(columns, *moments, fitter->chosen(), 1, nullptr).largest;
  }
  return out;
}

}  // namespace moldloft::geometry
