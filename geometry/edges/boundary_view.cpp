#include "geometry/edges/boundary_view.hpp"

#include "geometry/edges/edge_lines.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

// Vectors grow within what their constructor has reserved, which the compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {

namespace {

constexpr double tangent_stretch_mm = 30;  // long enough for 0.1 degrees, short against the bend of a side
constexpr std::size_t points_a_step = 32;
constexpr std::size_t bridged_stripes = 2;  // stripes without an edge point that do not cut a piece
constexpr double shortest_run_mm =
    3.5;  // a tip's last stripes are too short to count as runs (plate_runs.hpp)

double turn_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

}  // namespace

struct BoundaryViewer::Ends {
  std::uint16_t stripe;
  bool low_is_edge, high_is_edge;
  bool low_is_covered, high_is_covered;  // RunEnd::hidden: something lies over the edge
  Eigen::Vector3d low, high;
};

struct BoundaryViewer::Break {
  std::size_t before;  // the ring's point after the break
  // The boundary goes on between stripes, rather than out of the field: after the piece that ends here,
  // before the one that starts here.
  bool ends_hidden, starts_hidden;
};

BoundaryViewer::BoundaryViewer(std::size_t max_runs) {
  ends_.reserve(max_runs);
  ring_.reserve(2 * max_runs);
  points_.reserve(2 * max_runs);
  breaks_.reserve(2 * max_runs + 4);
  pieces_.reserve(2 * max_runs + 4);
}

BoundaryViewer::~BoundaryViewer() = default;
BoundaryViewer::BoundaryViewer(BoundaryViewer&&) noexcept = default;

std::size_t BoundaryViewer::bytes() const {
  return ends_.capacity() * sizeof(Ends) + (ring_.capacity() + points_.capacity()) * sizeof(EdgePoint) +
         breaks_.capacity() * sizeof(Break) + pieces_.capacity() * sizeof(BoundaryPiece);
}

// The outer boundary takes every stripe's lowest and highest end; what lies between them are holes and glare.
void BoundaryViewer::collect_ends(std::span<const PlateRun> runs) {
  ends_.clear();
  for (const PlateRun& run : runs) {
    if (!run.edge_first.allFinite() || !run.edge_last.allFinite()) continue;
    if (ends_.empty() || ends_.back().stripe != run.stripe) {
      if (ends_.size() == ends_.capacity()) return;
      ends_.push_back({.stripe = run.stripe,
                       .low_is_edge = is_edge(run.at_first),
                       .high_is_edge = false,
                       .low_is_covered = run.at_first == RunEnd::hidden,
                       .high_is_covered = false,
                       .low = run.edge_first,
                       .high = run.edge_last});
    }
    Ends& ends = ends_.back();
    ends.high = run.edge_last;
    ends.high_is_edge = is_edge(run.at_last);
    ends.high_is_covered = run.at_last == RunEnd::hidden;
  }
}

namespace {

enum class Cap { out_of_field, closes, hidden };

}  // namespace

