#include "geometry/fit/carrier.hpp"

#include "geometry/fit/smooth_sides.hpp"
#include "geometry/splines/closed_polygon.hpp"
#include "geometry/splines/convex_hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

namespace {

using Eigen::Vector2d;

constexpr double joint_mm = 1e-6;
constexpr double least_share = 1e-6;    // of the squared extent: less area is none
constexpr double rounding_room = 1e-9;  // of the extent
constexpr int most_chords_a_span = 4096;

// What one needs of a span of a curve: its ends, and derivatives that are exact there.
struct Piece {
  double a, b;
  CurvePoint2 start, end;
};

std::vector<Piece> pieces_of(const PlanCurve& curve) {
  std::vector<Piece> pieces;
  for (std::size_t k = cubic; k + cubic + 1 < curve.knots.size(); ++k) {
    const double a = curve.knots[k], b = curve.knots[k + 1];
    if (!(a < b)) continue;
    // Both ends by the basis of this span, since a derivative may jump at a knot.
    const auto at = [&](double t) {
      const BasisValues basis = cubic_basis(curve.knots, static_cast<int>(k), t);
      CurvePoint2 p{Vector2d::Zero(), Vector2d::Zero(), Vector2d::Zero()};
      for (int i = 0; i <= cubic; ++i) {
        const Vector2d& c = curve.control[k - cubic + i];
        p.value += basis.value[i] * c, p.first += basis.first[i] * c, p.second += basis.second[i] * c;
      }
      return p;
    };
    pieces.push_back({a, b, at(a), at(b)});
  }
  return pieces;
}

// Chords that stay within `off_mm` of the curve, its end left out: the sagitta is at most h^2 / 8 max |c''|.
void append_chords(const PlanCurve& curve, double off_mm, std::vector<Vector2d>& out) {
  for (const Piece& piece : pieces_of(curve)) {
    const double h = piece.b - piece.a;
    const double bend = std::max(piece.start.second.norm(), piece.end.second.norm());
    const double needed = std::ceil(std::sqrt(h * h * bend / (8 * off_mm)));
    const int n = static_cast<int>(std::clamp(needed, 1.0, double{most_chords_a_span}));
    for (int i = 0; i < n; ++i) out.push_back(curve.at(piece.a + h * i / n).value);
  }
}

struct Extent {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void take(double x) { low = std::min(low, x), high = std::max(high, x); }
  double size() const { return high - low; }
};

// The curve's extent along `direction`: at the ends of its pieces and where their derivative, a
// parabola, is zero.
void take_curve(const PlanCurve& curve, const Vector2d& direction, Extent& extent) {
  for (const Piece& piece : pieces_of(curve)) {
    extent.take(direction.dot(piece.start.value));
    extent.take(direction.dot(piece.end.value));
    const double h = piece.b - piece.a, c = direction.dot(piece.start.first),
                 b = direction.dot(piece.start.second), a = (direction.dot(piece.end.second) - b) / (2 * h);
    const double discriminant = b * b - 4 * a * c;
    if (discriminant < 0) continue;
    const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
    for (const double root : {q / a, c / q}) {
      if (root > 0 && root < h) extent.take(direction.dot(curve.at(piece.a + root).value));
    }
  }
}

// The direction of the hull's edge on which the least rectangle stands, turned to within 45 degrees of x.
Vector2d best_direction(const std::vector<Vector2d>& hull) {
  Vector2d best = Vector2d::UnitX();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Vector2d along = (hull[(i + 1) % hull.size()] - hull[i]).normalized(),
                   across(-along.y(), along.x());
    Extent u, v;
    for (const Vector2d& p : hull) u.take(along.dot(p)), v.take(across.dot(p));
    const double area = u.size() * v.size();
    if (area < least * (1 - rounding_room)) least = area, best = along;
  }
  while (std::abs(best.y()) > std::abs(best.x()) || best.x() < 0) best = Vector2d(best.y(), -best.x());
  return best;
}

PlanCurve straight(const Vector2d& a, const Vector2d& b) {
  return {uniform_clamped_knots(1), {a, a + (b - a) / 3, b - (b - a) / 3, b}};
}

