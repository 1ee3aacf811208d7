#include "geometry/edges/outline_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

// Vectors grow within what their constructor has reserved, which the compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {
namespace {

using Eigen::Vector2d;

constexpr std::size_t points_a_step = 16, bins_a_step = 512, feet_a_step = 1024;
constexpr std::size_t most_bins = 8192, most_runs = 128;
constexpr double least_bin_mm = 2;  // edge points of one shot lie 1.4 mm apart
constexpr int foot_iterations = 3;
constexpr std::size_t fewest_teeth = 3;
// Round more than one corner: a plate of another smooth shape crosses the four sides of its outline eight times.
constexpr int turns_of_teeth = 12, fewest_turns = 3;
constexpr double small_corner_mm = 12;
constexpr double least_spread = 0.15;   // of the chord; points all along it have 0.29
constexpr std::size_t margin_bins = 2;  // a notch's walls stand over the ends of its mouth

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Of edge points about a place: enough for the line and the circle of least squares through them.
struct Moments {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0, z = 0, zz = 0;  // z = x^2 + y^2
  void add(const Vector2d& p) {
    const double q = p.squaredNorm();
    n += 1, x += p.x(), y += p.y();
    xx += p.x() * p.x(), xy += p.x() * p.y(), yy += p.y() * p.y();
    z += q, zz += q * q, xz += q * p.x(), yz += q * p.y();
  }
};

struct LineSpread {
  double along = 0, across = 0;  // standard deviations
};

LineSpread line_spread(const Moments& m) {
  const double xx = m.xx / m.n - m.x * m.x / (m.n * m.n), yy = m.yy / m.n - m.y * m.y / (m.n * m.n),
               xy = m.xy / m.n - m.x * m.y / (m.n * m.n);
  const double middle = (xx + yy) / 2, half = std::hypot((xx - yy) / 2, xy);
  return {std::sqrt(middle + half), std::sqrt(std::max(0.0, middle - half))};
}

double chord_distance(const Vector2d& a, const Vector2d& b, const Vector2d& p) {
  const Vector2d d = b - a;
  const double share = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
  return (p - a - share * d).norm();
}

struct Arc {
  double radius = 0, rms = std::numeric_limits<double>::infinity();
};

// The arc that touches both sides of a corner, its centre `along` times the radius from it, for which the points lie
// nearest: |p - r along| = r, whose residual z - 2 r (along p) + r^2 (along^2 - 1) is 2 r times the distance, nearly.
Arc touching_arc(const Moments& m, const Vector2d& along, double largest_radius) {
  const double k = along.squaredNorm() - 1;
  const double w = along.x() * m.x + along.y() * m.y;
  const double ww =
      along.x() * along.x() * m.xx + 2 * along.x() * along.y() * m.xy + along.y() * along.y() * m.yy;
  const double zw = along.x() * m.xz + along.y() * m.yz;
  const auto mean_square = [&](double r) {
    const double sum = m.zz + 4 * r * r * ww + r * r * r * r * k * k * m.n - 4 * r * zw +
                       2 * r * r * k * m.z - 4 * r * r * r * k * w;
    return std::max(0.0, sum) / (4 * r * r * m.n);
  };
  Arc best;
  constexpr int trials = 128;
  const double growth = std::pow(largest_radius, 1.0 / trials);  // from 1 mm
  double r = 1;
  for (int i = 0; i <= trials; ++i, r *= growth) {
    const double rms = std::sqrt(mean_square(r));
    if (rms < best.rms) best = {r, rms};
  }
  return best;
}

}  // namespace

double outline_limit_mm(double noise_mm) { return std::max(0.5, 5 * noise_mm); }

struct OutlineCheck::Foot {
  float station = 0, inwards = 0;
};

struct OutlineCheck::Bin {
  std::uint32_t on = 0, off = 0;
  std::uint32_t inside = 0;  // of those that are off
};

// A stretch of the boundary that misses, in bins from first_bin_ on.
struct OutlineCheck::Run {
  std::size_t begin = 0, end = 0;  // one past its last bin
  bool beside = false;             // others lie on the outline there
  std::uint32_t points = 0;
  double inwards = 0, outwards = 0;
  Vector2d reference = Vector2d::Zero();
  int corner = -1;
  Moments moments{};
};

