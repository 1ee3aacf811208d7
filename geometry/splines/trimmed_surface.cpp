#include "geometry/splines/trimmed_surface.hpp"

#include "geometry/splines/closed_polygon.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::geometry {

namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr double joint_tolerance = 1e-9;    // of (u, v): a micrometre on a plate of a kilometre
constexpr double domain_tolerance = 1e-12;  // rounding of a curve that touches the border
constexpr double finest_tolerance_mm =
    1e-9;  // below, rounding of coordinates of metres would be halved for ever
constexpr int most_halvings = 24;
constexpr int looks_a_piece = 15;

template <typename Curve>
double domain_start(const Curve& curve) {
  return curve.knots[cubic];
}
template <typename Curve>
double domain_end(const Curve& curve) {
  return curve.knots[curve.knots.size() - cubic - 1];
}

bool all_finite(std::span<const double> numbers) {
  return std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); });
}

std::expected<void, Error> check_knots(std::span<const double> knots, std::size_t control) {
  if (control < cubic + 1) return std::unexpected(Error::too_few_points);
  if (!all_finite(knots)) return std::unexpected(Error::not_finite);
  const bool clamped = knots.size() == control + cubic + 1 && std::ranges::is_sorted(knots) &&
                       knots[0] == knots[cubic] && knots[control] == knots[control + cubic] &&
                       knots[0] < knots[control];
  if (!clamped) return std::unexpected(Error::knots_not_increasing);
  return {};
}

template <typename Curve>
std::expected<void, Error> check_curve(const Curve& curve) {
  if (auto knots = check_knots(curve.knots, curve.control.size()); !knots) return knots;
  const bool finite = std::ranges::all_of(curve.control, [](const auto& p) { return p.allFinite(); });
  if (!finite) return std::unexpected(Error::not_finite);
  return {};
}

std::expected<void, Error> check_net(const BSplineSurface& s) {
  if (s.y.rows() != s.x.rows() || s.z.rows() != s.x.rows() || s.y.cols() != s.x.cols() ||
      s.z.cols() != s.x.cols())
    return std::unexpected(Error::too_few_points);
  if (auto u = check_knots(s.knots_u, static_cast<std::size_t>(s.x.rows())); !u) return u;
  if (auto v = check_knots(s.knots_v, static_cast<std::size_t>(s.x.cols())); !v) return v;
  if (!s.x.allFinite() || !s.y.allFinite() || !s.z.allFinite()) return std::unexpected(Error::not_finite);
  return {};
}

std::expected<void, Error> check_image(const BSplineSurface& surface, const TrimCurve& curve,
                                       double tolerance_mm) {
  if (auto checked = check_curve(*curve.image); !checked) return checked;
  const double a = domain_start(curve.path), b = domain_end(curve.path);
  if (domain_start(*curve.image) != a || domain_end(*curve.image) != b)
    return std::unexpected(Error::off_surface);
  const int looks = 4 * static_cast<int>(curve.image->knots.size() + curve.path.knots.size());
  for (int i = 0; i <= looks; ++i) {
    const double t = a + (b - a) * i / looks;
    const Vector2d uv = curve.path.at(t).value;
    if (!((surface.at(uv.x(), uv.y()).value - curve.image->value(t)).norm() <= tolerance_mm))
      return std::unexpected(Error::off_surface);
  }
  return {};
}

Vector2d end_of(const TrimCurve& curve, bool last) {
  return last != curve.reversed ? curve.path.control.back() : curve.path.control.front();
}

std::expected<void, Error> check_loop(const BSplineSurface& surface, const TrimLoop& loop,
                                      double tolerance_mm) {
  if (loop.empty()) return std::unexpected(Error::too_few_points);
  for (const TrimCurve& curve : loop) {
    if (auto checked = check_curve(curve.path); !checked) return checked;
  }
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vector2d gap = end_of(loop[i], true) - end_of(loop[(i + 1) % loop.size()], false);
    if (gap.cwiseAbs().maxCoeff() > joint_tolerance) return std::unexpected(Error::open_loop);
  }
  const Vector2d low{surface.knots_u.front(), surface.knots_v.front()},
      high{surface.knots_u.back(), surface.knots_v.back()};
  for (const Vector2d& uv : chords(loop)) {
    if ((low - uv).maxCoeff() > domain_tolerance || (uv - high).maxCoeff() > domain_tolerance)
      return std::unexpected(Error::outside_domain);
  }
  for (const TrimCurve& curve : loop) {
    if (!curve.image) continue;
    if (auto checked = check_image(surface, curve, tolerance_mm); !checked) return checked;
  }
  return {};
}

