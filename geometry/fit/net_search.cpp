#include "geometry/fit/net_search.hpp"

#include "geometry/fit/shot_offsets.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <utility>

namespace moldloft::geometry {

namespace {

// Multiply-adds, about: of a cell from four, of a shot's cell into a coarser one, of a shot, of keeping an unknown.
constexpr double merge_cost = 2000, restrict_cost = 200, shot_cost = 30, keep_cost = 10;

// How many things at `cost` each a step has room for, at most `wanted`; one in any case where it has done nothing yet.
std::size_t room_for(std::size_t wanted, double cost, double budget, double done) {
  const double least = done > 0 || wanted == 0 ? 0 : 1;
  return static_cast<std::size_t>(std::clamp((budget - done) / cost, least, static_cast<double>(wanted)));
}

// The place of the first cell without points; that past the last where there is none.
std::size_t first_empty_cell(const MomentGrid& grid) {
  const std::uint32_t* const counts = grid.counts();
  return static_cast<std::size_t>(std::find(counts, counts + grid.cell_count(), 0u) - counts);
}

}  // namespace

std::pair<int, int> control_of(const SplineNet& net, int unknown) {
  const int fast = net.v_is_fast() ? net.control_v() : net.control_u();
  return net.v_is_fast() ? std::pair(unknown / fast, unknown % fast)
                         : std::pair(unknown % fast, unknown / fast);
}

void NetCandidate::heights_into(Eigen::MatrixXd& z, double datum) const {
  for (int i = 0; i < net.control_u(); ++i) {
    for (int j = 0; j < net.control_v(); ++j) z(i, j) = coefficients[net.index(i, j)] + datum;
  }
}

// The finest net and its halvings: in both directions as long as both can be halved, then in the one that can.
std::vector<NetCandidate> NetSearch::candidates_of(SplineNet finest, bool nested) {
  std::vector<NetCandidate> nets;
  int u = finest.cells_u(), v = finest.cells_v();
  nets.push_back({.net = std::move(finest)});
  while (nested && (u > fewest_spans || v > fewest_spans)) {
    u = std::max(u / 2, fewest_spans), v = std::max(v / 2, fewest_spans);
    nets.push_back({.net = SplineNet(u, v), .merged = MomentGrid::unwritten(u, v)});
  }
  for (NetCandidate& c : nets) c.coefficients.reserve(static_cast<std::size_t>(c.net.unknowns()));
  return nets;
}

bool NetSearch::determined(const NetCandidate& c, const NetSearchSettings& settings, double points) {
  return points > 0 && points >= settings.points_an_unknown * c.net.unknowns();
}

NetSolver NetSearch::solver_for(std::span<const NetCandidate> nets, const NetSearchSettings& settings,
                                double points) {
  const auto largest =
      std::ranges::find_if(nets, [&](const NetCandidate& c) { return determined(c, settings, points); });
  if (largest == nets.end()) return NetSolver(0, 0);
  NetSolver solver(static_cast<std::size_t>(largest->net.unknowns()),
                   static_cast<std::size_t>(largest->net.half_band()));
  solver.want_norm(settings.norm);
  return solver;
}

NetSearch::NetSearch(SplineNet finest, const NetSearchSettings& settings, double most_points)
    : settings_(settings),
      candidates_(candidates_of(std::move(finest), settings.nested)),
      scores_(candidates_.size()),
      count_(candidates_.size()),
      solver_(solver_for(candidates_, settings, most_points)) {
  if (!settings.shrinks) return;
  const SplineNet& net = candidates_.front().net;
  for (int spans = fewest_spans; spans <= std::max(net.cells_u(), net.cells_v()); spans *= 2)
    tables_.push_back(std::make_shared<const SpanTable>(uniform_clamped_knots(spans)));
  // The candidates let go of the tables that they were made with: here, where memory may be freed.
  shrink_to(net.cells_u(), net.cells_v());
}

// Each candidate is no larger than the one that its place was made for.
void NetSearch::shrink_to(int spans_u, int spans_v) {
  const auto table = [&](int spans) {
    const auto place =
        static_cast<std::size_t>(std::countr_zero(static_cast<unsigned>(spans / fewest_spans)));
    return tables_[place];
  };
  count_ = 0;
  for (int u = spans_u, v = spans_v;; u = std::max(u / 2, fewest_spans), v = std::max(v / 2, fewest_spans)) {
    NetCandidate& c = candidates_[count_++];
    c.net = SplineNet(table(u), table(v));
    if (c.merged) c.merged->reshape(u, v);
    if (u == fewest_spans && v == fewest_spans) break;
  }
  chosen_ = first_ = 0, stage_ = Stage::done;
}

std::size_t NetSearch::bytes() const {
  std::size_t sum = solver_.bytes() + scores_.capacity() * sizeof(NetScore);
  for (const auto& table : tables_) sum += table->bytes();
  for (const NetCandidate& c : candidates_) {
    sum += sizeof c + c.net.bytes() + c.coefficients.capacity() * sizeof(double);
    if (c.merged) sum += c.merged->bytes();
  }
  return sum;
}

// Candidates with more unknowns than the points determine are passed over; their moments are merged all the same.
std::expected<void, Flaw> NetSearch::start(const MomentGrid& points, const NetTask& model,
                                           ShotOffsets* shots) {
  points_ = &points, model_ = model, shots_ = shots;
  const double count = static_cast<double>(model.totals.points);
  first_ = 0;
  while (first_ < count_ && !determined(candidates_[first_], settings_, count)) ++first_;
  if (first_ == count_ || !(model.totals.weight > 0)) {
    first_ = 0;
    return fail(Error::too_few_points, model.totals.points);
  }
  search_in(1, count_, Stage::merge);
  return {};
}

void NetSearch::search_in(std::size_t first, std::size_t end, Stage stage) {
  at_ = first, end_ = end, stage_ = stage;
  cell_ = shot_ = 0, shot_cell_ = 0;
}

std::unexpected<Flaw> NetSearch::fail(Error error, std::size_t where) {
  flaw_ = {error, where}, stage_ = Stage::failed;
  return std::unexpected(flaw_);
}

void NetSearch::also_try(SplineNet net, std::span<const int> at_u, std::span<const int> at_v) {
  assert(stage_ == Stage::done && model_.boundary.empty() && !settings_.shrinks);
  MomentGrid merged(net.cells_u(), net.cells_v());
  merged.merge_blocks(*points_, at_u, at_v);
  // It may have more unknowns than the nested nets that the points determine.
  if (!solver_.holds(net)) {
    solver_ = NetSolver(static_cast<std::size_t>(net.unknowns()), static_cast<std::size_t>(net.half_band()));
    solver_.want_norm(settings_.norm);
  }
  std::size_t place = first_;
  while (place < count_ && candidates_[place].net.unknowns() >= net.unknowns()) ++place;
  const auto offset = static_cast<std::ptrdiff_t>(place);
  candidates_.insert(candidates_.begin() + offset, {.net = std::move(net), .merged = std::move(merged)});
  scores_.insert(scores_.begin() + offset, NetScore{});
  ++count_;
  search_in(place, place + 1, Stage::start);
}

void NetSearch::solve_again() {
  assert(stage_ == Stage::done);
  search_in(chosen_, chosen_ + 1, Stage::start);
}

// The cells of all nets, each one's from those of the next finer one; true when all are merged. Alternating with the
// solutions would find the caches cold.
bool NetSearch::merge_some(double budget) {
  for (; at_ < end_ && candidates_[at_].merged; ++at_, cell_ = 0) {
    MomentGrid& to = *candidates_[at_].merged;
    const auto left = static_cast<std::size_t>(to.cell_count() - cell_);
    const int end = cell_ + static_cast<int>(room_for(left, merge_cost, budget, work_));
    to.merge_cells(cell_, end, grid(candidates_[at_ - 1]));
    work_ += merge_cost * (end - cell_);
    cell_ = end;
    if (cell_ < to.cell_count()) return false;
  }
  return true;
}

// The shots' cells into those of the net at hand; true when all are merged.
bool NetSearch::merge_shots(double budget) {
  if (shots_ == nullptr || at_ == 0) return true;
  const MomentGrid& to = *candidates_[at_].merged;
  while (shot_ < shots_->count()) {
    if (shot_cell_ == 0) shot_cells_ = shots_->cells_of(shot_);
    const std::size_t end = shot_cell_ + room_for(shot_cells_ - shot_cell_, restrict_cost, budget, work_);
    if (end == shot_cell_ && end < shot_cells_) return false;
    shots_->coarsen(shot_, to, shot_cell_, end);
    work_ += shot_cost + restrict_cost * static_cast<double>(end - shot_cell_);
    shot_cell_ = end;
    if (end < shot_cells_) return false;
    ++shot_, shot_cell_ = 0;
  }
  shots_->coarsened(to);
  shot_ = 0;
  return true;
}

std::expected<bool, Flaw> NetSearch::start_net() {
  const NetCandidate& c = candidates_[at_];
  if (model_.fairing <= 0 && model_.sparse_fairing <= 0) {
    const std::size_t empty = first_empty_cell(grid(c));
    if (empty < static_cast<std::size_t>(grid(c).cell_count())) return fail(Error::empty_cells, empty);
  }
  model_.net = &c.net, model_.moments = &grid(c);
  solver_.start(model_, shots_);
  return false;
}

// The offsets are part of every net's model, so a finer net gains nothing by following the shots' steps. All nets are
// compared under the finest net's estimate of the noise.
void NetSearch::take_score() {
  NetCandidate& c = candidates_[at_];
  c.result = solver_.result();
  c.coefficients.assign(solver_.coefficients().begin(), solver_.coefficients().end());
  model_.point_sigma_mm = c.result.point_sigma_mm;
  scores_[at_] = score_of(c.net, model_.totals, c.result);
  work_ += keep_cost * c.net.unknowns();
}

std::expected<bool, Flaw> NetSearch::step(double budget, double spent) {
  // Small nets and short stages share a step. Half of a step leaves room for the largest piece that cannot be divided.
  work_ = spent, full_ = false;
  while (true) {
    const auto ready = piece(budget);
    if (!ready || *ready || full_ || work_ >= budget / 2) return ready;
  }
}

std::expected<bool, Flaw> NetSearch::piece(double budget) {
  switch (stage_) {
    case Stage::merge:
      full_ = !merge_some(budget);
      if (full_) return false;
      at_ = 0, stage_ = Stage::merge_shots;
      [[fallthrough]];
    case Stage::merge_shots:
      full_ = !merge_shots(budget);
      if (full_) return false;
      if (at_ < first_) return ++at_, false;
      [[fallthrough]];
    case Stage::start:
      stage_ = Stage::solve;
      return start_net();
    case Stage::solve: {
      const auto solved = solver_.step(budget - work_);
      work_ += solver_.work();
      full_ = solver_.full();
      if (!solved) {
        const SplineNet& net = candidates_[at_].net;
        const auto [i, j] = control_of(
            net, std::max(0, solver_.singular_unknown() >= 0 ? solver_.singular_unknown()
                                                             : solver_.factor().smallest_column()));
        return fail(solved.error(), static_cast<std::size_t>(i) * net.control_v() + j);
      }
      if (*solved) stage_ = Stage::score;
      return false;
    }
    case Stage::score:
      take_score();
      if (++at_ < end_) return stage_ = Stage::merge_shots, false;
      chosen_ = first_ + choose_net(scores(), settings_.criterion, settings_.tolerance);
      stage_ = Stage::done;
      return true;
    case Stage::done:
      return true;
    case Stage::failed:
      break;
  }
  return std::unexpected(flaw_);
}

std::expected<void, Flaw> NetSearch::finish() {
  while (true) {
    const auto ready = step(std::numeric_limits<double>::max());
    if (!ready) return std::unexpected(ready.error());
    if (*ready) return {};
  }
}

// A net costs unknowns^2, near enough: sixteen times the next one.
double NetSearch::progress() const {
  if (stage_ == Stage::done) return 1;
  if (stage_ == Stage::failed || stage_ == Stage::merge) return 0;
  double all = 0, done = 0;
  for (std::size_t k = 0; k < count_; ++k) {
    const double unknowns = candidates_[k].net.unknowns(), cost = unknowns * unknowns;
    all += cost;
    if (k < at_) done += cost;
    if (k != at_) continue;
    if (stage_ == Stage::solve) done += cost * solver_.progress();
    if (stage_ == Stage::score) done += cost;
  }
  return std::min(done / all, 0.999);
}

}  // namespace moldloft::geometry
