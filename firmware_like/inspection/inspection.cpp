#include "firmware_like/inspection/inspection.hpp"

#include "firmware_like/inspection/plate_match.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace moldloft::firmware_like {
namespace {

using Eigen::Vector3d;
using geometry::DesignFaces;
using geometry::RigidMotion;

constexpr int map_cells = 60;
constexpr double no_partner_mm = 0.5;  // beyond the design's border
constexpr int histogram_bins = 40;
constexpr std::size_t most_worst = 5;
constexpr double worst_apart = 0.15;  // of the plate's size
constexpr double close_sigmas = 2;
constexpr double strangers_share =
    0.1;                               // of a list's points beyond the plate: it is not a list of this plate
constexpr double nowhere_share = 0.5;  // of the plate without a partner: the two do not lie on each other

std::unexpected<Failure> refuse(std::string what) { return std::unexpected(Failure{std::move(what)}); }

double distance_to(const std::vector<geometry::BorderSample>& border, const Vector3d& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& s : border) least = std::min(least, (s.at - p).squaredNorm());
  return std::sqrt(least);
}

Spread spread_of(std::vector<double> values) {
  Spread s;
  s.count = values.size();
  if (values.empty()) return s;
  std::ranges::sort(values);
  double sum = 0, square = 0;
  for (const double v : values) sum += v, square += v * v;
  const auto rank = [&](double share) {
    return values[std::min(values.size() - 1,
                           static_cast<std::size_t>(share * static_cast<double>(values.size())))];
  };
  s.mean_mm = sum / static_cast<double>(s.count);
  s.rms_mm = std::sqrt(square / static_cast<double>(s.count));
  s.least_mm = values.front(), s.most_mm = values.back();
  s.p05_mm = rank(0.05), s.median_mm = rank(0.5), s.p95_mm = rank(0.95);
  return s;
}

// The uncertainty of a deviation: of the shot that saw the place, of the pose, and in a corner, where the fit has few
// points to hold on to, of the surface itself.
double sigma_at(const geometry::PlateAlignment& a, const RunResult& result, const Vector3d& at,
                const Vector3d& normal, double u, double v) {
  geometry::Vector6 row;
  row << normal, (at - a.centroid).cross(normal);
  double square = std::pow(result.promised.repeatability_z_mm, 2) + row.dot(a.covariance * row);
  const auto& fit = result.measured->fit;
  // A stored result knows its spans by its surface.
  const int spans_u = result.measured->surface.control_u() - 3,
            spans_v = result.measured->surface.control_v() - 3;
  for (int corner = 0; corner < 4; ++corner) {
    const double from_u = corner == 0 || corner == 3 ? u : 1 - u, from_v = corner < 2 ? v : 1 - v;
    const double part = std::max(0.0, 1 - from_u * spans_u) * std::max(0.0, 1 - from_v * spans_v);
    square += std::pow(part * fit.corner_sigma_mm[static_cast<std::size_t>(corner)], 2);
  }
  return std::sqrt(square);
}

class Inspector {
 public:
  Inspector(const RunResult& result, Design design, const InspectionSettings& settings,
            const DesignFaces& measured)
      : result_{result},
        design_{std::move(design)},
        settings_{settings},
        measured_{measured},
        plate_{samples_of(result)} {}

  std::expected<Inspection, Failure> by_faces(std::span<const MeasuredPoint>);
  std::expected<Inspection, Failure> by_points();

 private:
  void take(PlateMatch);
  void map(const DesignFaces&);
  void single_points(const DesignFaces&, std::span<const MeasuredPoint>);
  void lengths(const DesignFaces&);
  void conclude();
  void judge();
  void find_worst();
  int region_at(const Vector3d&) const;

  const RunResult& result_;
  Design design_;
  const InspectionSettings& settings_;
  const DesignFaces& measured_;
  PlateSamples plate_;
  bool upside_down_ = false;
  Inspection out_;
};

int Inspector::region_at(const Vector3d& at) const {
  for (std::size_t i = 0; i < settings_.regions.size(); ++i) {
    const auto& r = settings_.regions[i];
    if (at.x() >= r.min.x() && at.x() <= r.max.x() && at.y() >= r.min.y() && at.y() <= r.max.y())
      return static_cast<int>(i);
  }
  return -1;
}

