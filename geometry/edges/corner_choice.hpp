// Which of the corners that a tracker believes to have seen are corners of the plate.
//
// A tracker looks at one field at a time: a notch, a saw tooth of a torn edge or a tack weld looks like a
// corner there. Seen from farther away the boundary goes straight on past a false corner and turns at a true
// one. So each candidate is looked at with the edge points in a ring around it: two branches leave it, each
// is fitted by a line, the lines give the turn and, where they meet, the corner itself. Candidates that come
// to lie together are one.
//
// Frame        plan view, mm
// Work         step() makes one pass: over 4,096 edge points (are they numbers, which lie in the ring) or over the
//              points of one ring, at most 2,048; about ten of them a round, three rounds a candidate
// Allocation   in the constructor only
// Failure      Error::not_four_sided when other than four are left, too_few_points without candidates or edge
//              points, capacity with more candidates than planned, not_finite when one of them is no number
#pragma once

#include "geometry/error.hpp"
#include "geometry/nonblocking.hpp"

#include <Eigen/Core>

#include <array>
#include <expected>
#include <optional>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct CornerChoiceSettings {
  double ring_inner_mm = 20, ring_outer_mm = 110;  // teeth and notches are smaller, sides are longer
  double min_turn = 0.52;                          // rad (30 degrees)
  double merge_mm = 45;                            // corners nearer than this are one
  std::size_t max_candidates = 64;
};

struct CornerLine {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), direction = Eigen::Vector2d::UnitX();
  double rms = 0;
  std::size_t count = 0;
};

class CornerChoice {
 public:
  explicit CornerChoice(const CornerChoiceSettings&);

  // Both spans are the caller's and must stay until the work is done. A `scale` below one looks at smaller rings for
  // sides that the settings' ring goes beyond; it takes smaller teeth for corners.
  void begin(std::span<const Eigen::Vector2d> edges, std::span<const Eigen::Vector2d> candidates,
             double scale = 1) MOLDLOFT_GEOMETRY_NONBLOCKING;
  std::expected<bool, Error> step() MOLDLOFT_GEOMETRY_NONBLOCKING;  // true when the corners are chosen
  // Counter-clockwise; the side from the first to the second is one of the longer pair.
  const std::array<Eigen::Vector2d, 4>& corners() const { return corners_; }
  // How many were left, four or not, and where; counter-clockwise about their middle.
  std::size_t count() const MOLDLOFT_GEOMETRY_NONBLOCKING { return chosen_.size(); }
  const Eigen::Vector2d& corner(std::size_t i) const MOLDLOFT_GEOMETRY_NONBLOCKING {
    return chosen_[i].position;
  }
  std::size_t bytes() const;

 private:
  struct Corner {
    Eigen::Vector2d position;
    double turn = 0, rms_mm = 0;
  };
  enum class Stage : std::uint8_t { check, gather, spread, divide, line_a, line_b, arrange };
  std::span<const Eigen::Vector2d> next_edges();
  void begin_round(const Eigen::Vector2d& about);
  bool gather(std::span<const Eigen::Vector2d> edges);
  void end_gathering();
  void spread();
  void divide();
  bool nearer_a(const Eigen::Vector2d&) const;
  bool meet();
  void end_round(bool is_corner);
  void keep(const Corner&);
  std::expected<void, Error> arrange();

  CornerChoiceSettings settings_;
  double scale_ = 1;
  std::span<const Eigen::Vector2d> edges_, candidates_;
  std::vector<Eigen::Vector2d> ring_;
  std::vector<Corner> chosen_;
  std::array<Eigen::Vector2d, 4> corners_;
  Stage stage_ = Stage::check;
  std::size_t next_ = 0;          // candidate
  int round_ = 0, division_ = 0;  // of the candidate at hand
  std::size_t edge_ = 0;          // the next edge point to look at
  Eigen::Vector2d about_;         // middle of the ring
  Eigen::Vector2d branch_a_, branch_b_;
  std::array<CornerLine, 2> lines_;
  Corner examined_;
};

}  // namespace moldloft::geometry
