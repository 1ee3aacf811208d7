#include "firmware_like/inspection/frame_lines.hpp"

#include "geometry/splines/convex_hull.hpp"

#include <Eigen/Dense>
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

constexpr double reach_mm = 2;     // beyond the measured border: a pin at the seam still has its height
constexpr double inset = 0.04;     // of the plate's length: where the first and the last frame stand
constexpr int most_pins = 17;      // as hull systems print them
constexpr int steps_across = 240;  // to find a frame's two ends
constexpr double square_share = 0.97, aligned_cosine = 0.996;  // width to length; 5 degrees
constexpr double flat_mm = 0.05;  // of a sagitta: below it a frame has no side to which it is bent
constexpr std::array<double, 12> spacings{5, 10, 20, 25, 50, 100, 150, 200, 250, 400, 500, 1000};

struct Span1 {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void add(double t) { low = std::min(low, t), high = std::max(high, t); }
  double length() const { return high - low; }
};

// The measured plate's height over the design's base plane, where the line along up meets it.
std::optional<double> measured_height(const DesignFaces& measured, const RigidMotion& design_from_world,
                                      const Vector3d& at, const FrameAxes& axes) {
  const RigidMotion world_from_design = design_from_world.inverse();
  const auto hit = measured.crossing(world_from_design * at, world_from_design.linear() * axes.up, reach_mm);
  if (!hit) return std::nullopt;
  return (design_from_world * hit->point - axes.origin).dot(axes.up);
}

// Parabola a + b t + c t^2 through values at t in -1..1.
std::array<double, 3> parabola(const std::vector<std::pair<double, double>>& values) {
  Eigen::MatrixX3d rows(static_cast<Eigen::Index>(values.size()), 3);
  Eigen::VectorXd right(rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const auto& [t, value] = values[static_cast<std::size_t>(i)];
    rows.row(i) << 1, t, t * t;
    right[i] = value;
  }
  const Eigen::Vector3d solved = rows.colPivHouseholderQr().solve(right);
  return {solved[0], solved[1], solved[2]};
}

void conclude(FrameLine& line) {
  std::vector<std::pair<double, double>> gaps, heights;
  for (const auto& pin : line.pins) {
    const auto gap = pin.gap_mm();
    if (!gap) continue;
    ++line.measured;
    line.open_mm = std::max(line.open_mm, -*gap);
    line.pressed_mm = std::max(line.pressed_mm, *gap);
    gaps.emplace_back(pin.way_mm / line.half_mm, *gap);
    heights.emplace_back(pin.way_mm / line.half_mm, pin.design_mm);
  }
  if (gaps.size() < 3) return;
  const auto gap = parabola(gaps), height = parabola(heights);
  line.lean_mm = gap[1];
  const double side = std::abs(height[2]) < flat_mm ? 1 : height[2] < 0 ? -1 : 1;
  line.bend_mm = -gap[2] * side;
  line.curvature_per_m = 2 * gap[2] / (line.half_mm * line.half_mm) * 1000;
}

void conclude(std::vector<FrameLine>& lines) {
  for (auto& line : lines) conclude(line);
  // As an angle, since frames differ in length.
  double mean = 0;
  int count = 0;
  for (const auto& line : lines) {
    if (line.measured >= 3) mean += line.lean_mm / line.half_mm, ++count;
  }
  if (count == 0) return;
  mean /= count;
  for (auto& line : lines) line.sight_mm = line.measured >= 3 ? line.lean_mm - mean * line.half_mm : 0;
}

}  // namespace

FrameAxes frame_axes(const DesignFaces& design) {
  FrameAxes axes;
  axes.origin = design.centroid();
  // Up is the axis of the design's own frame that is nearest to its normal, where one is near; frames stand across the
  // longer side of the plate.
  const Vector3d normal = design.up();
  Eigen::Index nearest = 0;
  axes.up = normal.cwiseAbs().maxCoeff(&nearest) > 0.94
                ? Vector3d{Vector3d::Unit(nearest) * (normal[nearest] < 0 ? -1 : 1)}
                : normal;
  const Vector3d first = axes.up.unitOrthogonal(), second = axes.up.cross(first);
  std::vector<Eigen::Vector2d> plan;
  for (const auto& s : design.border()) plan.emplace_back(first.dot(s.at), second.dot(s.at));
  const auto round = geometry::smallest_rectangle(geometry::convex_hull(std::move(plan)));
  axes.x = round.along.x() * first + round.along.y() * second;
  // A square has no longer side: the one nearer to an axis of the design's frame, or that axis where it is meant.
  const Vector3d other = axes.up.cross(axes.x);
  if (round.width > square_share * round.length && other.cwiseAbs()[0] > axes.x.cwiseAbs()[0]) axes.x = other;
  Eigen::Index along = 0;
  if (axes.x.cwiseAbs().maxCoeff(&along) > aligned_cosine)
    axes.x = (Vector3d::Unit(along) - axes.up * axes.up[along]).normalized() * (axes.x[along] < 0 ? -1 : 1);
  axes.x.cwiseAbs().maxCoeff(&along);
  if (axes.x[along] < 0) axes.x = -axes.x;
  axes.y = axes.up.cross(axes.x);
  return axes;
}