void Inspector::take(PlateMatch match) {
  out_.plate = result_.label.plate;
  out_.design = design_.name;
  out_.design_file = design_.file;
  out_.kind = design_.kind;
  out_.method = settings_.method;
  out_.design_from_world = match.design_from_world;
  out_.alignment = std::move(match.alignment);
  out_.undetermined = std::move(match.undetermined);
  out_.remarks = design_.remarks;
  std::ranges::move(match.remarks, std::back_inserter(out_.remarks));
  upside_down_ = match.upside_down;
}

// A grid over the measured surface, its border included.
void Inspector::map(const DesignFaces& design) {
  const auto& s = result_.measured->surface;
  const double side = upside_down_ ? -1 : 1;
  out_.map_u = out_.map_v = map_cells + 1;
  for (int i = 0; i <= map_cells; ++i) {
    for (int k = 0; k <= map_cells; ++k) {
      const double u = static_cast<double>(i) / map_cells, v = static_cast<double>(k) / map_cells;
      const Vector3d at = out_.design_from_world * s.at(u, v).value;
      const auto foot = design.foot(at);
      out_.places.push_back({.at = at,
                             .mm = side * foot.signed_mm,
                             .sigma_mm = sigma_at(out_.alignment, result_, at, foot.normal, u, v),
                             .u = static_cast<float>(u),
                             .v = static_cast<float>(v),
                             .border = distance_to(design.border(), at) < settings_.border_width_mm,
                             .beyond = foot.overhang_mm > no_partner_mm || !foot.converged,
                             .region = region_at(at)});
    }
  }
}

void Inspector::single_points(const DesignFaces& design, std::span<const MeasuredPoint> points) {
  const double side = upside_down_ ? -1 : 1;
  out_.points.reserve(points.size());
  // Near the border is asked of the map's cell, not of every point.
  const auto is_border = [&](const MeasuredPoint& p) {
    const auto cell = [](float t) {
      return std::clamp(static_cast<int>(std::lround(t * map_cells)), 0, map_cells);
    };
    return out_.places[static_cast<std::size_t>(cell(p.u) * (map_cells + 1) + cell(p.v))].border;
  };
  for (const auto& p : points) {
    const Vector3d at = out_.design_from_world * p.position.cast<double>();
    const auto foot = design.foot(at);
    if (foot.overhang_mm > no_partner_mm || !foot.converged) continue;
    out_.points.push_back({at.cast<float>(), static_cast<float>(side * foot.signed_mm), is_border(p)});
  }
}

