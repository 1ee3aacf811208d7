#include "geometry/stripes/parameter_correction.hpp"

#include "geometry/stripes/net_equations.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

namespace moldloft::geometry {

namespace {

using Eigen::Matrix3d, Eigen::Vector2d, Eigen::Vector3d;

// Damping of the net's step, relative to the data's own weight. It starts where a step is nearly a
// point-distance one, falls by ten when the model was right and grows by four when it was wrong; below the
// least the tangential directions would leave the matrix without positive pivots, above the largest a step
// moves the surface by rounding.
constexpr double first_damping = 1e-2, least_damping = 1e-9, largest_damping = 1e4;
constexpr double damping_falls = 0.1, damping_grows = 4;
constexpr double good_model = 0.5, poor_model = 0.1;  // achieved over promised reduction
constexpr int settled_rounds = 3;

// Smallest over largest pivot of the fit at given parameters, below which the data leave the net open
// somewhere: sixteen stripes on eleven control points show 0.1, one stripe too few 1e-16.
constexpr double determined = 1e-10;

constexpr int foot_steps = 12;          // Newton: 2 or 3 beside the foot
constexpr int foot_halvings = 12;       // of a step that overshoots
constexpr double foot_reached = 1e-15;  // a step of the parameters that no longer matters
constexpr double flat_share = 1e-8;  // of the squared distance: less of it along the surface is near the foot

struct Domain {
  Vector2d low, high;
};

// A point seen from the surface at its parameters.
struct Foot {
  Vector2d uv;
  Vector3d residual;  // surface minus point
  double squared;
  Vector3d du, dv;
  bool free_u, free_v;  // false at a border over which the foot would like to go
};

Foot see(const SurfacePoint& at, const Vector3d& point, const Vector2d& uv, const Domain& domain) {
  Foot foot{uv, at.value - point, 0, at.du, at.dv, true, true};
  foot.squared = foot.residual.squaredNorm();
  const double slope_u = at.du.dot(foot.residual), slope_v = at.dv.dot(foot.residual);
  foot.free_u = !((uv.x() <= domain.low.x() && slope_u > 0) || (uv.x() >= domain.high.x() && slope_u < 0));
  foot.free_v = !((uv.y() <= domain.low.y() && slope_v > 0) || (uv.y() >= domain.high.y() && slope_v < 0));
  return foot;
}

// The Newton step of the parameters towards the foot, in the directions that are free; Gauss-Newton where the
// Hessian does not show a minimum.
Vector2d newton_step(const SurfacePoint& at, const Foot& foot) {
  const double gu = foot.free_u ? at.du.dot(foot.residual) : 0.0,
               gv = foot.free_v ? at.dv.dot(foot.residual) : 0.0;
  const double e = at.du.squaredNorm(), f = at.du.dot(at.dv), g = at.dv.squaredNorm();
  double a = e + at.duu.dot(foot.residual), b = f + at.duv.dot(foot.residual),
         c = g + at.dvv.dot(foot.residual);
  if (!foot.free_u) return {0, foot.free_v ? -gv / (c > 0.1 * g ? c : g) : 0.0};
  if (!foot.free_v) return {-gu / (a > 0.1 * e ? a : e), 0};
  if (!(a > 0 && a * c - b * b > 1e-3 * e * g)) a = e, b = f, c = g;
  const double det = a * c - b * b;
  if (!(det > 0)) return {0, 0};
  return {-(c * gu - b * gv) / det, -(a * gv - b * gu) / det};
}

// How far the residual is from standing on the surface: its share along the free tangents, squared, mm^2.
double slant(const Foot& foot) {
  const double u = foot.free_u ? std::pow(foot.du.dot(foot.residual), 2) / foot.du.squaredNorm() : 0.0;
  const double v = foot.free_v ? std::pow(foot.dv.dot(foot.residual), 2) / foot.dv.squaredNorm() : 0.0;
  return u + v;
}

// From `uv` to the foot of `point`; its distance never grows on the way but by rounding.
Foot settle(const BSplineSurface& surface, const Vector3d& point, const Vector2d& uv, const Domain& domain) {
  SurfacePoint at = surface.at(uv.x(), uv.y());
  Foot foot = see(at, point, uv, domain);
  for (int step = 0; step < foot_steps; ++step) {
    const Vector2d full = newton_step(at, foot);
    if (!full.allFinite()) break;
    // Near the foot the distance is flat and its fall drowns in rounding: there the slant tells whether
    // to go on.
    const bool near = slant(foot) <= flat_share * foot.squared;
    bool better = false;
    double share = 1;
    for (int halving = 0; halving < (near ? 1 : foot_halvings) && !better; ++halving, share *= 0.5) {
      const Vector2d there = (foot.uv + share * full).cwiseMax(domain.low).cwiseMin(domain.high);
      if ((there - foot.uv).cwiseAbs().maxCoeff() <= foot_reached) return foot;
      const SurfacePoint next = surface.at(there.x(), there.y());
      const Foot moved = see(next, point, there, domain);
      better = near ? slant(moved) < slant(foot) : moved.squared < foot.squared;
      if (better) foot = moved, at = next;
    }
    if (!better) break;
  }
  return foot;
}

// What of a residual the parameters cannot take away: the projection off the tangent directions
// that are free.
Matrix3d stands_off(const Foot& foot) {
  Matrix3d weight = Matrix3d::Identity();
  if (foot.free_u && foot.free_v) {
    const Vector3d cross = foot.du.cross(foot.dv);
    const double area = cross.squaredNorm();
    if (area > 0) return cross * cross.transpose() / area;
  }
  const Vector3d along = foot.free_u ? foot.du : foot.dv;
  if ((foot.free_u || foot.free_v) && along.squaredNorm() > 0)
    weight -= along * along.transpose() / along.squaredNorm();
  return weight;
}

bool good_knots(const std::vector<double>& knots) {
  if (knots.size() < 2 * cubic + 2) return false;
  for (std::size_t k = 1; k < knots.size(); ++k) {
    if (!(knots[k] >= knots[k - 1])) return false;
  }
  const std::size_t last = knots.size() - 1;
  if (knots[cubic] != knots[0] || knots[last - cubic] != knots[last]) return false;
  for (std::size_t k = 1; k + cubic < last; ++k) {  // a knot four times within would cut the surface
    if (!(knots[k + cubic] > knots[k])) return false;
  }
  return std::isfinite(knots.front()) && std::isfinite(knots.back());
}

// The sheet's lengths along u and v, from the best affine map of the parameters to the points.
std::expected<Vector2d, Error> sheet_size(std::span<const Vector3d> points,
                                          std::span<const Vector2d> parameters) {
  Vector2d middle = Vector2d::Zero();
  for (const Vector2d& uv : parameters) middle += uv / static_cast<double>(parameters.size());
  Eigen::Matrix2d gram = Eigen::Matrix2d::Zero();
  Eigen::Matrix<double, 3, 2> load = Eigen::Matrix<double, 3, 2>::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vector2d d = parameters[k] - middle;
    gram += d * d.transpose(), load += points[k] * d.transpose();
  }
  if (!(gram.determinant() > 1e-12 * gram.trace() * gram.trace())) return std::unexpected(Error::collinear);
  const Eigen::Matrix<double, 3, 2> map = load * gram.inverse();
  const double u = map.col(0).norm(), v = map.col(1).norm(), least = 1e-6 * (u + v);
  return Vector2d(std::max(u, least), std::max(v, least)).cwiseMax(1e-300);
}

class Correction {
 public:
  Correction(std::span<const Vector3d> points, const BSplineSurface& frame,
             const CorrectionSettings& settings, const Vector2d& size)
      : points_(points),
        settings_(settings),
        size_(size),
        domain_{{frame.knots_u.front(), frame.knots_v.front()}, {frame.knots_u.back(), frame.knots_v.back()}},
        separate_(frame.knots_u, frame.knots_v, settings.keep_border, 1),
        feet_(points.size()) {
    fit_.surface.knots_u = frame.knots_u, fit_.surface.knots_v = frame.knots_v;
    const auto nu = static_cast<Eigen::Index>(frame.knots_u.size()) - cubic - 1;
    const auto nv = static_cast<Eigen::Index>(frame.knots_v.size()) - cubic - 1;
    const Eigen::MatrixXd* given[3] = {&frame.x, &frame.y, &frame.z};
    Eigen::MatrixXd* nets[3] = {&fit_.surface.x, &fit_.surface.y, &fit_.surface.z};
    for (int axis = 0; axis < 3; ++axis) {
      if (!settings.keep_border) {
        *nets[axis] = Eigen::MatrixXd::Zero(nu, nv);
      } else {
        *nets[axis] = *given[axis];
        nets[axis]->block(1, 1, nu - 2, nv - 2).setZero();
      }
    }
  }

