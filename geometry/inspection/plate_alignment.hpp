// Alignment of a whole plate with its design: surface and outline together, from any start.
//
// Problem      min mean(d_i^2) + mean(e_k^2) over design_from_plate: d_i the signed distance of surface point i to its
//              foot, e_k the distance of edge point k to the design's border, across it in the tangent plane. The
//              surface alone lets a sheet slide in its own plane; the outline does not
// Method       Gauss-Newton on both, damped when the sum grows (Levenberg-Marquardt). Robust: Tukey's biweight at 4.685
//              times the spread, of either kind by itself, with the spread from the median
// Start        within some 20 degrees and a tenth of the plate: alignment_starts.hpp finds such
// Frame        the plate's, and the motion to the design's; mm, rad
// Covariance   of the small motion (t, w) after the result, q -> c + exp([w])(q - c) + t about the points' centroid c,
//              design frame: t in mm first, then w in rad. Points of one group (an exposure) err together by
//              group_sigma_mm, edges by edge_sigma_mm, so thousands of points do not make a pose a thousand times
//              surer than ten exposures do
// Undetermined a direction in which neither surface nor outline changes is not followed: the pose stays where the start
//              has it, and the result names it
// Cost         0.3 us a point and iteration; 5 to 20 iterations
// Allocation   yes
// Failure      too_few_points (fewer than 6, or all beyond the border), not_finite, sizes_differ, not_converged
#pragma once

#include "geometry/error.hpp"
#include "geometry/inspection/design_faces.hpp"
#include "geometry/inspection/point_plane_system.hpp"
#include "geometry/rigid_motion.hpp"

#include <cstdint>
#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct PlateToAlign {
  std::span<const Eigen::Vector3d> points;      // of its surface, evenly spread
  std::span<const Eigen::Vector3d> edges;       // of its outline, evenly spread; may be empty
  std::span<const std::uint16_t> point_groups;  // of every point or edge; empty: each errs for itself
  std::span<const std::uint16_t> edge_groups;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // the side that was measured
};

struct PlateAlignmentSettings {
  RigidMotion start = RigidMotion::Identity();
  bool robust = false;
  bool with_border = true;
  bool points_belong =
      false;  // every point has a partner on the design: one beyond the border is drawn back to it
  double border_tolerance_mm = 0.5;  // points farther beyond the design's border have no partner there
  double point_sigma_mm = 0.05, group_sigma_mm = 0.013, edge_sigma_mm = 0.05;
  int most_iterations = 80;
};

struct PlateAlignment {
  RigidMotion design_from_plate = RigidMotion::Identity();
  double rms_mm = 0, border_rms_mm = 0;  // of the points and edges that take part
  std::size_t points = 0, outliers = 0, beyond_border = 0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Matrix6 covariance = Matrix6::Zero();
  std::vector<Vector6> undetermined;  // unit directions, (t, radius w) in mm
  double radius_mm = 0;
  int iterations = 0;
};

std::expected<PlateAlignment, Flaw> align(const DesignFaces&, const PlateToAlign&,
                                          const PlateAlignmentSettings& = {});

// The motion that lays the first points on the second ones with the least sum of squares (Kabsch 1976). Failure:
// too_few_points (fewer than three), collinear, sizes_differ, not_finite.
std::expected<RigidMotion, Error> motion_between(std::span<const Eigen::Vector3d> from,
                                                 std::span<const Eigen::Vector3d> to);

}  // namespace moldloft::geometry
