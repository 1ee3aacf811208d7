// The scanner's eye: laser planes cast on the plate, its side walls and the table, seen by cameras.
//
// Scanner coordinates as hal/scanner/frame.hpp says. The projector stands at (0, 0, H) over the centre of the
// field. Laser plane i passes through x_i, and its ray j through y_j at z = 0. Both lie at the middles of
// equal parts of the field. A point is measured if the ray meets it first, if it lies within +-depth of z =
// 0, and if at least one camera sees it. What the plate hides from all cameras is shadow. Noise moves a point
// along its ray.
//
// Frame        in: world_from_scanner, mm; out: scanner coordinates, mm
// Cost         a frame of 100 x 500 rays 5 to 10 ms
// Allocation   none in expose(): the frame must be large enough, the work space is made at construction
// Failure      none; where nothing is measured the point is missing (NaN)
#pragma once

#include "geometry/rigid_motion.hpp"
#include "hal/scanner/frame.hpp"
#include "host_sim/base/random.hpp"
#include "host_sim/plates/plate.hpp"

#include <Eigen/Core>

#include <vector>

namespace moldloft::host_sim {

struct OpticsSettings {
  int stripes = 100, points_per_stripe = 500;
  double field_x_mm = 102, field_y_mm = 102;  // at z = 0
  double depth_mm = 60;                       // z is measured within +-depth
  double height_mm = 500;                     // H, of the projector
  std::vector<Eigen::Vector3d> cameras = {{200.0, 0.0, 500.0}};

  double noise_mm = 0.051;       // sigma along the ray: field of view / 2000 (thesis, chapter 4)
  double drop_out = 0.01;        // share of rays lost on a surface that faces the projector
  double slope_drop_out = 0.05;  // more with incidence: times (1 / cos - 1), never more than 95 %
  double gloss = 0.1;            // share lost where the mirror image of the laser hits a camera
  double glare = 0.05;           // rad, how wide that mirror image is
  double outliers = 0.001;       // share of points that lie somewhere else
  double outlier_mm = 4;         // sigma of how far
};

// A coarser raster: every n-th plane, every n-th ray.
struct Raster {
  int every_stripe = 1, every_point = 1;
};

class Optics {
 public:
  explicit Optics(const OpticsSettings&);
  ~Optics();
  Optics(Optics&&) noexcept;

  void expose(const PlateInstance&, const geometry::RigidMotion& world_from_scanner, Random&, const Raster&,
              hal::Frame&) noexcept;

  const OpticsSettings& settings() const noexcept { return settings_; }
  // Half the extent of what a frame can hold: the field at the far end of the depth range, and room for noise.
  Eigen::Vector3d half_extent_mm() const noexcept;

 private:
  struct WorkSpace;
  OpticsSettings settings_;
  std::unique_ptr<WorkSpace> work_;
};

}  // namespace moldloft::host_sim