template <typename Curve>
Curve reversed_curve(const Curve& curve) {
  Curve back = curve;
  std::ranges::reverse(back.control);
  const double sum = curve.knots.front() + curve.knots.back();
  for (std::size_t i = 0; i < curve.knots.size(); ++i)
    back.knots[i] = sum - curve.knots[curve.knots.size() - 1 - i];
  return back;
}

// One border as a path: a straight line through the Greville abscissae runs at unit speed.
TrimCurve border(const BSplineSurface& s, bool along_u, bool at_end, bool walked_back) {
  TrimCurve curve;
  curve.reversed = walked_back;
  const std::vector<double>&along = along_u ? s.knots_u : s.knots_v,
        &across = along_u ? s.knots_v : s.knots_u;
  const double fixed = at_end ? across.back() : across.front();
  const int n = along_u ? s.control_u() : s.control_v();
  const int row = !at_end ? 0 : along_u ? s.control_v() - 1 : s.control_u() - 1;
  curve.path.knots = along;
  SpaceCurve image{along, {}};
  for (int i = 0; i < n; ++i) {
    const double g = greville(along, i);
    curve.path.control.push_back(along_u ? Vector2d(g, fixed) : Vector2d(fixed, g));
    const int a = along_u ? i : row, b = along_u ? row : i;
    image.control.push_back({s.x(a, b), s.y(a, b), s.z(a, b)});
  }
  curve.image = std::move(image);
  return curve;
}

struct ImagePoint {
  Vector3d value, slope;
};

ImagePoint image_at(const BSplineSurface& surface, const PlanCurve& path, double t) {
  const CurvePoint2 c = path.at(t);
  const SurfacePoint s = surface.at(c.value.x(), c.value.y());
  return {s.value, s.du * c.first.x() + s.dv * c.first.y()};
}

bool piece_fits(const BSplineSurface& surface, const PlanCurve& path, double a, double b,
                const ImagePoint& at_a, const ImagePoint& at_b, double tolerance_mm) {
  for (int k = 1; k <= looks_a_piece; ++k) {
    const double s = k / (looks_a_piece + 1.0), r = 1 - s;
    const Vector3d hermite = r * r * (1 + 2 * s) * at_a.value + s * s * (1 + 2 * r) * at_b.value +
                             (b - a) * s * r * (r * at_a.slope - s * at_b.slope);
    const Vector2d uv = path.at(a + (b - a) * s).value;
    if (!((surface.at(uv.x(), uv.y()).value - hermite).norm() <= tolerance_mm)) return false;
  }
  return true;
}

}  // namespace

TrimLoop natural_border(const BSplineSurface& s) {
  return {border(s, true, false, false), border(s, false, true, false), border(s, true, true, true),
          border(s, false, false, true)};
}

PlanCurve reversed(const PlanCurve& curve) { return reversed_curve(curve); }
SpaceCurve reversed(const SpaceCurve& curve) { return reversed_curve(curve); }

template <typename Vector>
std::vector<Vector> hermite_control(const std::vector<double>& parameter, const std::vector<Vector>& value,
                                    const std::vector<Vector>& slope) {
  // With double knots the control points are the pieces' inner Bezier points: the joints lie between them.
  std::vector<Vector> control{value.front()};
  for (std::size_t i = 0; i + 1 < parameter.size(); ++i) {
    const double third = (parameter[i + 1] - parameter[i]) / 3;
    control.push_back(value[i] + third * slope[i]);
    control.push_back(value[i + 1] - third * slope[i + 1]);
  }
  control.push_back(value.back());
  return control;
}
template std::vector<Vector2d> hermite_control(const std::vector<double>&, const std::vector<Vector2d>&,
                                               const std::vector<Vector2d>&);
template std::vector<Vector3d> hermite_control(const std::vector<double>&, const std::vector<Vector3d>&,
                                               const std::vector<Vector3d>&);

