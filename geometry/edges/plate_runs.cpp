#include "geometry/edges/plate_runs.hpp"

#include "geometry/edges/stripe_line.hpp"
#include "geometry/edges/stripe_walk.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// Vectors grow within what their constructor has reserved, which the compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {

namespace {

constexpr double trim_sigmas =
    4.0;  // the last points of a run are looked at once more, against the points inside

constexpr double start_slope =
    0.6;  // tan 31 degrees: what a line may turn out to be while its slope is unknown
constexpr std::size_t line_points = 12;  // for lines at the ends of runs, as long as the filter's memory
constexpr std::size_t trim_points = 3;   // as many points as a side wall leaves beyond an edge

// Runs a stripe may hold on average: a field of 102 mm holds 34 of the shortest.
constexpr std::size_t runs_per_stripe = 40;
constexpr std::size_t stripes_in_turn = StripeLanes::count;
constexpr std::size_t points_in_turn = 192;
constexpr std::uint32_t farthest_link =
    3;  // stripes ahead: two may be missing between two runs of one region

// The usual distance between neighbouring points near one end of a run, where perspective may
// have stretched it.
double spacing_near_end(const StripeView& stripe, std::span<const std::uint32_t> good, bool at_last) {
  std::array<double, 21> sample;
  std::size_t count = 0;
  const std::size_t n = std::min(good.size(), sample.size() + 1);
  const auto end = at_last ? good.last(n) : good.first(n);
  for (std::size_t k = 1; k < n; ++k) {
    const double steps = end[k] - end[k - 1];
    sample[count++] = (stripe.y[end[k]] - stripe.y[end[k - 1]]) / steps;
  }
  if (count == 0) return 0;
  std::nth_element(sample.begin(), sample.begin() + count / 2, sample.begin() + count);
  return sample[count / 2];
}

}  // namespace

struct PlateRunFinder::Run {
  std::uint32_t begin, count;  // in good_
  std::uint32_t parent;        // union-find over runs
  std::uint16_t stripe;
  bool linked_forward;
  double y_first, y_last;
};

PlateRunFinder::PlateRunFinder(std::size_t max_stripes, std::size_t max_points, Simd simd)
    : max_stripes_(max_stripes), max_points_(max_points), simd_(simd) {
  good_.reserve(max_points);
  pieces_.reserve(max_points / fewest_piece_points + 1);
  walked_.resize(max_points / fewest_piece_points + stripes_in_turn);
  walks_.reserve(stripes_in_turn);
  runs_.reserve(max_stripes * runs_per_stripe);
  found_.reserve(max_stripes * runs_per_stripe);
  first_run_.reserve(max_stripes + 1);
}

PlateRunFinder::~PlateRunFinder() = default;
PlateRunFinder::PlateRunFinder(PlateRunFinder&&) noexcept = default;

std::size_t PlateRunFinder::bytes() const {
  return good_.capacity() * sizeof(good_[0]) +
         (pieces_.capacity() + walked_.capacity()) * sizeof(StripePiece) + runs_.capacity() * sizeof(Run) +
         found_.capacity() * sizeof(PlateRun) + walks_.capacity() * sizeof(StripeWalk) +
         first_run_.capacity() * sizeof(first_run_[0]);
}

// The next stripes are walked in turn. What a walk finds lies apart until the stripes before it are done: behind the
// room that they may take.
void PlateRunFinder::begin_walks(std::size_t count, const PlateRunSettings& settings) {
  std::size_t good_at = good_.size(), pieces_at = 0;
  for (std::size_t k = 0; k < count; ++k) good_at += stripes_[next_stripe_ + k].z.size();
  kept_ = good_.size();
  good_.resize(good_at);  // within what is reserved: no stripe leaves more indices than it has points
  good_at = kept_;
  walks_.clear();
  for (std::size_t k = 0; k < count; ++k) {
    const StripeView& stripe = stripes_[next_stripe_ + k];
    walks_.push_back(StripeWalk(stripe, settings, good_.data() + good_at, &walked_[pieces_at]));
    good_at += stripe.z.size(), pieces_at += stripe.z.size() / fewest_piece_points + 1;
  }
  walking_ = true;
}

