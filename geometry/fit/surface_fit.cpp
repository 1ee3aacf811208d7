#include "geometry/fit/surface_fit.hpp"

#include "geometry/fit/net_search.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

// Blocks of matrices whose sizes were fixed in the constructor, vectors that grow within what was reserved there: the
// compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {

namespace {

constexpr double total_cost = 100;  // multiply-adds, about, of a cell's weight

constexpr int cleared_a_step = 512;  // cells: 0.3 MB

// Room for a surface over every net that a plate may have; what is not taken is not touched.
class Surfaces {
 public:
  Surfaces(int max_u, int max_v) : longest_(std::max(max_u, max_v)) {
    const int shortest = std::min(max_u, max_v);
    for (int u = fewest_spans; u <= longest_; u *= 2) {
      for (int v = fewest_spans; v <= longest_; v *= 2) {
        BSplineSurface& s = all_.emplace_back();
        if (std::min(u, v) > shortest) continue;
        s.knots_u = uniform_clamped_knots(u), s.knots_v = uniform_clamped_knots(v);
        for (Eigen::MatrixXd* const m : {&s.x, &s.y, &s.z}) m->resize(u + cubic, v + cubic);
      }
    }
    for (Eigen::MatrixXd* const m : {&all_.front().x, &all_.front().y, &all_.front().z}) m->setZero();
  }

  BSplineSurface& over(int spans_u, int spans_v) {
    return all_[place(spans_u) * place(2 * longest_) + place(spans_v)];
  }

  std::size_t bytes() const {
    std::size_t sum = 0;
    for (const BSplineSurface& s : all_) sum += 3 * static_cast<std::size_t>(s.z.size()) * sizeof(double);
    return sum;
  }

 private:
  static std::size_t place(int spans) {
    return static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(spans / fewest_spans)));
  }

  int longest_;
  std::vector<BSplineSurface> all_;
};

// The power of two whose spans are nearest to `span_mm` by ratio, within what there is room for.
int spans_over(double length_mm, double span_mm, int most) {
  const double wanted = std::clamp(length_mm / span_mm * std::numbers::sqrt2, 1.0, static_cast<double>(most));
  return std::min(
      most, std::max(fewest_finest_spans, static_cast<int>(std::bit_floor(static_cast<unsigned>(wanted)))));
}

// Room for the shots' moments: a shot sees a tenth of a plate, every place is seen by a few shots, and small
// plates, which every shot sees whole, have few shots.
std::size_t shot_cells_planned(const SurfaceFitSettings& settings) {
  const std::size_t cells = static_cast<std::size_t>(settings.max_spans_u) * settings.max_spans_v;
  return settings.shot_sigma_mm > 0 ? std::max<std::size_t>(4 * cells, 16 * 1024) : 0;
}

}  // namespace

struct SurfaceFit::Work {
  enum class Stage { adding, total, search, done, failed };

  explicit Work(const SurfaceFitSettings& s)
      : settings(s),
        finest(MomentGrid::unwritten(s.max_spans_u, s.max_spans_v)),
        search(SplineNet(s.max_spans_u, s.max_spans_v), {.tolerance = s.tolerance_mm, .shrinks = true}),
        surfaces(s.max_spans_u, s.max_spans_v),
        shots(s.max_shots, s.max_spans_u, s.max_spans_v, shot_cells_planned(s),
              s.shot_sigma_mm > 0 ? (s.max_spans_u + 3u) * (s.max_spans_v + 3u) : 0) {}

  void choose_finest();
  void fold(int of_shot);
  bool total_some();
  std::expected<void, Flaw> start_search();
  void finish();
  std::unexpected<Error> fail(const Flaw& flaw) {
    error = flaw.error, stage = Stage::failed;
    return std::unexpected(error);
  }

  SurfaceFitSettings settings;
  MomentGrid finest;  // takes the points
  NetSearch search;
  Surfaces surfaces;
  BSplineSurface* surface =
      &surfaces.over(fewest_spans, fewest_spans);  // that of the net that was chosen last
  ShotOffsets shots;
  const PlanMap* map = nullptr;
  PointTotals totals;
  SurfaceFitReport report;
  Eigen::Vector2d last_uv{0.5, 0.5};
  double datum = 0;  // heights are summed relative to the first point's, so that squares keep their digits
  Stage stage = Stage::adding;
  Error error = Error::too_few_points;
  int cell = 0;  // that clearing or adding up is at
  double work = 0;
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
  std::size_t sum = sizeof(Work) + work_->finest.bytes() + work_->search.bytes() + work_->shots.bytes();
  return sum + work_->surfaces.bytes();
}

void SurfaceFit::begin(const PlanMap& map) {
  begin_clearing(map);
  while (!clear_some()) {
  }
}

bool SurfaceFit::clear_some() {
  MomentGrid& finest = work_->finest;
  const int end = std::min(work_->cell + cleared_a_step, finest.cell_count());
  finest.clear(work_->cell, end);
  work_->cell = end;
  return end == finest.cell_count();
}

