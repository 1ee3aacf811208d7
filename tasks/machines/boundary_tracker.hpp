// The boundary tracker: from the edges that one shot shows to the next place to shoot from, once round the
// plate, counter-clockwise (thesis section 5.3.2).
//
//   seek_edge    from a start pose inside the plate along world +x until an edge shows
//   first_side   the field is centred on that edge: the outline begins here
//   track        each shot shows a piece of the boundary; the next one is centred ahead of where it left the field
//   turn_head    the boundary hides between parallel stripes: the same place again with the stripes turned
//   step_back    nothing of the boundary was seen: back towards where it last was
//
// Frame        world, plan view, mm; the scanner is level, so a turn about z is all that matters
// Allocation   in the constructor only; the memory for edge points is part of the memory plan
// Failure      TrackState::failed with a message that says what was seen and what to do
#pragma once

#include "geometry/edges/boundary_view.hpp"
#include "geometry/rigid_motion.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/base/transition.hpp"
#include "tasks/machines/loop_closure.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace moldloft::tasks {

// A place to shoot from: the centre of the field of view and the turn of the scanner about world z. Stripes run along
// the scanner's y axis, so at head_yaw + 90 degrees in world.
struct ShotPlace {
  Eigen::Vector3d centre{0, 0, 0};
  double head_yaw = 0;
};

enum class TrackState : std::uint8_t { seek_edge, first_side, track, turn_head, step_back, closed, failed };
constexpr int track_state_count = 7;

enum class TrackEvent : std::uint8_t {
  no_plate,           // the hint hit nothing
  plate_fills_field,  // plate, but no edge
  side,
  corner,         // the piece that is being followed, and how it ends: at the field's limit
  hidden,         // ... or hidden between stripes
  loop_closed,    // the piece passes where the outline began
  passes_beside,  // it passes there, but millimetres beside
  hole_closed,    // it does, but round a hole
  beyond_plan,    // no room is left for the edge points that it shows, or for another shot
};
constexpr int track_event_count = 9;

enum class TrackAction : std::uint8_t {
  none,
  step_along_x,
  step_half_along_x,
  change_height,
  centre_on_edge,
  begin_outline,
  look_past_hole,
  leave_hole,
  begin_again,
  advance,
  turn,
  back_up,
  finish,
  report_off_plate,
  report_no_edge,
  report_lost,
  report_hidden,
  report_too_large,
  report_open,
};

struct TrackContext {
  int seek_steps = 0, half_steps = 0, turns = 0, backs = 0, heights = 0;
  int max_seek_steps = 0, max_half_steps = 0, max_turns = 0, max_backs = 0, max_heights = 0;
  int rounds = 0;           // gone beside the beginning
  bool is_far_off = false;  // so far beside that the beginning was no edge of the plate
};

using TrackTransition = hal::Transition<TrackState, TrackEvent, TrackAction, TrackContext>;
std::span<const TrackTransition> track_transitions() MOLDLOFT_NONBLOCKING;
std::span<const hal::Ignored<TrackState, TrackEvent>> track_ignored();
std::string_view to_string(TrackState) MOLDLOFT_NONBLOCKING;
std::string_view to_string(TrackEvent) MOLDLOFT_NONBLOCKING;
std::string_view to_string(TrackAction) MOLDLOFT_NONBLOCKING;

struct TrackerSettings {
  double field_half_x_mm = 51, field_half_y_mm = 51;
  double overlap_mm = 15;  // of the boundary piece that the next shot sees again
  double crossing =
      0.785;  // rad: stripes cross the boundary at 45 degrees, so that a square corner shows both sides
  double min_crossing = 0.44;  // rad: below 25 degrees edge points become rare, the head is turned
  double seek_step_mm = 70;
  double close_mm = 8;           // the loop is closed where a piece passes this near to its beginning
  double corner_merge_mm = 20;   // corners nearer than this are one, seen twice
  double progress_mm = 3;        // a shot that leads on by less shows nothing new
  std::size_t max_corners = 64;  // of more, the sharpest are kept
  // The field's centre stays between these; a plate that is not seen at one height is sought a storey higher or lower.
  double lowest_z_mm = -std::numeric_limits<double>::infinity();
  double highest_z_mm = std::numeric_limits<double>::infinity();
  double storey_mm = 96;
  int max_heights = 5;  // besides the start's
  int max_half_steps = 2;
  int max_seek_steps = 60, max_turns = 3, max_backs = 2, max_shots = 96;
  std::size_t max_edge_points = 24000;
};