// Sides along the border and diagonals, of a design whose border is the rectangle of its parameters.
void Inspector::lengths(const DesignFaces& design) {
  if (design.count() != 1 || !design_.faces[0].trims.empty()) return;
  const auto& s = design.surface(0);
  const double u0 = s.along_u().first(), u1 = s.along_u().last(), v0 = s.along_v().first(),
               v1 = s.along_v().last();
  const std::array<Eigen::Vector2d, 4> designed{Eigen::Vector2d{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
  const std::array<Eigen::Vector2d, 4> own{Eigen::Vector2d{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const auto& mine = result_.measured->surface;
  std::array<std::size_t, 4> partner{};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d q = out_.design_from_world * mine.at(own[i].x(), own[i].y()).value;
    for (std::size_t k = 1; k < 4; ++k) {
      const auto off = [&](std::size_t n) {
        return (s.at(designed[n].x(), designed[n].y()).value - q).squaredNorm();
      };
      if (off(k) < off(partner[i])) partner[i] = k;
    }
  }
  const auto length = [](const auto& surface, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    constexpr int pieces = 400;
    double sum = 0;
    Vector3d before = surface.at(a.x(), a.y()).value;
    for (int k = 1; k <= pieces; ++k) {
      const Eigen::Vector2d uv = a + (b - a) * k / pieces;
      const Vector3d next = surface.at(uv.x(), uv.y()).value;
      sum += (next - before).norm();
      before = next;
    }
    return sum;
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t k = (i + 1) % 4;
    if ((partner[i] + 1) % 4 != partner[k] && (partner[k] + 1) % 4 != partner[i])
      return;  // not corner to corner
    out_.edges.push_back({fmt::format("side {}", i + 1), length(mine, own[i], own[k]),
                          length(s, designed[partner[i]], designed[partner[k]])});
  }
  const auto straight = [](const auto& surface, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return (surface.at(a.x(), a.y()).value - surface.at(b.x(), b.y()).value).norm();
  };
  for (const std::size_t i : {0u, 1u})
    out_.edges.push_back({fmt::format("diagonal {}-{}", i + 1, i + 3), straight(mine, own[i], own[i + 2]),
                          straight(s, designed[partner[i]], designed[partner[i + 2]])});
}

void Inspector::find_worst() {
  std::vector<const InspectedPlace*> order;
  Vector3d low = Vector3d::Constant(1e300), high = -low;
  for (const auto& p : out_.places) {
    if (p.beyond) continue;
    order.push_back(&p);
    low = low.cwiseMin(p.at), high = high.cwiseMax(p.at);
  }
  std::ranges::stable_sort(order, std::greater{}, [](const auto* p) { return std::abs(p->mm); });
  const double apart = worst_apart * (high - low).norm();
  for (const auto* p : order) {
    if (out_.worst.size() == most_worst) return;
    if (std::ranges::all_of(out_.worst, [&](const auto& w) { return (w.at - p->at).norm() > apart; }))
      out_.worst.push_back(*p);
  }
}

void Inspector::judge() {
  if (!settings_.limit) return;
  struct Class {
    std::string name;
    Limit limit;
    std::vector<const InspectedPlace*> places = {};
  };
  std::vector<Class> classes;
  for (const auto& r : settings_.regions) classes.push_back({r.name, r.limit});
  classes.push_back({"inside", *settings_.limit});
  classes.push_back({"border", settings_.border_limit.value_or(*settings_.limit)});
  for (const auto& p : out_.places) {
    if (p.beyond) continue;
    const auto which =
        p.region >= 0 ? static_cast<std::size_t>(p.region) : classes.size() - (p.border ? 1 : 2);
    classes[which].places.push_back(&p);
  }
  out_.verdict = Judgement::passes;
  for (const auto& one : classes) {
    if (one.places.empty()) continue;
    JudgedRegion region{.name = one.name, .limit = one.limit, .spread = {}};
    std::vector<double> values;
    std::size_t within = 0;
    double nearest =
        std::numeric_limits<double>::infinity();  // way of the worst place to its limit, in sigmas
    double worst = -std::numeric_limits<double>::infinity();
    for (const auto* p : one.places) {
      values.push_back(p->mm);
      const double over = std::max(p->mm - one.limit.high_mm, one.limit.low_mm - p->mm);
      within += over <= 0 ? 1 : 0;
      if (over > worst) worst = over, nearest = std::abs(over) / std::max(p->sigma_mm, 1e-9);
    }
    region.spread = spread_of(std::move(values));
    region.share_within = static_cast<double>(within) / static_cast<double>(one.places.size());
    region.passes = within == one.places.size();
    region.is_close = nearest < close_sigmas;
    if (!region.passes) out_.verdict = Judgement::fails;
    out_.regions.push_back(std::move(region));
  }
  // A close region decides only where no other one fails clearly.
  const bool fails_clearly =
      std::ranges::any_of(out_.regions, [](const auto& r) { return !r.passes && !r.is_close; });
  out_.is_close = !fails_clearly && std::ranges::any_of(out_.regions, &JudgedRegion::is_close);
}

void Inspector::conclude() {
  std::vector<double> inside, border, all;
  for (const auto& p : out_.places) {
    if (!p.beyond) (p.border ? border : inside).push_back(p.mm);
  }
  out_.inside = spread_of(inside);
  out_.border = spread_of(border);
  if (out_.points.empty()) {
    all = inside;
    all.insert(all.end(), border.begin(), border.end());
  } else {
    for (const auto& p : out_.points) all.push_back(p.mm);
  }
  const Spread whole = spread_of(all);
  const double low = whole.least_mm, width = std::max(whole.most_mm - low, 1e-6) / histogram_bins;
  for (int i = 0; i < histogram_bins; ++i)
    out_.histogram.push_back({low + i * width, low + (i + 1) * width, 0});
  for (const double v : all)
    ++out_.histogram[static_cast<std::size_t>(
                         std::clamp(static_cast<int>((v - low) / width), 0, histogram_bins - 1))]
          .count;
  find_worst();
  judge();
  out_.twist_mm = twist_of(out_.frame_lines);
}

std::expected<Inspection, Failure> Inspector::by_faces(std::span<const MeasuredPoint> points) {
  const auto design = DesignFaces::from(design_.faces);
  if (!design)
    return refuse(fmt::format("{}: face {}: {}", design_.file, design.error().where + 1,
                              geometry::to_string(design.error().error)));
  auto match = match_faces(*design, plate_, result_, design_.kind, settings_);
  if (!match) return std::unexpected(match.error());
  take(std::move(*match));
  map(*design);
  const auto beyond =
      static_cast<std::size_t>(std::ranges::count(out_.places, true, &InspectedPlace::beyond));
  if (static_cast<double>(beyond) > nowhere_share * static_cast<double>(out_.places.size()))
    return refuse(fmt::format(
        "{}: plate and design do not lie on each other ({:.0f} % of the plate stands beyond the design); "
        "choose another --align",
        design_.file, 100.0 * static_cast<double>(beyond) / static_cast<double>(out_.places.size())));
  if (beyond > 0)
    out_.remarks.push_back(
        fmt::format("{:.1f} % of the plate stands beyond the design's border and is not judged",
                    100.0 * static_cast<double>(beyond) / static_cast<double>(out_.places.size())));
  single_points(*design, points);
  lengths(*design);
  out_.axes = frame_axes(*design);
  out_.frame_lines = frame_lines(*design, measured_, out_.design_from_world, out_.axes, settings_.frames);
  conclude();
  return std::move(out_);
}

std::expected<Inspection, Failure> Inspector::by_points() {
  auto match = match_points(measured_, plate_, design_, settings_);
  if (!match) return std::unexpected(match.error());
  take(std::move(*match));
  const RigidMotion world_from_design = out_.design_from_world.inverse();
  std::size_t beyond = 0;
  for (const auto& p : design_.points) {
    const Vector3d q = world_from_design * p;
    const auto foot = measured_.foot(q);
    InspectedPlace place{
        .at = p,
        .mm = -foot.signed_mm,  // the plate stands higher where the design's point lies below it
        .sigma_mm = sigma_at(out_.alignment, result_, q, foot.normal, foot.u, foot.v),
        .u = static_cast<float>(foot.u),
        .v = static_cast<float>(foot.v),
        .border = distance_to(measured_.border(), q) < settings_.border_width_mm,
        .beyond = foot.overhang_mm > no_partner_mm || !foot.converged,
        .region = region_at(p)};
    beyond += place.beyond ? 1 : 0;
    out_.places.push_back(place);
  }
  if (static_cast<double>(beyond) > strangers_share * static_cast<double>(out_.places.size()))
    return refuse(fmt::format(
        "{}: {} of its {} points lie beyond the plate: a list of another plate? Or choose another --align",
        design_.file, beyond, out_.places.size()));
  if (beyond > 0)
    out_.remarks.push_back(
        fmt::format("{} of {} points lie beyond the plate and are not judged", beyond, out_.places.size()));
  if (design_.templates)
    out_.frame_lines = frame_lines(*design_.templates, measured_, out_.design_from_world);
  conclude();
  return std::move(out_);
}

}  // namespace

std::string_view to_string(AlignmentMethod method) {
  constexpr std::array<std::string_view, 7> names{"best",    "robust", "above", "below",
                                                  "corners", "datum",  "none"};
  return names[static_cast<std::size_t>(method)];
}

std::optional<AlignmentMethod> alignment_named(std::string_view name) {
  for (int i = 0; i < 7; ++i) {
    if (to_string(static_cast<AlignmentMethod>(i)) == name) return static_cast<AlignmentMethod>(i);
  }
  return std::nullopt;
}

std::string alignment_names() { return "best, robust, above, below, corners, datum or none"; }

std::expected<Inspection, Failure> inspect(const RunResult& result, std::span<const MeasuredPoint> points,
                                           const Design& design, const InspectionSettings& settings) {
  const geometry::DesignFace face{result.measured->surface, {}};
  const auto measured = DesignFaces::from({&face, 1});
  if (!measured)
    return refuse(fmt::format("the measured surface: {}", geometry::to_string(measured.error().error)));
  Inspector inspector{result, design, settings, *measured};
  return design.faces.empty() ? inspector.by_points() : inspector.by_faces(points);
}

}  // namespace moldloft::firmware_like