// Makes runs of what the walks have found; false when there are too many.
bool PlateRunFinder::keep_walked(const PlateRunSettings& settings) {
  for (const StripeWalk& walk : walks_) {
    const auto good = walk.good();
    pieces_.assign(walk.pieces().begin(), walk.pieces().end());
    for (StripePiece& piece : pieces_) piece.begin += static_cast<std::uint32_t>(kept_);
    std::copy(good.begin(), good.end(), good_.begin() + static_cast<std::ptrdiff_t>(kept_));
    kept_ += good.size();
    first_run_.push_back(static_cast<std::uint32_t>(runs_.size()));
    if (!keep_runs(static_cast<std::uint16_t>(next_stripe_), stripes_[next_stripe_], settings)) return false;
    ++next_stripe_;
  }
  good_.resize(kept_);
  walks_.clear();
  return true;
}

void PlateRunFinder::drop_short_pieces(const StripeView& stripe, std::size_t min_points,
                                       double min_length_mm) {
  std::erase_if(pieces_, [&](const StripePiece& piece) {
    const double length = stripe.y[good_[piece.begin + piece.count - 1]] - stripe.y[good_[piece.begin]];
    return piece.count < min_points || length < min_length_mm;
  });
}

// Joins pieces that continue each other over a drop-out, a speck of dirt or a crease: the lines at both ends
// meet, in the middle of the gap, within less than a step.
void PlateRunFinder::join_pieces(const StripeView& stripe, const PlateRunSettings& settings) {
  if (pieces_.empty()) return;
  std::size_t kept = 0;
  for (std::size_t k = 1; k < pieces_.size(); ++k) {
    StripePiece& before = pieces_[kept];
    const StripePiece& after = pieces_[k];
    const std::span<const std::uint32_t> good(good_);
    const auto tail =
        good.subspan(before.begin, before.count).last(std::min<std::size_t>(before.count, line_points));
    const auto head = good.subspan(after.begin, std::min<std::size_t>(after.count, line_points));
    const double y_tail = stripe.y[tail.back()], y_head = stripe.y[head.front()],
                 middle = 0.5 * (y_tail + y_head);
    const StripeLine left = fit_line(stripe, tail), right = fit_line(stripe, head);
    const bool flat = std::max(std::abs(left.slope_z), std::abs(right.slope_z)) <= HeightFilter::max_slope;
    if (flat && y_head - y_tail <= settings.bridge_mm &&
        std::abs(left.z_at(middle) - right.z_at(middle)) < settings.min_step_mm) {
      // What lay between the two was dropped; their points move together.
      std::copy_n(good_.begin() + after.begin, after.count, good_.begin() + before.begin + before.count);
      before.count += after.count;
    } else {
      pieces_[++kept] = after;
    }
  }
  pieces_.resize(kept + 1);
}

// The first points beyond an edge may have slipped in while the line still allowed them: compare the
// outermost three with the line through the points inside them.
void PlateRunFinder::trim_ends(const StripeView& stripe, const PlateRunSettings& settings) {
  for (StripePiece& piece : pieces_) {
    if (piece.count < line_points + trim_points) continue;
    const auto good = std::span<const std::uint32_t>(good_).subspan(piece.begin, piece.count);
    const double n = line_points;
    const auto strays = [&](const StripeLine& line, std::uint32_t i, std::uint32_t inside) {
      // Standard deviation of a point against a line through n others, extrapolated by up to three points.
      const double reach = (n / 2 + trim_points) / n;
      const double sigma = settings.noise_mm * std::sqrt(1 + 1 / n + 12 * reach * reach / n);
      const double fall = std::abs(stripe.z[i] - stripe.z[inside]),
                   along = std::abs(stripe.y[i] - stripe.y[inside]);
      return std::abs(stripe.z[i] - line.z_at(stripe.y[i])) > trim_sigmas * sigma &&
             fall > HeightFilter::max_slope * along;
    };
    // From inside outwards: whatever lies beyond the first wall point goes with it.
    std::uint32_t at_first = 0, at_last = 0;
    const std::size_t end = good.size() - 1;
    const StripeLine head = fit_line(stripe, good.subspan(trim_points, line_points));
    for (std::uint32_t k = trim_points; k-- > 0 && at_first == 0;) {
      if (strays(head, good[k], good[k + 1])) at_first = k + 1;
    }
    const StripeLine tail = fit_line(stripe, good.last(line_points + trim_points).first(line_points));
    for (std::uint32_t k = trim_points; k-- > 0 && at_last == 0;) {
      if (strays(tail, good[end - k], good[end - k - 1])) at_last = k + 1;
    }
    piece.begin += at_first;
    piece.count -= at_first + at_last;
  }
}