OutlineCheck::OutlineCheck(std::size_t max_points) {
  feet_.reserve(max_points);
  bins_.reserve(most_bins);
  runs_.reserve(most_runs);
}

OutlineCheck::~OutlineCheck() = default;
OutlineCheck::OutlineCheck(OutlineCheck&&) noexcept = default;

std::size_t OutlineCheck::bytes() const {
  return feet_.capacity() * sizeof(Foot) + bins_.capacity() * sizeof(Bin) + runs_.capacity() * sizeof(Run);
}

std::expected<void, Error> OutlineCheck::begin(const Outline& outline, std::span<const Vector2d> edge_points,
                                               const OutlineCheckSettings& settings) {
  stage_ = Stage::done;
  found_count_ = more_ = 0;
  longest_miss_mm_ = longest_unseen_mm_ = 0;
  if (edge_points.size() > feet_.capacity()) return std::unexpected(Error::capacity);
  station_[0] = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& control = outline.sides[i].control;
    if (control.empty() || !std::ranges::all_of(control, [](const Vector2d& p) { return p.allFinite(); }))
      return std::unexpected(Error::not_finite);
    const double length = (control.back() - control.front()).norm();
    if (!(length > 0)) return std::unexpected(Error::no_extent);
    station_[i + 1] = station_[i] + length;
    bulge_[i] = 0;
    for (const Vector2d& p : control)
      bulge_[i] = std::max(bulge_[i], chord_distance(control.front(), control.back(), p));
  }
  settings_ = settings;
  outline_ = &outline;
  points_ = edge_points;
  bins_used_ = std::min<std::size_t>(most_bins, static_cast<std::size_t>(station_[4] / least_bin_mm) + 1);
  bin_mm_ = station_[4] / static_cast<double>(bins_used_);
  bins_.assign(bins_used_, {});
  corner_gap_.fill(std::numeric_limits<double>::infinity());
  feet_.clear();
  runs_.clear();
  next_ = 0;
  in_run_ = in_apart_ = false;
  stage_ = Stage::project;
  return {};
}

bool OutlineCheck::step() {
  switch (stage_) {
    case Stage::project:
      project_chunk();
      break;
    case Stage::walk:
      walk_chunk();
      break;
    case Stage::gather:
      gather_chunk();
      break;
    case Stage::name:
      name_runs();
      join_teeth();
      add_unseen_corners();
      stage_ = Stage::done;
      return true;
    case Stage::done:
      return true;
  }
  return false;
}

// The nearest place of the four sides. The parameter runs along the chord, from where Newton's method goes to the foot.
OutlineCheck::Foot OutlineCheck::foot_of(const Vector2d& p) const {
  double least = std::numeric_limits<double>::infinity();
  Foot foot;
  for (std::size_t i = 0; i < 4; ++i) {
    const PlanCurve& side = outline_->sides[i];
    const Vector2d start = side.control.front(), chord = side.control.back() - start;
    // The side lies within the hull of its control points.
    if (chord_distance(start, side.control.back(), p) - bulge_[i] > least) continue;
    const double first = side.begin(), last = side.end();
    double t = first + std::clamp((p - start).dot(chord) / chord.squaredNorm(), 0.0, 1.0) * (last - first);
    auto at = side.at(t);
    for (int k = 0; k < foot_iterations; ++k) {
      const double slope = at.first.squaredNorm() + (at.value - p).dot(at.second);
      if (!(slope > 0)) break;
      t = std::clamp(t - (at.value - p).dot(at.first) / slope, first, last);
      at = side.at(t);
    }
    const double distance = (p - at.value).norm();
    // Beyond a corner both sides have their foot in it: outside, whatever the tangent of the one says.
    const bool beyond =
        (t <= first && (p - at.value).dot(at.first) < 0) || (t >= last && (p - at.value).dot(at.first) > 0);
    if (!(distance < least)) continue;
    least = distance;
    const bool inside = !beyond && cross(at.first, p - at.value) > 0;
    const double share = (t - first) / (last - first);
    foot.station = static_cast<float>(station_[i] + share * (station_[i + 1] - station_[i]));
    foot.inwards = static_cast<float>(inside ? distance : -distance);
  }
  return foot;
}

