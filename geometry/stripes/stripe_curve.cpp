#include "geometry/stripes/stripe_curve.hpp"

#include <algorithm>

namespace moldloft::geometry {

std::vector<double> consistent_parameters(std::span<const Eigen::Vector2d> uv, const Eigen::Vector2d& from,
                                          const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = (to - from) / (to - from).squaredNorm();
  std::vector<double> t(uv.size());
  for (std::size_t i = 0; i < uv.size(); ++i) t[i] = std::clamp((uv[i] - from).dot(along), 0.0, 1.0);
  return t;
}

std::expected<StripeCurve, Flaw> fit_stripe(std::span<const Eigen::Vector3d> points,
                                            std::span<const Eigen::Vector2d> uv,
                                            std::span<const double> knots, StripeParameter parameter) {
  if (uv.size() != points.size()) return std::unexpected(Flaw{Error::sizes_differ});
  if (points.size() < 2) return std::unexpected(Flaw{Error::too_few_points});
  const Eigen::Vector2d from = uv.front(), to = uv.back();
  if (!from.allFinite() || !to.allFinite()) return std::unexpected(Flaw{Error::not_finite});
  if (from == to) return std::unexpected(Flaw{Error::no_length});

  std::vector<double> t;
  if (parameter == StripeParameter::consistent) {
    t = consistent_parameters(uv, from, to);
  } else {
    auto chords = chord_length_parameters<3>(points);
    if (!chords) return std::unexpected(chords.error());
    t = std::move(*chords);
  }
  const auto fit = fit_curve<3>(points, t, knots);
  if (!fit) return std::unexpected(fit.error());
  return StripeCurve{
      {{knots.begin(), knots.end()}, straight_preimage(from, to)}, fit->curve, fit->rms, fit->max};
}

}  // namespace moldloft::geometry
