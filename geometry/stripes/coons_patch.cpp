#include "geometry/stripes/coons_patch.hpp"

#include "geometry/splines/refinement.hpp"

#include <algorithm>

namespace moldloft::geometry {

namespace {

void stretch_to_unit(SpaceCurve& curve) {
  const double begin = curve.begin(), end = curve.end();
  if (begin == 0 && end == 1) return;
  for (double& t : curve.knots) t = t == end ? 1 : (t - begin) / (end - begin);
}

}  // namespace

std::expected<CoonsPatch, Flaw> CoonsPatch::through(CoonsSides sides, double gap_mm) {
  SpaceCurve* const all[] = {&sides.low_v, &sides.high_v, &sides.low_u, &sides.high_u};
  for (std::size_t i = 0; i < 4; ++i) {
    if (const auto checked = check(*all[i]); !checked) return std::unexpected(Flaw{checked.error(), i});
    stretch_to_unit(*all[i]);
  }
  const std::pair<const Eigen::Vector3d&, const Eigen::Vector3d&> meeting[] = {
      {sides.low_v.control.front(), sides.low_u.control.front()},
      {sides.low_v.control.back(), sides.high_u.control.front()},
      {sides.high_v.control.front(), sides.low_u.control.back()},
      {sides.high_v.control.back(), sides.high_u.control.back()}};
  CoonsPatch patch;
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const auto& [a, b] = meeting[corner];
    if (!((a - b).norm() <= gap_mm)) return std::unexpected(Flaw{Error::corners_apart, corner});
    patch.corners_[corner] = 0.5 * (a + b);
  }
  patch.sides_ = std::move(sides);
  return patch;
}

SurfacePoint CoonsPatch::at(double u, double v) const {
  u = std::clamp(u, 0.0, 1.0), v = std::clamp(v, 0.0, 1.0);
  const CurvePoint<3> low_v = sides_.low_v.at(u), high_v = sides_.high_v.at(u);
  const CurvePoint<3> low_u = sides_.low_u.at(v), high_u = sides_.high_u.at(v);
  const auto& [c00, c10, c01, c11] = corners_;
  SurfacePoint p;
  p.value = (1 - v) * low_v.value + v * high_v.value + (1 - u) * low_u.value + u * high_u.value -
            ((1 - u) * ((1 - v) * c00 + v * c01) + u * ((1 - v) * c10 + v * c11));
  p.du = (1 - v) * low_v.first + v * high_v.first + high_u.value - low_u.value -
         ((1 - v) * (c10 - c00) + v * (c11 - c01));
  p.dv = high_v.value - low_v.value + (1 - u) * low_u.first + u * high_u.first -
         ((1 - u) * (c01 - c00) + u * (c11 - c10));
  p.duu = (1 - v) * low_v.second + v * high_v.second;
  p.duv = high_v.first - low_v.first + high_u.first - low_u.first - ((c11 - c01) - (c10 - c00));
  p.dvv = (1 - u) * low_u.second + u * high_u.second;
  return p;
}

BSplineSurface CoonsPatch::net() const {
  CoonsSides s = sides_;
  for (SpaceCurve* side :
       {&s.low_v, &s.high_v, &s.low_u, &s.high_u})  // a blend is linear: degree 1 is the least
    if (side->degree < 1) *side = elevate(*side, 1);
  make_compatible(s.low_v, s.high_v);
  make_compatible(s.low_u, s.high_u);

  const auto nu = static_cast<Eigen::Index>(s.low_v.control.size());
  const auto nv = static_cast<Eigen::Index>(s.low_u.control.size());
  BSplineSurface net{s.low_v.knots,           s.low_u.knots,           Eigen::MatrixXd(nu, nv),
                     Eigen::MatrixXd(nu, nv), Eigen::MatrixXd(nu, nv), s.low_v.degree,
                     s.low_u.degree};
  const auto& [c00, c10, c01, c11] = corners_;
  for (int i = 0; i < nu; ++i) {
    const double g = greville(net.knots_u, i, net.degree_u);
    for (int j = 0; j < nv; ++j) {
      const double h = greville(net.knots_v, j, net.degree_v);
      const Eigen::Vector3d p = (1 - h) * s.low_v.control[i] + h * s.high_v.control[i] +
                                (1 - g) * s.low_u.control[j] + g * s.high_u.control[j] -
                                ((1 - g) * ((1 - h) * c00 + h * c01) + g * ((1 - h) * c10 + h * c11));
      net.x(i, j) = p.x(), net.y(i, j) = p.y(), net.z(i, j) = p.z();
    }
  }
  return net;
}

}  // namespace moldloft::geometry
