#include "tasks/slices/shot_view.hpp"

#include "hal/base/reserved.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace moldloft::tasks {

using geometry::PlateRun;

namespace {
constexpr std::size_t max_runs_per_stripe =
    8;  // a plate with more holes than that on one line is not a plate
}

ShotView::ShotView(std::size_t max_stripes, std::size_t max_points, const ShotViewSettings& settings)
    : settings_{settings}, finder_{max_stripes, max_points}, viewer_{max_stripes * max_runs_per_stripe} {
  stripes_.reserve(max_stripes);
}

std::size_t ShotView::bytes() const {
  return finder_.bytes() + viewer_.bytes() + stripes_.capacity() * sizeof(geometry::StripeView);
}

void ShotView::begin(const hal::Frame& frame, const Request& request, hal::Scanner* unpacks) {
  settings_.runs.hint_reach_mm = request.reach_mm;
  request_ = request;
  frame_ = &frame;
  unpacks_ = unpacks;
  stage_ = Stage::cut;
  runs_ = {};
  boundary_ = {};
  stripes_.clear();
  for (const auto& line : frame.lines()) {
    const auto column = [&](const std::vector<float>& c) {
      return std::span{c}.subspan(line.first, line.count);
    };
    hal::add_within_reserve(stripes_,
                            geometry::StripeView{column(frame.x), column(frame.y), column(frame.z)});
  }
  // A frame beyond the memory plan cannot come: the driver was told the same limits.
  const auto begun = finder_.begin(stripes_);
  assert(begun.has_value());
  (void)begun;
}

std::size_t ShotView::points_here() const {
  return unpacks_ == nullptr ? frame_->point_count : unpacks_->unpacked();
}

// Stripes are cut as soon as their own points are there.
std::size_t ShotView::points_wanted() const {
  const std::size_t stripes = finder_.reads_up_to(stripes_a_step);
  if (stripes == 0) return 0;
  const auto& last = frame_->stripes[stripes - 1];
  return std::size_t{last.first} + last.count;
}

bool ShotView::waits() const {
  return stage_ == Stage::cut && points_here() < points_wanted() && unpacks_->packed() == 0;
}

bool ShotView::step() {
  switch (stage_) {
    case Stage::cut: {
      if (points_here() < points_wanted()) {
        unpacks_->unpack(points_a_step);
        return false;
      }
      const auto cut = finder_.cut_stripes(stripes_a_step, settings_.runs);
      if (!cut) return end();
      if (*cut) stage_ = Stage::find;
      return false;
    }
    case Stage::find: {
      const auto found = finder_.find_plate(runs_a_step, request_.hint, settings_.runs);
      if (!found) return end();
      if (!*found) return false;
      runs_ = finder_.plate_runs();
      if (!request_.boundary) return end();
      viewer_.begin(runs_, stripes_.size(), settings_.boundary);
      stage_ = Stage::boundary;
      return false;
    }
    case Stage::boundary:
      if (!viewer_.step()) return false;
      boundary_ = viewer_.view();
      return end();
    case Stage::done:
      return true;
  }
  return true;
}

ShotView::PieceKind ShotView::next_kind() const {
  switch (stage_) {
    case Stage::cut:
      if (points_here() < points_wanted()) return PieceKind::unpack;
      return finder_.walks() ? PieceKind::walk_stripes : PieceKind::cut_stripes;
    case Stage::find:
      return finder_.describes() ? PieceKind::describe_plate : PieceKind::find_plate;
    case Stage::boundary:
    case Stage::done:
      break;
  }
  return PieceKind::other;
}

bool ShotView::end() {
  stage_ = Stage::done;
  rewind({});
  return true;
}

Eigen::Vector3d ShotView::point_of(const PlateRun& run, std::uint32_t point) const {
  const auto& stripe = stripes_[run.stripe];
  return {stripe.x[point], stripe.y[point], stripe.z[point]};
}

Eigen::Vector3d ShotView::first_of(const PlateRun& run) const {
  return is_edge(run.at_first) ? run.edge_first : point_of(run, run.first);
}

Eigen::Vector3d ShotView::last_of(const PlateRun& run) const {
  return is_edge(run.at_last) ? run.edge_last : point_of(run, run.last);
}

void ShotView::rewind(const Lattice& lattice) {
  lattice_ = lattice;
  run_ = 0;
  point_ = runs_.empty() ? 0 : runs_.front().first;
}

bool ShotView::within_margins(const PlateRun& run, std::uint32_t point) const {
  const auto& stripe = stripes_[run.stripe];
  const double y = stripe.y[point];
  if (is_edge(run.at_first) && y - run.edge_first.y() < settings_.edge_margin_mm) return false;
  if (is_edge(run.at_last) && run.edge_last.y() - y < settings_.edge_margin_mm) return false;
  return true;
}

// Most of its two neighbours on each side lie elsewhere. Two spacings on a slope of 15 degrees are 0.1 mm, well within
// the gate of a scanner whose noise is a thousandth of its field.
bool ShotView::is_outlier(const PlateRun& run, std::uint32_t point) const {
  const auto& z = stripes_[run.stripe].z;
  const std::uint32_t from = std::max(run.first, point < 2 ? 0 : point - 2),
                      to = std::min(run.last, point + 2);
  const double gate = settings_.outlier_sigmas * settings_.runs.noise_mm;
  int near = 0, far = 0;
  for (std::uint32_t i = from; i <= to; ++i) {
    if (i == point || !std::isfinite(z[i])) continue;
    ++(std::abs(z[point] - z[i]) > gate ? far : near);
  }
  return far > near;
}

std::size_t ShotView::next(std::span<Eigen::Vector3d> out) {
  std::size_t count = 0;
  while (count < out.size() && run_ < runs_.size()) {
    const PlateRun& run = runs_[run_];
    if (point_ > run.last || (run.stripe - lattice_.first_stripe) % lattice_.stripe_stride != 0) {
      if (++run_ < runs_.size()) point_ = runs_[run_].first;
      continue;
    }
    const auto& stripe = stripes_[run.stripe];
    if (std::isfinite(stripe.z[point_]) && within_margins(run, point_) && !is_outlier(run, point_)) {
      out[count++] = {stripe.x[point_], stripe.y[point_], stripe.z[point_]};
    }
    point_ += lattice_.point_stride;
  }
  return count;
}

}  // namespace moldloft::tasks
