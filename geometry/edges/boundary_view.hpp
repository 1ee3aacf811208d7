// What one shot shows of the plate's boundary: its edge points in order, counter-clockwise about the plate
// (the plate on the left), cut into pieces where the boundary runs out of the field, and what each piece is:
// a side or a corner.
//
// A region's boundary goes along the lower ends of its runs with the stripes ascending and back along the
// upper ends. Where the region begins or ends with a stripe inside the field, the boundary lies hidden
// between two parallel stripes (thesis section 5.3.2); the piece is then marked as hidden there and the
// scanner has to be turned.
//
// Frame        as the edge points are given: scanner coordinates, plan view decides
// Cost         O(edge points), plus a split search of O(n log n) for corners
// Allocation   in the constructor only
// Failure      none: runs whose ends are no finite numbers are left out, and where nothing is seen the
//              view is empty
#pragma once

#include "geometry/edges/plate_runs.hpp"
#include "geometry/nonblocking.hpp"

#include <Eigen/Core>

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct EdgePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::uint16_t stripe = 0;
};

struct BoundaryPiece {
  enum class Kind { side, corner };
  std::uint32_t first = 0, count = 0;  // its points in BoundaryView::points, counter-clockwise
  Kind kind = Kind::side;
  // Direction of travel (unit, plan view) at both ends, from robust local lines.
  Eigen::Vector2d tangent_first = Eigen::Vector2d::Zero(), tangent_last = Eigen::Vector2d::Zero();
  double turn = 0;  // rad from tangent_first to tangent_last; positive is a convex corner
  // Kind::corner: where the lines of both sides meet, extrapolated if need be.
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
  std::uint32_t points_before = 0;  // Kind::corner: points on the first side, the rest lie on the second
  bool goes_on = false;             // the piece whose first point follows its last is the boundary's next
  bool hidden_first = false, hidden_last = false;  // the boundary goes on unseen between stripes at this end
  double rms_mm = 0;                               // residual about the one line or the two
};

struct BoundaryViewSettings {
  double min_corner_turn = 0.26;      // rad (15 degrees): less is a side that bends
  double max_line_rms_mm = 0.25;      // a side straighter than this needs no corner
  std::uint32_t min_side_points = 4;  // fewer points on a side of a corner do not give it a tangent
  double stripe_pitch_mm = 1.03;      // for telling a hidden boundary from a step to the next stripe
  double field_half_x_mm = 51.0, field_half_y_mm = 51.0, field_margin_mm = 1.0;
};

class BoundaryViewer {
 public:
  explicit BoundaryViewer(std::size_t max_runs);
  ~BoundaryViewer();
  BoundaryViewer(BoundaryViewer&&) noexcept;

  struct View {
    std::span<const EdgePoint> points;
    std::span<const BoundaryPiece> pieces;  // longest first; empty when no edge is in the field
    bool plate_fills_field = false;  // no edge at all, and every stripe lies on the plate from end to end
    // Where the region ends inside the field with a long stripe, the boundary runs unseen between this x
    // and the next stripe: the plate ends within half a pitch of the value, seen even where no stripe shows
    // an edge point.
    std::optional<double> hidden_low_x_mm, hidden_high_x_mm;
  };
  View look(std::span<const PlateRun> runs, std::size_t stripe_count,
            const BoundaryViewSettings&) MOLDLOFT_GEOMETRY_NONBLOCKING;  // valid until the next call

  // The same in bounded pieces: begin(), step() until it says true, view(). A step goes over one piece of
  // the boundary once.
  void begin(std::span<const PlateRun> runs, std::size_t stripe_count,
             const BoundaryViewSettings&) MOLDLOFT_GEOMETRY_NONBLOCKING;
  bool step() MOLDLOFT_GEOMETRY_NONBLOCKING;
  const View& view() const MOLDLOFT_GEOMETRY_NONBLOCKING { return view_; }

  std::size_t bytes() const;

 private:
  struct Ends;   // one stripe's lower and upper end
  struct Break;  // a place in the ring of edge points where the boundary leaves the field or hides

  // A stretch of the ring's points between two breaks: where it begins, its corners, where it ends.
  struct Cuts {
    static constexpr std::size_t max_corners = 8;  // a plate has four
    std::array<std::size_t, max_corners + 2> at{};
    std::size_t count = 2;
  };
  enum class Stage : std::uint8_t { take, drop, find_corners, trim_last, trim_first, describe, done };

  void collect_ends(std::span<const PlateRun> runs);
  void walk_ring(View&, std::size_t stripe_count, const BoundaryViewSettings&);
  void open_ring();
  void take_stretch();
  bool drop_false_points();
  bool find_corners();
  bool trim_last(std::span<const EdgePoint> all, Cuts&) const;
  bool trim_first(std::span<const EdgePoint> all, Cuts&) const;
  void describe(const Cuts&, bool hidden_first, bool hidden_last, const BoundaryViewSettings&);
  void finish();
  void describe_side(std::size_t begin, std::size_t end, BoundaryPiece, const BoundaryViewSettings&);
  void describe_corner(std::size_t begin, std::size_t split, std::size_t end, BoundaryPiece,
                       const BoundaryViewSettings&);

  std::vector<Ends> ends_;
  std::vector<EdgePoint> ring_, points_;
  std::vector<Break> breaks_;
  std::vector<BoundaryPiece> pieces_;
  BoundaryViewSettings settings_;
  View view_;
  std::size_t stripe_count_ = 0, ring_start_ = 0, next_break_ = 0;
  std::size_t stretch_begin_ = 0;
  // How far a pass over the stretch has come: dropping, and the search for corners.
  static constexpr std::size_t drop_lag =
      6;  // a point may be overwritten once no later point is judged by it
  std::array<bool, drop_lag> verdicts_{};
  std::size_t drop_at_ = 0, drop_kept_ = 0, cut_ = 0;
  int drops_done_ = 0, cut_passes_ = 0;
  bool hidden_first_ = false, hidden_last_ = false;
  Cuts cuts_;
  Stage stage_ = Stage::done;
};

}  // namespace moldloft::geometry
