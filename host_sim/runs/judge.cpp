#include "host_sim/runs/judge.hpp"

#include "firmware_like/process/json_file.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/run/surface_file.hpp"
#include "host_sim/base/plan_polygon.hpp"

#include <Eigen/LU>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace moldloft::host_sim {

namespace {

using geometry::BSplineSurface;

Eigen::Vector2d clamped(const Eigen::Vector2d& uv) { return uv.cwiseMax(0.0).cwiseMin(1.0); }

// (u, v) of the surface's point over a plan position, Newton from `guess`; nothing when there is none
// in the domain.
std::optional<Eigen::Vector2d> over(const BSplineSurface& surface, const Eigen::Vector2d& plan,
                                    Eigen::Vector2d uv) {
  for (int step = 0; step < 30; ++step) {
    const auto s = surface.at(uv.x(), uv.y());
    const Eigen::Vector2d miss = plan - s.value.head<2>();
    if (miss.norm() < 1e-9) return uv;
    Eigen::Matrix2d jacobian;
    jacobian << s.du.head<2>(), s.dv.head<2>();
    uv = clamped(uv + jacobian.inverse() * miss);
  }
  const Eigen::Vector2d miss = plan - surface.at(uv.x(), uv.y()).value.head<2>();
  if (miss.norm() < 1e-6) return uv;
  return std::nullopt;
}

// A start for Newton: the nearest of a few points of the surface in plan.
Eigen::Vector2d nearest_parameters(const BSplineSurface& surface, const Eigen::Vector2d& plan) {
  constexpr int steps = 12;
  Eigen::Vector2d best{0.5, 0.5};
  double best_distance = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j <= steps; ++j) {
      const Eigen::Vector2d uv{static_cast<double>(i) / steps, static_cast<double>(j) / steps};
      const double distance = (surface.at(uv.x(), uv.y()).value.head<2>() - plan).squaredNorm();
      if (distance < best_distance) best_distance = distance, best = uv;
    }
  }
  return best;
}

// The distance along the normal from a true point to the surface, starting from the parameters over it:
// S(u, v) - lambda n = p, three equations. At the very border the normal may miss the surface; there the
// height difference times the normal's z is the same to second order.
double along_normal(const BSplineSurface& surface, const Eigen::Vector3d& p, const Eigen::Vector3d& n,
                    const Eigen::Vector2d& start) {
  Eigen::Vector2d uv = start;
  double lambda = (surface.at(uv.x(), uv.y()).value.z() - p.z()) * n.z();
  const double fallback = lambda;
  for (int step = 0; step < 20; ++step) {
    const auto s = surface.at(uv.x(), uv.y());
    const Eigen::Vector3d miss = p + lambda * n - s.value;
    if (miss.norm() < 1e-10) return lambda;
    Eigen::Matrix3d jacobian;
    jacobian << s.du, s.dv, -n;
    const Eigen::Vector3d move = jacobian.partialPivLu().solve(miss);
    uv = clamped(uv + move.head<2>());
    lambda += move.z();
  }
  return (p + lambda * n - surface.at(uv.x(), uv.y()).value).norm() < 1e-7 ? lambda : fallback;
}

std::vector<Eigen::Vector2d> border_of(const BSplineSurface& surface) {
  constexpr int steps = 500;  // of each side
  std::vector<Eigen::Vector2d> border;
  const auto add = [&](double u, double v) { border.push_back(surface.at(u, v).value.head<2>()); };
  for (int k = 0; k < steps; ++k) add(static_cast<double>(k) / steps, 0.0);
  for (int k = 0; k < steps; ++k) add(1.0, static_cast<double>(k) / steps);
  for (int k = 0; k < steps; ++k) add(1.0 - static_cast<double>(k) / steps, 1.0);
  for (int k = 0; k < steps; ++k) add(0.0, 1.0 - static_cast<double>(k) / steps);
  return border;
}

double farthest(PlanPoints from, PlanPoints outline) {
  double most = 0;
  for (const auto& p : from) most = std::max(most, distance_to_outline(outline, p));
  return most;
}

double hausdorff(PlanPoints a, PlanPoints b, double step_mm) {
  return std::max(farthest(sampled_outline(a, step_mm), b), farthest(sampled_outline(b, step_mm), a));
}