std::size_t OutlineCheck::bin_of(double station) const {
  return std::min(bins_used_ - 1, static_cast<std::size_t>(std::max(0.0, station) / bin_mm_));
}

void OutlineCheck::project_chunk() {
  const std::size_t end = std::min(points_.size(), next_ + points_a_step);
  for (; next_ < end; ++next_) {
    const Vector2d& p = points_[next_];
    // A point that is no number has no place; it is counted nowhere.
    const Foot foot = p.allFinite() ? foot_of(p) : Foot{};
    feet_.push_back(foot);
    if (!p.allFinite()) continue;
    for (std::size_t i = 0; i < 4; ++i)
      corner_gap_[i] = std::min(corner_gap_[i], (p - outline_->sides[i].control.front()).norm());
    Bin& bin = bins_[bin_of(foot.station)];
    ++(std::abs(foot.inwards) <= settings_.limit_mm ? bin.on : bin.off);
    if (foot.inwards > settings_.limit_mm) ++bin.inside;
  }
  if (next_ < points_.size()) return;
  first_bin_ = clean_bin();
  next_ = 0;
  stage_ = Stage::walk;
}

// A bin in the middle of a stretch where all points lie on the outline: no run goes across it. Where there is none, one
// with points on the outline.
std::size_t OutlineCheck::clean_bin() const {
  constexpr std::size_t around = 6;
  std::size_t any = 0, clean = 0;
  for (std::size_t k = 0; k < 2 * bins_used_; ++k) {
    const Bin& bin = bins_[k % bins_used_];
    if (bin.on > 0) any = k % bins_used_;
    clean = bin.off > 0 ? 0 : clean + 1;
    const Bin& middle = bins_[(k + bins_used_ - around) % bins_used_];
    if (clean > 2 * around && middle.on > 0) return (k + bins_used_ - around) % bins_used_;
  }
  return any;
}

// From a bin with points on the outline once round. Stretches without such bins are runs; bins that hold both kinds
// make runs of what lies beside.
void OutlineCheck::walk_chunk() {
  constexpr std::size_t apart_gap = 4;  // bins
  const std::size_t stop = std::min(bins_used_, next_ + bins_a_step);
  for (; next_ < stop; ++next_) {
    const Bin& bin = bins_[(first_bin_ + next_) % bins_used_];
    if (bin.on == 0 && !in_run_) in_run_ = true, run_begin_ = next_;
    if (bin.on > 0 && in_run_) end_run(next_);
    if (bin.on > 0 && bin.off > 0) {
      if (!in_apart_) in_apart_ = true, apart_begin_ = next_;
      apart_last_ = next_;
    } else if (in_apart_ && next_ - apart_last_ > apart_gap) {
      end_apart(apart_last_ + 1);
    }
  }
  if (next_ < bins_used_) return;
  if (in_run_) end_run(bins_used_);
  if (in_apart_) end_apart(apart_last_ + 1);
  drop_covered();
  place_runs();
  next_ = 0;
  stage_ = Stage::gather;
}

// Cuts the empty ends off a run with points beside the outline, unless they are too long to go unseen.
void OutlineCheck::end_run(std::size_t end) {
  in_run_ = false;
  std::size_t first = end, last = run_begin_, off = 0;
  for (std::size_t k = run_begin_; k < end; ++k) {
    const std::uint32_t n = bins_[(first_bin_ + k) % bins_used_].off;
    if (n == 0) continue;
    off += n;
    first = std::min(first, k);
    last = k + 1;
  }
  const double length = static_cast<double>(end - run_begin_) * bin_mm_;
  const double missed = off > 0 ? static_cast<double>(last - first) * bin_mm_ : 0;
  const bool misses = off >= settings_.min_points && missed >= settings_.min_length_mm;
  const bool is_unseen = length - missed >= settings_.unseen_mm;
  if (!misses) longest_miss_mm_ = std::max(longest_miss_mm_, missed);
  if (!is_unseen) longest_unseen_mm_ = std::max(longest_unseen_mm_, length - missed);
  if (!misses && !is_unseen) return;
  const bool whole = is_unseen;
  const Run run{.begin = whole ? run_begin_ : first, .end = whole ? end : last};
  const auto before =
      std::ranges::find_if(runs_.rbegin(), runs_.rend(), [](const Run& r) { return !r.beside; });
  if (before != runs_.rend() && run.begin - before->end <= margin_bins) {
    before->end = run.end;
    return;
  }
  keep(run);
}

