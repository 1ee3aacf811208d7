#include "geometry/stripes/matching_checks.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace moldloft::geometry {

namespace {

std::expected<void, Error> check_samples(const SampledTrack& track, std::span<const double> knots_u,
                                         std::span<const double> knots_v) {
  if (track.uv.empty() || (!track.weight.empty() && track.weight.size() != track.uv.size()))
    return std::unexpected(Error::too_few_points);
  const auto within = [](std::span<const double> knots, double x) {
    return x >= knots[cubic] && x <= knots[knots.size() - cubic - 1];
  };
  for (const Eigen::Vector2d& uv : track.uv) {
    if (!uv.allFinite()) return std::unexpected(Error::not_finite);
    if (!within(knots_u, uv.x()) || !within(knots_v, uv.y())) return std::unexpected(Error::preimage_outside);
  }
  for (const double weight : track.weight)
    if (!std::isfinite(weight) || weight < 0) return std::unexpected(Error::not_finite);
  return {};
}

}  // namespace

CoincidentPair find_coincident(std::span<const Eigen::Vector2d> from, std::span<const Eigen::Vector2d> to,
                               double nearest) {
  // Both directions look the same from their middle: sorted by that, only neighbours can coincide.
  std::vector<double> middle(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) middle[i] = from[i].x() + to[i].x();
  std::vector<int> order(from.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int i) { return middle[i]; });
  const auto near = [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return (p - q).norm() <= nearest;
  };
  for (std::size_t a = 0; a < order.size(); ++a) {
    for (std::size_t b = a + 1; b < order.size() && middle[order[b]] - middle[order[a]] <= 2 * nearest; ++b) {
      const int i = std::min(order[a], order[b]), j = std::max(order[a], order[b]);
      if ((near(from[i], from[j]) && near(to[i], to[j])) || (near(from[i], to[j]) && near(to[i], from[j])))
        return {i, j};
    }
  }
  return {};
}

std::expected<void, MatchingFailure> check_tracks(std::span<const double> knots_u,
                                                  std::span<const double> knots_v,
                                                  std::span<const StripeTrack> stripes,
                                                  std::span<const SampledTrack> samples) {
  for (const auto knots : {knots_u, knots_v})
    if (const auto good = check_cubic_knots(knots); !good)
      return std::unexpected(MatchingFailure{.error = good.error()});
  const auto blame = [](Error what, std::size_t stripe) {
    return std::unexpected(MatchingFailure{.error = what, .stripe = static_cast<int>(stripe)});
  };
  std::vector<Eigen::Vector2d> from, to;
  std::vector<int> straight;
  for (std::size_t s = 0; s < stripes.size(); ++s) {
    if (const auto good = check_cubic_knots(stripes[s].knots); !good) return blame(good.error(), s);
    if (const auto good = check_preimage(stripes[s].preimage, stripes[s].knots, knots_u, knots_v); !good)
      return blame(good.error(), s);
    const std::vector<Eigen::Vector2d>& uv = stripes[s].preimage.uv;
    if (uv.size() > 2) continue;  // two paths may bend between the same ends
    from.push_back(uv.front()), to.push_back(uv.back()), straight.push_back(static_cast<int>(s));
  }
  for (std::size_t s = 0; s < samples.size(); ++s)
    if (const auto good = check_samples(samples[s], knots_u, knots_v); !good)
      return blame(good.error(), stripes.size() + s);
  const double size = std::max(knots_u.back() - knots_u.front(), knots_v.back() - knots_v.front());
  if (const auto [first, second] = find_coincident(from, to, nearest_stripes * size); second >= 0)
    return std::unexpected(MatchingFailure{Error::coincident_stripes, straight[second], straight[first], {}});
  return {};
}

}  // namespace moldloft::geometry
