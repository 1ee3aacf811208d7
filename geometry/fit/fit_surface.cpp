#include "geometry/fit/fit_surface.hpp"

#include "geometry/fit/fit_checks.hpp"
#include "geometry/fit/net_search.hpp"
#include "geometry/fit/robust_weights.hpp"
#include "geometry/splines/band_condition.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::geometry {

namespace {

// Nets between the best one and its neighbours, of half and twice its spans, have these shares of its spans.
constexpr double shares_between[] = {0.75, 0.875, 1.25, 1.5};

// Reweighting rests when neither the coefficients nor the scale move by more than this share of the scale.
constexpr double robust_rest = 0.01;

// Heights that are met to this share of their size have no spread to weigh them by.
constexpr double rounding_share = 1e-14;

bool chooses(const FitSettings& settings) {
  return settings.control_u == 0 && settings.control_v == 0 && settings.knots_u.empty();
}

SplineNet finest_net(const FitSettings& settings, const MomentGrid& grid) {
  // Over a domain the net lives on [0, 1]: only differences of knots matter to it.
  return settings.knots_u.empty() ? SplineNet(grid.cells_u(), grid.cells_v())
                                  : SplineNet(settings.knots_u, settings.knots_v);
}

NetSearchSettings search_settings(const FitSettings& settings) {
  const bool fair = settings.fairing.everywhere > 0 || settings.fairing.where_sparse > 0;
  return {.nested = chooses(settings),
          .points_an_unknown = chooses(settings) ? points_an_unknown
                               : fair            ? 0.0
                                                 : 1.0,
          .criterion = settings.criterion,
          .tolerance = settings.tolerance,
          .norm = settings.condition};
}

NetTask model_of(const FitSettings& settings, const PointTotals& totals, std::span<const double> boundary) {
  NetTask model;
  model.totals = totals;
  // Over given knots the integrals are in the columns' own unit.
  if (settings.knots_u.empty()) {
    model.length_u_mm = settings.domain.max_u - settings.domain.min_u;
    model.length_v_mm = settings.domain.max_v - settings.domain.min_v;
  }
  model.fairing = settings.fairing.everywhere;
  model.sparse_fairing = settings.fairing.where_sparse;
  model.sparse_points = std::max(1u, settings.fairing.sparse_points);
  model.boundary = boundary, model.boundary_weight = settings.boundary.weight;
  return model;
}

// Of a net on [0, 1] whose inner knots are simple, stretched to [begin, end].
std::vector<double> stretched_knots(const SpanTable& spans, double begin, double end) {
  std::vector<double> knots(cubic + 1, begin);
  for (int k = 1; k < spans.spans(); ++k) knots.push_back(begin + spans[k].begin * (end - begin));
  knots.insert(knots.end(), cubic + 1, end);
  return knots;
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

// The search over one set of moments, stepped until done, and the surface that it found.
class Fitter {
 public:
  Fitter(const FitSettings& settings, const MomentAccumulator& finest)
      : settings_(settings),
        finest_(finest),
        totals_(finest.totals()),
        search_(finest_net(settings, finest.grid()), search_settings(settings),
                static_cast<double>(totals_.points)) {}

  std::expected<void, Flaw> run() {
    set_boundary();
    const NetTask model = model_of(settings_, totals_, boundary_);
    if (const auto good = search_.start(finest_.grid(), model); !good) return good;
    if (boundary_.empty()) {
      const auto good = check_spread(search_.candidates().front().net, finest_.grid());
      if (!good) return good;
    }
    if (const auto good = search_.finish(); !good) return good;
    if (chooses(settings_)) {
      if (const auto good = try_between(); !good) return good;
    }
    if (settings_.condition && search_.scores().size() > 1) {
      search_.solve_again();
      return search_.finish();
    }
    return {};
  }

  const NetCandidate& chosen() const { return search_.chosen(); }
  // Whether the choice is none of the nested, evenly spaced nets.
  bool chose_between() const {
    const auto whole_share = [](int finest, int spans) { return finest % spans == 0; };
    return chooses(settings_) && !(whole_share(finest_.grid().cells_u(), chosen().net.cells_u()) &&
                                   whole_share(finest_.grid().cells_v(), chosen().net.cells_v()));
  }

  FittedSurface result() const {
    FittedSurface out{.surface = surface(), .report = {}};
    const NetResult& result = chosen().result;
    const NetScore& score = search_.score();
    FitReport& report = out.report;
    report.totals = totals_;
    report.rms_residual = score.rms_residual, report.sigma = score.sigma;
    report.empty_cells = result.empty_cells, report.sparse_cells = result.sparse_cells;
    report.smallest_pivot = result.smallest_pivot;
    std::tie(report.smallest_pivot_i, report.smallest_pivot_j) =
        control_of(chosen().net, result.smallest_pivot_unknown);
    if (settings_.condition)
      report.condition = search_.solver().norm_one() * estimated_inverse_norm(search_.solver().factor());
    report.nets.assign(search_.scores().begin(), search_.scores().end());
    report.chosen = search_.chosen_score();
    report.freedom = result.freedom;
    report.bytes = finest_.bytes() + search_.bytes() + sizeof(PointBlock) +
                   3 * static_cast<std::size_t>(out.surface.z.size()) * sizeof(double);
    return out;
  }

 private:
  // Between the best net and its neighbours lie others whose knots are knots of the finest grid too, only not quite
  // evenly spaced; their moments follow from the same sums.
  std::expected<void, Flaw> try_between() {
    const int u = chosen().net.cells_u(), v = chosen().net.cells_v();
    const MomentGrid& finest = finest_.grid();
    for (const double share : shares_between) {
      const int spans_u = static_cast<int>(share * u), spans_v = static_cast<int>(share * v);
      if (std::min(spans_u, spans_v) < fewest_spans || spans_u > finest.cells_u() / 2 ||
          spans_v > finest.cells_v() / 2) {
        continue;
      }
      const std::vector<int> at_u = nearly_equal(finest.cells_u(), spans_u),
                             at_v = nearly_equal(finest.cells_v(), spans_v);
      SplineNet net(knots_at(at_u), knots_at(at_v));
      if (static_cast<double>(totals_.points) < points_an_unknown * net.unknowns()) continue;
      search_.also_try(std::move(net), at_u, at_v);
      if (const auto good = search_.finish(); !good) return good;
    }
    return {};
  }

  void set_boundary() {
    const Eigen::MatrixXd& given = settings_.boundary.control;
    if (given.size() == 0) return;
    const SplineNet& net = search_.candidates().front().net;
    boundary_.resize(static_cast<std::size_t>(net.unknowns()));
    for (int i = 0; i < net.control_u(); ++i) {
      for (int j = 0; j < net.control_v(); ++j) boundary_[net.index(i, j)] = given(i, j) - finest_.datum();
    }
  }

  BSplineSurface surface() const {
    const SplineNet& net = chosen().net;
    const FitDomain& d = settings_.domain;
    BSplineSurface s;
    const bool given = !settings_.knots_u.empty();
    s.knots_u = given ? settings_.knots_u : stretched_knots(net.spans_u(), d.min_u, d.max_u);
    s.knots_v = given ? settings_.knots_v : stretched_knots(net.spans_v(), d.min_v, d.max_v);
    s.x.resize(net.control_u(), net.control_v());
    s.y = s.z = s.x;
    for (int i = 0; i < net.control_u(); ++i) {
      for (int j = 0; j < net.control_v(); ++j) {
        s.x(i, j) = greville(s.knots_u, i), s.y(i, j) = greville(s.knots_v, j);
      }
    }
    chosen().heights_into(s.z, finest_.datum());
    return s;
  }

  const FitSettings& settings_;
  const MomentAccumulator& finest_;
  PointTotals totals_;
  NetSearch search_;
  std::vector<double> boundary_;
};

double difference(std::span<const double> a, std::span<const double> b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double worst = 0;
  for (std::size_t k = 0; k < a.size(); ++k) worst = std::max(worst, std::abs(a[k] - b[k]));
  return worst;
}

}  // namespace

std::expected<MomentAccumulator, Flaw> accumulator_for(const FitSettings& settings, double datum) {
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

std::expected<FittedSurface, Flaw> fit_moments(const MomentAccumulator& moments,
                                               const FitSettings& settings) {
  if (const auto good = check_settings(settings); !good) return std::unexpected(good.error());
  if (!has_cells_of(moments, settings)) return std::unexpected(Flaw{Error::sizes_differ});
  Fitter fitter(settings, moments);
  if (const auto good = fitter.run(); !good) return std::unexpected(good.error());
  return fitter.result();
}

std::expected<FittedSurface, Flaw> fit_surface(const PointColumns& columns, const FitSettings& settings) {
  if (columns.size() == 0) return std::unexpected(Flaw{Error::too_few_points});
  const double datum = columns.z[0];
  if (!std::isfinite(datum)) return std::unexpected(Flaw{Error::not_finite, 0});
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
  const double rounding = rounding_share * std::sqrt(out.report.totals.squares / out.report.totals.weight);
  for (int pass = 0; pass < settings.robust_passes && scale > rounding; ++pass) {
    const std::vector<double> before = fitter->chosen().coefficients;
    weighted.emplace(*accumulator_for(settings, datum));
    const ResidualPass residuals = residual_pass(columns, *moments, fitter->chosen(), scale, &*weighted);
    fitter.emplace(settings, *weighted);
    if (const auto good = fitter->run(); !good) return std::unexpected(good.error());
    out = fitter->result();
    const double scale_before = scale;
    scale = residuals.median.scale();
    out.report.robust_passes = pass + 1, out.report.robust_sigma = scale;
    const double moved = difference(before, fitter->chosen().coefficients);
    if (pass > 0 && moved < robust_rest * scale && std::abs(scale - scale_before) < robust_rest * scale)
      break;
  }
  if (fitter->chose_between()) {
    // The points are at hand: once more, with the chosen number of spans at even distances.
    FitSettings even = settings;
    even.control_u = out.surface.control_u(), even.control_v = out.surface.control_v();
    fitter.reset();
    moments = std::unexpected(Flaw{});
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
