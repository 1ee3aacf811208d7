#include "firmware_like/inspection/plate_match.hpp"

#include "geometry/inspection/alignment_starts.hpp"
#include "geometry/inspection/localization.hpp"
#include "geometry/splines/convex_hull.hpp"

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

using Eigen::Vector3d;
using geometry::AlignmentStart;
using geometry::DesignFaces;
using geometry::PlateAlignment;
using geometry::PlateAlignmentSettings;
using geometry::PlateToAlign;
using geometry::RigidMotion;

constexpr int samples_a_side = 44, edges_a_side = 60;
constexpr double size_off = 0.1;      // of a length: an outline that differs by more is another plate's
constexpr double points_cover = 0.7;  // of the plate's extents: fewer say nothing of how it lies in its plane
constexpr double as_good = 1.15, as_good_mm = 0.02;  // than the best pose: nothing tells the two apart
constexpr double mirror_better = 0.6, mirror_clearly_mm = 0.1;
constexpr double outline_share = 0.02, outline_least_mm = 1.5;  // rms of an outline that is not this plate's
constexpr double point_sigma_mm = 0.01;  // of a place of the fitted surface, from the points' noise
constexpr double another_share = 0.75, formed_share = 0.5, another_least_mm = 0.5;  // of the design's depth
constexpr double rim_mm = 3;  // beyond the design's border: the plate's own edge is still held to its side
// What an arm errs in plan from one place to another, and a whole stretch of edge with it; its points do not show it.
constexpr double least_edge_sigma_mm = 0.06;

std::unexpected<Failure> refuse(std::string what) { return std::unexpected(Failure{std::move(what)}); }

// The smallest rectangle round points in their own plane, its longer side first: what a person would measure.
struct Extents {
  double length = 0, width = 0;
  Vector3d middle = Vector3d::Zero(), normal = Vector3d::UnitZ();
};

std::vector<Eigen::Vector2d> plan_of(std::span<const Vector3d> points, const Extents& e) {
  const Vector3d x = e.normal.unitOrthogonal(), y = e.normal.cross(x);
  std::vector<Eigen::Vector2d> plan;
  for (const auto& p : points) plan.emplace_back(x.dot(p - e.middle), y.dot(p - e.middle));
  return plan;
}

Extents extents_of(std::span<const Vector3d> points) {
  Extents e;
  for (const auto& p : points) e.middle += p;
  e.middle /= static_cast<double>(points.size());
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const auto& p : points) moments += (p - e.middle) * (p - e.middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes{moments};
  e.normal = axes.eigenvectors().col(0);
  const auto round = geometry::smallest_rectangle(geometry::convex_hull(plan_of(points, e)));
  e.length = round.length, e.width = round.width;
  return e;
}

// The convex hull of points in their own plane, evenly resampled: the outline that a list of points has.
std::vector<Vector3d> hull_of(std::span<const Vector3d> points) {
  const Extents e = extents_of(points);
  const Vector3d x = e.normal.unitOrthogonal(), y = e.normal.cross(x);
  const auto hull = geometry::convex_hull(plan_of(points, e));
  double all = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) all += (hull[(i + 1) % hull.size()] - hull[i]).norm();
  std::vector<Vector3d> even;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d a = hull[i], b = hull[(i + 1) % hull.size()];
    const int count = std::max(1, static_cast<int>(std::lround(4 * edges_a_side * (b - a).norm() / all)));
    for (int k = 0; k < count; ++k) {
      const Eigen::Vector2d p = a + (b - a) * (k + 0.5) / count;
      even.push_back(e.middle + p.x() * x + p.y() * y);
    }
  }
  return even;
}

struct Unit {
  double mm;
  const char* name;
};
constexpr std::array<Unit, 5> units{
    {{1, "mm"}, {10, "cm"}, {25.4, "inches"}, {304.8, "feet"}, {1000, "metres"}}};

const Unit* unit_of_ratio(double plate_over_design, double tolerance) {
  for (const auto& unit : units) {
    if (std::abs(std::log(plate_over_design / unit.mm)) < tolerance) return &unit;
  }
  return nullptr;
}

