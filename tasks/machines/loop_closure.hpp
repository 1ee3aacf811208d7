// Whether a walk along an edge has come back to where it began: round the plate, beside its beginning, or round a hole.
//
// What counts is how often the walk has gone round a point that lies on the plate: once for the plate's own boundary,
// whatever its corners, teeth and bends; not at all, or the other way, for a hole's.
//
// Frame        plan view, mm
// Cost         an arc tangent a point
// Source       winding number of a closed curve
#pragma once

#include "hal/base/realtime.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <limits>

namespace moldloft::tasks {

class LoopClosure {
 public:
  enum class Verdict : std::uint8_t {
    open,
    closed,  // round the plate, and back within `close_mm`
    beside,  // round the plate and on, but never back there
    hole,    // back there, but not round the plate
  };

  LoopClosure() = default;
  // A walk that begins at `anchor`; `on_plate` lies within the plate's boundary, away from it.
  LoopClosure(const Eigen::Vector2d& anchor, const Eigen::Vector2d& on_plate,
              double close_mm) MOLDLOFT_NONBLOCKING;

  Verdict go_on_to(const Eigen::Vector2d&) MOLDLOFT_NONBLOCKING;
  // The least distance to the anchor on the way back to it.
  double beside_mm() const { return nearest_mm_; }
  const Eigen::Vector2d& anchor() const { return anchor_; }

 private:
  Eigen::Vector2d anchor_{0, 0}, on_plate_{0, 0}, last_{0, 0};
  double close_mm_ = 0;
  double wound_ = 0;     // rad, counter-clockwise
  double area_mm2_ = 0;  // between the walk and its anchor, negative where it goes clockwise
  double nearest_mm_ = std::numeric_limits<double>::infinity();
  bool has_left_ = false;
};

}  // namespace moldloft::tasks