// Walks once round the region, counter-clockwise, collecting edge points and the breaks between them.
void BoundaryViewer::walk_ring(View& view, std::size_t stripe_count, const BoundaryViewSettings& settings) {
  ring_.clear(), breaks_.clear();
  const std::size_t n = ends_.size();
  const auto add_break = [&](bool hidden) {
    if (!breaks_.empty() && breaks_.back().before == ring_.size()) {
      breaks_.back().starts_hidden = hidden;
    } else if (breaks_.size() < breaks_.capacity()) {
      breaks_.push_back({ring_.size(), hidden, hidden});
    }
  };
  // A region that ends inside the field with stripe `at` closes there if its stripes get shorter fast enough
  // to vanish before the next one; `inner` are the stripes that come before it.
  const auto cap = [&](std::size_t at, std::ptrdiff_t inner, bool outermost) {
    const double x = ends_[at].low.x();
    const bool beside_field = std::abs(x) >= settings.field_half_x_mm - settings.field_margin_mm;
    if (outermost || beside_field) return Cap::out_of_field;
    const auto length = [&](std::size_t k) { return ends_[k].high.y() - ends_[k].low.y(); };
    double shrinks = 0;
    const auto before = [&](std::ptrdiff_t steps) { return static_cast<std::ptrdiff_t>(at) + steps * inner; };
    for (std::ptrdiff_t steps : {1, 3}) {
      if (before(steps) < 0 || before(steps) >= static_cast<std::ptrdiff_t>(n)) break;
      shrinks = std::max(shrinks, (length(before(steps)) - length(at)) / static_cast<double>(steps));
    }
    return length(at) <= 1.5 * shrinks + shortest_run_mm ? Cap::closes : Cap::hidden;
  };
  const auto add_end = [&](std::size_t k, bool low, std::size_t& missing) {
    const bool edge = low ? ends_[k].low_is_edge : ends_[k].high_is_edge;
    const bool covered = low ? ends_[k].low_is_covered : ends_[k].high_is_covered;
    if (edge) {
      ring_.push_back({low ? ends_[k].low : ends_[k].high, ends_[k].stripe});
      missing = 0;
    } else if (!covered || ++missing > bridged_stripes) {
      add_break(false);
    }
  };
  const auto add_cap = [&](std::size_t at, Cap kind, std::optional<double>& hidden_x, double outward) {
    const bool any_edge = ends_[at].low_is_edge || ends_[at].high_is_edge;
    if (kind == Cap::hidden) hidden_x = ends_[at].low.x() + 0.5 * outward * settings.stripe_pitch_mm;
    if (kind == Cap::hidden && any_edge) add_break(true);
    if (kind == Cap::out_of_field) add_break(false);
  };

  std::size_t missing = 0;
  for (std::size_t k = 0; k < n; ++k) add_end(k, true, missing);
  const bool last_outermost = ends_.back().stripe + 1u == stripe_count;
  add_cap(n - 1, cap(n - 1, -1, last_outermost), view.hidden_high_x_mm, 1);
  missing = 0;
  for (std::size_t k = n; k-- > 0;) add_end(k, false, missing);
  add_cap(0, cap(0, 1, ends_.front().stripe == 0), view.hidden_low_x_mm, -1);
}

// The ring starts behind its first break, so that no stretch crosses the start of the walk.
void BoundaryViewer::open_ring() {
  const std::size_t n = ring_.size();
  // A break after the last point is one before the first.
  if (!breaks_.empty() && breaks_.back().before == n) {
    const Break last = breaks_.back();
    breaks_.pop_back();
    if (!breaks_.empty() && breaks_.front().before == 0) {
      breaks_.front().ends_hidden = last.ends_hidden;
    } else {
      breaks_.insert(breaks_.begin(), {0, last.ends_hidden, last.starts_hidden});
    }
  }
  // A ring without a break, a plate smaller than the field, is opened in the middle of its lower side.
  if (breaks_.empty()) breaks_.push_back({n / 4, false, false});
  ring_start_ = breaks_.front().before;
  std::rotate_copy(ring_.begin(), ring_.begin() + ring_start_, ring_.end(), std::back_inserter(points_));
  ring_.swap(points_);  // the ring keeps all points in order, points_ takes those that are believed
  points_.clear();
}

// The points from the next break to the one after it.
void BoundaryViewer::take_stretch() {
  const std::size_t from = breaks_[next_break_].before - ring_start_;
  const bool last = next_break_ + 1 == breaks_.size();
  const std::size_t to = last ? ring_.size() : breaks_[next_break_ + 1].before - ring_start_;
  stretch_begin_ = points_.size();
  std::copy(ring_.begin() + from, ring_.begin() + to, std::back_inserter(points_));
}

// Some points of one pass over the stretch; true when the pass is done. Judged against the unchanged
// points, dropped afterwards.
bool BoundaryViewer::drop_false_points() {
  const auto piece = std::span<const EdgePoint>(points_).subspan(stretch_begin_);
  const std::size_t end = piece.size() + drop_lag;
  for (std::size_t left = points_a_step; left > 0 && drop_at_ < end; --left, ++drop_at_) {
    if (drop_at_ >= drop_lag) {
      const std::size_t settled = drop_at_ - drop_lag;
      const bool keep = !verdicts_[settled % drop_lag];
      if (keep) points_[stretch_begin_ + drop_kept_++] = points_[stretch_begin_ + settled];
    }
    if (drop_at_ < piece.size()) verdicts_[drop_at_ % drop_lag] = is_false_point(piece, drop_at_);
  }
  if (drop_at_ < end) return false;
  points_.resize(stretch_begin_ + drop_kept_);
  return true;
}