std::string size_words(const Extents& e) { return fmt::format("{:.4g} x {:.4g}", e.length, e.width); }

// The best end from all starts, each plain or robust.
struct End {
  PlateAlignment alignment;
  bool upside_down = false;
  double score() const { return std::hypot(alignment.rms_mm, alignment.border_rms_mm); }
  double turn() const { return Eigen::AngleAxisd{alignment.design_from_plate.linear()}.angle(); }
};

std::vector<End> ends_of(const DesignFaces& fixed, const PlateToAlign& moving,
                         std::span<const Vector3d> outline, PlateAlignmentSettings settings,
                         bool with_border) {
  std::vector<End> ends;
  for (const auto& start : geometry::alignment_starts(fixed, outline, moving.up)) {
    settings.start = start.design_from_plate;
    settings.with_border = with_border;
    auto end = geometry::align(fixed, moving, settings);
    if (end) ends.push_back({std::move(*end), start.upside_down});
  }
  std::ranges::sort(ends, {}, &End::score);
  return ends;
}

std::vector<Vector3d> mirrored(std::span<const Vector3d> points, const Vector3d& about, const Vector3d& up) {
  const Vector3d across = up.unitOrthogonal();
  std::vector<Vector3d> out;
  for (const auto& p : points) out.push_back(p - 2 * across * across.dot(p - about));
  return out;
}

// What is moved, what it is moved onto, and the words for both.
struct Question {
  const DesignFaces& fixed;
  std::span<const Vector3d> points, edges, outline;  // edges empty: the outline only says where to start
  std::span<const std::uint16_t> point_groups, edge_groups;
  Vector3d up;
  PlateAlignmentSettings settings;
  bool with_border = true, may_be_mirrored = true;
};

std::expected<End, Failure> best_end(const Question& q, std::vector<std::string>& remarks) {
  const PlateToAlign moving{.points = q.points,
                            .edges = q.edges,
                            .point_groups = q.point_groups,
                            .edge_groups = q.edge_groups,
                            .up = q.up};
  auto ends = ends_of(q.fixed, moving, q.outline, q.settings, q.with_border);
  if (ends.empty())
    return refuse("plate and design cannot be laid on each other: no pose was found from any side");
  if (q.may_be_mirrored) {
    const auto points = mirrored(q.points, q.outline[0], q.up), edges = mirrored(q.edges, q.outline[0], q.up),
               outline = mirrored(q.outline, q.outline[0], q.up);
    const auto others = ends_of(q.fixed,
                                {.points = points,
                                 .edges = edges,
                                 .point_groups = q.point_groups,
                                 .edge_groups = q.edge_groups,
                                 .up = q.up},
                                outline, q.settings, q.with_border);
    const double direct = ends.front().score();
    if (!others.empty() && others.front().score() < mirror_better * direct &&
        direct - others.front().score() > mirror_clearly_mm)
      return refuse(
          fmt::format("the design is mirrored: turned over in a mirror it fits to {:.2f} mm rms, as it is to "
                      "{:.2f} mm. Is it the one of the other side of the ship?",
                      others.front().score(), direct));
  }
  const double most = as_good * ends.front().score() + as_good_mm;
  std::erase_if(ends, [&](const End& e) { return e.score() > most; });
  const auto turns = std::ranges::count(ends, false, &End::upside_down);
  std::ranges::stable_sort(ends, {}, [](const End& e) { return std::pair{e.upside_down, e.turn()}; });
  const End& chosen = ends.front();
  if (turns > 1 && !chosen.upside_down)
    remarks.push_back(
        fmt::format("{} ways of turning it fit equally well (to {:.2f} mm); the one nearest to how the plate "
                    "lies was taken: check which end is which",
                    turns, chosen.score()));
  if (chosen.upside_down) remarks.push_back("the side that was measured is the underside of the design");
  return chosen;
}

