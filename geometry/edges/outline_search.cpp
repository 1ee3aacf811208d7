#include "geometry/edges/outline_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// Vectors grow within what their constructor has reserved, which the compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {
namespace {

using Eigen::Vector2d;

// Of the settings' ring: sides down to 40 mm are longer than the smallest.
constexpr std::array scales{1.0, 0.6, 0.4, 0.25};
constexpr double torn_hold = 2;   // so many times as far may a corner lie where the whole rim is torn
constexpr int most_attempts = 5;  // of one scale: a bent side straightens in two or three
constexpr std::size_t points_a_step = 256;
constexpr double widest_share = 0.15;  // of its length: how far a side may leave the chord of its corners
constexpr int trials_a_side = 96, trials_a_step = 4;
constexpr double least_spread = 0.01;  // of three samples along a side: they lie apart
constexpr double fewer_share = 0.97;   // of the edge along lines between three corners: a triangle
constexpr double along_mm = 2, along_share = 0.01;  // of a side's length: it may be bent

double distance_to_segment(const Vector2d& a, const Vector2d& b, const Vector2d& p) {
  const Vector2d d = b - a;
  const double length_2 = d.squaredNorm();
  const double share = length_2 > 0 ? std::clamp((p - a).dot(d) / length_2, 0.0, 1.0) : 0;
  return (p - a - share * d).norm();
}

struct Miss {
  double length_mm = 0;
  int places = 0;
};

Miss miss_of(std::span<const OutlineDeviation> deviations) {
  Miss miss;
  for (const OutlineDeviation& d : deviations) {
    if (d.kind == OutlineDeviation::Kind::apart || d.kind == OutlineDeviation::Kind::corner_unseen) continue;
    miss.length_mm += d.length_mm;
    ++miss.places;
  }
  return miss;
}

// Whole sides, and something in some of the corners.
bool is_clear(std::span<const OutlineDeviation> deviations) {
  using Kind = OutlineDeviation::Kind;
  return std::ranges::all_of(deviations, [](const OutlineDeviation& d) {
    return d.kind == Kind::corner_cut || d.kind == Kind::corner_rounded || d.kind == Kind::corner_missing ||
           d.kind == Kind::corner_unseen;
  });
}

// A side that is bent by what stands in a corner passes near more of it, and misses in more places.
bool is_better(const Miss& a, const Miss& b) {
  return a.length_mm < 0.7 * b.length_mm || (a.places < b.places && a.length_mm < 1.3 * b.length_mm);
}

}  // namespace

OutlineSearch::OutlineSearch(std::size_t max_points, const CornerChoiceSettings& corners,
                             const OutlineSettings& outline, const OutlineSearchSettings& settings)
    : settings_{settings}, choice_{corners}, builder_{max_points, outline}, check_{max_points} {
  left_out_.reserve(max_points);
  best_ = builder_.outline();
}

std::size_t OutlineSearch::bytes() const {
  return choice_.bytes() + builder_.bytes() + check_.bytes() + left_out_.capacity();
}

void OutlineSearch::begin(std::span<const Vector2d> edges, std::span<const Vector2d> candidates) {
  edges_ = edges, candidates_ = candidates;
  named_count_ = corner_count_ = 0;
  share_along_ = 0;
  has_outline_ = is_torn_ = false;
  scale_ = 0;
  begin_scale();
}

void OutlineSearch::begin_scale() {
  choice_.begin(edges_, candidates_, scales[static_cast<std::size_t>(scale_)]);
  attempt_ = 0;
  stage_ = Stage::choose;
}

std::expected<bool, Error> OutlineSearch::step() {
  switch (stage_) {
    case Stage::choose: {
      const auto chosen = choice_.step();
      const bool has_none = candidates_.empty() && !edges_.empty();  // an edge without any corner: a disc
      if (!chosen && chosen.error() != Error::not_four_sided && !has_none)
        return std::unexpected(chosen.error());
      if (chosen && !*chosen) return false;
      choose_done();
      return false;
    }
    case Stage::compare:
      if (!compare_chunk()) return false;
      return next_scale();
    case Stage::build: {
      const auto built = builder_.step();
      if (built && !*built) return false;
      if (built && check_.begin(builder_.outline(), edges_, settings_.check)) {
        stage_ = Stage::check;
        return false;
      }
      // What stands in the corners bends the sides so far that they do not meet.
      if (attempt_ == 0) return repair(), false;
      next_ = along_ = 0;
      stage_ = Stage::compare;  // no outline has these corners
      return false;
    }
    case Stage::check:
      if (!check_.step()) return false;
      return check_done();
    case Stage::sample:
      if (sample_chunk()) stage_ = Stage::agree;
      return false;
    case Stage::agree:
      if (agree_some()) next_ = 0, stage_ = Stage::leave_out;
      return false;
    case Stage::leave_out:
      next_attempt();
      return false;
    case Stage::done:
      return true;
  }
  return true;
}