std::vector<double> hermite_knots(const std::vector<double>& parameter) {
  std::vector<double> knots(2, parameter.front());
  for (const double t : parameter) knots.insert(knots.end(), 2, t);
  knots.insert(knots.end(), 2, parameter.back());
  return knots;
}

SpaceCurve image_on(const BSplineSurface& surface, const PlanCurve& path, double tolerance_mm) {
  const double allowed = std::max(tolerance_mm, finest_tolerance_mm) / 2;
  std::vector<double> parameter;
  std::vector<Vector3d> value, slope;
  const auto keep = [&](double t, const ImagePoint& point) {
    parameter.push_back(t), value.push_back(point.value), slope.push_back(point.slope);
  };
  struct Piece {
    double end;
    ImagePoint at_end;
    int halvings;
  };
  double a = domain_start(path);
  ImagePoint at_a = image_at(surface, path, a);
  keep(a, at_a);
  std::vector<Piece> ahead;  // the nearest last
  for (std::size_t k = cubic + 1; k + cubic < path.knots.size(); ++k) {
    if (path.knots[k] == path.knots[k - 1]) continue;
    ahead.push_back({path.knots[k], image_at(surface, path, path.knots[k]), 0});
    while (!ahead.empty()) {
      const Piece piece = ahead.back();
      if (piece.halvings < most_halvings &&
          !piece_fits(surface, path, a, piece.end, at_a, piece.at_end, allowed)) {
        const double middle = a + (piece.end - a) / 2;
        ahead.back().halvings = piece.halvings + 1;
        ahead.push_back({middle, image_at(surface, path, middle), piece.halvings + 1});
        continue;
      }
      ahead.pop_back();
      a = piece.end, at_a = piece.at_end;
      keep(a, at_a);
    }
  }
  return {hermite_knots(parameter), hermite_control(parameter, value, slope)};
}

std::vector<Vector2d> chords(const TrimLoop& loop, int chords_a_span) {
  std::vector<Vector2d> points;
  for (const TrimCurve& curve : loop) {
    const std::vector<double>& knots = curve.path.knots;
    std::vector<Vector2d> walked;
    for (std::size_t k = cubic; k + cubic + 1 < knots.size(); ++k) {
      if (knots[k] == knots[k + 1]) continue;
      for (int i = 0; i < chords_a_span; ++i)
        walked.push_back(curve.path.at(knots[k] + (knots[k + 1] - knots[k]) * i / chords_a_span).value);
    }
    walked.push_back(curve.path.control.back());
    if (curve.reversed) std::ranges::reverse(walked);
    points.insert(points.end(), walked.begin(), walked.end() - 1);  // its end is the next one's start
  }
  return points;
}

std::expected<void, Error> check(const TrimmedSurface& face, double tolerance_mm) {
  if (auto net = check_net(face.surface); !net) return net;
  std::vector<Vector2d> outer;
  if (!face.outer.empty()) {
    if (auto loop = check_loop(face.surface, face.outer, tolerance_mm); !loop) return loop;
    outer = chords(face.outer);
    if (crosses_itself(outer)) return std::unexpected(Error::self_crossing);
    if (!(signed_area(outer) > 0)) return std::unexpected(Error::wrong_way_round);
  }
  std::vector<std::vector<Vector2d>> holes;
  for (const TrimLoop& hole : face.holes) {
    if (auto loop = check_loop(face.surface, hole, tolerance_mm); !loop) return loop;
    holes.push_back(chords(hole));
    if (crosses_itself(holes.back())) return std::unexpected(Error::self_crossing);
    if (!(signed_area(holes.back()) < 0)) return std::unexpected(Error::wrong_way_round);
    if (!outer.empty()) {
      if (cross(outer, holes.back())) return std::unexpected(Error::self_crossing);
      if (!contains(outer, holes.back().front())) return std::unexpected(Error::wrong_way_round);
    }
    for (std::size_t i = 0; i + 1 < holes.size(); ++i) {
      if (cross(holes[i], holes.back()) || contains(holes[i], holes.back().front()) ||
          contains(holes.back(), holes[i].front()))
        return std::unexpected(Error::self_crossing);
    }
  }
  return {};
}

}  // namespace moldloft::geometry