std::vector<std::string> words_for(const PlateAlignment& a, const Vector3d& up) {
  std::vector<std::string> words;
  for (const auto& d : a.undetermined) {
    const Vector3d shift = d.head<3>(), turn = d.tail<3>();
    const double lift = std::abs(shift.dot(up)), spin = std::abs(turn.dot(up));
    const double slide = std::sqrt(std::max(0.0, shift.squaredNorm() - lift * lift));
    const double tilt = std::sqrt(std::max(0.0, turn.squaredNorm() - spin * spin));
    const double most = std::max({lift, spin, slide, tilt});
    words.push_back(
        most == slide ? fmt::format("a shift along ({:.2f}, {:.2f}, {:.2f})", shift.x(), shift.y(), shift.z())
        : most == spin ? "a turn about the plate's normal"
        : most == tilt ? "a tilt"
                       : "the height");
  }
  return words;
}

PlateAlignmentSettings alignment_settings(const RunResult& result, const InspectionSettings& settings) {
  return {.robust = settings.method == AlignmentMethod::robust,
          .point_sigma_mm = point_sigma_mm,
          .group_sigma_mm = result.promised.repeatability_z_mm,
          .edge_sigma_mm = std::max(least_edge_sigma_mm, result.measured->outline.rms_mm)};
}

std::expected<void, Failure> same_size(const Extents& plate, const Extents& design) {
  const double length = plate.length / design.length, width = plate.width / design.width;
  if (std::abs(std::log(length)) < size_off && std::abs(std::log(width)) < size_off) return {};
  const std::string sizes =
      fmt::format("the design measures {}, the plate {} mm", size_words(design), size_words(plate));
  const auto* unit = unit_of_ratio(std::sqrt(length * width), size_off / 2);
  if (unit != nullptr && unit->mm != 1 && std::abs(std::log(length / width)) < size_off)
    return refuse(fmt::format("{}: the design is in {}; export it in mm", sizes, unit->name));
  return refuse(fmt::format(
      "{}: another plate's design? (--outline ignore compares a plate that still has its margin)", sizes));
}

// A pose in which no height of the plate is on the wrong side: what the outline says of its plane stays.
std::expected<void, Failure> lift_to_one_side(const DesignFaces& design, const PlateSamples& plate,
                                              PlateMatch& match, AlignmentMethod method) {
  if (design.count() != 1)
    return refuse("one-sided alignment needs a design of one face; use best, robust or datum");
  const bool above =
      (method == AlignmentMethod::one_sided_above) != ((design.sign(0) < 0) != match.upside_down);
  geometry::LocalizationSettings settings;
  settings.start = match.design_from_world;
  settings.side = above ? geometry::AllowedSide::above : geometry::AllowedSide::below;
  Eigen::Index up = 0;
  design.up().cwiseAbs().maxCoeff(&up);
  for (Eigen::Index k = 0; k < 3; ++k) settings.fixed[static_cast<std::size_t>(k)] = k != up;
  settings.fixed[static_cast<std::size_t>(3 + up)] = true;
  // The rim is where a plate touches first.
  auto points = plate.points;
  points.insert(points.end(), plate.edges.begin(), plate.edges.end());
  settings.border_tolerance_mm = rim_mm;
  const auto lies = geometry::localize(design.surface(0), points, settings);
  if (!lies)
    return refuse(fmt::format("no one-sided pose was found: {}", geometry::to_string(lies.error().error)));
  match.design_from_world = lies->design_from_plate;
  match.alignment.rms_mm = lies->rms_mm;
  match.remarks.push_back(fmt::format("touches the design at {} places", lies->contact_count));
  return {};
}

