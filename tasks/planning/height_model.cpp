#include "tasks/planning/height_model.hpp"

#include <Eigen/Cholesky>

// Fixed-size Eigen throughout: constants that it keeps in local statics, and function pointers in its reductions, hide
// from the compiler that nothing here waits or allocates.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::tasks {
namespace {

constexpr double length_scale_mm = 100;  // brings the monomials to one size
// Curvature that the points do not show is taken as none: a ridge on the second-order terms, weak against a handful of
// points that do show it.
constexpr double ridge = 1e-3;

}  // namespace

HeightModel::Row HeightModel::row(double x_mm, double y_mm) const {
  const double x = (x_mm - origin_.x()) / length_scale_mm, y = (y_mm - origin_.y()) / length_scale_mm;
  Row r;
  r << 1, x, y, x * x, x * y, y * y;
  return r;
}

void HeightModel::add(const Eigen::Vector3d& p) {
  if (count_++ == 0) origin_ = p;
  const Row r = row(p.x(), p.y());
  normal_ += r * r.transpose();
  right_ += r * (p.z() - origin_.z());
}

void HeightModel::solve() {
  if (count_ == 0) return;
  Eigen::Matrix<double, 6, 6> a = normal_ / static_cast<double>(count_);
  a.diagonal() += Row{1e-12, ridge * 1e-3, ridge * 1e-3, ridge, ridge, ridge};
  coefficients_ = a.ldlt().solve(right_ / static_cast<double>(count_));
}

double HeightModel::at(double x_mm, double y_mm) const {
  return count_ == 0 ? 0.0 : origin_.z() + row(x_mm, y_mm).dot(coefficients_);
}

}  // namespace moldloft::tasks
