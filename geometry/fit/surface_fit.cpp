#include "geometry/fit/surface_fit.hpp"

#include "geometry/fit/net_choice.hpp"
#include "geometry/fit/net_solver.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

// Blocks of matrices whose sizes were fixed in the constructor, vectors that grow within what was reserved there: the
// compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {

namespace {

constexpr int fewest_spans = 4;  // of a side as well: the nets must refine the sides' knots

// Multiply-adds, about: of a cell from four, of a shot's cell into a coarser one, and of a cell's weight.
constexpr double merge_cost = 2000, restrict_cost = 200, total_cost = 100;

constexpr int cleared_a_step = 512;  // cells: 0.3 MB

// A net is tried when it has at least this many points for every unknown.
constexpr double points_an_unknown = 4;

struct Level {
  Level(int spans_u, int spans_v) : net(spans_u, spans_v) {
    surface.knots_u = uniform_clamped_knots(spans_u);
    surface.knots_v = uniform_clamped_knots(spans_v);
    surface.x = surface.y = surface.z = Eigen::MatrixXd::Zero(spans_u + cubic, spans_v + cubic);
  }
  SplineNet net;
  BSplineSurface surface;
};

// The finest net and its halvings, in both directions as long as both can be halved, then in the
// one that can.
std::vector<std::pair<int, int>> nested_nets(int spans_u, int spans_v) {
  std::vector<std::pair<int, int>> nets{{spans_u, spans_v}};
  while (nets.back() != std::pair(fewest_spans, fewest_spans)) {
    nets.emplace_back(std::max(nets.back().first / 2, fewest_spans),
                      std::max(nets.back().second / 2, fewest_spans));
  }
  return nets;
}

// Room for the shots' moments: a shot sees a tenth of a plate, every place is seen by a few shots, and small
// plates, which every shot sees whole, have few shots.
std::size_t shot_cells_planned(const SurfaceFitSettings& settings) {
  const std::size_t cells = static_cast<std::size_t>(settings.max_spans_u) * settings.max_spans_v;
  return settings.shot_sigma_mm > 0 ? std::max<std::size_t>(4 * cells, 16 * 1024) : 0;
}

}  // namespace

struct SurfaceFit::Work {
  enum class Phase { adding, total, merge, solve, compare, finish, done, failed };

  explicit Work(const SurfaceFitSettings& s)
      : settings(s),
        solver((s.max_spans_u + 3u) * (s.max_spans_v + 3u),
               3u * (std::min(s.max_spans_u, s.max_spans_v) + 3) + 3),
        shots(s.max_shots, s.max_spans_u, s.max_spans_v, shot_cells_planned(s),
              s.shot_sigma_mm > 0 ? (s.max_spans_u + 3u) * (s.max_spans_v + 3u) : 0) {
    for (const auto& [spans_u, spans_v] : nested_nets(s.max_spans_u, s.max_spans_v)) {
      levels.emplace_back(spans_u, spans_v);
      moments.emplace_back(spans_u, spans_v);
    }
  }

  void fold(int of_shot);
  bool total_some();
  void start_level();
  std::expected<bool, Error> piece();
  bool merge_some();
  void keep_if_best();
  void finish();

  SurfaceFitSettings settings;
  std::vector<Level> levels;        // finest first
  std::vector<MomentGrid> moments;  // of every level; the first takes the points
  NetSolver solver;
  ShotOffsets shots;
  const PlanMap* map = nullptr;
  PointTotals totals;
  SurfaceFitReport report;
  Eigen::Vector2d last_uv{0.5, 0.5};
  double datum = 0;  // heights are summed relative to the first point's, so that squares keep their digits
  Phase phase = Phase::adding;
  Error error = Error::too_few_points;
  std::size_t level = 0, first_level = 0, best = 0;
  int cell = 0, shot = 0;
  std::size_t shot_cell = 0, shot_cells = 0;  // of the shot that merging is at
  double best_score = 0, point_sigma = 0;
  double work = 0;
  bool full = false;  // the step has no room for the next piece
  PointBlock block;
  std::array<double, PointBlock::capacity> u, v;
};

