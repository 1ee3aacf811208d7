// The equations of point to surface alignment: every point's signed distance at its true foot, linearized in
// a small rigid motion, and summed to normal equations.
//
// Model        a point q (design frame) moves to c + exp([w]) (q - c) + t; its signed distance changes by
//              n . t + ((q - c) x n) . w, n the surface's normal at the foot: exact to first order, since the
//              foot moves along the surface only. Unknowns y = (t, radius w), all in mm: radius is the
//              points' rms distance from c
// Feet         by foot_near from the plan view's guess, or from the foot before where the surface has no plan
//              view. Beyond the border the surface goes on as its tangent plane there
// Cost         about 0.13 us a point near the surface
// Allocation   feet(), rows() and the like are sized in the constructor; pass() allocates nothing
// Determinism  sums run in the order of the points
#pragma once

#include "geometry/inspection/foot_point.hpp"
#include "geometry/inspection/least_distance.hpp"
#include "geometry/rigid_motion.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace moldloft::geometry {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;

struct PointPlaneSums {
  Matrix6 normal = Matrix6::Zero();      // sum w j j'
  Vector6 gradient = Vector6::Zero();    // sum w j d
  double square = 0;                     // sum w d^2, with a robust scale sum w rho(d)
  double weight = 0;                     // sum w of the points that take part
  double psi_square = 0, psi_slope = 0;  // of the robust influence function, for the covariance
  std::size_t points = 0, beyond_border = 0;
  Eigen::Vector3d mean_normal = Eigen::Vector3d::Zero();
};

class PointPlaneSystem {
 public:
  // The spans must stay alive. `weights` may be empty: all 1.
  PointPlaneSystem(const PreparedSurface& design, std::span<const Eigen::Vector3d> plate_points,
                   std::span<const double> weights);

  struct Moments {  // of the points, plate frame
    Eigen::Vector3d centroid;
    Eigen::Vector3d spread;  // principal mean squares, ascending
    double radius;
  };
  const Moments& moments() const { return moments_; }

  // One pass at a pose. With tukey_mm > 0 every point is weighted by Tukey's biweight of that width.
  PointPlaneSums pass(const RigidMotion& design_from_plate, double tukey_mm = 0);

  std::span<const double> distances() const { return distances_; }  // of the last pass
  std::span<const double> overhangs() const { return overhangs_; }
  std::span<const Parameters> feet() const { return feet_; }
  std::span<const std::array<double, 6>> rows() const { return rows_; }  // j; only after keep_rows()
  void keep_rows() { rows_.resize(points_.size()); }

  // Chooses who takes part in the passes that follow, by the last one. Beyond: all but the points that stand
  // farther beyond the border than this; says whether that changes anything. Farther: without those at which
  // a robust weight of this width is zero; says how many.
  bool leave_out_beyond(double overhang_mm);
  std::size_t leave_out_farther(double distance_mm);
  std::span<const std::uint8_t> taking_part() const { return takes_part_; }

 private:
  const PreparedSurface& design_;
  std::span<const Eigen::Vector3d> points_;
  std::span<const double> weights_;
  Moments moments_;
  std::vector<double> distances_, overhangs_;
  std::vector<Parameters> feet_;
  std::vector<std::uint8_t> takes_part_;
  std::vector<std::array<double, 6>> rows_;
  bool first_ = true;
};

}  // namespace moldloft::geometry