std::expected<void, Failure> lay_on_corners(const DesignFaces& design, const RunResult& result,
                                            PlateMatch& match) {
  if (design.count() != 1)
    return refuse("alignment by corners needs a design of one four-sided face; use best or datum");
  const auto& s = design.surface(0);
  const double u0 = s.along_u().first(), u1 = s.along_u().last(), v0 = s.along_v().first(),
               v1 = s.along_v().last();
  const std::array<Vector3d, 4> corners{s.at(u0, v0).value, s.at(u1, v0).value, s.at(u1, v1).value,
                                        s.at(u0, v1).value};
  std::vector<Vector3d> from, to;
  for (const auto& [u, v] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
    from.push_back(result.measured->surface.at(u, v).value);
    const Vector3d q = match.design_from_world * from.back();
    to.push_back(
        *std::ranges::min_element(corners, {}, [&](const Vector3d& c) { return (c - q).squaredNorm(); }));
  }
  const auto motion = geometry::motion_between(from, to);
  if (!motion)
    return refuse(fmt::format("the corners do not make a pose: {}", geometry::to_string(motion.error())));
  match.design_from_world = *motion;
  double square = 0;
  for (std::size_t i = 0; i < 4; ++i) square += (*motion * from[i] - to[i]).squaredNorm();
  match.remarks.push_back(
      fmt::format("corners lie {:.2f} mm rms from those of the design", std::sqrt(square / 4)));
  return {};
}

std::expected<PlateMatch, Failure> by_datum(const InspectionSettings& settings) {
  std::vector<Vector3d> from, to;
  for (const auto& pair : settings.datum) from.push_back(pair.measured), to.push_back(pair.designed);
  const auto motion = geometry::motion_between(from, to);
  if (!motion)
    return refuse(fmt::format("--datum: {}; three places or more that are not on a line are wanted",
                              geometry::to_string(motion.error())));
  PlateMatch match;
  match.design_from_world = match.alignment.design_from_plate = *motion;
  double square = 0;
  for (std::size_t i = 0; i < from.size(); ++i) square += (*motion * from[i] - to[i]).squaredNorm();
  match.remarks.push_back(fmt::format("{} datum places lie {:.2f} mm rms from each other", from.size(),
                                      std::sqrt(square / static_cast<double>(from.size()))));
  return match;
}

std::vector<Vector3d> border_points(const DesignFaces& design) {
  // As evenly as the samples allow: each as often as its length says.
  double all = 0;
  for (const auto& s : design.border()) all += s.length_mm;
  const double pitch = all / (8 * edges_a_side);
  std::vector<Vector3d> points;
  double due = 0;
  for (const auto& s : design.border()) {
    for (due += s.length_mm; due >= pitch; due -= pitch) points.push_back(s.at);
  }
  return points;
}

double depth_of(std::span<const Vector3d> points) {
  const Extents e = extents_of(points);
  double square = 0;
  for (const auto& p : points) square += std::pow(e.normal.dot(p - e.middle), 2);
  return std::sqrt(square / static_cast<double>(points.size()));
}

// The border finely, then evenly by length; what one boundary shot has seen is a group.
void add_outline(const geometry::BSplineSurface& s, double field_mm, PlateSamples& to) {
  constexpr int fine = 400;  // a side
  std::vector<Vector3d> line;
  for (int side = 0; side < 4; ++side) {
    for (int k = 0; k < fine; ++k) {
      const double t = static_cast<double>(k) / fine;
      const double u = side == 0 ? t : side == 1 ? 1 : side == 2 ? 1 - t : 0;
      const double v = side == 0 ? 0 : side == 1 ? t : side == 2 ? 1 : 1 - t;
      line.push_back(s.at(u, v).value);
    }
  }
  line.push_back(line.front());
  double all = 0;
  for (std::size_t k = 1; k < line.size(); ++k) all += (line[k] - line[k - 1]).norm();
  const double pitch = all / (4 * edges_a_side);
  double way = 0, due = pitch / 2;
  for (std::size_t k = 1; k < line.size(); ++k) {
    way += (line[k] - line[k - 1]).norm();
    for (; way >= due; due += pitch) {
      to.edges.push_back(line[k]);
      to.edge_groups.push_back(static_cast<std::uint16_t>(due / field_mm));
    }
  }
}

