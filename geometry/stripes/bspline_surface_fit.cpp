#include "geometry/stripes/bspline_surface_fit.hpp"

#include "geometry/splines/span_restriction.hpp"
#include "geometry/stripes/matching_checks.hpp"
#include "geometry/stripes/stripe_matching.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace moldloft::geometry {

namespace {

using Gram = MatchingSystem::Gram;
using Side = MatchingSystem::Side;
using Ring = MatchingSystem::Ring;

// Adds rows^T rows, rows given as columns; only the 4 x 4 blocks on and below the diagonal.
template <int count>
void add_gram(const Eigen::Matrix<double, 16, count>& rows, Gram& gram) {
  for (int i = 0; i < 4; ++i) {
    for (int c = 0; c < 4; ++c) {
      for (int k = i; k < 4; ++k) {
        Eigen::Vector4d sum = gram.col(4 * i + c).template segment<4>(4 * k);
        for (int p = 0; p < count; ++p) sum += rows(4 * i + c, p) * rows.col(p).template segment<4>(4 * k);
        gram.col(4 * i + c).template segment<4>(4 * k) = sum;
      }
    }
  }
}

// Gathers what falls into one cell in a row of pieces, and hands it to the band when the next cell begins.
class CellGram {
 public:
  explicit CellGram(MatchingSystem& system) : system_(system) {}
  ~CellGram() { flush(); }

  Gram& at(int first_u, int first_v) {
    if (first_u != u_ || first_v != v_) {
      flush();
      u_ = first_u, v_ = first_v;
      gram_.setZero();
    }
    return gram_;
  }

 private:
  void flush() {
    if (u_ >= 0) system_.add(u_, v_, gram_);
  }
  MatchingSystem& system_;
  Gram gram_;
  int u_ = -1, v_ = -1;
};

Eigen::Vector4d basis_at(std::span<const double> knots, int span, double t) {
  return Eigen::Map<const Eigen::Vector4d>(cubic_basis(knots, span, t).value.data());
}

// The 16 control points of a cell, one a row.
Side cell_of(const BSplineSurface& surface, int first_u, int first_v) {
  Side cell;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      cell.row(4 * i + j) << surface.x(first_u + i, first_v + j), surface.y(first_u + i, first_v + j),
          surface.z(first_u + i, first_v + j);
    }
  }
  return cell;
}

using CubicControl = Eigen::Matrix<double, 4, 3>;
CubicControl piece_control(const Eigen::Matrix4d& along_t, const SpaceCurve& stripe, int first) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 4>> control(stripe.control[first].data());
  return (control.lazyProduct(along_t)).transpose();
}

Eigen::Matrix<double, 16, 1> sample_row(const Eigen::Vector4d& along_u, const Eigen::Vector4d& along_v) {
  Eigen::Matrix<double, 16, 1> row;
  for (int i = 0; i < 4; ++i) row.segment<4>(4 * i) = along_u[i] * along_v;
  return row;
}

}  // namespace

BSplineSurfaceFit::BSplineSurfaceFit(std::vector<double> knots_u, std::vector<double> knots_v, Ring ring)
    : knots_u_(std::move(knots_u)),
      knots_v_(std::move(knots_v)),
      system_(static_cast<int>(knots_u_.size()) - cubic - 1, static_cast<int>(knots_v_.size()) - cubic - 1,
              ring) {}

std::expected<BSplineSurfaceFit, MatchingFailure> BSplineSurfaceFit::assemble(
    std::vector<double> knots_u, std::vector<double> knots_v, std::span<const StripeTrack> stripes,
    std::span<const SampledTrack> samples, const MatchingSettings& settings) {
  if (const auto good = check_tracks(knots_u, knots_v, stripes, samples); !good)
    return std::unexpected(good.error());

  BSplineSurfaceFit fit(std::move(knots_u), std::move(knots_v), settings.ring);
  fit.add_pieces(stripes, settings.weight);
  fit.add_samples(samples);
  fit.report_ = {
      static_cast<int>(fit.pieces_.size()), static_cast<int>(fit.samples_.size()), fit.system_.size(), {}};
  const long equations = 7L * fit.report_.pieces + fit.report_.samples;
  if (equations < fit.report_.unknowns)
    return std::unexpected(MatchingFailure{.error = Error::too_few_stripes});
  const auto pivot = fit.system_.factor();
  if (!pivot) return std::unexpected(MatchingFailure{.error = Error::singular, .control = pivot.error()});
  // Small pivots magnify rounding one after the other, so that a pivot which is nothing else may stand above each bound
  // that is made of one. By this the control points' error bound is as large as they are.
  const double no_digit_left = 1 / (4 * fit.half_band() * std::numeric_limits<double>::epsilon());
  if (const double condition = fit.condition(); !(condition < no_digit_left)) {
    return std::unexpected(
        MatchingFailure{.error = Error::singular, .control = pivot->weakest, .condition = condition});
  }
  fit.report_.pivot = *pivot;
  return fit;
}