SurfaceFit::SurfaceFit(const SurfaceFitSettings& settings) {
  assert(std::has_single_bit(static_cast<unsigned>(settings.max_spans_u)) &&
         settings.max_spans_u >= fewest_spans);
  assert(std::has_single_bit(static_cast<unsigned>(settings.max_spans_v)) &&
         settings.max_spans_v >= fewest_spans);
  work_ = std::make_unique<Work>(settings);
}

SurfaceFit::~SurfaceFit() = default;

std::size_t SurfaceFit::bytes() const {
  std::size_t sum = sizeof(Work) + work_->solver.bytes() + work_->shots.bytes();
  for (const MomentGrid& grid : work_->moments) sum += grid.bytes();
  for (const Level& level : work_->levels)
    sum += level.net.bytes() + 3 * level.surface.z.size() * sizeof(double);
  return sum;
}

void SurfaceFit::begin(const PlanMap& map) {
  begin_clearing(map);
  while (!clear_some()) {
  }
}

bool SurfaceFit::clear_some() {
  MomentGrid& finest = work_->moments.front();
  const int end = std::min(work_->cell + cleared_a_step, finest.cell_count());
  finest.clear(work_->cell, end);
  work_->cell = end;
  return end == finest.cell_count();
}

void SurfaceFit::begin_clearing(const PlanMap& map) {
  work_->map = &map;
  work_->cell = 0;
  work_->shots.clear();
  work_->totals = {};
  work_->report = {};
  work_->last_uv = {0.5, 0.5};
  work_->block.count = 0, work_->block.shot_rows_wanted = work_->settings.shot_sigma_mm > 0;
  work_->phase = Work::Phase::adding;
}

// The block's heights and weights, and u and v, are there.
void SurfaceFit::Work::fold(int of_shot) {
  if (block.count == 0) return;
  const MomentKernel& kernel = moment_kernel();
  MomentGrid& finest = moments.front();
  const int nu = settings.max_spans_u, nv = settings.max_spans_v;
  kernel.locate(block, u.data(), v.data(), {nu, nv, double(nu), double(nv), 0, 0});
  kernel.values(block);
  kernel.fold(block, finest.cells(), finest.counts());
  if (settings.shot_sigma_mm > 0) shots.add(of_shot, block);
  totals.points += static_cast<std::uint64_t>(block.count);
  block.count = 0;
}

std::expected<void, Error> SurfaceFit::add(std::span<const Eigen::Vector3d> world_points, double weight,
                                           int shot) {
  Work& work = *work_;
  assert(work.map != nullptr);
  if (shot < 0 || shot >= work.settings.max_shots) return std::unexpected(Error::capacity);
  if (!(weight > 0) || !std::isfinite(weight)) return std::unexpected(Error::not_finite);
  PointBlock& block = work.block;
  block.weighted = weight != 1;
  std::array<double, PointBlock::capacity> x, y;
  for (std::size_t first = 0; first < world_points.size(); first += x.size()) {
    const auto points = world_points.subspan(first, std::min(x.size(), world_points.size() - first));
    for (std::size_t k = 0; k < points.size(); ++k) {
      // A height that is not finite sends its point off the plate.
      x[k] = std::isfinite(points[k].z()) ? points[k].x() : points[k].z(), y[k] = points[k].y();
    }
    work.report.points_off +=
        work.map->invert({x.data(), points.size()}, {y.data(), points.size()}, {work.u.data(), points.size()},
                         {work.v.data(), points.size()}, work.last_uv);
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (std::isnan(work.u[k])) continue;
      if (work.totals.points == 0 && block.count == 0) work.datum = points[k].z();
      const auto to = static_cast<std::size_t>(block.count++);
      // Rounding may put a point of the rim outside by a hair.
      work.u[to] = std::clamp(work.u[k], 0.0, 1.0), work.v[to] = std::clamp(work.v[k], 0.0, 1.0);
      block.height[to] = points[k].z() - work.datum, block.weight[to] = weight;
    }
    work.fold(shot);
  }
  return {};
}