bool PlateRunFinder::keep_runs(std::uint16_t stripe_index, const StripeView& stripe,
                               const PlateRunSettings& settings) {
  drop_short_pieces(stripe, fewest_piece_points, 0.15 * settings.min_run_mm);  // walls are steep, so short
  join_pieces(stripe, settings);
  drop_short_pieces(stripe, fewest_piece_points, settings.min_run_mm);
  join_pieces(stripe, settings);
  trim_ends(stripe, settings);
  if (runs_.size() + pieces_.size() > runs_.capacity()) return false;
  for (const StripePiece& piece : pieces_) {
    const auto id = static_cast<std::uint32_t>(runs_.size());
    runs_.push_back({.begin = piece.begin,
                     .count = piece.count,
                     .parent = id,
                     .stripe = stripe_index,
                     .linked_forward = false,
                     .y_first = stripe.y[good_[piece.begin]],
                     .y_last = stripe.y[good_[piece.begin + piece.count - 1]]});
  }
  return true;
}

std::uint32_t PlateRunFinder::region_of(std::uint32_t run) const {
  while (runs_[run].parent != run) run = runs_[run].parent;
  return run;
}

// Runs on neighbouring stripes belong together where they lie side by side at heights that a sloping plate
// allows. A stripe that is missing, or has no run there, is looked across as a drop-out would be.
void PlateRunFinder::link_run(std::uint32_t i, const PlateRunSettings& settings) {
  const std::size_t next = runs_[i].stripe + links_ahead_;
  if (runs_[i].linked_forward || next >= stripes_.size()) return;
  const auto points_of = [&](const Run& run) {
    return std::span<const std::uint32_t>(good_).subspan(run.begin, run.count);
  };
  const auto continues = [&](const Run& a, const Run& b) {
    const double from = std::max(a.y_first, b.y_first), to = std::min(a.y_last, b.y_last);
    if (to - from < 0.25 * settings.min_run_mm) return false;
    int agree = 0;
    for (const double share : {0.15, 0.5, 0.85}) {
      const double y = from + share * (to - from);
      const StripeLine here = line_about(stripes_[a.stripe], points_of(a), y, 4);
      const StripeLine there = line_about(stripes_[b.stripe], points_of(b), y, 4);
      const double dx = std::abs(there.x_at(y) - here.x_at(y));
      const bool near = b.stripe == a.stripe + 1 || dx <= settings.bridge_mm;
      agree +=
          near && std::abs(there.z_at(y) - here.z_at(y)) <= 0.5 * settings.min_step_mm + start_slope * dx;
    }
    return agree >= 2;
  };

  for (std::uint32_t j = first_run_[next]; j < first_run_[next + 1]; ++j) {
    if (!continues(runs_[i], runs_[j])) continue;
    runs_[i].linked_forward = true;
    const std::uint32_t a = region_of(i), b = region_of(j);
    runs_[std::max(a, b)].parent = std::min(a, b);
  }
}

// Short paths: a parent never lies behind its child, so one pass in order flattens every tree.
void PlateRunFinder::flatten_regions() {
  for (Run& run : runs_) run.parent = runs_[run.parent].parent;
}

void PlateRunFinder::compare_with(const Eigen::Vector3d& hint, std::uint32_t i) {
  const Run& run = runs_[i];
  const double y = std::clamp(hint.y(), run.y_first, run.y_last);
  const auto good = std::span<const std::uint32_t>(good_).subspan(run.begin, run.count);
  const StripeLine line = line_about(stripes_[run.stripe], good, y, 4);
  const double distance = (Eigen::Vector3d(line.x_at(y), y, line.z_at(y)) - hint).norm();
  if (distance < least_) least_ = distance, nearest_ = i;
}

