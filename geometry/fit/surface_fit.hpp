// The streaming surface fit: points are folded into Bernstein moments cell by cell and forgotten; nets of 2^k
// by 2^l spans come out of the same pass; generalized cross-validation picks one.
//
// Model        z(u, v) = sum N_i(u) M_j(v) z_ij + d_s, with d_s the unknown height error of shot s (robot
//              repeatability), a zero-mean random effect with standard deviation shot_sigma_mm:
//              overlapping shots and neighbours estimate it together with the surface. (u, v) are
//              plan-view parameters (plan_map.hpp)
// Moments      per cell 7 x 7 of B6 B6 and 4 x 4 of z B3 B3 (cell_moments.hpp), per shot 4 x 4 of B3 B3
// Fairing      a thin-plate term, tiny relative to the data, so that cells without points stay defined
// Frame        world, mm
// Work         add() costs O(points) and is called with bounded chunks; step() does one bounded piece
//              of the solution
// Memory       fixed by the settings, never by the number of points; all of it allocated in the constructor, and what a
//              plate's net does not need is not touched
// Failure      Error::capacity, singular, not_finite, too_few_points
#pragma once

#include "geometry/error.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/nonblocking.hpp"
#include "geometry/splines/bspline.hpp"

#include <cstdint>
#include <expected>
#include <memory>
#include <span>

namespace moldloft::geometry {

// Spans a side of the finest net that a length of span may ask for.
constexpr int fewest_finest_spans = 8, most_finest_spans = 256;

struct SurfaceFitSettings {
  // The finest net that there is room for: powers of two, at least 4. Either may be that of a plate's longer side.
  int max_spans_u = 32, max_spans_v = 32;
  // Of the finest net over a plate: powers of two, their spans nearest to this (by ratio), as far as there is room, but
  // 8 at least. 0: always the finest that there is room for.
  double finest_span_mm = 0;
  int max_shots = 64;
  double shot_sigma_mm = 0.013;  // 0: shots are taken as exact
  // The coarsest net is taken that misses no more than this (rms) of what the best net explains. Errors of
  // pose in the plane look like steps of height where the plate slopes; below a few micrometres a finer
  // net follows those.
  double tolerance_mm = 0.005;
  double noise_mm = 0;    // of a point of weight 1; 0: estimated from the finest net's residual
  double fairing = 1e-5;  // relative to the data: the ratio of the matrices' traces
};

struct SurfaceFitReport {
  std::uint64_t points_used = 0, points_off = 0;  // folded in; outside the outline or rejected
  int spans_u = 0, spans_v = 0;
  int finest_spans_u = 0, finest_spans_v = 0;  // of the finest net that was tried
  double rms_residual_mm = 0;                  // weighted, of the chosen net, computed from the moments
  double sigma_mm = 0;                         // noise of one point: residual over the degrees of freedom
  double smallest_pivot = 0;  // relative to the largest: small means a badly determined control point
  int empty_cells = 0;        // of the chosen net
  std::array<double, 4> corner_sigma_mm{};  // of the height at the outline's corners, from the points' noise
  double shot_offset_rms_mm = 0, shot_offset_max_mm = 0;
  int shots_without_offset = 0;  // taken as exact, since the memory plan had no room for their moments
};

class SurfaceFit {
 public:
  // What a step of the solution may cost in multiply-adds, as long as no net has more than 100 spans on its shorter
  // side: 6 us with AVX-512, 200 us on a processor of 500 million instructions a second.
  static constexpr double work_a_step = 62'000;

  explicit SurfaceFit(const SurfaceFitSettings&);
  ~SurfaceFit();

  void begin(const PlanMap& map)
      MOLDLOFT_GEOMETRY_NONBLOCKING;  // forgets everything; the map must stay alive
  // The same in bounded pieces: points may be added once clear_some() has said true.
  void begin_clearing(const PlanMap& map) MOLDLOFT_GEOMETRY_NONBLOCKING;
  bool clear_some() MOLDLOFT_GEOMETRY_NONBLOCKING;
  // Folds points of one shot in. `shot` counts from 0; all points of one shot must be added before another
  // shot begins. Points off the plate are counted and left out. Wholly bounded by the size of the chunk.
  std::expected<void, Error> add(std::span<const Eigen::Vector3d> world_points, double weight,
                                 int shot) MOLDLOFT_GEOMETRY_NONBLOCKING;

  void start_solving() MOLDLOFT_GEOMETRY_NONBLOCKING;
  std::expected<bool, Error> step()
      MOLDLOFT_GEOMETRY_NONBLOCKING;                      // one bounded piece; true when the surface is ready
  double progress() const MOLDLOFT_GEOMETRY_NONBLOCKING;  // of the solution, 0..1
  double work() const;  // multiply-adds of the last step: at most work_a_step

  const BSplineSurface& surface() const;
  const SurfaceFitReport& report() const;
  std::size_t bytes() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace moldloft::geometry