void SurfaceFit::start_solving() {
  Work& work = *work_;
  work.shots.finish_adding();
  work.totals.weight = work.totals.squares = 0;
  work.report.points_used = work.totals.points;
  work.level = 0, work.cell = work.shot = 0, work.shot_cell = 0;
  work.best_score = std::numeric_limits<double>::infinity();
  work.point_sigma = work.settings.noise_mm;
  // Nets with more unknowns than the points determine are passed over; their moments are merged all the same.
  work.first_level = 0;
  const auto determined = [&](const Level& level) {
    return static_cast<double>(work.totals.points) >= points_an_unknown * level.net.unknowns();
  };
  while (work.first_level + 1 < work.levels.size() && !determined(work.levels[work.first_level]))
    ++work.first_level;
  if (work.map == nullptr || !determined(work.levels[work.first_level])) {
    work.error = Error::too_few_points;
    work.phase = Work::Phase::failed;
    return;
  }
  work.phase = Work::Phase::total;
}

// What all cells hold together; true when the last is in.
bool SurfaceFit::Work::total_some() {
  const MomentGrid& grid = moments.front();
  for (; cell < grid.cell_count(); ++cell, work += total_cost) {
    if (work + total_cost > NetSolver::work_a_step) return false;
    totals.weight += grid.cells()[cell].weight();
    totals.squares += grid.cells()[cell].squares();
  }
  cell = 0;
  return true;
}

void SurfaceFit::Work::start_level() {
  const Eigen::Vector2d across = map->at(1, 0.5).value - map->at(0, 0.5).value;
  const Eigen::Vector2d along = map->at(0.5, 1).value - map->at(0.5, 0).value;
  NetTask task;
  task.net = &levels[level].net, task.moments = &moments[level], task.totals = totals;
  task.length_u_mm = across.norm(), task.length_v_mm = along.norm();
  task.fairing = settings.fairing;
  task.shot_sigma_mm = settings.shot_sigma_mm, task.point_sigma_mm = point_sigma;
  solver.start(task, &shots);
  phase = Phase::solve;
}

// Cells, then the shots' cells, into those of the next net; true when all are merged.
bool SurfaceFit::Work::merge_some() {
  MomentGrid& grid = moments[level];
  if (cell < grid.cell_count()) {
    const int room = static_cast<int>(std::max(0.0, NetSolver::work_a_step - work) / merge_cost);
    const int end = std::min(cell + room, grid.cell_count());
    grid.merge_cells(cell, end, moments[level - 1]);
    work += merge_cost * (end - cell);
    cell = end;
    if (cell < grid.cell_count()) return false;
  }
  while (shot < shots.count()) {
    if (shot_cell == 0) shot_cells = shots.cells_of(shot);
    const auto room = static_cast<std::size_t>(std::max(0.0, NetSolver::work_a_step - work) / restrict_cost);
    const std::size_t end = std::min(shot_cells, shot_cell + room);
    if (end == shot_cell && end < shot_cells) return false;
    shots.coarsen(shot, grid, shot_cell, end);
    work += 30 + restrict_cost * static_cast<double>(end - shot_cell);
    shot_cell = end;
    if (end < shot_cells) return false;
    ++shot, shot_cell = 0;
  }
  shots.coarsened(grid);
  cell = shot = 0;
  return true;
}