namespace {

// Where the run leaves the plate: half a spacing beyond its last good point, on the line through the last
// points. The true edge lies anywhere between the last point and the one that would have followed.
Eigen::Vector3d edge_beyond(const StripeView& stripe, std::span<const std::uint32_t> good, bool at_last,
                            double spacing) {
  const std::size_t n = std::min(good.size(), line_points);
  const StripeLine line = fit_line(stripe, at_last ? good.last(n) : good.first(n));
  const double half = 0.5 * spacing;
  const double y = at_last ? stripe.y[good.back()] + half : stripe.y[good.front()] - half;
  return {line.x_at(y), y, line.z_at(y)};
}

struct Neighbour {
  bool exists = false;
  double gap_mm = 0,
         rise_mm = 0;  // to the next run on the stripe; how much higher it lies than this one goes on
};

// A stripe that reports every ray ends at the field's limit whatever the plate's height does to its width
// there; one that leaves missing points out ends there by its position.
bool at_field_limit(double y_outward, std::size_t rays_beyond, double spacing,
                    const PlateRunSettings& settings) {
  return static_cast<double>(rays_beyond) * spacing <= settings.field_margin_mm ||
         y_outward >= settings.field_half_y_mm - settings.field_margin_mm;
}

RunEnd kind_of_end(const Neighbour& beyond, const PlateRunSettings& settings) {
  if (!beyond.exists) return RunEnd::free_end;
  if (beyond.gap_mm <= settings.bridge_mm) return beyond.rise_mm > 0 ? RunEnd::hidden : RunEnd::step_down;
  // Behind a gap: something that towers over the plate throws a shadow on it; anything else leaves
  // the edge free.
  const bool towers = beyond.rise_mm > settings.min_step_mm && beyond.gap_mm <= 3 * settings.bridge_mm;
  return towers ? RunEnd::hidden : RunEnd::free_end;
}

}  // namespace

std::expected<std::span<const PlateRun>, Error> PlateRunFinder::find(std::span<const StripeView> stripes,
                                                                     const Eigen::Vector3d& hint,
                                                                     const PlateRunSettings& settings) {
  if (const auto begun = begin(stripes); !begun) return std::unexpected(begun.error());
  for (bool all = false; !all;) {
    const auto cut = cut_stripes(stripes_in_turn, settings);
    if (!cut) return std::unexpected(cut.error());
    all = *cut;
  }
  if (const auto found = find_plate(std::numeric_limits<std::size_t>::max(), hint, settings); !found)
    return std::unexpected(found.error());
  return plate_runs();
}

std::expected<void, Error> PlateRunFinder::begin(std::span<const StripeView> stripes) {
  std::size_t points = 0;
  for (const StripeView& stripe : stripes) {
    if (stripe.x.size() != stripe.z.size() || stripe.y.size() != stripe.z.size())
      return std::unexpected(Error::sizes_differ);
    points += stripe.z.size();
  }
  if (stripes.size() > max_stripes_ || points > max_points_) return std::unexpected(Error::capacity);

  good_.clear(), runs_.clear(), first_run_.clear(), found_.clear(), walks_.clear();
  walking_ = false;
  stripes_ = stripes;
  next_stripe_ = 0, next_run_ = 0;
  stage_ = Stage::link, links_ahead_ = 1;
  return {};
}

std::size_t PlateRunFinder::reads_up_to(std::size_t at_most) const {
  const std::size_t more =
      walks_.empty() ? std::min({at_most, stripes_in_turn, stripes_.size() - next_stripe_}) : walks_.size();
  return next_stripe_ + more;
}

std::expected<bool, Error> PlateRunFinder::cut_stripes(std::size_t at_most,
                                                       const PlateRunSettings& settings) {
  if (walks_.empty() && next_stripe_ < stripes_.size()) {
    begin_walks(reads_up_to(at_most) - next_stripe_, settings);
    return false;
  }
  if (walking_) {
    walking_ = !StripeWalk::walk_in_turn(walks_, stripe_kernel(simd_), points_in_turn);
    return false;
  }
  if (!keep_walked(settings)) return std::unexpected(Error::capacity);
  return next_stripe_ == stripes_.size();
}