  std::expected<CorrectedFit, Error> run(std::span<const Vector2d> parameters) {
    for (std::size_t k = 0; k < points_.size(); ++k) feet_[k].uv = parameters[k];
    see_all();
    if (!first_fit()) return std::unexpected(Error::singular);
    CorrectionReport& report = fit_.report;
    see_all();
    report.start_rms_mm = rms();
    report.sums_mm2.push_back(sum_);
    std::vector<Foot> feet = feet_;
    settle_all(fit_.surface, feet);
    if (const double sum = sum_of(feet); sum <= sum_) feet_ = std::move(feet), sum_ = sum;
    report.sums_mm2.push_back(sum_);
    report.end = settings_.step == CorrectionStep::tangent_distance ? tangent_rounds() : point_rounds();

    report.rms_mm = rms();
    for (const Foot& foot : feet_) {
      report.max_mm = std::max(report.max_mm, std::sqrt(foot.squared));
      fit_.parameters.push_back(foot.uv);
    }
    return std::move(fit_);
  }

 private:
  double rms() const { return std::sqrt(sum_ / static_cast<double>(points_.size())); }
  static double sum_of(std::span<const Foot> feet) {
    double sum = 0;
    for (const Foot& foot : feet) sum += foot.squared;
    return sum;
  }
  void see_all() {
    for (std::size_t k = 0; k < points_.size(); ++k)
      feet_[k] = see(fit_.surface.at(feet_[k].uv.x(), feet_[k].uv.y()), points_[k], feet_[k].uv, domain_);
    sum_ = sum_of(feet_);
  }
  void settle_all(const BSplineSurface& surface, std::vector<Foot>& feet) const {
    for (std::size_t k = 0; k < points_.size(); ++k)
      feet[k] = settle(surface, points_[k], feet[k].uv, domain_);
  }
  // The net that is closest to the points at their parameters, coordinate by coordinate.
  bool refit() {
    separate_.clear();
    for (const Foot& foot : feet_)
      separate_.add(live_basis(fit_.surface, foot.uv), Matrix3d::Identity(), foot.residual);
    if (fairing_ > 0) separate_.add_fairing(fairing_, size_.x(), size_.y(), fit_.surface);
    if (!separate_.solve()) return false;
    separate_.add_solution_to(fit_.surface);
    return true;
  }