// The offsets are part of every net's model, so a finer net gains nothing by following the shots' steps.
void SurfaceFit::Work::keep_if_best() {
  const NetResult& result = solver.result();
  point_sigma = result.point_sigma_mm;  // all nets are compared under the finest net's estimate
  // Scores are mean squared errors of prediction, so their difference is the square of what the coarser
  // net misses. Nets come from fine to coarse: each one within the tolerance of the best so far takes
  // over from it.
  const double score = generalized_cross_validation(totals, result);
  if (!(score < best_score + settings.tolerance_mm * settings.tolerance_mm)) return;
  best_score = std::min(best_score, score), best = level;
  Level& kept = levels[level];
  for (int i = 0; i < kept.net.control_u(); ++i) {
    for (int j = 0; j < kept.net.control_v(); ++j) {
      kept.surface.z(i, j) = solver.coefficients()[kept.net.index(i, j)] + datum;
    }
  }
  const double n = static_cast<double>(totals.points);
  report.spans_u = moments[level].cells_u(), report.spans_v = moments[level].cells_v();
  report.rms_residual_mm = std::sqrt(result.squares / totals.weight);
  report.sigma_mm = std::sqrt(result.squares / std::max(1.0, n - result.freedom));
  report.smallest_pivot = result.smallest_pivot;
  report.empty_cells = result.empty_cells;
  report.shot_offset_rms_mm = result.offset_rms_mm, report.shot_offset_max_mm = result.offset_max_mm;
  report.shots_without_offset = shots.exact();
}

void SurfaceFit::Work::finish() { map->to_net(levels[best].surface); }

std::expected<bool, Error> SurfaceFit::step() {
  // Small nets and short phases share a step. Half of a step leaves room for the largest piece that cannot be divided.
  work_->work = 0, work_->full = false;
  while (true) {
    const auto ready = work_->piece();
    if (!ready || *ready || work_->full || work_->work >= NetSolver::work_a_step / 2) return ready;
  }
}

std::expected<bool, Error> SurfaceFit::Work::piece() {
  switch (phase) {
    case Phase::adding:
      return std::unexpected(Error::too_few_points);
    case Phase::failed:
      return std::unexpected(error);
    case Phase::done:
      return true;
    case Phase::total:
      full = !total_some();
      if (full) return false;
      if (first_level == 0) {
        start_level();
      } else {
        level = 1, phase = Phase::merge;
      }
      return false;
    case Phase::merge:
      full = !merge_some();
      if (full) return false;
      if (level < first_level) {
        ++level;
      } else {
        start_level();
      }
      return false;
    case Phase::solve: {
      const auto solved = solver.step(NetSolver::work_a_step - work);
      work += solver.work();
      full = solver.full();
      if (!solved) {
        error = solved.error(), phase = Phase::failed;
        return std::unexpected(error);
      }
      if (*solved) phase = Phase::compare;
      return false;
    }
    case Phase::compare:
      keep_if_best();
      work += 10.0 * levels[level].net.unknowns();
      phase = ++level < levels.size() ? Phase::merge : Phase::finish;
      return false;
    case Phase::finish:
      finish();
      phase = Phase::done;
      return true;
  }
  return true;
}

double SurfaceFit::progress() const {
  const Work& work = *work_;
  if (work.phase == Work::Phase::done) return 1;
  if (work.phase == Work::Phase::adding || work.phase == Work::Phase::total ||
      work.phase == Work::Phase::failed)
    return 0;
  // A net costs unknowns^2, near enough: sixteen times the next one.
  double all = 0, done = 0;
  for (std::size_t k = 0; k < work.levels.size(); ++k) {
    const double unknowns = work.levels[k].net.unknowns(), cost = unknowns * unknowns;
    all += cost;
    if (k < work.level) done += cost;
    if (k != work.level) continue;
    if (work.phase == Work::Phase::solve) done += cost * work.solver.progress();
    if (work.phase == Work::Phase::compare) done += cost;
  }
  return std::min(done / all, 0.999);
}

double SurfaceFit::work() const { return work_->work; }
const BSplineSurface& SurfaceFit::surface() const { return work_->levels[work_->best].surface; }
const SurfaceFitReport& SurfaceFit::report() const { return work_->report; }

}  // namespace moldloft::geometry