void BSplineSurfaceFit::add_pieces(std::span<const StripeTrack> stripes, PieceWeight weight) {
  std::vector<TrackPiece> cuts;
  CellGram cell(system_);
  for (std::size_t s = 0; s < stripes.size(); ++s) {
    const StripeTrack& stripe = stripes[s];
    stripe_knots_.push_back(stripe.knots);
    cuts.clear();
    cut_stripe(stripe.preimage, stripe.knots, knots_u_, knots_v_, cuts);
    for (const TrackPiece& cut : cuts) {
      Piece& piece = pieces_.emplace_back();
      piece.root_weight = weight == PieceWeight::length ? std::sqrt(cut.length()) : 1.0;
      piece.along_u = piece.root_weight * span_restriction(knots_u_, cut.span_u, cut.uv0.x(), cut.uv1.x());
      piece.along_v = span_restriction(knots_v_, cut.span_v, cut.uv0.y(), cut.uv1.y());
      piece.along_t = span_restriction(stripe.knots, cut.stripe_span, cut.t0, cut.t1);
      piece.stripe = static_cast<int>(s), piece.first_t = cut.stripe_span - cubic;
      piece.first_u = cut.span_u - cubic, piece.first_v = cut.span_v - cubic;
      add_gram(bicubic_rows(piece.along_u, piece.along_v), cell.at(piece.first_u, piece.first_v));
    }
  }
}

void BSplineSurfaceFit::add_samples(std::span<const SampledTrack> tracks) {
  CellGram cell(system_);
  for (std::size_t s = 0; s < tracks.size(); ++s) {
    const auto& [uv, weight] = tracks[s];
    sample_count_.push_back(uv.size());
    for (std::size_t n = 0; n < uv.size(); ++n) {
      const int span_u = find_span(knots_u_, uv[n].x()), span_v = find_span(knots_v_, uv[n].y());
      const double root = weight.empty() ? 1.0 : std::sqrt(weight[n]);
      samples_.push_back({root * basis_at(knots_u_, span_u, uv[n].x()), basis_at(knots_v_, span_v, uv[n].y()),
                          root, static_cast<int>(s), static_cast<int>(n), span_u - cubic, span_v - cubic});
      const Sample& sample = samples_.back();
      add_gram<1>(sample_row(sample.along_u, sample.along_v), cell.at(sample.first_u, sample.first_v));
    }
  }
}

std::expected<void, MatchingFailure> BSplineSurfaceFit::check_data(std::span<const SpaceCurve> stripes,
                                                                   std::span<const SampledPoints> samples,
                                                                   const BSplineSurface& base) const {
  if (stripes.size() != stripe_knots_.size() || samples.size() != sample_count_.size())
    return std::unexpected(MatchingFailure{.error = Error::too_few_points});
  const auto finite = [](const Eigen::Vector3d& point) { return point.allFinite(); };
  for (std::size_t s = 0; s < stripes.size(); ++s) {
    const auto& [knots, control, degree] = stripes[s];
    const int stripe = static_cast<int>(s);
    if (degree != cubic || knots != stripe_knots_[s])
      return std::unexpected(MatchingFailure{.error = Error::curves_not_compatible, .stripe = stripe});
    if (control.size() + cubic + 1 != knots.size())
      return std::unexpected(MatchingFailure{.error = Error::too_few_points, .stripe = stripe});
    if (!std::ranges::all_of(control, finite))
      return std::unexpected(MatchingFailure{.error = Error::not_finite, .stripe = stripe});
  }
  for (std::size_t s = 0; s < samples.size(); ++s) {
    const int stripe = static_cast<int>(stripes.size() + s);
    if (samples[s].size() != sample_count_[s])
      return std::unexpected(MatchingFailure{.error = Error::too_few_points, .stripe = stripe});
    if (!std::ranges::all_of(samples[s], finite))
      return std::unexpected(MatchingFailure{.error = Error::not_finite, .stripe = stripe});
  }
  if (system_.ring() == Ring::given) {
    const auto wrong = [&](const Eigen::MatrixXd& net) {
      return net.rows() != control_u() || net.cols() != control_v();
    };
    if (wrong(base.x) || wrong(base.y) || wrong(base.z))
      return std::unexpected(MatchingFailure{.error = Error::too_few_points});
    if (!base.x.allFinite() || !base.y.allFinite() || !base.z.allFinite())
      return std::unexpected(MatchingFailure{.error = Error::not_finite});
  }
  return {};
}

