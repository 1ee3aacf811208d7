// Whether a four-sided outline is what the edge points saw, both ways: every edge point lies on the outline, and every
// part of the outline has edge points near it. What does not is named: what it is, where, how long, how far off.
//
// The outline's own fit cannot say so: it gives no weight to the very points that would speak. Here no point is left
// out. Each point goes to its foot on the outline, and what misses counts as consecutive length along the boundary: a
// torn edge misses in many short places, a cut corner in one long one.
//
// Frame        plan view, mm; the outline counter-clockwise, so that its left is inside
// Cost         of a point 0.3 us; step() does one bounded piece (16 points, or 512 bins of the boundary)
// Allocation   OutlineCheck in its constructor only; check_outline() is for reports and allocates
// Failure      Error::capacity with more points than planned, not_finite, no_extent (a side without length)
#pragma once

#include "geometry/edges/outline.hpp"
#include "geometry/error.hpp"
#include "geometry/nonblocking.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstdint>
#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct OutlineDeviation {
  enum class Kind : std::uint8_t {
    step,            // the edge leaves the side: a notch (inwards), a tongue (outwards), a bend
    corner_cut,      // a straight line where the corner should be
    corner_rounded,  // an arc where the corner should be: radius_mm
    corner_missing,  // neither: a piece is out of the corner, or the corner lies elsewhere
    ragged,          // one step after the other: teeth, scallops, waves
    corner_unseen,   // no edge point near the corner: the sides meet there, whatever the plate does
    unseen,          // no edge point near the outline, and none beside it
    apart,           // edge points beside the outline where others lie on it: a hole, a part on the plate,
                     // shots that disagree
  };
  Kind kind = Kind::step;
  // Where: the corner, the middle of the edge points that miss, or of what nobody saw.
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), to = Eigen::Vector2d::Zero();  // its ends, on the outline
  double length_mm = 0;                    // of the boundary, from `from` counter-clockwise to `to`
  double inwards_mm = 0, outwards_mm = 0;  // the farthest edge points on either side; 0 when there is none
  double leg_before_mm = 0, leg_after_mm = 0;  // corner_*: how much of either side is gone
  double corner_gap_mm = 0;  // corner_*: from where the sides meet to the nearest edge point
  double radius_mm = 0;      // corner_rounded
  std::uint8_t side = 0;     // 0 to 3, or of a corner the side that begins there
  std::uint32_t points = 0;  // edge points that miss
  double distance_mm() const { return inwards_mm > outwards_mm ? inwards_mm : outwards_mm; }
  // Both ways: of the edge points from the outline, and of the outline's corner from them.
  double farthest_mm() const { return corner_gap_mm > distance_mm() ? corner_gap_mm : distance_mm(); }
};

struct OutlineCheckSettings {
  double limit_mm = 0.5;     // an edge point farther from the outline than this misses
  double min_length_mm = 3;  // misses over less than this of the boundary are single false points
  double unseen_mm = 25;     // so much of the boundary may go without edge points
  double corner_gap_mm =
      4.1;               // the edge point nearest to a corner may be so far from it: four stripe pitches
  double tooth_mm = 60;  // steps of a side that follow each other closer than this are one ragged rim
  std::uint32_t min_points = 3;
};

// The limit that the noise of an edge point allows: no less than 0.5 mm, five times the noise where that is more.
double outline_limit_mm(double noise_mm);

class OutlineCheck {
 public:
  static constexpr std::size_t most_deviations = 64;

  explicit OutlineCheck(std::size_t max_points);
  ~OutlineCheck();
  OutlineCheck(OutlineCheck&&) noexcept;

  // Both are the caller's and must stay until the work is done.
  std::expected<void, Error> begin(const Outline&, std::span<const Eigen::Vector2d> edge_points,
                                   const OutlineCheckSettings&) MOLDLOFT_GEOMETRY_NONBLOCKING;
  bool step() MOLDLOFT_GEOMETRY_NONBLOCKING;  // true when all is named
  // Along the boundary from the first corner. Where there are more than most_deviations, the rest is in more().
  std::span<const OutlineDeviation> deviations() const { return {found_.data(), found_count_}; }
  std::size_t more() const { return more_; }
  // Whether the edge point's foot lies in a stretch that misses, or nearer than `margin_mm` to one.
  bool is_in_doubt(std::size_t point, double margin_mm) const MOLDLOFT_GEOMETRY_NONBLOCKING;
  // The longest stretch that missed but was too short to be named, and the longest without edge points: how far a good
  // plate is from being named.
  double longest_miss_mm() const { return longest_miss_mm_; }
  double longest_unseen_mm() const { return longest_unseen_mm_; }
  double widest_corner_gap_mm() const { return *std::ranges::max_element(corner_gap_); }
  std::size_t bytes() const;

 private:
  struct Foot;
  struct Bin;
  struct Run;
  enum class Stage : std::uint8_t { project, walk, gather, name, done };

  Foot foot_of(const Eigen::Vector2d&) const;
  void project_chunk();
  void walk_chunk();
  void end_run(std::size_t end);
  void end_apart(std::size_t end);
  void keep(const Run&);
  void drop_covered();
  void place_runs();
  double unwrapped(std::size_t bin) const;
  void gather_chunk();
  void name_runs();
  OutlineDeviation name_run(const Run&) const;
  bool is_ragged(const Run&) const;
  void describe_corner(const Run&, OutlineDeviation&) const;
  void join_teeth();
  void add_unseen_corners();
  Eigen::Vector2d at_station(double station) const;
  std::size_t bin_of(double station) const;
  std::size_t clean_bin() const;
  int corner_between(double begin, double end) const;

  OutlineCheckSettings settings_;
  const Outline* outline_ = nullptr;
  std::span<const Eigen::Vector2d> points_;
  std::array<double, 4> bulge_{};  // how far each side may leave its chord
  std::array<double, 4> corner_gap_{};
  std::array<double, 5> station_{};  // where each side begins along the boundary; [4] is its length
  double bin_mm_ = 1;
  std::size_t bins_used_ = 0, next_ = 0, first_bin_ = 0;
  std::vector<Foot> feet_;
  std::vector<Bin> bins_;
  std::vector<Run> runs_;
  std::array<OutlineDeviation, most_deviations> found_;
  std::size_t found_count_ = 0, more_ = 0;
  double longest_miss_mm_ = 0, longest_unseen_mm_ = 0;
  std::size_t run_begin_ = 0, apart_begin_ = 0, apart_last_ = 0;
  bool in_run_ = false, in_apart_ = false;
  Stage stage_ = Stage::done;
};

// The same at once, for reports and stored runs.
std::expected<std::vector<OutlineDeviation>, Error> check_outline(
    const Outline&, std::span<const Eigen::Vector2d> edge_points, const OutlineCheckSettings& = {});

}  // namespace moldloft::geometry