void OutlineCheck::end_apart(std::size_t end) {
  in_apart_ = false;
  std::size_t off = 0;
  for (std::size_t k = apart_begin_; k < end; ++k) off += bins_[(first_bin_ + k) % bins_used_].off;
  const double length = static_cast<double>(end - apart_begin_) * bin_mm_;
  const double from = unwrapped(apart_begin_), to = unwrapped(end);
  // Two points inside a corner are not false by chance.
  const bool is_corner = off >= 2 && to - from <= small_corner_mm && corner_between(from, to) >= 0;
  if (!is_corner && (off < settings_.min_points || length < settings_.min_length_mm)) {
    longest_miss_mm_ = std::max(longest_miss_mm_, length);
    return;
  }
  keep({.begin = apart_begin_, .end = end, .beside = true});
}

void OutlineCheck::keep(const Run& run) {
  if (runs_.size() == runs_.capacity()) {
    ++more_;
    return;
  }
  runs_.push_back(run);
}

// What lies beside the outline at the very ends of a run belongs to the run.
void OutlineCheck::drop_covered() {
  const auto covered = [&](const Run& run) {
    return run.beside && std::ranges::any_of(runs_, [&](const Run& other) {
             return !other.beside && run.begin + margin_bins >= other.begin &&
                    run.end <= other.end + margin_bins;
           });
  };
  runs_.erase(std::remove_if(runs_.begin(), runs_.end(), covered), runs_.end());
}

// The one corner between two places along the boundary; -1 where there is none, or more.
int OutlineCheck::corner_between(double begin, double end) const {
  int corners = 0, found = -1;
  for (int c = 0; c < 8; ++c) {
    const double at = station_[static_cast<std::size_t>(c % 4)] + (c >= 4 ? station_[4] : 0);
    if (at < begin - bin_mm_ || at > end + bin_mm_) continue;
    ++corners;
    found = c % 4;
  }
  return corners == 1 ? found : -1;
}

// Which corner a run goes round, and the place about which its points are summed.
void OutlineCheck::place_runs() {
  for (Run& run : runs_) {
    const double begin = unwrapped(run.begin), end = unwrapped(run.end);
    run.reference = at_station((begin + end) / 2);
    // Where a corner lacks a few millimetres, the ends of its sides share their bins with what misses.
    if (run.beside && end - begin > small_corner_mm) continue;
    run.corner = corner_between(begin, end);
    if (run.corner >= 0) run.beside = false;
    if (run.corner >= 0) run.reference = outline_->corners[static_cast<std::size_t>(run.corner)];
  }
}

double OutlineCheck::unwrapped(std::size_t bin) const {
  return static_cast<double>(first_bin_ + bin) * bin_mm_;
}

Vector2d OutlineCheck::at_station(double station) const {
  const double s = std::fmod(station, station_[4]);
  std::size_t i = 0;
  while (i < 3 && s >= station_[i + 1]) ++i;
  const PlanCurve& side = outline_->sides[i];
  const double share = (s - station_[i]) / (station_[i + 1] - station_[i]);
  return side.value(side.begin() + std::clamp(share, 0.0, 1.0) * (side.end() - side.begin()));
}

// Gives each point that misses to its run: one that covers its place, or lies right beside it.
void OutlineCheck::gather_chunk() {
  const std::size_t end = runs_.empty() ? feet_.size() : std::min(feet_.size(), next_ + feet_a_step);
  for (; next_ < end && !runs_.empty(); ++next_) {
    const Foot& foot = feet_[next_];
    if (!(std::abs(foot.inwards) > settings_.limit_mm)) continue;
    const std::size_t bin = (bin_of(foot.station) + bins_used_ - first_bin_) % bins_used_;
    Run* best = nullptr;
    for (Run& run : runs_) {
      const std::size_t margin = run.beside ? 0 : margin_bins;
      if (bin + margin < run.begin || bin >= run.end + margin) continue;
      if (best == nullptr || best->beside) best = &run;
    }
    if (best == nullptr) continue;
    ++best->points;
    best->inwards = std::max(best->inwards, static_cast<double>(foot.inwards));
    best->outwards = std::max(best->outwards, static_cast<double>(-foot.inwards));
    best->moments.add(points_[next_] - best->reference);
  }
  if (next_ < end) next_ = end;
  if (next_ < feet_.size()) return;
  stage_ = Stage::name;
}