std::expected<void, Error> check_sides(std::span<const PlanCurve> sides) {
  if (sides.empty()) return std::unexpected(Error::too_few_points);
  for (const PlanCurve& side : sides) {
    const std::size_t n = side.control.size();
    if (n < cubic + 1) return std::unexpected(Error::too_few_points);
    const auto finite = [](const auto& x) { return std::isfinite(x); };
    if (!std::ranges::all_of(side.control, [](const Vector2d& p) { return p.allFinite(); }) ||
        !std::ranges::all_of(side.knots, finite))
      return std::unexpected(Error::not_finite);
    const auto& k = side.knots;
    if (k.size() != n + cubic + 1 || !std::ranges::is_sorted(k) || k[0] != k[cubic] || k[n] != k[n + cubic] ||
        !(k[0] < k[n]))
      return std::unexpected(Error::knots_not_increasing);
  }
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Vector2d gap = sides[i].control.back() - sides[(i + 1) % sides.size()].control.front();
    if (gap.norm() > joint_mm) return std::unexpected(Error::open_loop);
  }
  return {};
}

std::vector<Vector2d> chords_of(std::span<const PlanCurve> sides, double off_mm) {
  std::vector<Vector2d> all;
  for (const PlanCurve& side : sides) append_chords(side, off_mm, all);
  return all;
}

}  // namespace

bool Carrier::inside(const Vector2d& xy) const { return contains(chords, xy); }

std::expected<Carrier, Error> carrier_of(std::span<const PlanCurve> given, const CarrierSettings& settings) {
  if (auto checked = check_sides(given); !checked) return std::unexpected(checked.error());
  std::vector<PlanCurve> sides(given.begin(), given.end());
  Carrier carrier;
  carrier.chords = chords_of(sides, settings.chord_mm);
  if (carrier.chords.size() < 3) return std::unexpected(Error::too_few_points);
  const std::vector<Vector2d> hull = convex_hull(carrier.chords);
  Extent x, y;
  for (const Vector2d& p : hull) x.take(p.x()), y.take(p.y());
  const double extent = std::max(x.size(), y.size());
  if (!(signed_area(hull) > least_share * extent * extent)) return std::unexpected(Error::collinear);
  if (crosses_itself(carrier.chords)) return std::unexpected(Error::self_crossing);
  if (signed_area(carrier.chords) < 0) {
    std::ranges::reverse(sides);
    for (PlanCurve& side : sides) side = reversed(side);
    std::ranges::reverse(carrier.chords);
  }

  const Vector2d along = best_direction(hull), across(-along.y(), along.x());
  Extent u, v;
  for (const PlanCurve& side : sides) take_curve(side, along, u), take_curve(side, across, v);
  const double room = settings.margin_mm + rounding_room * extent;
  const Vector2d origin = (u.low - room) * along + (v.low - room) * across;
  const double width = u.size() + 2 * room, height = v.size() + 2 * room;
  carrier.outline.corners = {origin, origin + width * along, origin + width * along + height * across,
                             origin + height * across};
  for (std::size_t i = 0; i < 4; ++i)
    carrier.outline.sides[i] = straight(carrier.outline.corners[i], carrier.outline.corners[(i + 1) % 4]);
  carrier.covered = signed_area(carrier.chords) / (width * height);

  for (PlanCurve& side : sides) {
    for (Vector2d& p : side.control)
      p = Vector2d(along.dot(p - origin) / width, across.dot(p - origin) / height);
    carrier.trim.push_back({.path = std::move(side)});
  }
  for (std::size_t i = 0; i < carrier.trim.size();
       ++i) {  // sides that meet within joint_mm now meet in every bit
    carrier.trim[i].path.control.back() = carrier.trim[(i + 1) % carrier.trim.size()].path.control.front();
  }
  return carrier;
}

std::expected<Carrier, Error> carrier_of(std::span<const Vector2d> polyline,
                                         const CarrierSettings& settings) {
  const auto sides = smooth_sides(polyline, settings.corner_angle);
  if (!sides) return std::unexpected(sides.error());
  return carrier_of(*sides, settings);
}

}  // namespace moldloft::geometry