// A plate that is formed, and not to this: half formed it would differ by half of the design's depth.
bool is_another(double rms_mm, double design_depth_mm, double plate_depth_mm) {
  return rms_mm > another_least_mm && rms_mm > another_share * design_depth_mm &&
         plate_depth_mm > formed_share * design_depth_mm;
}

std::string another_words(double rms_mm, double design_depth_mm) {
  return fmt::format(
      "the plate is formed, and differs from this design by {:.1f} mm rms (a flat sheet would by {:.1f} mm): "
      "another "
      "plate's design? (--force compares all the same)",
      rms_mm, design_depth_mm);
}

}  // namespace

PlateSamples samples_of(const RunResult& result) {
  PlateSamples all;
  const auto& s = result.measured->surface;
  const double field_x = std::max(result.track.field_x_mm, 1.0),
               field_y = std::max(result.track.field_y_mm, 1.0);
  Vector3d up = Vector3d::Zero();
  for (int i = 0; i < samples_a_side; ++i) {
    for (int k = 0; k < samples_a_side; ++k) {
      const auto r = s.at((i + 0.5) / samples_a_side, (k + 0.5) / samples_a_side);
      const auto cell = [](double x, double field) { return static_cast<int>(std::floor(x / field)) & 255; };
      all.points.push_back(r.value);
      all.point_groups.push_back(
          static_cast<std::uint16_t>(cell(r.value.x(), field_x) * 256 + cell(r.value.y(), field_y)));
      up += r.du.cross(r.dv);
    }
  }
  all.up = up.normalized();
  add_outline(s, std::min(field_x, field_y), all);
  return all;
}

std::expected<PlateMatch, Failure> match_faces(const DesignFaces& design, const PlateSamples& plate,
                                               const RunResult& result, DesignKind kind,
                                               const InspectionSettings& settings) {
  if (settings.method == AlignmentMethod::datum) return by_datum(settings);
  if (settings.method == AlignmentMethod::none) return PlateMatch{};
  const auto border = border_points(design);
  const Extents plate_size = extents_of(plate.edges), design_size = extents_of(border);
  if (settings.with_outline) {
    if (auto same = same_size(plate_size, design_size); !same) return std::unexpected(same.error());
  }
  PlateMatch match;
  const Question question{.fixed = design,
                          .points = plate.points,
                          .edges = plate.edges,
                          .outline = plate.edges,
                          .point_groups = plate.point_groups,
                          .edge_groups = plate.edge_groups,
                          .up = plate.up,
                          .settings = alignment_settings(result, settings),
                          .with_border = settings.with_outline};
  const auto end = best_end(question, match.remarks);
  if (!end) return std::unexpected(end.error());
  match.alignment = end->alignment;
  match.upside_down = end->upside_down;
  match.design_from_world = end->alignment.design_from_plate;
  match.undetermined = words_for(end->alignment, design.up());
  const double most =
      std::max(outline_least_mm, outline_share * std::hypot(plate_size.length, plate_size.width));
  if (settings.with_outline && end->alignment.border_rms_mm > most)
    return refuse(
        fmt::format("the outline of the plate lies {:.1f} mm rms from the design's: another plate's design? "
                    "(--outline ignore compares a plate that still has its margin)",
                    end->alignment.border_rms_mm));
  const double plate_depth = depth_of(plate.points);
  std::vector<Vector3d> feet;
  for (const auto& p : plate.points) feet.push_back(design.foot(match.design_from_world * p).point);
  const double design_depth = depth_of(feet);
  if (kind == DesignKind::surface && is_another(end->alignment.rms_mm, design_depth, plate_depth) &&
      !settings.insists)
    return refuse(another_words(end->alignment.rms_mm, design_depth));
  if (settings.method == AlignmentMethod::corners) {
    if (auto laid = lay_on_corners(design, result, match); !laid) return std::unexpected(laid.error());
  }
  if (settings.method == AlignmentMethod::one_sided_above ||
      settings.method == AlignmentMethod::one_sided_below) {
    if (auto lifted = lift_to_one_side(design, plate, match, settings.method); !lifted)
      return std::unexpected(lifted.error());
  }
  return match;
}