bool OutlineCheck::is_in_doubt(std::size_t point, double margin_mm) const {
  const double station = feet_[point].station;
  return std::ranges::any_of(runs_, [&](const Run& run) {
    if (run.beside) return false;
    const double begin = unwrapped(run.begin) - margin_mm, end = unwrapped(run.end) + margin_mm;
    return (station >= begin && station <= end) ||
           (station + station_[4] >= begin && station + station_[4] <= end) ||
           (station - station_[4] >= begin && station - station_[4] <= end);
  });
}

void OutlineCheck::name_runs() {
  std::sort(runs_.begin(), runs_.end(), [](const Run& a, const Run& b) { return a.begin < b.begin; });
  for (const Run& run : runs_) {
    if (run.beside && run.points < settings_.min_points && run.corner < 0) continue;  // a neighbour's
    if (found_count_ == most_deviations) {
      ++more_;
      continue;
    }
    found_[found_count_++] = name_run(run);
  }
}

OutlineDeviation OutlineCheck::name_run(const Run& run) const {
  using Kind = OutlineDeviation::Kind;
  const double begin = unwrapped(run.begin), end = unwrapped(run.end);
  OutlineDeviation named;
  named.from = at_station(begin), named.to = at_station(end);
  named.length_mm = end - begin;
  named.inwards_mm = run.inwards, named.outwards_mm = run.outwards;
  named.points = run.points;
  const double middle = std::fmod((begin + end) / 2, station_[4]);
  while (named.side < 3 && middle >= station_[named.side + 1u]) ++named.side;
  named.place = run.reference;
  if (run.points > 0 && run.corner < 0) named.place += Vector2d(run.moments.x, run.moments.y) / run.moments.n;
  if (run.beside)
    named.kind = Kind::apart;
  else if (run.points == 0)
    named.kind = Kind::unseen;
  else if (run.corner >= 0)
    describe_corner(run, named);
  else if (is_ragged(run))
    named.kind = Kind::ragged;
  return named;
}

// In and out, again and again.
bool OutlineCheck::is_ragged(const Run& run) const {
  const double begin = unwrapped(run.begin), end = unwrapped(run.end);
  const bool goes_round = std::ranges::any_of(station_, [&](double corner) {
    const auto within = [&](double at) { return at > begin && at < end; };
    return within(corner) || within(corner + station_[4]);
  });
  int turns = 0;
  std::optional<bool> was_inside;
  for (std::size_t k = run.begin; k < run.end; ++k) {
    const Bin& bin = bins_[(first_bin_ + k) % bins_used_];
    if (bin.off == 0) continue;
    const bool is_inside = 2 * bin.inside > bin.off;
    if (was_inside && is_inside != *was_inside) ++turns;
    was_inside = is_inside;
  }
  return turns >= (goes_round ? turns_of_teeth : fewest_turns) && end - begin < settings_.tooth_mm * turns;
}

// What stands where the corner should be: a line, an arc, or neither.
void OutlineCheck::describe_corner(const Run& run, OutlineDeviation& named) const {
  using Kind = OutlineDeviation::Kind;
  named.side = static_cast<std::uint8_t>(run.corner);
  named.corner_gap_mm = corner_gap_[named.side];
  const double begin = unwrapped(run.begin), end = unwrapped(run.end);
  double corner = station_[named.side];
  if (corner < begin - bin_mm_) corner += station_[4];
  named.leg_before_mm = std::max(0.0, corner - begin), named.leg_after_mm = std::max(0.0, end - corner);
  named.kind = Kind::corner_missing;
  if (run.points < settings_.min_points || run.outwards > run.inwards) return;
  const double chord = std::hypot(named.leg_before_mm, named.leg_after_mm);
  const double doubt =
      std::clamp(0.05 * chord, 2 * settings_.limit_mm, 4 * settings_.limit_mm);  // of the shape
  const PlanCurve& before = outline_->sides[(named.side + 3u) % 4];
  const PlanCurve& after = outline_->sides[named.side];
  const Vector2d back = -before.at(before.end()).first.normalized(),
                 on = after.at(after.begin()).first.normalized();
  const Vector2d middle = (back + on).normalized();
  const Arc arc = touching_arc(run.moments, middle / std::abs(cross(middle, on)), 4 * chord);
  const LineSpread line = line_spread(run.moments);
  // Points in one place of the gap tell nothing of its shape.
  if (line.along < least_spread * chord) return;
  if (line.across <= arc.rms && line.across < doubt) {
    named.kind = Kind::corner_cut;
  } else if (arc.rms < doubt) {
    named.kind = Kind::corner_rounded;
    named.radius_mm = arc.radius;
  }
}

