// Which way a plate lies on its design: sizes, units, half turns, mirrors, and what speaks against it being this design
// at all. A wrong answer that looks right is worse than none, so every doubt is a refusal or a remark.
//
// Thread       any; pure
// Failure      one line: which figures do not fit together, and what to do
#pragma once

#include "firmware_like/inspection/inspection.hpp"

#include <expected>

namespace moldloft::firmware_like {

// The measured plate as an alignment asks for it. World frame.
struct PlateSamples {
  std::vector<Eigen::Vector3d> points, edges;
  std::vector<std::uint16_t> point_groups, edge_groups;  // one exposure's field each
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};
PlateSamples samples_of(const RunResult&);

struct PlateMatch {
  geometry::RigidMotion design_from_world = geometry::RigidMotion::Identity();
  geometry::PlateAlignment alignment;  // of points and templates: of the design in the plate's world
  bool upside_down = false;            // the side that was measured is the other side of the design
  std::vector<std::string> undetermined, remarks;
};

std::expected<PlateMatch, Failure> match_faces(const geometry::DesignFaces& design, const PlateSamples&,
                                               const RunResult&, DesignKind, const InspectionSettings&);

// Points and templates are laid on the measured surface. Applies the design's unit; guesses it where nobody said it.
std::expected<PlateMatch, Failure> match_points(const geometry::DesignFaces& measured, const PlateSamples&,
                                                Design&, const InspectionSettings&);

}  // namespace moldloft::firmware_like
