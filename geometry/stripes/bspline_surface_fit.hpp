// A bicubic B-spline surface through stripes whose places on it are known: each stripe is a cubic B-spline
// curve cut into Bezier pieces at its own knots and at the surface's, and each piece gives seven equations on
// the 16 control points of its cell (thesis section 3.3, eq. 3.15-3.42). The matrix depends on the pre-images
// alone, so that the same places measured again are solved on the stored factor. Points with (u, v) of their
// own may be mixed in.
//
// Shapes       surface control net: knots_u.size() - 4 by knots_v.size() - 4
// Units        control points in mm in, mm out; (u, v), t and weights are plain numbers
// Accuracy     the control points are the least squares solution within 4 half_band eps condition() of their
//              size (Higham, Accuracy and Stability, theorem 10.4): a surface of these knots comes back from
//              its own stripes
// Cost         0.4 us a piece to assemble, 0.2 us to solve for, and the
//              band factorization (matching_system.hpp)
// Allocation   0.3 kB a piece and the band; solve() a right side and the surface
// Failure      MatchingFailure, which names the stripe or the control point
#pragma once

#include "geometry/splines/bspline.hpp"
#include "geometry/stripes/matching_failure.hpp"
#include "geometry/stripes/matching_system.hpp"
#include "geometry/stripes/stripe_pieces.hpp"

#include <Eigen/Core>

#include <expected>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct StripeTrack {  // what the matrix needs to know of a stripe
  std::vector<double> knots;
  Preimage preimage;
};

struct SampledTrack {  // points with their own (u, v), one equation each
  std::vector<Eigen::Vector2d> uv;
  std::vector<double> weight;  // of the squared residual; none: 1 each
};

// A piece counts once as it is (the thesis), or by its length in (u, v): a sliver that a knot line cuts off
// would else weigh like a whole span.
enum class PieceWeight { one, length };

struct MatchingSettings {
  PieceWeight weight = PieceWeight::length;
  MatchingSystem::Ring ring = MatchingSystem::Ring::given;  // the boundary curves are interpolated
};

using SampledPoints = std::vector<Eigen::Vector3d>;

struct MatchingReport {
  int pieces = 0, samples = 0, unknowns = 0;
  PivotReport pivot;
};

struct MatchingResidual {
  double rms_mm = 0;  // of all equations, unweighted
  double max_mm = 0;  // no point of a stripe is farther from the surface at its (u, v) than this
};

class BSplineSurfaceFit {
 public:
  // Cuts, assembles and factors.
  static std::expected<BSplineSurfaceFit, MatchingFailure> assemble(
      std::vector<double> knots_u, std::vector<double> knots_v, std::span<const StripeTrack> stripes,
      std::span<const SampledTrack> samples = {}, const MatchingSettings& = {});

  // The curve of every stripe and the points of every sampled track, in the order of assemble(). The
  // outer ring of `base` (the Coons net of the boundary curves) is kept when the ring is given; else base
  // is not looked at.
  std::expected<BSplineSurface, MatchingFailure> solve(std::span<const SpaceCurve> stripes,
                                                       std::span<const SampledPoints> samples,
                                                       const BSplineSurface& base) const;

  MatchingResidual residual(std::span<const SpaceCurve> stripes, std::span<const SampledPoints> samples,
                            const BSplineSurface&) const;

  // Of the normal equations, estimated (matching_system.hpp).
  double condition() const { return system_.condition(); }
  int half_band() const { return system_.half_band(); }
  const MatchingReport& report() const { return report_; }

 private:
  struct Piece {  // bases on the piece in Bernstein form, u's times the weight's root
    Eigen::Matrix4d along_u, along_v, along_t;
    double root_weight;
    int stripe, first_t, first_u, first_v;
  };
  struct Sample {
    Eigen::Vector4d along_u, along_v;
    double root_weight;
    int track, index, first_u, first_v;
  };

  BSplineSurfaceFit(std::vector<double> knots_u, std::vector<double> knots_v, MatchingSystem::Ring);

  int control_u() const { return static_cast<int>(knots_u_.size()) - cubic - 1; }
  int control_v() const { return static_cast<int>(knots_v_.size()) - cubic - 1; }
  void add_pieces(std::span<const StripeTrack>, PieceWeight);
  void add_samples(std::span<const SampledTrack>);
  std::expected<void, MatchingFailure> check_data(std::span<const SpaceCurve> stripes,
                                                  std::span<const SampledPoints> samples,
                                                  const BSplineSurface& base) const;

  std::vector<double> knots_u_, knots_v_;
  std::vector<std::vector<double>> stripe_knots_;  // what solve() must be given
  std::vector<std::size_t> sample_count_;
  std::vector<Piece> pieces_;
  std::vector<Sample> samples_;
  MatchingSystem system_;
  MatchingReport report_;
};

}  // namespace moldloft::geometry
