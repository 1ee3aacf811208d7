// The registered points of a finished run, read back from its store: for points.ply and for the residuals'
// picture. Result time only: reads, allocates.
#pragma once

#include "firmware_like/results/plate_field.hpp"
#include "firmware_like/results/run_result.hpp"
#include "hal/record/run_store.hpp"

#include <vector>

namespace moldloft::firmware_like {

struct MeasuredPoint {
  Eigen::Vector3f position;  // world, mm
  float residual_mm;         // height over the fitted surface
  std::uint16_t shot, stripe;
  float u, v;
};

// Of a result that has a surface: points of the surface shots inside the outline, thinned to about `wanted`, within
// `gate_mm` of the surface (beyond lie outliers and what is not the plate).
std::expected<std::vector<MeasuredPoint>, hal::StoreError> measured_points(const RunResult&,
                                                                           const hal::RunStore&,
                                                                           std::size_t wanted,
                                                                           double gate_mm);

// The mean residual in each of count x count cells of (u, v).
PlateField residual_field(const std::vector<MeasuredPoint>&, int count);

}  // namespace moldloft::firmware_like
