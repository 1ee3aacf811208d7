// OpenCASCADE's two ways to project points on a surface, timed where it is installed.
#pragma once

#include "geometry/inspection/prepared_surface.hpp"

#include <optional>
#include <span>

namespace moldloft::bench {

struct OcctProjection {
  double next_us = 0;                          // ShapeAnalysis_Surface::NextValueOfUV from the guess
  double extrema_us = 0;                       // Extrema_ExtPS, set up once, tree search: the whole surface
  double next_off_mm = 0, extrema_off_mm = 0;  // the worst distance beyond ours
};

// nullopt where there is no OpenCASCADE. `distances` are ours, to compare.
std::optional<OcctProjection> occt_projection(const geometry::BSplineSurface&,
                                              std::span<const Eigen::Vector3d>,
                                              std::span<const geometry::Parameters> guesses,
                                              std::span<const double> distances, int runs);

}  // namespace moldloft::bench