// Which corner is the first is the controller's choice: the best of the four cyclic namings counts.
double corner_distance(const std::array<Eigen::Vector2d, 4>& truth,
                       const std::array<Eigen::Vector2d, 4>& measured) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t shift = 0; shift < 4; ++shift) {
    double most = 0;
    for (std::size_t k = 0; k < 4; ++k) most = std::max(most, (truth[k] - measured[(k + shift) % 4]).norm());
    best = std::min(best, most);
  }
  return best;
}

void compare_grid(const PlateInstance& truth, const BSplineSurface& measured, Verdict& verdict) {
  const auto world_from_plate = truth.world_from_plate();
  const auto& c = truth.plate->corners();
  double squares = 0;
  std::optional<Eigen::Vector2d> last;
  for (int i = 0; i < judge_grid; ++i) {
    for (int j = 0; j < judge_grid; ++j) {
      const double s = static_cast<double>(j) / (judge_grid - 1),
                   t = static_cast<double>(i) / (judge_grid - 1);
      const Eigen::Vector2d q = (1 - t) * ((1 - s) * c[0] + s * c[1]) + t * ((1 - s) * c[3] + s * c[2]);
      const Eigen::Vector3d p =
          world_from_plate * Eigen::Vector3d{q.x(), q.y(), truth.plate->height(q.x(), q.y())};
      auto& entry = verdict.grid.emplace_back(p.head<2>(), std::numeric_limits<double>::quiet_NaN());
      if (!truth.plate->inside(q.x(), q.y())) continue;
      auto uv = last ? over(measured, entry.world, *last) : std::nullopt;
      if (!uv) uv = over(measured, entry.world, nearest_parameters(measured, entry.world));
      if (!uv) continue;
      last = uv;
      const Eigen::Vector3d n = world_from_plate.linear() * truth.plate->normal(q.x(), q.y());
      entry.normal_mm = along_normal(measured, p, n, *uv);
      squares += entry.normal_mm * entry.normal_mm;
      if (std::abs(entry.normal_mm) > verdict.normal_max_mm) {
        verdict.normal_max_mm = std::abs(entry.normal_mm);
        verdict.normal_max_at = entry.world;
      }
      ++verdict.points;
    }
  }
  if (verdict.points > 0) verdict.normal_rms_mm = std::sqrt(squares / verdict.points);
}

}  // namespace

std::expected<Verdict, SimError> judge(const PlateInstance& truth, const BSplineSurface& measured,
                                       const std::array<Eigen::Vector2d, 4>& measured_corners) {
  Verdict verdict;
  verdict.grid.reserve(static_cast<std::size_t>(judge_grid) * judge_grid);
  compare_grid(truth, measured, verdict);
  if (verdict.points == 0)
    return std::unexpected(SimError{"the measured surface lies nowhere over the plate"});
  std::vector<Eigen::Vector2d> outline;
  for (const auto& p : truth.plate->outline()) outline.push_back(truth.to_world(p));
  const auto border = border_of(measured);
  verdict.outline_max_mm = hausdorff(outline, border, 0.5);
  verdict.corner_max_mm = corner_distance(truth.corners_in_world(), measured_corners);
  return verdict;
}

std::expected<Verdict, SimError> judge_run(const std::string& folder, const PlateInstance& truth) {
  const auto surface = firmware_like::read_surface(folder + "/surface.json");
  if (!surface) return std::unexpected(SimError{surface.error().what});
  const std::string path = folder + "/summary.json";
  auto summary = firmware_like::read_json(path);
  if (!summary) return std::unexpected(SimError{summary.error().what});
  std::array<Eigen::Vector2d, 4> corners;
  try {
    const auto& given = summary->at("boundary").at("corners_mm");
    if (given.size() != 4)
      return std::unexpected(SimError{path + ": boundary.corners_mm must hold four corners"});
    for (std::size_t k = 0; k < 4; ++k)
      corners[k] = {given[k].at(0).get<double>(), given[k].at(1).get<double>()};
  } catch (const nlohmann::json::exception& error) {
    return std::unexpected(SimError{fmt::format("{}: {}", path, error.what())});
  }
  auto verdict = judge(truth, *surface, corners);
  if (!verdict) return verdict;
  (*summary)["truth"] = {{"normal_max_mm", verdict->normal_max_mm},
                         {"normal_rms_mm", verdict->normal_rms_mm},
                         {"outline_max_mm", verdict->outline_max_mm},
                         {"corner_max_mm", verdict->corner_max_mm}};
  if (const auto written = firmware_like::write_file(path, firmware_like::json_text(*summary, 2) + "\n");
      !written)
    return std::unexpected(SimError{written.error().what});
  return verdict;
}

}  // namespace moldloft::host_sim
