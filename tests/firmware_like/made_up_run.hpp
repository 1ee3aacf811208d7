// A run as the audit sees it, made without a cell: a rectangular saddle of 300 x 200 mm, boundary shots round it and a
// zig-zag over it. Each shot's runs and samples are computed from the plate itself. What can go wrong in a cell is a
// function of the shot: where the plate lies then, what the scanner does not see.
#pragma once

#include "firmware_like/results/run_result.hpp"
#include "geometry/fit/plan_map.hpp"
#include "geometry/rigid_motion.hpp"

#include <cmath>
#include <functional>
#include <random>

namespace moldloft::firmware_like {

constexpr double plate_x_mm = 300, plate_y_mm = 200;
inline const Eigen::Vector2d plate_at{100, -100};  // its first corner

// Height and inside, in the plate's own coordinates, which are world's until it is moved.
inline double plate_height(const Eigen::Vector2d& p) {
  const Eigen::Vector2d d = p - plate_at - Eigen::Vector2d{plate_x_mm, plate_y_mm} / 2;
  return 20 + 4 * (d.x() / 150) * (d.y() / 100);
}
inline bool on_plate(const Eigen::Vector2d& p) {
  const Eigen::Vector2d d = p - plate_at;
  return d.x() > 0 && d.y() > 0 && d.x() < plate_x_mm && d.y() < plate_y_mm;
}

struct MadeUpRun {
  // Of the plate when shot i is taken, and of the scanner against where the mount says it is.
  std::function<geometry::RigidMotion(std::size_t)> plate_moves = [](std::size_t) {
    return geometry::RigidMotion::Identity();
  };
  geometry::RigidMotion mount_error = geometry::RigidMotion::Identity();
  std::function<bool(std::size_t, const Eigen::Vector2d&)> sees = [](std::size_t, const Eigen::Vector2d&) {
    return true;
  };
  double noise_mm = 0.05;

  RunResult result();