std::expected<BSplineSurface, MatchingFailure> BSplineSurfaceFit::solve(
    std::span<const SpaceCurve> stripes, std::span<const SampledPoints> samples,
    const BSplineSurface& base) const {
  if (const auto good = check_data(stripes, samples, base); !good) return std::unexpected(good.error());

  BSplineSurface surface{knots_u_, knots_v_, {}, {}, {}};
  Eigen::MatrixXd* nets[3] = {&surface.x, &surface.y, &surface.z};
  const Eigen::MatrixXd* base_nets[3] = {&base.x, &base.y, &base.z};
  for (int axis = 0; axis < 3; ++axis) {
    nets[axis]->setZero(control_u(), control_v());
    if (system_.ring() == Ring::unknown) continue;
    // The ring alone, zeros inside: what the rows give for it goes to the right side (eq. 3.41).
    *nets[axis] = *base_nets[axis];
    nets[axis]->block(1, 1, control_u() - 2, control_v() - 2).setZero();
  }

  Eigen::MatrixX3d side = Eigen::MatrixX3d::Zero(system_.size(), 3);
  for (const Piece& piece : pieces_) {
    const BicubicRows rows = bicubic_rows(piece.along_u, piece.along_v);
    const CubicControl control = piece_control(piece.along_t, stripes[piece.stripe], piece.first_t);
    SexticSide g = piece.root_weight * sextic_side(control);
    if (system_.touches_ring(piece.first_u, piece.first_v))
      g -= rows.transpose().lazyProduct(cell_of(surface, piece.first_u, piece.first_v));
    system_.add_side(piece.first_u, piece.first_v, rows.lazyProduct(g), side);
  }
  for (const Sample& sample : samples_) {
    const auto row = sample_row(sample.along_u, sample.along_v);
    Eigen::RowVector3d g = sample.root_weight * samples[sample.track][sample.index].transpose();
    if (system_.touches_ring(sample.first_u, sample.first_v))
      g -= row.transpose() * cell_of(surface, sample.first_u, sample.first_v);
    system_.add_side(sample.first_u, sample.first_v, row * g, side);
  }
  system_.solve(side);
  for (int n = 0; n < system_.size(); ++n) {
    const auto [i, j] = system_.control_of(n);
    for (int axis = 0; axis < 3; ++axis) (*nets[axis])(i, j) = side(n, axis);
  }
  return surface;
}

MatchingResidual BSplineSurfaceFit::residual(std::span<const SpaceCurve> stripes,
                                             std::span<const SampledPoints> samples,
                                             const BSplineSurface& surface) const {
  double sum = 0, most = 0;
  const auto take = [&](const Eigen::RowVector3d& miss) {
    sum += miss.squaredNorm(), most = std::max(most, miss.squaredNorm());
  };
  for (const Piece& piece : pieces_) {
    const CubicControl control = piece_control(piece.along_t, stripes[piece.stripe], piece.first_t);
    // Between Bernstein coefficients the difference stays within their hull: its largest
    // bounds it everywhere.
    const SexticSide miss = bicubic_rows(piece.along_u, piece.along_v).transpose() *
                                cell_of(surface, piece.first_u, piece.first_v) / piece.root_weight -
                            sextic_side(control);
    for (int p = 0; p < 7; ++p) take(miss.row(p));
  }
  for (const Sample& sample : samples_) {
    if (sample.root_weight == 0) continue;
    take(sample_row(sample.along_u, sample.along_v).transpose() *
             cell_of(surface, sample.first_u, sample.first_v) / sample.root_weight -
         samples[sample.track][sample.index].transpose());
  }
  const double equations = 7.0 * report_.pieces + report_.samples;
  return {std::sqrt(sum / equations), std::sqrt(most)};
}

}  // namespace moldloft::geometry