void OutlineSearch::choose_done() {
  polygon_count_ = choice_.count();
  for (std::size_t i = 0; i < std::min(polygon_count_, most_corners); ++i) polygon_[i] = choice_.corner(i);
  next_ = along_ = 0;
  stage_ = Stage::compare;
  if (polygon_count_ != 4) return;
  if (builder_.begin(edges_, choice_.corners())) stage_ = Stage::build;
}

// Which corners are neighbours is not asked: an outline that goes inwards has no middle to order them about.
bool OutlineSearch::lies_along(const Vector2d& p) const {
  for (std::size_t i = 0; i < polygon_count_; ++i) {
    for (std::size_t k = i + 1; k < polygon_count_; ++k) {
      const Vector2d &a = polygon_[i], &b = polygon_[k];
      if (distance_to_segment(a, b, p) < std::max(along_mm, along_share * (b - a).norm())) return true;
    }
  }
  return false;
}

// How much of the edge lies along lines between the corners at hand.
bool OutlineSearch::compare_chunk() {
  if (polygon_count_ < 3 || polygon_count_ > most_corners) {
    if (corner_count_ == 0 && share_along_ == 0 && polygon_count_ < 3) {
      corner_count_ = polygon_count_;
      std::copy_n(polygon_.begin(), polygon_count_, corners_.begin());
    }
    return true;
  }
  const std::size_t end = std::min(edges_.size(), next_ + points_a_step / 8);
  for (; next_ < end; ++next_) along_ += lies_along(edges_[next_]) ? 1 : 0;
  if (next_ < edges_.size()) return false;
  const double share = static_cast<double>(along_) / static_cast<double>(edges_.size());
  if (share > share_along_ + 0.002) {
    share_along_ = share;
    corner_count_ = polygon_count_;
    std::copy_n(polygon_.begin(), polygon_count_, corners_.begin());
  }
  return true;
}

std::expected<bool, Error> OutlineSearch::check_done() {
  const Miss miss = miss_of(check_.deviations()), least = miss_of(deviations());
  const bool is_same = has_outline_ && miss.places == least.places && miss.length_mm == least.length_mm;
  // A side that was fitted without what stands in its corners is the truer one.
  const bool is_truer = attempt_ > 0 && is_clear(check_.deviations()) && miss.places <= least.places &&
                        miss.length_mm < 1.3 * least.length_mm;
  if (!has_outline_ || miss.places == 0 || is_truer || is_better(miss, least)) {
    has_outline_ = true;
    best_ = builder_.outline();  // of one size: nothing is allocated
    named_count_ = check_.deviations().size();
    std::ranges::copy(check_.deviations(), named_.begin());
  }
  // Leaving teeth out would leave most of the edge out.
  if (attempt_ == 0 && is_torn_all_round()) {
    is_torn_ = true;
    stage_ = Stage::done;
    return true;
  }
  if (miss.places == 0 || (attempt_ > 1 && is_same && is_clear(deviations()) && is_trusted())) {
    stage_ = Stage::done;
    return true;
  }
  if (attempt_ + 1 < most_attempts) {
    repair();
  } else {
    next_ = along_ = 0;
    stage_ = Stage::compare;
  }
  return false;
}

void OutlineSearch::repair() {
  ++attempt_;
  left_out_.clear();
  next_ = 0;
  stage_ = Stage::leave_out;
  if (attempt_ == 1) begin_sampling();
}

Vector2d OutlineSearch::ChordSide::at(const Vector2d& p) const {
  const Vector2d d = p - start;
  return {d.dot(along) / length, along.x() * d.y() - along.y() * d.x()};
}

double OutlineSearch::ChordSide::off_parabola(const Vector2d& q) const {
  return std::abs(q.y() - (parabola[0] + q.x() * (parabola[1] + q.x() * parabola[2])));
}

void OutlineSearch::begin_sampling() {
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d start = choice_.corners()[i], d = choice_.corners()[(i + 1) % 4] - start;
    sides_[i].start = start;
    sides_[i].length = std::max(d.norm(), 1e-3);
    sides_[i].along = d / sides_[i].length;
    sides_[i].count = sides_[i].agreed = 0;
    sides_[i].parabola.setZero();
  }
  draw_ = 1;
  trial_ = 0;
  stage_ = Stage::sample;
}

// The side whose chord the point lies along and nearest to; -1 where there is none.
int OutlineSearch::side_along(const Vector2d& p) const {
  int nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 4; ++i) {
    const ChordSide& side = sides_[static_cast<std::size_t>(i)];
    const Vector2d q = side.at(p);
    if (q.x() < 0 || q.x() > 1 || std::abs(q.y()) > widest_share * side.length || std::abs(q.y()) >= least)
      continue;
    least = std::abs(q.y());
    nearest = i;
  }
  return nearest;
}