std::expected<bool, Error> PlateRunFinder::find_plate(std::size_t at_most_runs, const Eigen::Vector3d& hint,
                                                      const PlateRunSettings& settings) {
  if (!hint.allFinite()) return std::unexpected(Error::not_finite);
  // One past the last stripe's runs.
  if (first_run_.size() == stripes_.size()) first_run_.push_back(static_cast<std::uint32_t>(runs_.size()));
  while (true) {
    for (; next_run_ < runs_.size() && at_most_runs > 0; ++next_run_, --at_most_runs) {
      switch (stage_) {
        case Stage::link:
          link_run(next_run_, settings);
          break;
        case Stage::seek_hint:
          if (next_run_ == 0)
            least_ = settings.hint_reach_mm, nearest_ = static_cast<std::uint32_t>(runs_.size());
          compare_with(hint, next_run_);
          break;
        case Stage::describe:
          if (region_of(next_run_) == nearest_) found_.push_back(described(next_run_, settings));
          break;
      }
    }
    if (next_run_ < runs_.size()) return false;
    if (const auto ended = end_stage(); !ended || *ended) return ended;
  }
}

// All runs have been through the stage; says whether it was the last.
std::expected<bool, Error> PlateRunFinder::end_stage() {
  switch (stage_) {
    case Stage::link:
      flatten_regions();
      if (++links_ahead_ > farthest_link) stage_ = Stage::seek_hint;
      break;
    case Stage::seek_hint:
      if (runs_.empty() || nearest_ == runs_.size()) return std::unexpected(Error::not_on_plate);
      nearest_ = region_of(nearest_);
      stage_ = Stage::describe;
      break;
    case Stage::describe:
      return true;
  }
  next_run_ = 0;
  return false;
}

PlateRun PlateRunFinder::described(std::uint32_t i, const PlateRunSettings& settings) const {
  const Run& run = runs_[i];
  const StripeView& stripe = stripes_[run.stripe];
  const auto good = std::span<const std::uint32_t>(good_).subspan(run.begin, run.count);
  PlateRun out;
  out.stripe = run.stripe, out.first = good.front(), out.last = good.back();
  const double spacing_first = spacing_near_end(stripe, good, false),
               spacing_last = spacing_near_end(stripe, good, true);
  out.edge_first = edge_beyond(stripe, good, false, spacing_first);
  out.edge_last = edge_beyond(stripe, good, true, spacing_last);

  const auto neighbour = [&](std::uint32_t j, bool above) {
    const Run& other = runs_[j];
    const auto theirs = std::span<const std::uint32_t>(good_).subspan(other.begin, other.count);
    const std::size_t n = std::min(good.size(), line_points), m = std::min(theirs.size(), line_points);
    const StripeLine line = fit_line(stripe, above ? good.last(n) : good.first(n));
    const StripeLine far = fit_line(stripe, above ? theirs.first(m) : theirs.last(m));
    const double gap = above ? other.y_first - run.y_last : run.y_first - other.y_last;
    const double y = above ? other.y_first : other.y_last;
    return Neighbour{true, gap, far.z_at(y) - line.z_at(y)};
  };
  const bool below = i > first_run_[run.stripe], above = i + 1 < first_run_[run.stripe + 1u];
  const std::size_t rays_above = stripe.z.size() - 1 - out.last;
  const bool low_limit = at_field_limit(-run.y_first, out.first, spacing_first, settings);
  const bool high_limit = at_field_limit(run.y_last, rays_above, spacing_last, settings);
  const auto end_at = [&](bool at_limit, const Neighbour& beyond, std::uint32_t point) {
    if (at_limit) return RunEnd::field_limit;
    const RunEnd end = kind_of_end(beyond, settings);
    const bool is_deep = std::abs(stripe.z[point]) > settings.depth_mm - settings.depth_margin_mm;
    return end == RunEnd::free_end && is_deep ? RunEnd::out_of_depth : end;
  };
  out.at_first = end_at(low_limit, below ? neighbour(i - 1, false) : Neighbour{}, out.first);
  out.at_last = end_at(high_limit, above ? neighbour(i + 1, true) : Neighbour{}, out.last);
  return out;
}

}  // namespace moldloft::geometry
