#include "geometry/stripes/stripe_pieces.hpp"

#include "geometry/splines/bspline.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace moldloft::geometry {

namespace {

// Rounding moves a crossing by some 1e-16; a piece shorter than this would carry nothing but that rounding.
constexpr double nearest_cuts = 1e-12;

struct Domain {
  double first, last;
  bool contains(double x) const {
    const double slack = nearest_cuts * (last - first);
    return x >= first - slack && x <= last + slack;
  }
};

Domain domain_of(std::span<const double> knots) { return {knots[cubic], knots[knots.size() - cubic - 1]}; }

// Where the straight line from `from` (at t0) to `to` (at t1) meets the distinct inner knots.
void add_crossings(std::span<const double> knots, double from, double to, double t0, double t1,
                   std::vector<double>& cuts) {
  if (from == to) return;
  const double low = std::min(from, to), high = std::max(from, to);
  const auto last = knots.end() - cubic - 1;
  for (auto knot = std::upper_bound(knots.begin() + cubic + 1, last, low); knot < last && *knot < high;
       ++knot)
    cuts.push_back(t0 + (t1 - t0) * ((*knot - from) / (to - from)));
}

}  // namespace

Eigen::Vector2d Preimage::at(double s) const {
  const auto next = std::upper_bound(t.begin() + 1, t.end() - 1, s);
  const auto i = next - t.begin();
  const double share = (s - t[i - 1]) / (t[i] - t[i - 1]);
  return (1 - share) * uv[i - 1] + share * uv[i];
}

Preimage straight_preimage(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return {{0.0, 1.0}, {from, to}};
}

std::expected<void, Error> check_preimage(const Preimage& preimage, std::span<const double> stripe_knots,
                                          std::span<const double> knots_u, std::span<const double> knots_v) {
  const auto& [t, uv] = preimage;
  if (t.size() < 2 || uv.size() != t.size()) return std::unexpected(Error::too_few_points);
  const Domain domain = domain_of(stripe_knots), domain_u = domain_of(knots_u), domain_v = domain_of(knots_v);
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (!std::isfinite(t[i]) || !uv[i].allFinite()) return std::unexpected(Error::not_finite);
    if (!domain_u.contains(uv[i].x()) || !domain_v.contains(uv[i].y()))
      return std::unexpected(Error::preimage_outside);
  }
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (!(t[i] > t[i - 1])) return std::unexpected(Error::knots_not_increasing);
    if (!((uv[i] - uv[i - 1]).norm() > nearest_cuts)) return std::unexpected(Error::no_length);
  }
  const double slack = nearest_cuts * (domain.last - domain.first);
  if (std::abs(t.front() - domain.first) > slack || std::abs(t.back() - domain.last) > slack)
    return std::unexpected(Error::preimage_outside);
  return {};
}

void cut_stripe(const Preimage& preimage, std::span<const double> stripe_knots,
                std::span<const double> knots_u, std::span<const double> knots_v,
                std::vector<TrackPiece>& pieces) {
  std::vector<double> cuts;
  for (std::size_t i = 1; i < preimage.t.size(); ++i) {
    const double t0 = preimage.t[i - 1], t1 = preimage.t[i];
    const Eigen::Vector2d from = preimage.uv[i - 1], to = preimage.uv[i];
    cuts.clear();
    add_crossings(stripe_knots, t0, t1, t0, t1, cuts);
    add_crossings(knots_u, from.x(), to.x(), t0, t1, cuts);
    add_crossings(knots_v, from.y(), to.y(), t0, t1, cuts);
    cuts.push_back(t1);
    std::ranges::sort(cuts);

    const double nearest = nearest_cuts * (t1 - t0);
    double begin = t0;
    Eigen::Vector2d uv_begin = from;
    for (std::size_t c = 0; c < cuts.size(); ++c) {
      const bool last = c + 1 == cuts.size();
      if (!last && (cuts[c] - begin <= nearest || t1 - cuts[c] <= nearest)) continue;
      const double end = cuts[c], share = (end - t0) / (t1 - t0);
      const Eigen::Vector2d uv_end = last ? to : Eigen::Vector2d((1 - share) * from + share * to);
      // The middle says which cell it is: the ends may lie a rounding beyond its border.
      const Eigen::Vector2d middle = 0.5 * (uv_begin + uv_end);
      pieces.push_back({find_span(stripe_knots, 0.5 * (begin + end)), find_span(knots_u, middle.x()),
                        find_span(knots_v, middle.y()), begin, end, uv_begin, uv_end});
      begin = end, uv_begin = uv_end;
    }
  }
}

}  // namespace moldloft::geometry
