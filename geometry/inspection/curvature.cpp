#include "geometry/inspection/curvature.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace moldloft::geometry {

namespace {

// The sine below which parameter lines count as touching, and the share of the second derivatives below which
// a first derivative is rounding: at 1e-10 curvatures still carry six digits, and what lies below is a pole.
constexpr double least_sine = 1e-10;
constexpr double least_speed = 1e-10;

constexpr double rounding = 32 * std::numeric_limits<double>::epsilon();

// The derivatives with the three columns that the map evaluates; `value` is not needed.
struct Derivatives {
  Eigen::Vector3d du, dv, duu, duv, dvv;
};

// The tangent plane: unit normal, orthonormal basis (first along r_u), and the forms.
struct Frame {
  FundamentalForms forms;
  Eigen::Vector3d normal;
  double speed_u, speed_v;           // |r_u|, |r_v|
  double bend_uu, bend_uv, bend_vv;  // |r_uu|, |r_uv|, |r_vv|
  double area;                       // sqrt(EG - F^2), from the cross product: nothing cancels
};

// The shape operator in that basis: S = [[a, b], [b, c]].
struct Shape {
  double a, b, c;
  double doubt;  // how far off each entry may be
  double mean() const { return 0.5 * (a + c); }
  double radius() const { return std::sqrt(0.25 * (a - c) * (a - c) + b * b); }  // (k1 - k2) / 2
};

std::expected<Frame, Error> frame_of(const Derivatives& p) {
  Frame frame;
  const Eigen::Vector3d cross = p.du.cross(p.dv);
  FundamentalForms& w = frame.forms;
  w.e = p.du.squaredNorm(), w.f = p.du.dot(p.dv), w.g = p.dv.squaredNorm();
  frame.area = cross.norm();
  frame.speed_u = std::sqrt(w.e), frame.speed_v = std::sqrt(w.g);
  frame.bend_uu = p.duu.norm(), frame.bend_uv = p.duv.norm(), frame.bend_vv = p.dvv.norm();
  if (!std::isfinite(w.e + w.g + frame.bend_uu + frame.bend_uv + frame.bend_vv))
    return std::unexpected(Error::not_finite);
  const bool stands_u = frame.speed_u <= least_speed * std::max(frame.bend_uu, frame.bend_uv);
  const bool stands_v = frame.speed_v <= least_speed * std::max(frame.bend_vv, frame.bend_uv);
  if (stands_u || stands_v || !(frame.area > least_sine * frame.speed_u * frame.speed_v))
    return std::unexpected(Error::singular_parametrization);
  frame.normal = cross / frame.area;
  w.l = p.duu.dot(frame.normal), w.m = p.duv.dot(frame.normal), w.n = p.dvv.dot(frame.normal);
  return frame;
}

// With t1 = r_u / |r_u| and t2 = (r_v - s r_u) / q, s = F / E, q = area / |r_u|, the second form
// gives the entries.
Shape shape_of(const Frame& frame) {
  const FundamentalForms& w = frame.forms;
  const double s = w.f / w.e, inverse_area = 1 / frame.area;
  Shape shape;
  shape.a = w.l / w.e;
  shape.b = (w.m - s * w.l) * inverse_area;
  shape.c = (w.n - s * (2 * w.m - s * w.l)) * (w.e * inverse_area * inverse_area);
  const double speeds = frame.speed_u * frame.speed_v;
  const double bend = frame.bend_uu * w.g + 2 * frame.bend_uv * speeds + frame.bend_vv * w.e;
  shape.doubt = rounding * bend * speeds * (inverse_area * inverse_area * inverse_area);
  return shape;
}

}  // namespace

std::expected<FundamentalForms, Error> fundamental_forms(const SurfacePoint& point) {
  const auto frame = frame_of({point.du, point.dv, point.duu, point.duv, point.dvv});
  if (!frame) return std::unexpected(frame.error());
  return frame->forms;
}

