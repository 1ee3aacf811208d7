// Stripes of consecutive shots joined into lines that run across the whole plate, for lofting (thesis section
// 5.3.4: "choose two stripes in the two consecutive shots which give the minimum distance and connect them").
//
// From shot to shot the nearest pair of a line and a stripe is joined, then the nearest of those that are
// left, and so on. A distance is that from the line's end to the stripe, seen as a chain of chords, so that
// shots may overlap: what a stripe has before the place nearest to the line's end is dropped. The direction
// in which a stripe was recorded does not matter. What a joint costs in smoothness is told with it; the
// thesis found that joints kink, and that is why lofting also approximates.
//
// Units        millimetres, radians; world coordinates
// Cost         every point of a shot is visited once for each line: lines * points a shot
// Allocation   what is returned, and a table of lines * stripes
// Failure      too_few_points (no shot, a shot without stripes, a stripe of fewer than 2 points), not_finite,
//              repeated_points, with the stripe, counted through all shots. Stripes that find no partner are no
//              error: left_over counts them.
#pragma once

#include "geometry/error.hpp"

#include <Eigen/Geometry>

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

using Stripe = std::vector<Eigen::Vector3d>;  // points in order along the laser line
using StripesOfShot = std::vector<Stripe>;

struct JoinSettings {
  double most_gap_mm = 5;   // farther apart, two stripes are not the same line
  int tangent_points = 10;  // how many points at a joint decide its two tangents (noise bends single chords)
};

struct StripeJoint {
  int shot = 0;              // between this shot and the next
  int stripe = 0, next = 0;  // their numbers in these
  double gap_mm = 0;         // from the end of the one to the nearest place of the other
  double step_mm = 0;        // the part of it across the line
  double kink_rad = 0;       // between the tangents on either side
  int dropped_points = 0;    // of the next stripe, since shots overlap
};

struct JoinedLine {
  std::vector<Eigen::Vector3d> points;
  std::vector<StripeJoint> joints;  // one fewer than shots
};

struct JoinedStripes {
  std::vector<JoinedLine>
      lines;          // those that run through all shots, in the order of the first shot's stripes
  int left_over = 0;  // stripes that are part of none
};

std::expected<JoinedStripes, Flaw> join_stripes(std::span<const StripesOfShot> shots,
                                                const JoinSettings& settings = {});

}  // namespace moldloft::geometry
