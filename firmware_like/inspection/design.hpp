// What a plate must become, as a value: faces from CAD or from an earlier run, points that somebody measured or
// computed, or the heights at frames that a hull system prints for templates.
//
// Units        mm, once read; design frame
// Thread       any: it owns all that it holds
#pragma once

#include "firmware_like/inspection/template_list.hpp"
#include "geometry/inspection/design_faces.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

enum class DesignKind : std::uint8_t { surface, points, templates, earlier_run };
std::string_view to_string(DesignKind);

struct Design {
  DesignKind kind = DesignKind::surface;
  std::string file, name;
  std::vector<geometry::DesignFace> faces;  // of a surface or an earlier run
  std::vector<Eigen::Vector3d> points;      // of a list of points, or of all pins of the templates
  std::vector<Eigen::Vector3d> edges;       // where templates say that the seams are
  std::optional<TemplateList> templates;
  std::optional<double> mm_per_unit;  // of `points`, still to be applied; nullopt: nobody said it
  std::vector<std::string> remarks;   // what was understood, for a person
};

}  // namespace moldloft::firmware_like