void SurfaceFit::begin_clearing(const PlanMap& map) {
  work_->map = &map;
  work_->cell = 0;
  work_->choose_finest();
  work_->shots.clear(work_->finest.cells_u(), work_->finest.cells_v());
  work_->totals = {};
  work_->report = {};
  work_->last_uv = {0.5, 0.5};
  work_->block.count = 0, work_->block.shot_rows_wanted = work_->settings.shot_sigma_mm > 0;
  work_->stage = Work::Stage::adding;
}

void SurfaceFit::Work::choose_finest() {
  const auto [least, most] = std::minmax(settings.max_spans_u, settings.max_spans_v);
  int spans_u = settings.max_spans_u, spans_v = settings.max_spans_v;
  if (settings.finest_span_mm > 0) {
    const Eigen::Vector2d corners[] = {map->at(0, 0).value, map->at(1, 0).value, map->at(1, 1).value,
                                       map->at(0, 1).value};
    const auto side = [&](int i) { return (corners[(i + 1) % 4] - corners[i]).norm(); };
    const double length_u = std::max(side(0), side(2)), length_v = std::max(side(1), side(3));
    spans_u = spans_over(length_u, settings.finest_span_mm, length_u < length_v ? least : most);
    spans_v = spans_over(length_v, settings.finest_span_mm, length_u < length_v ? most : least);
  }
  finest.reshape(spans_u, spans_v);
  search.shrink_to(spans_u, spans_v);
}

// The block's heights and weights, and u and v, are there.
void SurfaceFit::Work::fold(int of_shot) {
  if (block.count == 0) return;
  const MomentKernel& kernel = moment_kernel();
  const int nu = finest.cells_u(), nv = finest.cells_v();
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
  work_->shots.finish_adding();
  work_->totals.weight = work_->totals.squares = 0;
  work_->report.points_used = work_->totals.points;
  work_->cell = 0;
  work_->stage = Work::Stage::total;
}

// What all cells hold together; true when the last is in.
bool SurfaceFit::Work::total_some() {
  for (; cell < finest.cell_count(); ++cell, work += total_cost) {
    if (work + total_cost > NetSolver::work_a_step) return false;
    totals.weight += finest.cells()[cell].weight();
    totals.squares += finest.cells()[cell].squares();
  }
  return true;
}

std::expected<void, Flaw> SurfaceFit::Work::start_search() {
  if (map == nullptr) return std::unexpected(Flaw{Error::too_few_points});
  const Eigen::Vector2d across = map->at(1, 0.5).value - map->at(0, 0.5).value;
  const Eigen::Vector2d along = map->at(0.5, 1).value - map->at(0.5, 0).value;
  NetTask model;
  model.totals = totals;
  model.length_u_mm = across.norm(), model.length_v_mm = along.norm();
  model.fairing = settings.fairing;
  model.shot_sigma_mm = settings.shot_sigma_mm, model.point_sigma_mm = settings.noise_mm;
  return search.start(finest, model, &shots);
}

void SurfaceFit::Work::finish() {
  const NetCandidate& chosen = search.chosen();
  surface = &surfaces.over(chosen.net.cells_u(), chosen.net.cells_v());
  chosen.heights_into(surface->z, datum);
  map->to_net(*surface);
  const NetScore& score = search.score();
  report.spans_u = score.spans_u, report.spans_v = score.spans_v;
  report.finest_spans_u = search.scores().front().spans_u,
  report.finest_spans_v = search.scores().front().spans_v;
  report.rms_residual_mm = score.rms_residual, report.sigma_mm = score.sigma;
  report.smallest_pivot = score.smallest_pivot;
  report.empty_cells = score.empty_cells;
  report.corner_sigma_mm = chosen.result.corner_sigma_mm;
  report.shot_offset_rms_mm = chosen.result.offset_rms_mm;
  report.shot_offset_max_mm = chosen.result.offset_max_mm;
  report.shots_without_offset = shots.exact();
}

std::expected<bool, Error> SurfaceFit::step() {
  Work& w = *work_;
  w.work = 0;
  switch (w.stage) {
    case Work::Stage::adding:
      return std::unexpected(Error::too_few_points);
    case Work::Stage::total:
      if (!w.total_some()) return false;
      if (const auto started = w.start_search(); !started) return w.fail(started.error());
      w.stage = Work::Stage::search;
      if (w.work >= NetSolver::work_a_step / 2) return false;
      [[fallthrough]];
    case Work::Stage::search: {
      const auto found = w.search.step(NetSolver::work_a_step, w.work);
      w.work = w.search.work();
      if (!found) return w.fail(found.error());
      if (!*found) return false;
      w.finish();
      w.stage = Work::Stage::done;
      return true;
    }
    case Work::Stage::done:
      return true;
    case Work::Stage::failed:
      break;
  }
  return std::unexpected(w.error);
}

double SurfaceFit::progress() const {
  if (work_->stage == Work::Stage::done) return 1;
  return work_->stage == Work::Stage::search ? work_->search.progress() : 0;
}

double SurfaceFit::work() const { return work_->work; }
const BSplineSurface& SurfaceFit::surface() const { return *work_->surface; }
const SurfaceFitReport& SurfaceFit::report() const { return work_->report; }

}  // namespace moldloft::geometry