  // The first fit: without fairing where the data determine the net by themselves.
  bool first_fit() {
    const BSplineSurface before = fit_.surface;
    fairing_ = 0;
    const bool solved = refit();
    fit_.report.smallest_pivot = solved ? separate_.smallest_pivot() : 0.0;
    fit_.report.largest_pivot = separate_.largest_pivot();
    if (solved && separate_.smallest_pivot() >= determined * separate_.largest_pivot()) return true;
    if (!(settings_.fairing > 0)) return false;
    fit_.surface = before;
    fit_.report.faired = true;
    fairing_ = settings_.fairing * separate_.trace() / separate_.fairing_trace(size_.x(), size_.y());
    return refit();
  }

  bool close_enough() const {
    return sum_ <= settings_.enough_mm * settings_.enough_mm * static_cast<double>(points_.size());
  }

  // Keeps a round's result. True when its gain is the third in a row that is not worth another.
  bool accept(BSplineSurface surface, std::vector<Foot> feet, double sum) {
    quiet_ = sum_ - sum < settings_.least_gain * sum_ ? quiet_ + 1 : 0;
    fit_.surface = std::move(surface), feet_ = std::move(feet), sum_ = sum;
    fit_.report.sums_mm2.push_back(sum);
    ++fit_.report.accepted;
    return quiet_ >= settled_rounds;
  }

  CorrectionEnd point_rounds() {
    for (int round = 0; round < settings_.most_rounds; ++round) {
      if (close_enough()) return CorrectionEnd::close_enough;
      BSplineSurface before = fit_.surface;
      std::vector<Foot> feet = feet_;
      if (refit()) settle_all(fit_.surface, feet);
      std::swap(before, fit_.surface);  // `before` holds what was found
      const double sum = sum_of(feet);
      if (!(sum < sum_)) {
        ++fit_.report.rejected;
        return CorrectionEnd::no_descent;
      }
      if (accept(std::move(before), std::move(feet), sum)) return CorrectionEnd::settled;
    }
    return CorrectionEnd::most_rounds;
  }

  struct Trial {
    BSplineSurface surface;
    std::vector<Foot> feet;
    double sum = 0;
    double promised = 0;  // the fall of the sum that the tangent planes foresee
  };

  // The tangent-distance step at this damping; nothing where the equations have no positive pivot.
  std::optional<Trial> tangent_step(NetEquations& equations, double damping) const {
    equations.clear();
    const Matrix3d damped = damping * Matrix3d::Identity();
    for (const Foot& foot : feet_) {
      const Matrix3d weight = stands_off(foot);
      equations.add(live_basis(fit_.surface, foot.uv), weight + damped, weight * foot.residual);
    }
    if (fairing_ > 0) equations.add_fairing(fairing_, size_.x(), size_.y(), fit_.surface);
    if (!equations.solve()) return std::nullopt;
    Trial trial{fit_.surface, feet_};
    equations.add_solution_to(trial.surface);
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const Foot& foot = feet_[k];
      const Matrix3d weight = stands_off(foot);
      const Vector3d there = trial.surface.at(foot.uv.x(), foot.uv.y()).value - points_[k];
      trial.promised += foot.residual.dot(weight * foot.residual) - there.dot(weight * there);
    }
    settle_all(trial.surface, trial.feet);
    trial.sum = sum_of(trial.feet);
    return trial;
  }

