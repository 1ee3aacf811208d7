// From edge points and what a tracker took for corners to a four-sided outline that is what the edge points saw, or to
// the word why there is none.
//
// Corners are chosen with large rings first, which look past teeth and notches; a plate with a side shorter than the
// ring is looked at with smaller ones. The first outline that all edge points lie on is the plate's. Where points miss
// (OutlineCheck), the sides are fitted again without them, so that a rounded corner or a notch bends no side: first to
// the points that agree on one parabola a side, then to all but those that the last outline missed. The outline that
// misses least is taken with its deviations named, unless they are too large to trust it.
//
// Frame        plan view, mm
// Work         step() does one bounded piece, as those of CornerChoice, OutlineBuilder and OutlineCheck
// Allocation   in the constructor only
// Failure      Error::not_four_sided: corners() and worst() say what was found instead; otherwise as CornerChoice and
//              OutlineBuilder have it
#pragma once

#include "geometry/edges/corner_choice.hpp"
#include "geometry/edges/outline.hpp"
#include "geometry/edges/outline_check.hpp"
#include "geometry/error.hpp"
#include "geometry/nonblocking.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct OutlineSearchSettings {
  OutlineCheckSettings check;
  double hold_mm = 15;          // an edge farther than this from the outline is another outline's
  double hold_unseen_mm = 100;  // so much of the boundary in one place may not go unseen
};

class OutlineSearch {
 public:
  static constexpr std::size_t most_corners = 12;

  OutlineSearch(std::size_t max_points, const CornerChoiceSettings&, const OutlineSettings&,
                const OutlineSearchSettings&);

  // Both spans are the caller's and must stay until the work is done.
  void begin(std::span<const Eigen::Vector2d> edges,
             std::span<const Eigen::Vector2d> candidates) MOLDLOFT_GEOMETRY_NONBLOCKING;
  std::expected<bool, Error> step() MOLDLOFT_GEOMETRY_NONBLOCKING;  // true when the outline is there
  const Outline& outline() const { return best_; }
  // Where the outline is not what the edge points saw, along the boundary; none on a good plate.
  std::span<const OutlineDeviation> deviations() const { return {named_.data(), named_count_}; }

  // ---- after not_four_sided: the corners between which the edge points lie on straight lines best,
  // counter-clockwise about their middle, and how much of the edge does (0 to 1).
  std::span<const Eigen::Vector2d> corners() const { return {corners_.data(), corner_count_}; }
  std::span<const Eigen::Vector2d> candidates() const {
    return candidates_;
  }  // as they were given to begin()
  double share_along() const { return share_along_; }
  // Of the best four-sided outline, what is farthest off; nullptr when there is none.
  const OutlineDeviation* worst() const MOLDLOFT_GEOMETRY_NONBLOCKING;
  std::size_t bytes() const;

 private:
  enum class Stage : std::uint8_t { choose, compare, build, check, sample, agree, leave_out, done };
  static constexpr std::size_t side_samples = 256;
  // Of the points that lie along the chord of two corners: where along it and how far beside it, and the parabola that
  // most of them agree on.
  struct ChordSide {
    Eigen::Vector2d start = Eigen::Vector2d::Zero(), along = Eigen::Vector2d::UnitX();
    double length = 1;
    std::array<Eigen::Vector2d, side_samples> samples;
    std::size_t count = 0, agreed = 0;
    Eigen::Vector3d parabola = Eigen::Vector3d::Zero();
    Eigen::Vector2d at(const Eigen::Vector2d& p) const;  // x: share of the length, y: mm to the left
    double off_parabola(const Eigen::Vector2d& share_and_offset) const;
  };

  void begin_scale();
  void begin_sampling();
  bool sample_chunk();
  bool agree_some();
  void try_parabola(ChordSide&);
  int side_along(const Eigen::Vector2d&) const;
  bool is_left_out(std::size_t point) const;
  void choose_done();
  bool compare_chunk();
  bool lies_along(const Eigen::Vector2d&) const;
  std::expected<bool, Error> check_done();
  std::expected<bool, Error> next_scale();
  void next_attempt();
  void repair();
  bool is_torn_all_round() const;
  bool is_trusted() const;
  bool has_fewer_corners() const;
  double weight_of(const OutlineDeviation&) const;

  OutlineSearchSettings settings_;
  CornerChoice choice_;
  OutlineBuilder builder_;
  OutlineCheck check_;
  std::span<const Eigen::Vector2d> edges_, candidates_;
  std::vector<std::uint8_t> left_out_;
  Outline best_;
  std::array<OutlineDeviation, OutlineCheck::most_deviations> named_;
  std::size_t named_count_ = 0;
  bool has_outline_ = false;
  bool is_torn_ = false;
  std::array<Eigen::Vector2d, most_corners> corners_, polygon_;
  std::size_t corner_count_ = 0, polygon_count_ = 0, next_ = 0, along_ = 0;
  double share_along_ = 0;
  int scale_ = 0, attempt_ = 0, trial_ = 0;
  std::uint32_t draw_ = 1;
  std::array<ChordSide, 4> sides_;
  Stage stage_ = Stage::done;
};

}  // namespace moldloft::geometry
