#include "geometry/inspection/point_plane_system.hpp"

#include "geometry/inspection/plain_motion.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace moldloft::geometry {

namespace {

using Eigen::Vector3d;

PointPlaneSystem::Moments moments_of(std::span<const Vector3d> points) {
  const double count = static_cast<double>(points.size());
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p;
  const Vector3d centroid = sum / count;
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) {
    const Vector3d d = p - centroid;
    square.noalias() += d * d.transpose();
  }
  square /= count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(square, Eigen::EigenvaluesOnly);
  return {centroid, axes.eigenvalues(), std::sqrt(square.trace())};
}

}  // namespace

PointPlaneSystem::PointPlaneSystem(const PreparedSurface& design, std::span<const Vector3d> plate_points,
                                   std::span<const double> weights)
    : design_(design),
      points_(plate_points),
      weights_(weights),
      moments_(moments_of(plate_points)),
      distances_(plate_points.size()),
      overhangs_(plate_points.size()),
      feet_(plate_points.size()),
      takes_part_(plate_points.size(), 1) {}

PointPlaneSums PointPlaneSystem::pass(const RigidMotion& design_from_plate, double tukey_mm) {
  const PlainMotion motion(design_from_plate);
  const Vector3d centre = motion * moments_.centroid;
  const double per_radius = 1 / moments_.radius;
  const bool by_plan = design_.is_explicit();
  PointPlaneSums sums;
  Pair normal[6][3] = {}, gradient[3] = {};
  double nx = 0, ny = 0, nz = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Vector3d q = motion * points_[i];
    FootPoint foot;
    if (by_plan) {
      const Parameters guess = design_.guess_of(q);
      foot = foot_near(design_, q, guess.u, guess.v, FootAccuracy::by_distance);
    } else if (first_) {
      foot = nearest_foot(design_, q).foot;
    } else {
      foot = foot_near(design_, q, feet_[i].u, feet_[i].v, FootAccuracy::by_distance);
    }
    feet_[i] = {foot.u, foot.v};
    const double d = foot.signed_mm;
    distances_[i] = d;
    overhangs_[i] = foot.overhang_mm;
    if (!takes_part_[i]) continue;
    const double x = foot.normal.x(), y = foot.normal.y(), z = foot.normal.z();
    const double ax = (q.x() - centre.x()) * per_radius, ay = (q.y() - centre.y()) * per_radius,
                 az = (q.z() - centre.z()) * per_radius;
    const double row[6] = {x, y, z, ay * z - az * y, az * x - ax * z, ax * y - ay * x};
    if (!rows_.empty()) rows_[i] = {row[0], row[1], row[2], row[3], row[4], row[5]};
    double w = weights_.empty() ? 1 : weights_[i];
    sums.weight += w;
    ++sums.points;
    if (foot.place != FootPlace::interior) ++sums.beyond_border;
    if (tukey_mm > 0) {
      const double share = w * d * d / (tukey_mm * tukey_mm), left = share < 1 ? 1 - share : 0;
      sums.square += tukey_mm * tukey_mm / 3 * (1 - left * left * left);
      sums.psi_square += w * d * d * left * left * left * left;
      sums.psi_slope += left * (left - 4 * share);
      w *= left * left;
    } else {
      sums.square += w * d * d;
    }
    nx += x, ny += y, nz += z;
    const Pair pairs[3] = {{row[0], row[1]}, {row[2], row[3]}, {row[4], row[5]}};
    for (int k = 0; k < 3; ++k) gradient[k] += (w * d) * pairs[k];
    for (int a = 0; a < 6; ++a) {
      for (int k = a / 2; k < 3; ++k) normal[a][k] += (w * row[a]) * pairs[k];
    }
  }
  first_ = false;
  for (int a = 0; a < 6; ++a) {
    sums.gradient[a] = gradient[a / 2][a % 2];
    for (int b = a; b < 6; ++b) sums.normal(a, b) = sums.normal(b, a) = normal[a][b / 2][b % 2];
  }
  sums.mean_normal = Vector3d(nx, ny, nz).normalized();
  return sums;
}

bool PointPlaneSystem::leave_out_beyond(double overhang_mm) {
  bool changed = false;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::uint8_t inside = overhangs_[i] <= overhang_mm ? 1 : 0;
    changed |= inside != takes_part_[i];
    takes_part_[i] = inside;
  }
  return changed;
}

std::size_t PointPlaneSystem::leave_out_farther(double distance_mm) {
  std::size_t out = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const double w = weights_.empty() ? 1 : weights_[i];
    if (takes_part_[i] && std::sqrt(w) * std::abs(distances_[i]) >= distance_mm) takes_part_[i] = 0, ++out;
  }
  return out;
}

}  // namespace moldloft::geometry