namespace {

bool well_inside(const Eigen::Vector2d& p, const BoundaryViewSettings& settings) {
  const double reach = settings.field_margin_mm + 6;
  return std::abs(p.x()) < settings.field_half_x_mm - reach &&
         std::abs(p.y()) < settings.field_half_y_mm - reach;
}

// True when the few points that end with `last` do not simply leave the field, or lie so far apart that the
// side runs almost along the stripes: the scanner sees more of it when it is turned.
bool stub_hides(const EdgePoint& last, const EdgePoint& before, const BoundaryViewSettings& settings) {
  const bool steep = (last.position - before.position).head<2>().norm() > 4 * settings.stripe_pitch_mm;
  return steep || well_inside(last.position.head<2>(), settings);
}

// True when a piece stops although its direction would take it to the next stripe, and the one after, well
// inside the field: its boundary turned away unseen, between stripes.
bool vanishes(std::span<const EdgePoint> part, bool at_last, const BoundaryViewSettings& settings) {
  if (part.size() < settings.min_side_points) return false;
  const auto stretch = at_last ? last_stretch(part, tangent_stretch_mm, settings.min_side_points)
                               : first_stretch(part, tangent_stretch_mm, settings.min_side_points);
  const Eigen::Vector2d direction = fit_edge_line(stretch).direction * (at_last ? 1.0 : -1.0);
  const Eigen::Vector2d end = (at_last ? part.back() : part.front()).position.head<2>();
  const double to_next_stripe = settings.stripe_pitch_mm / std::max(std::abs(direction.x()), 1e-3);
  return well_inside(end, settings) && well_inside(end + 2 * to_next_stripe * direction, settings);
}

}  // namespace

namespace {

// Where the points of `part` want two lines rather than one, and those make a corner with at least `least`
// points on either side: the first point beyond it. 0 where there is none.
std::size_t corner_within(std::span<const EdgePoint> part, std::size_t least,
                          const BoundaryViewSettings& settings) {
  const std::size_t min_side = settings.min_side_points;
  if (part.size() < min_side + least) return 0;
  const EdgeLine one = fit_edge_line(part);
  double squares = 0, largest = 0;
  for (const EdgePoint& p : part) {
    const double r = one.distance(p.position.head<2>());
    squares += r * r, largest = std::max(largest, std::abs(r));
  }
  const double rms = std::sqrt(squares / static_cast<double>(part.size()));
  if (rms <= settings.max_line_rms_mm && largest <= 4 * settings.max_line_rms_mm) return 0;
  // Two lines may split a piece with two corners between them; the point farthest from the chord is then
  // near one. Both searches may leave a side with two points: forced to more, they would borrow them from
  // the other side.
  for (const std::size_t split : {best_split(part, 2), split_at_farthest(part, tangent_stretch_mm, 2)}) {
    if (split < least || part.size() - split < least) continue;
    const EdgeLine a = fit_edge_line(last_stretch(part.first(split), tangent_stretch_mm, min_side));
    const EdgeLine b = fit_edge_line(first_stretch(part.subspan(split), tangent_stretch_mm, min_side));
    if (std::abs(turn_between(a.direction, b.direction)) >= settings.min_corner_turn) return split;
  }
  return 0;
}

}  // namespace

// One look at one part of the stretch; true when all corners are found. The first splits are found before the others
// are known: each is placed again between its neighbours, twice, and asked once more whether it is a corner.
bool BoundaryViewer::find_corners() {
  const std::span<const EdgePoint> all(points_);
  auto& at = cuts_.at;
  const auto cut = at.begin() + static_cast<std::ptrdiff_t>(cut_),
             end = at.begin() + static_cast<std::ptrdiff_t>(cuts_.count);
  if (cut_passes_ == 0) {
    if (cut_ + 1 < cuts_.count && cuts_.count < at.size()) {
      const std::size_t split =
          corner_within(all.subspan(at[cut_], at[cut_ + 1] - at[cut_]), settings_.min_side_points, settings_);
      if (split == 0) {
        ++cut_;
        return false;
      }
      std::copy_backward(cut + 1, end, end + 1);
      at[cut_ + 1] = at[cut_] + split;
      ++cuts_.count;
      return false;
    }
    cut_passes_ = 1, cut_ = 1;
    return false;
  }
  if (cut_ + 1 < cuts_.count) {
    const auto between = all.subspan(at[cut_ - 1], at[cut_ + 1] - at[cut_ - 1]);
    const std::size_t split = corner_within(between, settings_.min_side_points, settings_);
    if (split != 0) {
      at[cut_] = at[cut_ - 1] + split;
      ++cut_;
    } else {
      std::copy(cut + 1, end, cut);
      --cuts_.count;
    }
    return false;
  }
  cut_ = 1;
  return ++cut_passes_ > 2;
}

