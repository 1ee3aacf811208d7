#include "firmware_like/results/measured_points.hpp"

#include "firmware_like/config/device_makes.hpp"
#include "tasks/cell/shot_archive.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <algorithm>
#include <cmath>

namespace moldloft::firmware_like {

std::expected<std::vector<MeasuredPoint>, hal::StoreError> measured_points(const RunResult& result,
                                                                           const hal::RunStore& store,
                                                                           std::size_t wanted,
                                                                           double gate_mm) {
  const auto codec = frame_codec_of(store);
  if (!codec) return std::unexpected{hal::StoreError{codec.error().what}};
  const auto shots = store.shots();
  if (!shots) return std::unexpected{shots.error()};
  const auto& surface = result.measured->surface;
  const geometry::PlanMap map{result.measured->outline};
  const auto stride =
      static_cast<std::uint32_t>(std::ceil(
          std::sqrt(static_cast<double>(result.measured->fit.points_used) / static_cast<double>(wanted)))) +
      1;

  std::vector<MeasuredPoint> points;
  Eigen::Vector2d guess{0.5, 0.5};
  for (const auto& shot : *shots) {
    if (shot.purpose != hal::ShotPurpose::surface) continue;
    const auto frame = store.frame(shot, **codec);
    if (!frame) return std::unexpected{frame.error()};
    const auto world_from_scanner = tasks::motion_of(shot.reported) * result.tip_from_scanner;
    for (const auto& line : frame->lines()) {
      if (line.index % stride != 0) continue;
      for (std::uint32_t i = line.first; i < line.first + line.count; i += stride) {
        if (!std::isfinite(frame->z[i])) continue;
        const Eigen::Vector3d p = world_from_scanner * Eigen::Vector3d{frame->x[i], frame->y[i], frame->z[i]};
        const auto uv = map.invert(p.head<2>(), guess);
        if (!uv) continue;
        guess = *uv;
        const double residual = p.z() - surface.at(uv->x(), uv->y()).value.z();
        if (std::abs(residual) > gate_mm) continue;
        points.push_back({.position = p.cast<float>(),
                          .residual_mm = static_cast<float>(residual),
                          .shot = static_cast<std::uint16_t>(tasks::shot_number_of(shot.shot_id)),
                          .stripe = line.index,
                          .u = static_cast<float>(uv->x()),
                          .v = static_cast<float>(uv->y())});
      }
    }
  }
  return points;
}

PlateField residual_field(const std::vector<MeasuredPoint>& points, int count) {
  PlateField field;
  field.count_u = field.count_v = count;
  field.title = "Mean residual of the points about the fitted surface";
  field.unit = "um";
  field.scale = 1000;
  const auto cells = static_cast<std::size_t>(count * count);
  std::vector<double> sums(cells);
  std::vector<int> counts(cells);
  for (const auto& p : points) {
    const auto part = [&](float t) {
      return static_cast<std::size_t>(
          std::clamp(static_cast<int>(t * static_cast<float>(count)), 0, count - 1));
    };
    const std::size_t cell = part(p.u) * static_cast<std::size_t>(count) + part(p.v);
    sums[cell] += p.residual_mm;
    ++counts[cell];
  }
  for (std::size_t i = 0; i < cells; ++i) field.values.push_back(counts[i] == 0 ? NAN : sums[i] / counts[i]);
  return field;
}

}  // namespace moldloft::firmware_like