 private:
  void take(RunResult&, hal::ShotPurpose, const tasks::ShotPlace&);
  void take_stripe(RunResult&, std::size_t shot, const geometry::RigidMotion& world_from_scanner,
                   double x_mm);
  std::mt19937 random_{5};
};

inline geometry::Outline outline_of_made_up_plate() {
  geometry::Outline outline;
  outline.corners = {plate_at, plate_at + Eigen::Vector2d{plate_x_mm, 0},
                     plate_at + Eigen::Vector2d{plate_x_mm, plate_y_mm},
                     plate_at + Eigen::Vector2d{0, plate_y_mm}};
  outline.rms_mm = 0.04;
  for (std::size_t i = 0; i < 4; ++i) {
    auto& side = outline.sides[i];
    side.knots = geometry::uniform_clamped_knots(1);
    for (int k = 0; k < 4; ++k) {
      const double t = k / 3.0;
      side.control.push_back((1 - t) * outline.corners[i] + t * outline.corners[(i + 1) % 4]);
    }
  }
  return outline;
}

inline void MadeUpRun::take_stripe(RunResult& r, std::size_t shot,
                                   const geometry::RigidMotion& world_from_scanner, double x_mm) {
  std::normal_distribution<double> noise{0, noise_mm};
  const geometry::RigidMotion moved = plate_moves(shot);
  const auto point = [&](double y_mm) -> std::optional<Eigen::Vector3d> {
    // The scanner sits otherwise than it believes: the ray goes where it truly is.
    const Eigen::Vector3d truly = world_from_scanner * mount_error * Eigen::Vector3d{x_mm, y_mm, 0};
    const Eigen::Vector2d of_plate = (moved.inverse() * truly).head<2>();
    if (!on_plate(of_plate) || !sees(shot, of_plate)) return std::nullopt;
    const Eigen::Vector3d on_surface =
        moved * Eigen::Vector3d{of_plate.x(), of_plate.y(), plate_height(of_plate)};
    return world_from_scanner * (mount_error.inverse() * (world_from_scanner.inverse() * on_surface)) +
           Eigen::Vector3d{0, 0, noise(random_)};
  };
  constexpr double half_field_mm = 50, step_mm = 0.1;
  std::optional<tasks::SeenRun> run;
  for (int i = 0; i <= 1000; ++i) {
    const auto p = point(-half_field_mm + i * step_mm);
    if (p && !run)
      run = tasks::SeenRun{
          .first = *p, .last = *p, .at_first = i == 0 ? tasks::RunEdge::none : tasks::RunEdge::edge};
    if (p) run->last = *p;
    if (p && i % 50 == 25 && std::abs(std::remainder(x_mm, 24)) < 1) r.evidence.samples.push_back(*p);
    if (run && (!p || i == 1000)) {
      run->at_last = p ? tasks::RunEdge::none : tasks::RunEdge::edge;
      r.evidence.runs.push_back(*run);
      run.reset();
    }
  }
}

inline void MadeUpRun::take(RunResult& r, hal::ShotPurpose purpose, const tasks::ShotPlace& place) {
  const std::size_t shot = r.evidence.shots.size();
  const std::size_t first_run = r.evidence.runs.size();
  const auto world_from_scanner = geometry::turned_about_z(place.head_yaw, place.centre);
  for (int stripe = -16; stripe <= 16; ++stripe) take_stripe(r, shot, world_from_scanner, 3.0 * stripe);
  if (purpose == hal::ShotPurpose::boundary) {
    for (std::size_t i = first_run; i < r.evidence.runs.size(); ++i) {
      const auto& run = r.evidence.runs[i];
      if (run.at_first == tasks::RunEdge::edge) r.track.edge_points.push_back(run.first.head<2>());
      if (run.at_last == tasks::RunEdge::edge) r.track.edge_points.push_back(run.last.head<2>());
    }
    r.track.boundary_places.push_back(place);
  } else {
    r.track.surface_places.push_back(place);
  }
  r.evidence.shots.push_back({.number = static_cast<std::uint32_t>(shot + 1),
                              .purpose = purpose,
                              .place = place,
                              .world_from_scanner = world_from_scanner,
                              .plate_found = r.evidence.runs.size() > first_run,
                              .runs_end = static_cast<std::uint32_t>(r.evidence.runs.size()),
                              .samples_end = static_cast<std::uint32_t>(r.evidence.samples.size())});
}

inline RunResult MadeUpRun::result() {
  RunResult r;
  r.outcome = Outcome::complete;
  r.track.field_x_mm = r.track.field_y_mm = 100;
  r.promised = {.noise_mm = 0.05, .repeatability_z_mm = 0.013, .finest_span_mm = 10, .largest_unseen = 0.02};
  auto& plate = r.measured.emplace();
  plate.outline = outline_of_made_up_plate();
  plate.tolerance_mm = 0.005;
  plate.fit.sigma_mm = noise_mm;
  plate.fit.finest_spans_u = plate.fit.finest_spans_v = 32;
  plate.fit.points_used = 1'000'000;
  plate.surface.knots_u = plate.surface.knots_v = geometry::uniform_clamped_knots(1);
  for (auto* net : {&plate.surface.x, &plate.surface.y, &plate.surface.z}) net->setZero(4, 4);
  geometry::PlanMap{plate.outline}.to_net(plate.surface);
  // A bilinear height is reproduced by its values at the Greville points, which are the net's own plan positions.
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k)
      plate.surface.z(i, k) = plate_height({plate.surface.x(i, k), plate.surface.y(i, k)});
  const double diagonal = 0.785;
  const auto boundary = [&](double x, double y) {
    take(r, hal::ShotPurpose::boundary,
         {.centre = {plate_at.x() + x, plate_at.y() + y, 20}, .head_yaw = diagonal});
  };
  for (double x = 0; x < plate_x_mm; x += 60) boundary(x, 0);
  for (double y = 0; y < plate_y_mm; y += 50) boundary(plate_x_mm, y);
  for (double x = plate_x_mm; x > 0; x -= 60) boundary(x, plate_y_mm);
  for (double y = plate_y_mm; y > 0; y -= 50) boundary(0, y);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      const int along = row % 2 == 0 ? column : 3 - column;
      take(r, hal::ShotPurpose::surface,
           {.centre = {plate_at.x() + 40 + along * 73, plate_at.y() + 35 + row * 65, 20}, .head_yaw = 0});
    }
  }
  r.shots.boundary = static_cast<int>(r.track.boundary_places.size());
  r.shots.surface = static_cast<int>(r.track.surface_places.size());
  return r;
}

}  // namespace moldloft::firmware_like
