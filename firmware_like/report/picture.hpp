// The overview of a run as SVG: the plate in plan view, once with its shape and once with its
// deviation in colour, each with a scale. Over both lie the outline, the tracker's path and the shots.
// World coordinates, mm.
//
// Set-up and result time only: allocates.
#pragma once

#include "firmware_like/results/finding.hpp"
#include "firmware_like/results/plate_field.hpp"
#include "geometry/edges/outline.hpp"
#include "geometry/splines/bspline.hpp"
#include "tasks/machines/boundary_tracker.hpp"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

struct OverviewInput {
  std::string title, subtitle;
  std::string about = {};                             // whose run it is
  const geometry::BSplineSurface* surface = nullptr;  // null: only outline, path and shots
  std::span<const Eigen::Vector2d> edge_points{};
  std::span<const Eigen::Vector2d> corners{};
  std::span<const tasks::ShotPlace> boundary_places{}, surface_places{};
  double field_x_mm = 102, field_y_mm = 102;
  std::vector<PlateField> fields{};     // one panel each
  std::span<const Finding> findings{};  // those with a place are numbered as they come
};

std::string overview_svg(const OverviewInput&);

}  // namespace moldloft::firmware_like
