#include "tasks/scan_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

// Fixed-size Eigen throughout: constants that it keeps in local statics, and function pointers in its reductions, hide
// from the compiler that nothing here waits or allocates.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::tasks {
namespace {

using Eigen::Vector2d;

constexpr int samples_per_side = 64;
constexpr int sample_count = 4 * samples_per_side;
using Samples = std::array<Vector2d, sample_count>;

// World turned by a yaw; every sample goes through it, several times.
class Turned {
 public:
  explicit Turned(double yaw) : c_{std::cos(yaw)}, s_{std::sin(yaw)} {}
  Vector2d into(const Vector2d& p) const { return {c_ * p.x() + s_ * p.y(), -s_ * p.x() + c_ * p.y()}; }
  Vector2d out_of(const Vector2d& p) const { return {c_ * p.x() - s_ * p.y(), s_ * p.x() + c_ * p.y()}; }

 private:
  double c_, s_;
};

struct Box {
  double yaw = 0;     // of its first axis in world
  Vector2d min, max;  // in its own axes
  double area() const { return (max - min).prod(); }
};

Samples sample(const geometry::Outline& outline) {
  Samples points;
  for (int side = 0; side < 4; ++side) {
    for (int i = 0; i < samples_per_side; ++i) {
      points[static_cast<std::size_t>(side * samples_per_side + i)] =
          outline.sides[static_cast<std::size_t>(side)].at(static_cast<double>(i) / samples_per_side).value;
    }
  }
  return points;
}

Box box_at(double yaw, const Samples& points) {
  Box box{.yaw = yaw, .min = {INFINITY, INFINITY}, .max = {-INFINITY, -INFINITY}};
  const Turned axes{yaw};
  for (const auto& p : points) {
    const Vector2d q = axes.into(p);
    box.min = box.min.cwiseMin(q);
    box.max = box.max.cwiseMax(q);
  }
  return box;
}

// The least box has a side along a side of the convex hull; for a plate of four smooth sides the chords are
// near enough.
Box least_box(const geometry::Outline& outline, const Samples& points) {
  Box best;
  double least = INFINITY;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d chord = outline.corners[(i + 1) % 4] - outline.corners[i];
    const Box box = box_at(std::atan2(chord.y(), chord.x()), points);
    if (box.area() >= least) continue;
    least = box.area();
    best = box;
  }
  return best;
}

// Fields that cover `length` with the wanted overlap, and the distance from one to the next when spread evenly.
struct Spread {
  int count = 1;
  double first = 0, step = 0;
};
Spread spread(double from, double to, double field, const ScanPlanSettings& settings) {
  const double length = to - from + 2 * settings.margin_mm;
  Spread s;
  if (length > field)
    s.count = 1 + static_cast<int>(std::ceil((length - field) / (field - settings.overlap_mm) - 1e-9));
  s.step = s.count > 1 ? (length - field) / (s.count - 1) : 0;
  s.first = s.count > 1 ? from - settings.margin_mm + field / 2 : (from + to) / 2;
  return s;
}

// How far the outline reaches along the first axis between two heights of the second.
std::pair<double, double> extent_in_row(const Turned& axes, const Samples& points, double low, double high) {
  double from = INFINITY, to = -INFINITY;
  for (int i = 0; i < sample_count; ++i) {
    Vector2d a = axes.into(points[static_cast<std::size_t>(i)]);
    Vector2d b = axes.into(points[static_cast<std::size_t>((i + 1) % sample_count)]);
    if (a.y() > b.y()) std::swap(a, b);
    if (b.y() < low || a.y() > high) continue;
    const double rise = std::max(b.y() - a.y(), 1e-12);
    for (const double y : {std::max(a.y(), low), std::min(b.y(), high)}) {
      const double x = a.x() + (b.x() - a.x()) * std::clamp((y - a.y()) / rise, 0.0, 1.0);
      from = std::min(from, x);
      to = std::max(to, x);
    }
  }
  return {from, to};
}

}  // namespace

std::expected<std::size_t, geometry::Error> plan_zigzag(const geometry::Outline& outline,
                                                        const HeightModel& heights,
                                                        const ScanPlanSettings& settings,
                                                        const Vector2d& from, double head_yaw_now,
                                                        std::span<ShotPlace> places) {
  const Samples points = sample(outline);
  const Box box = least_box(outline, points);
  const Turned axes{box.yaw};
  const double half_turns = std::round((head_yaw_now - box.yaw) / std::numbers::pi);
  const double yaw = box.yaw + half_turns * std::numbers::pi;

  const Spread rows = spread(box.min.y(), box.max.y(), settings.field_y_mm, settings);
  const Vector2d start = axes.into(from);
  const bool from_top = start.y() > (box.min.y() + box.max.y()) / 2;
  bool forwards = start.x() < (box.min.x() + box.max.x()) / 2;

  std::size_t count = 0;
  for (int row = 0; row < rows.count; ++row, forwards = !forwards) {
    const double y = rows.first + (from_top ? rows.count - 1 - row : row) * rows.step;
    const auto [low, high] =
        extent_in_row(axes, points, y - settings.field_y_mm / 2, y + settings.field_y_mm / 2);
    if (low > high) continue;
    const Spread columns = spread(low, high, settings.field_x_mm, settings);
    for (int column = 0; column < columns.count; ++column) {
      if (count == places.size()) return std::unexpected{geometry::Error::capacity};
      const double x = columns.first + (forwards ? column : columns.count - 1 - column) * columns.step;
      const Vector2d centre = axes.out_of({x, y});
      places[count++] = {.centre = {centre.x(), centre.y(), heights.at(centre.x(), centre.y())},
                         .head_yaw = yaw};
    }
  }
  return count;
}

}  // namespace moldloft::tasks
