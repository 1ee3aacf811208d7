#include "geometry/stripes/stripe_joining.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace moldloft::geometry {

namespace {

using Run = std::span<const Eigen::Vector3d>;

// The direction of a run of points: from the middle of its first half to the middle of its second.
Eigen::Vector3d direction(Run run) {
  const std::size_t half = std::max<std::size_t>(run.size() / 2, 1);
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), last = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < half; ++i) first += run[i], last += run[run.size() - 1 - i];
  return (last - first).normalized();
}

double angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// The place on a chain of chords that is nearest to a point.
struct Foot {
  Eigen::Vector3d place;
  double distance = std::numeric_limits<double>::infinity();
  std::size_t next = 0;  // the first point behind it; the chain's size if it is the chain's last point
};

Foot foot_on(Run chain, const Eigen::Vector3d& point) {
  Foot foot;
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    const Eigen::Vector3d chord = chain[i + 1] - chain[i];
    const double share = std::clamp((point - chain[i]).dot(chord) / chord.squaredNorm(), 0.0, 1.0);
    const Eigen::Vector3d place = chain[i] + share * chord;
    const double distance = (place - point).norm();
    if (distance >= foot.distance) continue;
    const bool at_last = share == 1 && i + 2 == chain.size();
    foot = {place, distance, share == 0 ? i : at_last ? i + 2 : i + 1};
  }
  return foot;
}

struct Line {
  JoinedLine joined;
  int last_stripe = 0;
  bool alive = true;
};

// One way to go on with a line: over its end or, while it is a single stripe, over its start.
struct Candidate {
  double distance;
  int line, stripe;
  bool over_start;
};

struct Continuation {
  Stripe stripe;  // in the direction of the line
  Foot foot;
};

// The stripe turned into the line's direction, and where it goes on from the line's end; nothing if it lies
// wholly behind it.
std::optional<Continuation> continuation(Run line_end, const Stripe& stripe) {
  Continuation found{stripe, {}};
  if (direction(line_end).dot(stripe.back() - stripe.front()) < 0) std::ranges::reverse(found.stripe);
  found.foot = foot_on(found.stripe, line_end.back());
  while (found.foot.next < found.stripe.size() && found.stripe[found.foot.next] == line_end.back())
    ++found.foot.next;
  if (found.foot.next + 2 > found.stripe.size()) return std::nullopt;
  return found;
}

Run tail(const std::vector<Eigen::Vector3d>& points, int count) {
  return Run{points}.last(std::min(points.size(), static_cast<std::size_t>(count)));
}

void extend(Line& line, const Candidate& by, int shot, const Stripe& stripe, int tangent_points) {
  auto& [points, joints] = line.joined;
  if (by.over_start) std::ranges::reverse(points);
  const Run before = tail(points, tangent_points);
  const auto go_on = continuation(before, stripe);
  const Run rest = Run{go_on->stripe}.subspan(go_on->foot.next);
  const Eigen::Vector3d in = direction(before),
                        out = direction(rest.first(std::min<std::size_t>(rest.size(), tangent_points)));
  const Eigen::Vector3d across = go_on->foot.place - points.back();
  joints.push_back({shot, line.last_stripe, by.stripe, go_on->foot.distance,
                    (across - across.dot(in) * in).norm(), angle(in, out),
                    static_cast<int>(go_on->foot.next)});
  points.insert(points.end(), rest.begin(), rest.end());
  line.last_stripe = by.stripe;
}

std::optional<Flaw> what_is_wrong(std::span<const StripesOfShot> shots) {
  if (shots.empty()) return Flaw{Error::too_few_points};
  std::size_t where = 0;
  for (const StripesOfShot& shot : shots) {
    if (shot.empty()) return Flaw{Error::too_few_points, where};
    for (const Stripe& stripe : shot) {
      if (stripe.size() < 2) return Flaw{Error::too_few_points, where};
      for (std::size_t i = 0; i < stripe.size(); ++i) {
        if (!stripe[i].allFinite()) return Flaw{Error::not_finite, where};
        if (i > 0 && stripe[i] == stripe[i - 1]) return Flaw{Error::repeated_points, where};
      }
      ++where;
    }
  }
  return std::nullopt;
}

}  // namespace

std::expected<JoinedStripes, Flaw> join_stripes(std::span<const StripesOfShot> shots,
                                                const JoinSettings& settings) {
  if (const auto wrong = what_is_wrong(shots)) return std::unexpected(*wrong);
  std::vector<Line> lines;
  int stripes = 0;
  for (const Stripe& stripe : shots[0]) lines.push_back({{stripe, {}}, static_cast<int>(lines.size())});
  for (const StripesOfShot& shot : shots) stripes += static_cast<int>(shot.size());

  for (int shot = 0; shot + 1 < static_cast<int>(shots.size()); ++shot) {
    const StripesOfShot& next = shots[shot + 1];
    std::vector<Candidate> candidates;
    for (int l = 0; l < static_cast<int>(lines.size()); ++l) {
      if (!lines[l].alive) continue;
      const auto& points = lines[l].joined.points;
      const Run end = tail(points, settings.tangent_points);
      std::vector<Eigen::Vector3d> start{
          points.begin(),
          points.begin() + std::min<std::ptrdiff_t>(std::ssize(points), settings.tangent_points)};
      std::ranges::reverse(start);
      for (int s = 0; s < static_cast<int>(next.size()); ++s) {
        for (const bool over_start : {false, true}) {
          if (over_start && shot > 0) continue;
          const auto go_on = continuation(over_start ? Run{start} : end, next[s]);
          if (go_on && go_on->foot.distance <= settings.most_gap_mm)
            candidates.push_back({go_on->foot.distance, l, s, over_start});
        }
      }
    }
    std::ranges::stable_sort(candidates, {}, &Candidate::distance);
    std::vector<bool> extended(lines.size(), false), taken(next.size(), false);
    for (const Candidate& nearest : candidates) {
      if (extended[nearest.line] || taken[nearest.stripe]) continue;
      extend(lines[nearest.line], nearest, shot, next[nearest.stripe], settings.tangent_points);
      extended[nearest.line] = taken[nearest.stripe] = true;
    }
    for (std::size_t l = 0; l < lines.size(); ++l) lines[l].alive = lines[l].alive && extended[l];
  }

  JoinedStripes result;
  for (Line& line : lines)
    if (line.alive) result.lines.push_back(std::move(line.joined));
  result.left_over = stripes - static_cast<int>(result.lines.size() * shots.size());
  return result;
}

}  // namespace moldloft::geometry