class BoundaryTracker {
 public:
  explicit BoundaryTracker(const TrackerSettings&);

  void begin(const ShotPlace& start) MOLDLOFT_NONBLOCKING;

  struct Seen {
    geometry::RigidMotion world_from_scanner;
    bool plate_found = false;
    double plate_z_mm = 0;                // mean height of the plate in this shot, world
    geometry::BoundaryViewer::View view;  // scanner coordinates
  };
  struct Step {
    TrackEvent event{};
    TrackAction action{};
    TrackState from{}, to{};
    std::optional<ShotPlace> next;  // nothing when closed or failed
    hal::Message text;              // failed: what was seen, what to do
  };
  Step take(const Seen&) MOLDLOFT_NONBLOCKING;

  TrackState state() const { return state_; }
  // A point on the plate near the field that has just been ordered: the hint for finding the plate there (world).
  Eigen::Vector3d plate_hint() const { return hint_; }
  std::span<const Eigen::Vector2d> edge_points() const { return edges_; }
  std::span<const Eigen::Vector2d> corners() const { return corners_; }  // counter-clockwise, merged
  std::size_t bytes() const;

 private:
  // What is being followed, in world coordinates: the piece that passes nearest, and those that go on from it.
  struct Course {
    static constexpr std::size_t most_pieces = 9;
    std::array<const geometry::BoundaryPiece*, most_pieces> pieces{};
    std::size_t count = 0;
    Eigen::Vector3d nearest, exit;
    Eigen::Vector2d tangent_first;
    std::uint32_t nearest_index = 0;
    Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();  // world from scanner, plan view
    Eigen::Vector2d offset{0, 0};
    LoopClosure loop;  // after it
    double farthest_x_mm = 0;

    std::span<const geometry::BoundaryPiece* const> all() const { return {pieces.data(), count}; }
    bool has_corner() const MOLDLOFT_NONBLOCKING;
    Eigen::Vector2d heading_at_nearest() const MOLDLOFT_NONBLOCKING;
    bool hides() const { return pieces[count - 1]->hidden_last; }
  };
  TrackEvent observe(const Seen&, Course&);
  TrackEvent observe_plate(const Seen&, Course&);
  Course follow(const Seen&, const Eigen::Vector2d& from) const;
  void end_at_last_piece(const Seen&, Course&) const;
  std::optional<TrackEvent> come_round(const Seen&, Course&);
  Eigen::Vector2d point_on_plate(const Course&) const;
  void remember_edges(const Seen&);
  void remember_corners(const Course&);
  void remember_corner(const Eigen::Vector2d&, double turn);
  void move_front(const Course&);
  ShotPlace seek_on(TrackAction);
  Eigen::Vector3d corner_of_field_along_x() const;
  ShotPlace carry_out(TrackAction, const Course&);
  ShotPlace ahead() const;
  double healthy_yaw(double yaw) const;
  double yaw_crossing_both(double heading, double stripe) const;
  hal::Message explain(TrackAction) const;
  int heights_within_limits() const;
  double height_to_try(int count) const;

  TrackerSettings settings_;
  TrackState state_ = TrackState::seek_edge;
  TrackContext counts_;
  int shots_ = 0;
  ShotPlace start_;
  ShotPlace place_;  // of the shot that take() is about to look at
  Eigen::Vector3d front_{0, 0, 0}, hint_{0, 0, 0};
  Eigen::Vector2d heading_{1, 0};
  LoopClosure loop_;
  std::optional<Eigen::Vector2d> filled_;  // the last field that the plate filled
  double farthest_x_mm_ = 0;               // of the boundary since it began
  double plate_z_mm_ = 0;
  std::vector<Eigen::Vector2d> edges_, corners_;
  std::vector<double> corner_turns_;
};

}  // namespace moldloft::tasks