std::vector<FrameLine> frame_lines(const DesignFaces& design, const DesignFaces& measured,
                                   const RigidMotion& design_from_world, const FrameAxes& axes, int count) {
  Span1 along, across;
  for (const auto& s : design.border()) {
    along.add((s.at - axes.origin).dot(axes.x));
    across.add((s.at - axes.origin).dot(axes.y));
  }
  const auto spacing =
      std::ranges::find_if(spacings, [&](double d) { return across.length() / d < most_pins; });
  const double distance = spacing == spacings.end() ? across.length() / (most_pins - 1) : *spacing;
  std::vector<FrameLine> lines;
  for (int n = 0; n < count; ++n) {
    const double part = count == 1 ? 0.5 : inset + (1 - 2 * inset) * n / (count - 1);
    FrameLine line{.name = fmt::format("{}", n + 1), .x_mm = along.low + part * along.length(), .pins = {}};
    const auto place = [&](double y) { return Vector3d{axes.origin + line.x_mm * axes.x + y * axes.y}; };
    Span1 ends;
    for (int k = 0; k <= steps_across; ++k) {
      const double y = across.low + across.length() * k / steps_across;
      if (design.crossing(place(y), axes.up, 0)) ends.add(y);
    }
    if (!(ends.length() > 0)) continue;
    const double middle = (ends.low + ends.high) / 2;
    line.half_mm = ends.length() / 2;
    line.middle = place(middle);
    const int half = static_cast<int>(std::floor(line.half_mm / distance));
    for (int column = -half; column <= half; ++column) {
      const Vector3d at = place(middle + column * distance);
      const auto hit = design.crossing(at, axes.up, 0);
      if (!hit) continue;
      line.pins.push_back({.column = column,
                           .way_mm = column * distance,
                           .design_mm = (hit->point - axes.origin).dot(axes.up),
                           .measured_mm = measured_height(measured, design_from_world, hit->point, axes)});
    }
    lines.push_back(std::move(line));
  }
  conclude(lines);
  return lines;
}

std::vector<FrameLine> frame_lines(const TemplateList& list, const DesignFaces& measured,
                                   const RigidMotion& design_from_world) {
  const FrameAxes axes;  // ship coordinates: x along the ship, z up
  std::vector<FrameLine> lines;
  for (const auto& frame : list.frames) {
    FrameLine line{.name = frame.name, .x_mm = frame.middle.x(), .middle = frame.middle, .pins = {}};
    line.half_mm =
        list.distance_mm * std::max(std::abs(frame.pins.front().column), std::abs(frame.pins.back().column));
    if (frame.lower_mm && frame.upper_mm) line.half_mm = (*frame.lower_mm + *frame.upper_mm) / 2;
    for (const auto& pin : frame.pins) {
      const Vector3d at = frame.place(pin, list.distance_mm);
      line.pins.push_back({.column = pin.column,
                           .way_mm = pin.column * list.distance_mm,
                           .design_mm = at.z(),
                           .measured_mm = measured_height(measured, design_from_world, at, axes)});
    }
    lines.push_back(std::move(line));
  }
  conclude(lines);
  return lines;
}

double twist_of(const std::vector<FrameLine>& lines) {
  const auto is_measured = [](const FrameLine& l) { return l.measured >= 3; };
  const auto first = std::ranges::find_if(lines, is_measured);
  if (first == lines.end()) return 0;
  const auto last = std::ranges::find_if(lines.rbegin(), lines.rend(), is_measured);
  return (last->lean_mm / last->half_mm - first->lean_mm / first->half_mm) *
         (last->half_mm + first->half_mm) / 2;
}

}  // namespace moldloft::firmware_like
