#include "tasks/cell/shot_evidence.hpp"

#include "hal/base/reserved.hpp"

#include <algorithm>
#include <array>
#include <cmath>

// Fixed-size Eigen throughout: what it keeps in local statics and function pointers hides from the compiler that
// nothing here waits or allocates.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::tasks {
namespace {

template <typename T>
std::span<const T> part(const std::vector<T>& all, std::size_t begin, std::size_t end) {
  return std::span{all}.subspan(begin, end - begin);
}

// So that of `all` at most `wanted` remain.
std::uint32_t stride_for(std::size_t all, std::size_t wanted) {
  return static_cast<std::uint32_t>((all + wanted - 1) / wanted);
}

}  // namespace

std::span<const SeenRun> RunEvidence::runs_of(std::size_t shot) const {
  return part(runs, shot == 0 ? 0 : shots[shot - 1].runs_end, shots[shot].runs_end);
}

std::span<const Eigen::Vector3d> RunEvidence::samples_of(std::size_t shot) const {
  return part(samples, shot == 0 ? 0 : shots[shot - 1].samples_end, shots[shot].samples_end);
}

EvidenceBook::EvidenceBook(const Settings& settings)
    : field_reach_mm_{std::hypot(settings.field_x_mm, settings.field_y_mm) / 2} {
  kept_.shots.reserve(settings.max_shots);
  kept_.runs.reserve(settings.max_shots * runs_a_shot);
  kept_.samples.reserve(settings.max_shots * samples_a_shot);
}

std::size_t EvidenceBook::bytes() const {
  return kept_.shots.capacity() * sizeof(ShotSeen) + kept_.runs.capacity() * sizeof(SeenRun) +
         kept_.samples.capacity() * sizeof(Eigen::Vector3d);
}

void EvidenceBook::begin() {
  kept_.shots.clear();
  kept_.runs.clear();
  kept_.samples.clear();
}

RunEdge EvidenceBook::edge_at(geometry::RunEnd end) {
  if (end == geometry::RunEnd::out_of_depth) return RunEdge::out_of_depth;
  return geometry::is_edge(end) ? RunEdge::edge : RunEdge::none;
}

// How much is left out follows from how much of the plate the shot shows, a corner of it or all that the field holds.
void EvidenceBook::add_runs(const geometry::RigidMotion& world_from_scanner, const ShotView& view) {
  const auto runs = view.runs();
  if (runs.empty()) return;
  const std::uint32_t from = runs.front().stripe,
                      stride = stride_for(runs.back().stripe - from + 1, stripes_a_shot);
  std::size_t left = runs_a_shot;
  for (const geometry::PlateRun& run : runs) {
    if ((run.stripe - from) % stride != 0) continue;
    if (left-- == 0) return;
    const Eigen::Vector3d first = view.first_of(run), last = view.last_of(run);
    hal::add_within_reserve(kept_.runs, SeenRun{.first = world_from_scanner * first,
                                                .last = world_from_scanner * last,
                                                .at_first = edge_at(run.at_first),
                                                .at_last = edge_at(run.at_last)});
  }
}

void EvidenceBook::add_samples(const geometry::RigidMotion& world_from_scanner, ShotView& view) {
  const auto runs = view.runs();
  if (runs.empty()) return;
  std::uint32_t longest = 0;
  for (const geometry::PlateRun& run : runs) longest = std::max(longest, run.last - run.first + 1);
  std::array<Eigen::Vector3d, samples_a_shot> points;
  view.rewind({.stripe_stride = stride_for(runs.back().stripe - runs.front().stripe + 1, samples_across),
               .point_stride = stride_for(longest, samples_across),
               .first_stripe = runs.front().stripe});
  const std::size_t count = view.next(points);
  for (std::size_t i = 0; i < count; ++i)
    hal::add_within_reserve(kept_.samples, world_from_scanner * points[i]);
}

void EvidenceBook::add(const ShotSeen& shot, ShotView& view) {
  if (kept_.shots.size() == kept_.shots.capacity()) return;
  if (shot.plate_found) {
    add_runs(shot.world_from_scanner, view);
    add_samples(shot.world_from_scanner, view);
  }
  ShotSeen kept = shot;
  kept.runs_end = static_cast<std::uint32_t>(kept_.runs.size());
  kept.samples_end = static_cast<std::uint32_t>(kept_.samples.size());
  hal::add_within_reserve(kept_.shots, kept);
}

std::optional<Eigen::Vector3d> EvidenceBook::known_near(const ShotPlace& place, double field_half_x_mm,
                                                        double field_half_y_mm) const {
  const Eigen::Vector2d centre = place.centre.head<2>();
  const Eigen::Vector2d along_x{std::cos(place.head_yaw), std::sin(place.head_yaw)};
  const Eigen::Vector2d along_y{-along_x.y(), along_x.x()};
  // Shots farther away than this have seen nothing there.
  const double reach = std::hypot(field_half_x_mm, field_half_y_mm) + field_reach_mm_;
  std::optional<Eigen::Vector3d> nearest;
  double least = std::hypot(field_half_x_mm, field_half_y_mm);
  const auto consider = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector2d d = p.head<2>() - centre;
    if (std::abs(d.dot(along_x)) > field_half_x_mm || std::abs(d.dot(along_y)) > field_half_y_mm) return;
    if (d.norm() < least) nearest = p, least = d.norm();
  };
  for (std::size_t i = 0; i < kept_.shots.size(); ++i) {
    const ShotSeen& shot = kept_.shots[i];
    if (!shot.plate_found || (shot.place.centre.head<2>() - centre).norm() > reach) continue;
    for (const SeenRun& run : kept_.runs_of(i)) consider(run.first), consider(run.last);
    for (const Eigen::Vector3d& p : kept_.samples_of(i)) consider(p);
  }
  return nearest;
}

EvidenceBook::OutOfDepth EvidenceBook::last_out_of_depth() const {
  OutOfDepth count;
  if (kept_.shots.empty()) return count;
  const auto& shot = kept_.shots.back();
  const auto look = [&](RunEdge end, const Eigen::Vector3d& p) {
    if (end != RunEdge::out_of_depth) return;
    ++((shot.world_from_scanner.inverse() * p).z() > 0 ? count.above : count.below);
  };
  for (const SeenRun& run : kept_.runs_of(kept_.shots.size() - 1)) {
    ++count.runs;
    look(run.at_first, run.first);
    look(run.at_last, run.last);
  }
  return count;
}

}  // namespace moldloft::tasks