// Steps of one side that follow each other closely are one ragged rim.
void OutlineCheck::join_teeth() {
  using Kind = OutlineDeviation::Kind;
  const auto is_tooth = [](const OutlineDeviation& d) { return d.kind == Kind::step; };
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found_count_;) {
    std::size_t last = i, teeth = is_tooth(found_[i]) ? 1 : 0;
    for (std::size_t k = i + 1; teeth > 0 && k < found_count_; ++k) {
      if (found_[k].kind != Kind::apart && !is_tooth(found_[k])) break;
      if (found_[k].side != found_[i].side || (found_[k].from - found_[last].to).norm() > settings_.tooth_mm)
        break;
      last = k;
      teeth += is_tooth(found_[k]) ? 1 : 0;
    }
    OutlineDeviation joined = found_[i];
    if (teeth >= fewest_teeth) {
      joined.kind = Kind::ragged;
      joined.place *= joined.points;
      for (std::size_t k = i + 1; k <= last; ++k) {
        const OutlineDeviation& tooth = found_[k];
        joined.length_mm += (tooth.from - joined.to).norm() + tooth.length_mm;
        joined.to = tooth.to;
        joined.inwards_mm = std::max(joined.inwards_mm, tooth.inwards_mm);
        joined.outwards_mm = std::max(joined.outwards_mm, tooth.outwards_mm);
        joined.place += tooth.place * tooth.points;
        joined.points += tooth.points;
      }
      joined.place /= std::max<double>(1, joined.points);
      i = last + 1;
    } else {
      ++i;
    }
    found_[kept++] = joined;
  }
  found_count_ = kept;
}

// A corner in whose place an arc or a cut was seen is named already.
void OutlineCheck::add_unseen_corners() {
  // A scanner with stripes farther apart sees fewer points, of corners too.
  const double spacing = station_[4] / static_cast<double>(std::max<std::size_t>(1, points_.size()));
  const double allowed = std::max(settings_.corner_gap_mm, 4 * spacing);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector2d& corner = outline_->sides[i].control.front();
    const auto covers = [&](const Run& run) {
      const double begin = unwrapped(run.begin) - bin_mm_, end = unwrapped(run.end) + bin_mm_;
      const double near = station_[i], far = station_[i] + station_[4];
      return !run.beside && ((near >= begin && near <= end) || (far >= begin && far <= end));
    };
    const bool is_named = std::ranges::any_of(runs_, covers);
    if (corner_gap_[i] <= allowed || is_named) continue;
    if (found_count_ == most_deviations) {
      ++more_;
      continue;
    }
    OutlineDeviation& d = found_[found_count_++];
    d = {
        .kind = OutlineDeviation::Kind::corner_unseen, .place = corner, .side = static_cast<std::uint8_t>(i)};
    const double gap = std::min(corner_gap_[i], station_[4] / 4);
    d.from = at_station(station_[i] - gap + station_[4]), d.to = at_station(station_[i] + gap);
    d.length_mm = 2 * gap;
    d.corner_gap_mm = gap;
    d.leg_before_mm = d.leg_after_mm = gap;
  }
}

std::expected<std::vector<OutlineDeviation>, Error> check_outline(const Outline& outline,
                                                                  std::span<const Vector2d> edge_points,
                                                                  const OutlineCheckSettings& settings) {
  OutlineCheck check(edge_points.size());
  if (const auto begun = check.begin(outline, edge_points, settings); !begun)
    return std::unexpected(begun.error());
  while (!check.step()) {
  }
  return std::vector<OutlineDeviation>(check.deviations().begin(), check.deviations().end());
}

}  // namespace moldloft::geometry
