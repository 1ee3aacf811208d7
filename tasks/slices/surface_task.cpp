#include "tasks/slices/surface_task.hpp"

#include "geometry/edges/outline_search.hpp"
#include "hal/base/reserved.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace moldloft::tasks {

SurfaceTask::SurfaceTask(const SurfaceTaskSettings& settings)
    : settings_{settings},
      outline_{std::make_unique<geometry::OutlineSearch>(
          settings.max_edge_points, settings.corners, settings.outline,
          geometry::OutlineSearchSettings{.check = {.limit_mm = settings.edge_limit_mm}})},
      fit_{settings.fit} {
  reserve_.reserve(settings.max_boundary_shots * settings.reserve_points_per_shot);
  reserve_ends_.reserve(settings.max_boundary_shots);
}

SurfaceTask::~SurfaceTask() = default;

const geometry::Outline& SurfaceTask::outline() const { return outline_->outline(); }

std::size_t SurfaceTask::outline_bytes() const { return outline_->bytes(); }

void SurfaceTask::begin() {
  stage_ = Stage::idle;
  looking_at_ = nullptr;
  keeping_from_ = nullptr;
  planning_ = nullptr;
  kept_.end();
  folded_.end();
  reserve_.clear();
  reserve_ends_.clear();
  reserve_next_ = reserve_shot_ = 0;
  shots_ = 0;
}

void SurfaceTask::keep(ShotView& shot, const geometry::RigidMotion& world_from_scanner, FrameLease lease) {
  if (reserve_ends_.size() == reserve_ends_.capacity()) return;  // the tracker gives up before this
  shot.rewind({.stripe_stride = settings_.reserve_stride, .point_stride = settings_.reserve_stride});
  keeping_from_ = &shot;
  kept_ = std::move(lease);
  world_from_scanner_ = world_from_scanner;
  keep_end_ = std::min(reserve_.size() + settings_.reserve_points_per_shot, reserve_.capacity());
}

void SurfaceTask::step_keep() {
  std::size_t left = kept_points;
  while (left > 0 && reserve_.size() < keep_end_) {
    const std::size_t count = keeping_from_->next(
        std::span{chunk_}.first(std::min({left, keep_end_ - reserve_.size(), chunk_.size()})));
    if (count == 0) break;
    for (std::size_t i = 0; i < count; ++i)
      hal::add_within_reserve(reserve_, world_from_scanner_ * chunk_[i]);
    left -= count;
  }
  if (left == 0 && reserve_.size() < keep_end_) return;
  hal::add_within_reserve(reserve_ends_, reserve_.size());
  keeping_from_ = nullptr;
  kept_.end();
}

void SurfaceTask::build_outline(std::span<const Eigen::Vector2d> edges,
                                std::span<const Eigen::Vector2d> corner_candidates) {
  edges_ = edges;
  map_row_ = -1;
  outline_->begin(edges, corner_candidates);
  stage_ = Stage::building_outline;
}

void SurfaceTask::fold(ShotView& shot, const geometry::RigidMotion& world_from_scanner, FrameLease lease) {
  assert(stage_ == Stage::open || stage_ == Stage::failed);
  if (stage_ != Stage::open) return;
  shot.rewind({});
  shot_ = &shot;
  folded_ = std::move(lease);
  world_from_scanner_ = world_from_scanner;
  stage_ = Stage::folding;
}

void SurfaceTask::solve() {
  fit_.start_solving();
  stage_ = Stage::solving;
}

bool SurfaceTask::has_work() const {
  return can_look() || keeping() || planning() || stage_ == Stage::building_outline ||
         stage_ == Stage::clearing || stage_ == Stage::folding_reserve || stage_ == Stage::folding ||
         stage_ == Stage::solving;
}

void SurfaceTask::step(Instant) {
  if (can_look()) {
    if (looking_at_->step()) looking_at_ = nullptr;
    return;
  }
  if (keeping()) return step_keep();
  if (planning()) {
    if (planning_->step()) planning_ = nullptr;
    return;
  }
  switch (stage_) {
    case Stage::building_outline:
      return step_outline();
    case Stage::clearing:
      if (fit_.clear_some()) stage_ = Stage::folding_reserve;
      return;
    case Stage::folding_reserve:
      return step_reserve();
    case Stage::folding:
      return step_fold();
    case Stage::solving:
      return step_solve();
    default:
      return;
  }
}

void SurfaceTask::fail(geometry::Error error) {
  error_ = error;
  folded_.end();
  stage_ = Stage::failed;
}

void SurfaceTask::step_outline() {
  if (map_row_ < 0) {
    const auto done = outline_->step();
    if (!done) return fail(done.error());
    if (!*done) return;
    map_.assign(outline_->outline());
    map_row_ = 0;
    return;
  }
  constexpr int rows_a_step = 3;
  for (int i = 0; i < rows_a_step && map_row_ < geometry::PlanMap::check_rows; ++i, ++map_row_) {
    if (const auto good = map_.check_row(map_row_); !good) return fail(good.error());
  }
  if (map_row_ < geometry::PlanMap::check_rows) return;
  fit_.begin_clearing(map_);
  stage_ = Stage::clearing;
}

void SurfaceTask::step_reserve() {
  if (reserve_shot_ == reserve_ends_.size()) {
    shots_ = static_cast<int>(reserve_shot_);
    stage_ = Stage::open;
    return;
  }
  const std::size_t end = reserve_ends_[reserve_shot_];
  const std::size_t count = std::min(end - reserve_next_, chunk_points);
  if (count > 0) {
    const auto added =
        fit_.add(std::span{reserve_}.subspan(reserve_next_, count), 1.0, static_cast<int>(reserve_shot_));
    if (!added) return fail(added.error());
  }
  reserve_next_ += count;
  if (reserve_next_ == end) ++reserve_shot_;
}

void SurfaceTask::step_fold() {
  const std::size_t count = shot_->next(chunk_);
  if (count == 0) {
    ++shots_;
    folded_.end();
    stage_ = Stage::open;
    return;
  }
  const auto points = std::span{chunk_}.first(count);
  for (auto& p : points) p = world_from_scanner_ * p;
  if (const auto added = fit_.add(points, 1.0, shots_); !added) fail(added.error());
}

void SurfaceTask::step_solve() {
  const auto done = fit_.step();
  if (!done) return fail(done.error());
  if (*done) stage_ = Stage::ready;
}

}  // namespace moldloft::tasks
