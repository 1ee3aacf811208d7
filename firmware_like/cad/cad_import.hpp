// A STEP or IGES file as the faces of a design. OpenCASCADE reads it; this wing is the only one that knows it, and is
// built where it is installed.
//
// Faces        B-spline and Bezier surfaces, trimmed or not. Up to degree 3 they are taken over as they are; those of
//              higher degree and rational ones become cubic within approximated_mm. Others are refused by name
// Borders      chords within border_mm of the curves, corners kept; one that leaves its surface is refused
// Units        mm, whatever the file's unit is; placements of assemblies are applied
// Thread       one at a time: OpenCASCADE keeps settings of its own
// Blocking     reads a file
// Failure      one line: which file, what is in it, and what is wanted
#pragma once

#include "firmware_like/process/failure.hpp"
#include "geometry/inspection/design_faces.hpp"

#include <expected>
#include <filesystem>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

constexpr double approximated_mm = 1e-4;
constexpr double border_mm = 0.005;

struct ImportedDesign {
  std::vector<geometry::DesignFace> faces;
  std::string unit;      // of the file, as it names it; empty where it does not
  int approximated = 0;  // faces
};

std::expected<ImportedDesign, Failure> import_cad(const std::filesystem::path&);

}  // namespace moldloft::firmware_like