  CorrectionEnd tangent_rounds() {
    NetEquations coupled(fit_.surface.knots_u, fit_.surface.knots_v, settings_.keep_border, 3);
    double damping = first_damping;
    for (int round = 0; round < settings_.most_rounds; ++round) {
      if (close_enough()) return CorrectionEnd::close_enough;
      auto trial = tangent_step(coupled, damping);
      if (!trial || !(trial->sum < sum_)) {
        ++fit_.report.rejected;
        damping *= damping_grows;
        if (damping > largest_damping) return CorrectionEnd::no_descent;
        continue;
      }
      const double gain = (sum_ - trial->sum) / trial->promised;
      if (gain > good_model) damping = std::max(least_damping, damping * damping_falls);
      if (gain < poor_model) damping *= damping_grows;
      if (accept(std::move(trial->surface), std::move(trial->feet), trial->sum))
        return CorrectionEnd::settled;
    }
    return CorrectionEnd::most_rounds;
  }

  std::span<const Vector3d> points_;
  CorrectionSettings settings_;
  Vector2d size_;
  Domain domain_;
  NetEquations separate_;  // one matrix for the three coordinates
  CorrectedFit fit_;
  std::vector<Foot> feet_;
  double sum_ = 0;
  double fairing_ = 0;  // the energy's factor; none where the data determine the net
  int quiet_ = 0;
};

}  // namespace

std::string_view to_string(CorrectionEnd end) noexcept {
  switch (end) {
    case CorrectionEnd::close_enough:
      return "the points lie as close as asked for";
    case CorrectionEnd::settled:
      return "another round would not be worth it";
    case CorrectionEnd::no_descent:
      return "no step makes the distances smaller";
    case CorrectionEnd::most_rounds:
      return "the rounds allowed are used up";
  }
  return "unknown end";
}

std::expected<CorrectedFit, Error> fit_with_parameter_correction(std::span<const Vector3d> points,
                                                                 std::span<const Vector2d> parameters,
                                                                 const BSplineSurface& frame,
                                                                 const CorrectionSettings& settings) {
  if (!good_knots(frame.knots_u) || !good_knots(frame.knots_v))
    return std::unexpected(Error::knots_not_increasing);
  const auto nu = static_cast<Eigen::Index>(frame.knots_u.size()) - cubic - 1;
  const auto nv = static_cast<Eigen::Index>(frame.knots_v.size()) - cubic - 1;
  if (settings.keep_border) {
    assert(frame.x.rows() == nu && frame.x.cols() == nv && frame.y.rows() == nu && frame.y.cols() == nv &&
           frame.z.rows() == nu && frame.z.cols() == nv);
    if (!frame.x.allFinite() || !frame.y.allFinite() || !frame.z.allFinite())
      return std::unexpected(Error::not_finite);
  }
  const auto ring = settings.keep_border ? 2 : 0;
  const auto free = static_cast<std::size_t>((nu - ring) * (nv - ring));
  if (points.size() != parameters.size() || points.size() < free)
    return std::unexpected(Error::too_few_points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Vector2d& uv = parameters[k];
    if (!points[k].allFinite() || !uv.allFinite()) return std::unexpected(Error::not_finite);
    if (uv.x() < frame.knots_u.front() || uv.x() > frame.knots_u.back() || uv.y() < frame.knots_v.front() ||
        uv.y() > frame.knots_v.back())
      return std::unexpected(Error::outside_domain);
  }
  const auto size = sheet_size(points, parameters);
  if (!size) return std::unexpected(size.error());
  return Correction(points, frame, settings, *size).run(parameters);
}

std::vector<Vector2d> chord_length_parameters(std::span<const Vector3d> stripe, const Vector2d& from,
                                              const Vector2d& to) {
  std::vector<Vector2d> parameters(stripe.size(), from);
  std::vector<double> length(stripe.size(), 0.0);
  for (std::size_t k = 1; k < stripe.size(); ++k)
    length[k] = length[k - 1] + (stripe[k] - stripe[k - 1]).norm();
  if (stripe.empty() || !(length.back() > 0)) return parameters;
  for (std::size_t k = 0; k < stripe.size(); ++k) {
    const double t = length[k] / length.back();
    parameters[k] = (1 - t) * from + t * to;
  }
  return parameters;
}

}  // namespace moldloft::geometry
