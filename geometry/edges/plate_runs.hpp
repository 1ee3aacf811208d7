// Finds the plate in one frame: on every stripe the runs of points that lie on it, and how each run ends.
//
// Along a stripe a run is cut where the surface jumps or the data stop (thesis section 5.3.1: the plate's
// thickness makes an abrupt change of tangent). Runs of neighbouring stripes that continue each other in
// height form a region; the plate is the region that the hint lies on. A drop-out inside the plate is
// bridged, an outlier skipped. At a jump the plate is the nearer (higher) side: a jump upwards is something
// that lies on the plate or hides it, not the plate's edge.
//
// Frame        scanner coordinates (mm): stripes run along +y, follow one another along +x, z
//              towards the scanner
// Accuracy     an edge lies half a point spacing beyond the run's last good point, so without bias; standard
//              deviation 0.29 spacings along the stripe
// Cost         O(points); 50,000 points in 100 stripes take about 0.4 ms (moldloft-bench edges)
// Allocation   in the constructor only
// Failure      Error::not_on_plate when the hint hits nothing, not_finite when the hint is no number,
//              capacity when the frame is larger than planned, sizes_differ when a stripe's columns do
#pragma once

#include "geometry/error.hpp"
#include "geometry/nonblocking.hpp"
#include "geometry/simd.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <expected>
#include <limits>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct StripePiece;  // a stretch of one stripe before stretches are joined
class StripeWalk;

struct StripeView {  // columns of equal length, ordered along +y; NaN where a point is missing
  std::span<const float> x, y, z;
};

enum class RunEnd : std::uint8_t {
  field_limit,   // the stripe itself ends here: the plate goes on, unseen
  step_down,     // the surface drops: the plate's edge
  free_end,      // nothing is measured beyond: the plate's edge, the ground out of range or in the shadow
  hidden,        // the surface rises: something nearer covers what comes; not an edge
  out_of_depth,  // the surface leaves the depths that the scanner measures; not an edge
};

constexpr bool is_edge(RunEnd end) { return end == RunEnd::step_down || end == RunEnd::free_end; }

struct PlateRun {
  std::uint16_t stripe = 0;           // position in the span of stripes given
  std::uint32_t first = 0, last = 0;  // its first and last good point on that stripe, both on the plate
  RunEnd at_first = RunEnd::field_limit, at_last = RunEnd::field_limit;
  // Where it leaves the plate, where the end is an edge (scanner coordinates).
  Eigen::Vector3d edge_first = Eigen::Vector3d::Zero(), edge_last = Eigen::Vector3d::Zero();
};

struct PlateRunSettings {
  double noise_mm = 0.051;        // standard deviation of a point's height
  double min_step_mm = 1.5;       // a drop beyond this is an edge; well below the plate's thickness
  double bridge_mm = 4.0;         // a gap up to this with the same surface on both sides is a drop-out
  double min_run_mm = 3.0;        // shorter runs are outliers
  double field_half_y_mm = 51.0;  // a run that ends within field_margin_mm of it ends at the field's limit
  double field_margin_mm = 1.0;
  // Heights are measured within this, to each side of the field's centre. A run that ends within depth_margin_mm of it,
  // with nothing measured beyond, ends there because of it.
  double depth_mm = std::numeric_limits<double>::infinity();
  double depth_margin_mm = 1.0;
  double hint_reach_mm = 15.0;  // a hint farther than this from every run hits nothing
};

class PlateRunFinder {
 public:
  PlateRunFinder(std::size_t max_stripes, std::size_t max_points, Simd = widest_simd());
  ~PlateRunFinder();
  PlateRunFinder(PlateRunFinder&&) noexcept;

  // The plate's runs, stripe by stripe; valid until the next call. `hint` is a point on or near the plate
  // (scanner coordinates); the region with a run nearest to it is the plate.
  std::expected<std::span<const PlateRun>, Error> find(std::span<const StripeView> stripes,
                                                       const Eigen::Vector3d& hint,
                                                       const PlateRunSettings& settings);

  // The same in bounded pieces: begin(), cut_stripes() until it says true (it looks how far apart the points of at
  // most eight stripes lie, goes at most 192 points along them, 5 us, or makes runs of what it has found there), then
  // find_plate() until it says true (0.2 us a run), plate_runs(). The stripes are the caller's and stay until then.
  std::expected<void, Error> begin(std::span<const StripeView> stripes) MOLDLOFT_GEOMETRY_NONBLOCKING;
  std::expected<bool, Error> cut_stripes(std::size_t at_most,
                                         const PlateRunSettings& settings) MOLDLOFT_GEOMETRY_NONBLOCKING;
  std::expected<bool, Error> find_plate(std::size_t at_most_runs, const Eigen::Vector3d& hint,
                                        const PlateRunSettings& settings) MOLDLOFT_GEOMETRY_NONBLOCKING;
  // How many stripes, from the first, the next cut_stripes() reads: a frame may be cut while it still arrives.
  std::size_t reads_up_to(std::size_t at_most) const MOLDLOFT_GEOMETRY_NONBLOCKING;
  // cut_stripes() walks next, which is the costlier half.
  bool walks() const MOLDLOFT_GEOMETRY_NONBLOCKING { return walking_ || walks_.empty(); }
  bool describes() const MOLDLOFT_GEOMETRY_NONBLOCKING {  // find_plate() has come to the costlier half
    return stage_ == Stage::describe;
  }
  std::span<const PlateRun> plate_runs() const MOLDLOFT_GEOMETRY_NONBLOCKING { return found_; }

  std::size_t bytes() const;

 private:
  std::span<const StripeView> stripes_;  // of the frame at hand
  std::size_t next_stripe_ = 0;
  enum class Stage : std::uint8_t { link, seek_hint, describe };
  Stage stage_ = Stage::link;
  std::uint32_t next_run_ = 0, links_ahead_ = 1, nearest_ = 0;
  double least_ = 0;  // distance of the hint to the nearest run so far
  struct Run;         // a stretch of good points on one stripe, linked into its region

  void begin_walks(std::size_t count, const PlateRunSettings&);
  bool keep_walked(const PlateRunSettings&);
  void join_pieces(const StripeView&, const PlateRunSettings&);
  void drop_short_pieces(const StripeView&, std::size_t min_points, double min_length_mm);
  void trim_ends(const StripeView&, const PlateRunSettings&);
  bool keep_runs(std::uint16_t stripe, const StripeView&, const PlateRunSettings&);
  void link_run(std::uint32_t run, const PlateRunSettings&);
  void flatten_regions();
  void compare_with(const Eigen::Vector3d& hint, std::uint32_t run);
  PlateRun described(std::uint32_t run, const PlateRunSettings&) const;
  std::expected<bool, Error> end_stage();
  std::uint32_t region_of(std::uint32_t run) const;

  std::vector<std::uint32_t> good_;  // indices of good points, stripe after stripe; runs are stretches of it
  std::vector<StripeWalk> walks_;    // of the stripes that are walked in turn, until their runs are made
  bool walking_ = false;             // they have not come to their ends
  std::vector<StripePiece> walked_;  // what they find
  std::size_t kept_ = 0;             // of good_: where what is found begins
  std::vector<StripePiece> pieces_;  // of the stripe at hand
  std::vector<Run> runs_;            // of the whole frame, in order of stripe and y
  std::vector<std::uint32_t> first_run_;  // of every stripe, and one past the end
  std::vector<PlateRun> found_;
  std::size_t max_stripes_, max_points_;
  Simd simd_;
};

}  // namespace moldloft::geometry