// A stub of two or three points beyond a corner has no tangent: the side ends at the corner, and unless the
// stub leads out of the field, the rest of the boundary hides between stripes. Says whether it hides at the
// last, or first, end.
bool BoundaryViewer::trim_last(std::span<const EdgePoint> all, Cuts& cuts) const {
  const BoundaryViewSettings& settings = settings_;
  const std::size_t from = cuts.at[cuts.count - 2], end = cuts.at[cuts.count - 1];
  const std::size_t split = corner_within(all.subspan(from, end - from), 2, settings);
  if (split == 0 || end - from - split >= settings.min_side_points) {
    return vanishes(all.subspan(cuts.at[0], end - cuts.at[0]), true, settings);
  }
  cuts.at[cuts.count - 1] = from + split;
  return stub_hides(all[end - 1], all[end - 2], settings);
}

bool BoundaryViewer::trim_first(std::span<const EdgePoint> all, Cuts& cuts) const {
  const BoundaryViewSettings& settings = settings_;
  const std::size_t begin = cuts.at[0], to = cuts.at[1];
  const std::size_t split = corner_within(all.subspan(begin, to - begin), 2, settings);
  if (split == 0 || split >= settings.min_side_points) {
    return vanishes(all.subspan(begin, cuts.at[cuts.count - 1] - begin), false, settings);
  }
  cuts.at[0] = begin + split;
  return stub_hides(all[begin], all[begin + 1], settings);
}

// Cuts one stretch half-way between its corners and describes every part.
void BoundaryViewer::describe(const Cuts& cuts, bool hidden_first, bool hidden_last,
                              const BoundaryViewSettings& settings) {
  BoundaryPiece piece;
  piece.hidden_first = hidden_first, piece.hidden_last = hidden_last;
  const std::size_t count = cuts.count;
  if (count == 2) return describe_side(cuts.at[0], cuts.at[1], piece, settings);
  for (std::size_t k = 1; k + 1 < count; ++k) {
    const std::size_t from = k == 1 ? cuts.at[0] : (cuts.at[k - 1] + cuts.at[k]) / 2;
    const std::size_t to = k + 2 == count ? cuts.at[count - 1] : (cuts.at[k] + cuts.at[k + 1]) / 2;
    piece.hidden_first = k == 1 && hidden_first;
    piece.hidden_last = k + 2 == count && hidden_last;
    piece.goes_on = k + 2 < count;
    describe_corner(from, cuts.at[k], to, piece, settings);
  }
}

void BoundaryViewer::describe_side(std::size_t begin, std::size_t end, BoundaryPiece piece,
                                   const BoundaryViewSettings& settings) {
  const std::size_t min_side = settings.min_side_points;
  const auto part = std::span<const EdgePoint>(points_).subspan(begin, end - begin);
  if (part.size() < min_side || pieces_.size() == pieces_.capacity()) return;
  piece.first = static_cast<std::uint32_t>(begin), piece.count = static_cast<std::uint32_t>(end - begin);
  piece.tangent_first = fit_edge_line(first_stretch(part, tangent_stretch_mm, min_side)).direction;
  piece.tangent_last = fit_edge_line(last_stretch(part, tangent_stretch_mm, min_side)).direction;
  piece.turn = turn_between(piece.tangent_first, piece.tangent_last);
  piece.rms_mm = fit_edge_line(part).rms_mm;
  pieces_.push_back(piece);
}

