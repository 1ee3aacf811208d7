// Localization: the rigid motion that lays measured points on a design surface, how well it is determined,
// and on request with all of the plate on one side.
//
// Problem      min sum w_i d_i^2 over design_from_plate, d_i the signed distance of point i to its true foot
//              (thesis 6.4; sign as in foot_point.hpp). One-sided: the same with every d_i >= -tolerance
//              (above) or <= tolerance (below): what a forming or machining allowance asks for
// Method       Gauss-Newton on point-to-plane equations at true feet, undamped; a step after which the sum is
//              larger is taken back and damped (Levenberg-Marquardt). One-sided: from there, a sequence of
//              least distance programs on the linearized constraints (least_distance.hpp). Robust: reweighted from
//              the second pass on, and before the end a search for a pose that half of the points agree on
// Outliers     a robust fit bears 30 % of the points, one-sided, scattered or all in one corner, from starts 17
//              degrees and 27 mm off; from 40 degrees and 60 mm 30 % scattered or 10 % together. Where it cannot
//              tell, it does not converge; only a third that stands together within some 20 sigma of the plate can
//              bend the pose unseen
// Frame        points in the plate's frame, the motion to the design's; mm, rad
// Covariance   of the small motion (t, w) after the result, q -> c + exp([w])(q - c) + t, c the points'
//              centroid in the design frame: t in mm first, then w in rad, about the design's axes. sigma^2
//              (J' W J)^-1, for a robust fit with Huber's factor for the biweight. Fixed directions have
//              zero rows. Of a one-sided result: of the free fit's equations at that place, without regard
//              to the contacts
// Accuracy     stops when a step moves the points by less than `settled_mm` (rms); one-sided results break
//              their bound by less than 1e-9 mm
// Cost         0.13 us a point and iteration; 3 to 8 iterations, robust 12 to 25
// Allocation   34 bytes a point, one-sided 90
// Failure      Flaw names the error and, for not_finite and negative weights, the point:
//              too_few_points (fewer than 6, or than 3 free directions ask for, also once points beyond the
//              border and outliers are left out), not_finite, too_large, negative_weight, sizes_differ, collinear,
//              undetermined_pose (a plane lets points slide: fix those directions), no_feasible_pose,
//              not_converged, impossible_setting (a negative tolerance, a start that is no rigid motion)
#pragma once

#include "geometry/error.hpp"
#include "geometry/inspection/point_plane_system.hpp"
#include "geometry/inspection/prepared_surface.hpp"

#include <array>
#include <cstddef>
#include <expected>
#include <span>

namespace moldloft::geometry {

enum class AllowedSide { both, above, below };  // of the surface's normal

struct LocalizationSettings {
  RigidMotion start = RigidMotion::Identity();  // a first design_from_plate; 40 degrees and 60 mm off will do
  std::span<const double> weights;  // empty: all 1. In units of 1 / variance if they are to mean that
  // Directions in which the pose stays where the start has it: shifts along and small turns about
  // the design's axes.
  std::array<bool, 6> fixed{};
  bool robust = false;  // Tukey's biweight at 4.685 times the spread of the residuals (from their median)
  AllowedSide side = AllowedSide::both;
  double tolerance_mm = 0;  // by how much one-sided points may be on the other side
  // A point that stands farther beyond the design's border than this is left out in the end: it has
  // no partner there.
  double border_tolerance_mm = 0.5;
  double sigma_mm = 0;  // noise of a point of weight 1; 0: from the residuals
  double settled_mm = 1e-6;
  int most_iterations = 60;
};

enum class MotionKind {
  slide,
  spin,
  lift,
  tilt
};  // in the mean tangent plane, about its normal, along it, out of it

// A direction of the small motion that is independent of the others, by how well it is determined.
struct PoseDirection {
  MotionKind kind = MotionKind::slide;  // what most of it is
  Vector6 motion = Vector6::Zero();     // (t, w) of one standard deviation, mm and rad
  double sigma_mm = 0;                  // rms way of the points under it
  bool weak = false;                    // more than 5 times as uncertain as the best one
};

struct Contact {
  std::size_t point = 0;
  Parameters foot;
  double share = 0;  // of the force that holds the plate on its side; all shares sum to 1
};

struct Localization {
  RigidMotion design_from_plate = RigidMotion::Identity();
  int iterations = 0;  // passes over the points
  double rms_mm = 0;   // weighted, of the points that take part
  double sigma_mm = 0;
  std::size_t points = 0, beyond_border = 0, outliers = 0;  // taking part; left out for either reason
  Eigen::Vector3d centroid;                                 // of all points, design frame
  Matrix6 covariance = Matrix6::Zero();
  std::array<PoseDirection, 6> directions{};  // least determined first
  int direction_count = 0;                    // 6 less the fixed ones
  std::array<Contact, 6> contacts{};
  int contact_count = 0;
};

std::expected<Localization, Flaw> localize(const PreparedSurface& design,
                                           std::span<const Eigen::Vector3d> plate_points,
                                           const LocalizationSettings& settings = {});

}  // namespace moldloft::geometry