std::expected<PlateMatch, Failure> match_points(const DesignFaces& measured, const PlateSamples& plate,
                                                Design& design, const InspectionSettings& settings) {
  const bool has_edges = !design.edges.empty();
  auto outline = has_edges ? design.edges : hull_of(design.points);
  const Extents plate_size = extents_of(plate.edges), design_size = extents_of(outline);
  const double ratio =
      std::sqrt(plate_size.length * plate_size.width / (design_size.length * design_size.width));
  if (!design.mm_per_unit) {
    const auto* unit = unit_of_ratio(ratio, std::log(1.4));
    if (unit == nullptr)
      return refuse(fmt::format(
          "{}: the points reach over {} as written, the plate over {} mm: no unit makes them one plate; "
          "if it is this plate, say --unit",
          design.file, size_words(design_size), size_words(plate_size)));
    design.mm_per_unit = unit->mm;
    design.remarks.push_back(fmt::format("nobody said the unit; the size fits {}", unit->name));
  }
  for (auto& p : design.points) p *= *design.mm_per_unit;
  for (auto& p : outline) p *= *design.mm_per_unit;
  Extents scaled = design_size;
  scaled.length *= *design.mm_per_unit, scaled.width *= *design.mm_per_unit;
  if (settings.method == AlignmentMethod::datum) return by_datum(settings);
  if (settings.method == AlignmentMethod::none) return PlateMatch{};
  if (settings.method != AlignmentMethod::best && settings.method != AlignmentMethod::robust)
    return refuse(fmt::format(
        "--align {} needs a design with a surface; points and templates know best, robust, datum and none",
        to_string(settings.method)));
  if (has_edges) {
    if (auto same = same_size(plate_size, scaled); !same) return std::unexpected(same.error());
  } else if (scaled.length > 1.1 * plate_size.length || scaled.width > 1.1 * plate_size.width) {
    return refuse(fmt::format(
        "{}: the points reach over {} mm, the plate over {} mm: another plate's, or another unit (--unit)",
        design.file, size_words(scaled), size_words(plate_size)));
  } else if (scaled.length < points_cover * plate_size.length ||
             scaled.width < points_cover * plate_size.width) {
    return refuse(fmt::format(
        "{}: the points reach over {} mm, the plate over {} mm: too small a part to find where on the plate "
        "they lie; give --align datum or none",
        design.file, size_words(scaled), size_words(plate_size)));
  }
  const Vector3d up =
      design.kind == DesignKind::templates ? Vector3d::UnitZ() : extents_of(design.points).normal;
  PlateMatch match;
  const Question question{
      .fixed = measured,
      .points = design.points,
      .edges = has_edges ? std::span<const Vector3d>{outline} : std::span<const Vector3d>{},
      .outline = outline,
      .point_groups = {},
      .edge_groups = {},
      .up = up.z() < 0 ? Vector3d{-up} : up,
      .settings = {.robust = settings.method == AlignmentMethod::robust, .points_belong = true},
      .with_border = has_edges};
  const auto end = best_end(question, match.remarks);
  if (!end) return std::unexpected(end.error());
  match.alignment = end->alignment;
  match.upside_down = end->upside_down;
  match.design_from_world = end->alignment.design_from_plate.inverse();
  match.undetermined = words_for(end->alignment, measured.up());
  const double most =
      std::max(outline_least_mm, outline_share * std::hypot(plate_size.length, plate_size.width));
  if (has_edges && end->alignment.border_rms_mm > most)
    return refuse(fmt::format(
        "{}: its seams and ends lie {:.1f} mm rms from the plate's outline: a list of another plate?",
        design.file, end->alignment.border_rms_mm));
  const double depth = depth_of(design.points);
  if (is_another(end->alignment.rms_mm, depth, depth_of(plate.points)) && !settings.insists)
    return refuse(fmt::format("{}: {}", design.file, another_words(end->alignment.rms_mm, depth)));
  return match;
}

}  // namespace moldloft::firmware_like
