// Frame lines: the plate along each frame, as a template would show it.
//
// Heights      over the design's base plane, along its up, at pins that stand evenly along the frame
// Gap          measured less designed height at a pin. Above zero the template is pressed there, below zero it is open
// Bend         by how much the frame's sagitta falls short of the design's: +3 means bend 3 mm more, -2 is 2 mm too
//              much. From a parabola through the gaps: a frame that only lies higher or leans has none
// Sight mark   by how much the frame leans against the mean of all, over its half length: the plate's twist
// Units        mm, design frame; curvature 1/m
// Thread       any; pure
#pragma once

#include "firmware_like/inspection/design.hpp"
#include "geometry/inspection/design_faces.hpp"
#include "geometry/rigid_motion.hpp"

#include <optional>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

// Frames stand across `x`; pins go along `y`; heights along `up`.
struct FrameAxes {
  Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

struct FramePin {
  int column = 0;  // counted from the frame's middle
  double way_mm = 0;
  double design_mm = 0;               // height
  std::optional<double> measured_mm;  // nullopt: the plate does not reach so far
  std::optional<double> gap_mm() const {
    return measured_mm ? std::optional{*measured_mm - design_mm} : std::nullopt;
  }
};

struct FrameLine {
  std::string name;
  double x_mm = 0;                                   // of the frame, along the axes' x
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // design frame
  std::vector<FramePin> pins;
  int measured = 0;                         // pins
  double open_mm = 0, pressed_mm = 0;       // the largest gap of either kind, as 0 or more
  double bend_mm = 0, curvature_per_m = 0;  // curvature: measured less designed
  double lean_mm = 0;                       // over the half length
  double sight_mm = 0;                      // lean against the mean of all frames
  double half_mm = 0;                       // half of the frame's length
};

FrameAxes frame_axes(const geometry::DesignFaces&);

// Of a design with faces: `count` frames evenly over it.
std::vector<FrameLine> frame_lines(const geometry::DesignFaces& design, const geometry::DesignFaces& measured,
                                   const geometry::RigidMotion& design_from_world, const FrameAxes&,
                                   int count);

// Of a template list: its own frames and pins.
std::vector<FrameLine> frame_lines(const TemplateList&, const geometry::DesignFaces& measured,
                                   const geometry::RigidMotion& design_from_world);

// What heights at frames say of the plate as a whole.
double twist_of(const std::vector<FrameLine>&);

}  // namespace moldloft::firmware_like