// Every n-th point, so that all of the boundary is among the samples.
bool OutlineSearch::sample_chunk() {
  const std::size_t stride = edges_.size() / (2 * side_samples) + 1;
  const std::size_t end = std::min(edges_.size(), next_ + stride * points_a_step / 4);
  for (; next_ < end; next_ += stride) {
    const int i = side_along(edges_[next_]);
    if (i < 0) continue;
    ChordSide& side = sides_[static_cast<std::size_t>(i)];
    if (side.count < side_samples) side.samples[side.count++] = side.at(edges_[next_]);
  }
  return next_ >= edges_.size();
}

bool OutlineSearch::agree_some() {
  for (int k = 0; k < trials_a_step && trial_ < 4 * trials_a_side; ++k, ++trial_)
    try_parabola(sides_[static_cast<std::size_t>(trial_ / trials_a_side)]);
  return trial_ == 4 * trials_a_side;
}

// The parabola through three samples drawn from the side's; kept when more of the others lie on it than on the last.
void OutlineSearch::try_parabola(ChordSide& side) {
  if (side.count < 3) return;
  Eigen::Matrix3d a;
  Eigen::Vector3d b;
  for (int row = 0; row < 3; ++row) {
    draw_ = draw_ * 1664525U + 1013904223U;
    const Vector2d& q = side.samples[(draw_ >> 8) % side.count];
    a.row(row) << 1, q.x(), q.x() * q.x();
    b[row] = q.y();
  }
  if (std::abs(a.determinant()) < least_spread) return;
  const Eigen::Vector3d kept = side.parabola;
  side.parabola = a.inverse() * b;
  const bool bends = std::abs(side.parabola[2]) / 4 > widest_share * side.length;
  std::size_t agreed = 0;
  for (std::size_t i = 0; i < side.count && !bends; ++i)
    agreed += side.off_parabola(side.samples[i]) <= settings_.check.limit_mm ? 1 : 0;
  if (agreed > side.agreed)
    side.agreed = agreed;
  else
    side.parabola = kept;
}

// In the first repair what no parabola of a side agrees with, then what the last outline missed and what is near that.
bool OutlineSearch::is_left_out(std::size_t point) const {
  constexpr double margin_mm = 8;
  if (attempt_ > 1) return check_.is_in_doubt(point, margin_mm);
  const int i = side_along(edges_[point]);
  if (i < 0) return true;
  const ChordSide& side = sides_[static_cast<std::size_t>(i)];
  return side.off_parabola(side.at(edges_[point])) > 2 * settings_.check.limit_mm;
}

void OutlineSearch::next_attempt() {
  const std::size_t end = std::min(edges_.size(), next_ + points_a_step);
  for (; next_ < end; ++next_) left_out_.push_back(is_left_out(next_) ? 1 : 0);
  if (next_ < edges_.size()) return;
  next_ = along_ = 0;
  stage_ = builder_.begin(edges_, choice_.corners(), left_out_) ? Stage::build : Stage::compare;
}

std::expected<bool, Error> OutlineSearch::next_scale() {
  if (++scale_ < static_cast<int>(scales.size())) {
    begin_scale();
    return false;
  }
  stage_ = Stage::done;
  if (has_fewer_corners() || !is_trusted()) return std::unexpected(Error::not_four_sided);
  return true;
}

// Teeth along more than half of the boundary: a corner that is off by as much says nothing of the plate's shape.
bool OutlineSearch::is_torn_all_round() const {
  double torn = 0, around = 0;
  for (const OutlineDeviation& d : deviations())
    torn += d.kind == OutlineDeviation::Kind::ragged ? d.length_mm : 0;
  for (std::size_t i = 0; i < 4; ++i) around += (best_.corners[(i + 1) % 4] - best_.corners[i]).norm();
  return torn > around / 2;
}

bool OutlineSearch::is_trusted() const {
  const double hold_mm = is_torn_ ? torn_hold * settings_.hold_mm : settings_.hold_mm;
  return has_outline_ && std::ranges::all_of(deviations(), [&](const OutlineDeviation& d) {
           return weight_of(d) <= hold_mm;
         });
}

bool OutlineSearch::has_fewer_corners() const { return corner_count_ < 4 && share_along_ > fewer_share; }

// In mm off the outline. What lies apart is beside an edge that is where it should be.
double OutlineSearch::weight_of(const OutlineDeviation& d) const {
  if (d.kind == OutlineDeviation::Kind::apart) return 0;
  if (d.kind == OutlineDeviation::Kind::unseen)
    return settings_.hold_mm * d.length_mm / settings_.hold_unseen_mm;
  return d.farthest_mm();
}

const OutlineDeviation* OutlineSearch::worst() const {
  using Kind = OutlineDeviation::Kind;
  const auto found =
      std::ranges::max_element(deviations(), {}, [&](const OutlineDeviation& d) { return weight_of(d); });
  if (found == deviations().end()) return nullptr;
  // Where a ragged rim runs into a corner, the rim is the reason.
  const auto rim = std::ranges::find_if(deviations(), [&](const OutlineDeviation& d) {
    return d.kind == Kind::ragged && d.length_mm > found->length_mm;
  });
  return rim == deviations().end() ? &*found : &*rim;
}

}  // namespace moldloft::geometry
