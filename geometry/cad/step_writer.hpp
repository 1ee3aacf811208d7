// A face as the text of a STEP file: ISO 10303-21, application protocol 242 (managed model based 3d
// engineering, first edition, which every later edition contains).
//
// Content      one product with one ADVANCED_FACE in an OPEN_SHELL of a SHELL_BASED_SURFACE_MODEL, in
//              millimetres and radians. Edges of the natural border are rows of the net, bit for bit; edges
//              of trims are SURFACE_CURVEs of a space curve and a PCURVE, the latter being the master. The
//              face's normal is du x dv
// Uncertainty  CadLabel::closure_mm, stated as distance_accuracy_value
// Frame        that of the surface, world in the cell
// Accuracy     poles, knots and paths read back bit-equal; space curves of trims within closure_mm
//              of the surface
// Cost         about 60 bytes a control point
// Allocation   yes
// Failure      what check() of splines/trimmed_surface.hpp finds, impossible_setting: a closure_mm that is no length
#pragma once

#include "geometry/cad/cad_label.hpp"
#include "geometry/splines/trimmed_surface.hpp"

#include <expected>
#include <string>

namespace moldloft::geometry {

std::expected<std::string, Error> step_text(const TrimmedSurface&, const CadLabel&);

}  // namespace moldloft::geometry