std::expected<Curvature, Error> curvature_at(const SurfacePoint& point, double umbilic_tolerance) {
  const Derivatives p{point.du, point.dv, point.duu, point.duv, point.dvv};
  const auto frame = frame_of(p);
  if (!frame) return std::unexpected(frame.error());
  const Shape shape = shape_of(*frame);
  const double mean = shape.mean(), radius = shape.radius();

  Curvature out;
  out.mean = mean, out.k1 = mean + radius, out.k2 = mean - radius;
  out.gaussian = shape.a * shape.c - shape.b * shape.b;
  out.umbilic = 2 * radius <= std::max(umbilic_tolerance, shape.doubt);
  // The eigenvector of k1 lies at half the angle of (a - c, 2b).
  const double angle = out.umbilic ? 0.0 : 0.5 * std::atan2(2 * shape.b, shape.a - shape.c);
  const double cosine = std::cos(angle), sine = std::sin(angle);
  const FundamentalForms& w = frame->forms;
  const double q = frame->area / frame->speed_u;
  const Eigen::Vector2d along(1 / frame->speed_u, 0), across(-w.f / (w.e * q), 1 / q);
  const Eigen::Vector3d t1 = p.du / frame->speed_u, t2 = frame->normal.cross(t1);
  out.direction_1 = cosine * along + sine * across, out.direction_2 = cosine * across - sine * along;
  out.tangent_1 = cosine * t1 + sine * t2, out.tangent_2 = cosine * t2 - sine * t1;
  return out;
}

namespace {

// The control points of the curve r(u, .) and of its u derivatives, for one fixed u: a row of
// nodes shares them.
class NetAlong {
 public:
  explicit NetAlong(const BSplineSurface& surface)
      : surface_(surface), row_(static_cast<std::size_t>(surface.control_v())) {}

  void fix(double u_asked) {
    const double u = clamped(surface_.knots_u, u_asked);
    const int k = find_span(surface_.knots_u, u);
    const BasisValues basis = cubic_basis(surface_.knots_u, k, u);
    for (int j = 0; j < surface_.control_v(); ++j) {
      Column& at = row_[static_cast<std::size_t>(j)];
      at = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
      for (int a = 0; a <= cubic; ++a) {
        const int i = k - cubic + a;
        const Eigen::Vector3d point(surface_.x(i, j), surface_.y(i, j), surface_.z(i, j));
        at.value += basis.value[a] * point, at.du += basis.first[a] * point;
        at.duu += basis.second[a] * point;
      }
    }
  }

  Derivatives at(double v_asked) const {
    const double v = clamped(surface_.knots_v, v_asked);
    const int k = find_span(surface_.knots_v, v);
    const BasisValues basis = cubic_basis(surface_.knots_v, k, v);
    Derivatives p{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                  Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (int b = 0; b <= cubic; ++b) {
      const Column& at = row_[static_cast<std::size_t>(k - cubic + b)];
      p.du += basis.value[b] * at.du, p.duu += basis.value[b] * at.duu;
      p.dv += basis.first[b] * at.value, p.duv += basis.first[b] * at.du;
      p.dvv += basis.second[b] * at.value;
    }
    return p;
  }

 private:
  struct Column {
    Eigen::Vector3d value, du, duu;
  };
  static double clamped(std::span<const double> knots, double t) {
    return std::clamp(t, knots[cubic], knots[knots.size() - cubic - 1]);
  }
  const BSplineSurface& surface_;
  std::vector<Column> row_;
};

}  // namespace

std::expected<std::size_t, Error> curvature_map(const BSplineSurface& surface, std::span<const double> us,
                                                std::span<const double> vs, std::span<CurvatureSample> out) {
  if (us.empty() || vs.empty()) return std::unexpected(Error::too_few_points);
  if (out.size() < us.size() * vs.size()) return std::unexpected(Error::capacity);
  const auto finite = [](double t) { return std::isfinite(t); };
  if (!std::ranges::all_of(us, finite) || !std::ranges::all_of(vs, finite) || !surface.x.allFinite() ||
      !surface.y.allFinite() || !surface.z.allFinite())
    return std::unexpected(Error::not_finite);

  NetAlong net(surface);
  std::size_t singular = 0;
  for (std::size_t i = 0; i < us.size(); ++i) {
    net.fix(us[i]);
    for (std::size_t j = 0; j < vs.size(); ++j) {
      CurvatureSample& sample = out[i * vs.size() + j];
      if (const auto frame = frame_of(net.at(vs[j]))) {
        const Shape shape = shape_of(*frame);
        const double mean = shape.mean(), radius = shape.radius();
        sample = {shape.a * shape.c - shape.b * shape.b, mean, mean + radius, mean - radius};
      } else {
        constexpr double none = std::numeric_limits<double>::quiet_NaN();
        sample = {none, none, none, none};
        ++singular;
      }
    }
  }
  return singular;
}

}  // namespace moldloft::geometry