void BoundaryViewer::describe_corner(std::size_t begin, std::size_t split, std::size_t end,
                                     BoundaryPiece piece, const BoundaryViewSettings& settings) {
  const std::span<const EdgePoint> all(points_);
  const auto before = all.subspan(begin, split - begin), after = all.subspan(split, end - split);
  const std::size_t min_side = settings.min_side_points;
  const EdgeLine in = fit_edge_line(last_stretch(before, tangent_stretch_mm, min_side));
  const EdgeLine out = fit_edge_line(first_stretch(after, tangent_stretch_mm, min_side));
  piece.kind = BoundaryPiece::Kind::corner;
  piece.first = static_cast<std::uint32_t>(begin), piece.count = static_cast<std::uint32_t>(end - begin);
  piece.points_before = static_cast<std::uint32_t>(split - begin);
  piece.tangent_first = fit_edge_line(first_stretch(before, tangent_stretch_mm, min_side)).direction;
  piece.tangent_last = fit_edge_line(last_stretch(after, tangent_stretch_mm, min_side)).direction;
  piece.turn = turn_between(piece.tangent_first, piece.tangent_last);
  piece.corner = meeting_point(in, out).value_or(all[split].position.head<2>());
  const double nb = static_cast<double>(before.size()), na = static_cast<double>(after.size());
  const double rb = fit_edge_line(before).rms_mm, ra = fit_edge_line(after).rms_mm;
  piece.rms_mm = std::sqrt((nb * rb * rb + na * ra * ra) / (nb + na));
  if (pieces_.size() < pieces_.capacity()) pieces_.push_back(piece);
}

BoundaryViewer::View BoundaryViewer::look(std::span<const PlateRun> runs, std::size_t stripe_count,
                                          const BoundaryViewSettings& settings) {
  begin(runs, stripe_count, settings);
  while (!step()) {
  }
  return view_;
}

void BoundaryViewer::begin(std::span<const PlateRun> runs, std::size_t stripe_count,
                           const BoundaryViewSettings& settings) {
  settings_ = settings, stripe_count_ = stripe_count;
  view_ = {};
  points_.clear(), pieces_.clear(), ring_.clear();
  next_break_ = 0;
  collect_ends(runs);
  stage_ = ends_.empty() ? Stage::done : Stage::take;
  if (ends_.empty()) return;
  walk_ring(view_, stripe_count, settings);
  if (!ring_.empty()) open_ring();
}

bool BoundaryViewer::step() {
  switch (stage_) {
    case Stage::take:
      if (ring_.empty() || next_break_ == breaks_.size()) {
        finish();
        stage_ = Stage::done;
        return true;
      }
      take_stretch();
      drops_done_ = 0, drop_at_ = drop_kept_ = 0;
      stage_ = Stage::drop;
      return false;
    case Stage::drop: {
      if (!drop_false_points()) return false;
      drop_at_ = drop_kept_ = 0;
      // Twice, since one false point beside another can hide it.
      if (++drops_done_ < 2) return false;
      const bool enough = points_.size() - stretch_begin_ >= settings_.min_side_points;
      stage_ = enough ? Stage::find_corners : Stage::take;
      if (!enough) ++next_break_;
      cuts_ = {.at = {stretch_begin_, points_.size()}};
      cut_passes_ = 0, cut_ = 0;
      return false;
    }
    case Stage::find_corners:
      if (find_corners()) stage_ = Stage::trim_last;
      return false;
    case Stage::trim_last:
      hidden_last_ = breaks_[(next_break_ + 1) % breaks_.size()].ends_hidden;
      hidden_last_ |= trim_last(points_, cuts_);
      stage_ = Stage::trim_first;
      return false;
    case Stage::trim_first:
      hidden_first_ = breaks_[next_break_].starts_hidden;
      hidden_first_ |= trim_first(points_, cuts_);
      stage_ = Stage::describe;
      return false;
    case Stage::describe:
      describe(cuts_, hidden_first_, hidden_last_, settings_);
      ++next_break_;
      stage_ = Stage::take;
      return false;
    case Stage::done:
      return true;
  }
  return true;
}

void BoundaryViewer::finish() {
  const auto length = [&](const BoundaryPiece& piece) {
    return (points_[piece.first + piece.count - 1].position - points_[piece.first].position).head<2>().norm();
  };
  std::sort(pieces_.begin(), pieces_.end(),
            [&](const BoundaryPiece& a, const BoundaryPiece& b) { return length(a) > length(b); });
  view_.points = points_;
  view_.pieces = pieces_;
  // Stripes may be missing here and there; a plate that ends inside the field leaves the outer ones empty.
  const bool reaches_sides = !view_.hidden_low_x_mm && !view_.hidden_high_x_mm;
  view_.plate_fills_field = ring_.empty() && reaches_sides && ends_.size() * 10 >= stripe_count_ * 9;
}

}  // namespace moldloft::geometry
