// A face as the text of an IGES 5.3 file, fixed format.
//
// Content      entity 128 (the surface) alone where the face is bounded by its natural border; else 144
//              (trimmed surface) with a 142 (curve on the surface) for every loop: 126 (curve) in parameters
//              and in space, joined by 102 (composite) where a loop has several. The curve in parameters is
//              the preferred one
// Units        millimetres (flag 2, 2HMM); the file's resolution is CadLabel::closure_mm
// Frame        that of the surface, world in the cell
// Form         80 columns; a number is never divided between lines
// Accuracy     poles, knots and paths read back bit-equal (paths that a loop walks backwards: within 2 eps of
//              the knots' range); space curves of trims within closure_mm of the surface
// Cost         about 60 bytes a control point
// Allocation   yes
// Failure      what check() of splines/trimmed_surface.hpp finds, impossible_setting: a closure_mm that is no length
#pragma once

#include "geometry/cad/cad_label.hpp"
#include "geometry/splines/trimmed_surface.hpp"

#include <expected>
#include <string>

namespace moldloft::geometry {

std::expected<std::string, Error> iges_text(const TrimmedSurface&, const CadLabel&);

}  // namespace moldloft::geometry
