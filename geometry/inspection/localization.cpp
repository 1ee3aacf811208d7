#include "geometry/inspection/localization.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace moldloft::geometry {

namespace {

using Eigen::Vector3d;
using Vector = Eigen::Matrix<double, 6, 1>;
using Square = Eigen::Matrix<double, 6, 6>;

constexpr double undetermined = 1e-11;     // least to largest eigenvalue of the normal matrix; slopes of 3e-6
constexpr double flat_spread = 1e-20;      // second to first principal mean square: 1e-10 of the length
constexpr double tukey_factor = 4.685;     // 95 % efficient on normal noise
constexpr double sigma_from_mad = 1.4826;  // of normal noise
constexpr double weak_ratio = 5;
constexpr double penetration_mm = 1e-9;
constexpr double least_damping = 1e-6, first_damping = 1e-3, more_damping = 30, most_damping = 1e12;
// Steps below these are taken without asking for a lower sum: rounding hides it, or points beyond the border
// do.
constexpr double unseen_mm = 1e-3, trusted_mm = 1;
constexpr double coarse_mm = 0.1;  // enough to tell which points stand beyond the border
constexpr int most_rounds = 8;     // of leaving such points out

// Fixed unknowns stay in the equations, uncoupled and stiffer than all the others together: their steps are
// zero, and their eigenvalues come last.
struct FreeDirections {
  std::array<bool, 6> fixed;
  int count = 0;

  explicit FreeDirections(const std::array<bool, 6>& f)
      : fixed(f), count(static_cast<int>(std::ranges::count(f, false))) {}

  bool is_fixed(int k) const { return fixed[static_cast<std::size_t>(k)]; }
  Square of(const Matrix6& all) const {
    Square part = all;
    for (int k = 0; k < 6; ++k) {
      if (is_fixed(k)) part.row(k).setZero(), part.col(k).setZero();
    }
    const double stiff = 2 * part.trace();
    for (int k = 0; k < 6; ++k) {
      if (is_fixed(k)) part(k, k) = stiff;
    }
    return part;
  }
  Vector of(const Vector6& all) const {
    Vector part = all;
    for (int k = 0; k < 6; ++k) {
      if (is_fixed(k)) part[k] = 0;
    }
    return part;
  }
};

// Eigenvalues of a symmetric matrix, ascending, and its eigenvectors, by Jacobi's rotations (Golub and Van
// Loan, 8.5): every rotation makes one pair of entries zero, and six sweeps leave nothing that a double could
// show.
struct Axes {
  Vector values;
  Square vectors = Square::Identity();

  explicit Axes(Square a) {
    for (int sweep = 0; sweep < 12; ++sweep) {
      for (int p = 0; p < 6; ++p) {
        for (int q = p + 1; q < 6; ++q) {
          if (a(p, q) == 0) continue;
          const double tau = (a(q, q) - a(p, p)) / (2 * a(p, q));
          const double t = (tau < 0 ? -1 : 1) / (std::abs(tau) + std::hypot(1.0, tau));
          const double c = 1 / std::hypot(1.0, t), s = c * t;
          const auto turn = [&](Vector& x, Vector& y) {
            const Vector kept = x;
            x = c * kept - s * y;
            y = s * kept + c * y;
          };
          Vector x = a.col(p), y = a.col(q);
          turn(x, y);
          a.col(p) = x, a.col(q) = y;
          x = a.row(p).transpose(), y = a.row(q).transpose();
          turn(x, y);
          a.row(p) = x.transpose(), a.row(q) = y.transpose();
          a(p, q) = a(q, p) = 0;
          x = vectors.col(p), y = vectors.col(q);
          turn(x, y);
          vectors.col(p) = x, vectors.col(q) = y;
        }
      }
    }
    values = a.diagonal();
    for (int k = 1; k < 6; ++k) {
      for (int m = k; m > 0 && values[m] < values[m - 1]; --m) {
        std::swap(values[m], values[m - 1]);
        vectors.col(m).swap(vectors.col(m - 1));
      }
    }
  }
};

std::optional<InspectionError> fault_of(std::span<const Vector3d> points,
                                        const LocalizationSettings& settings, int free) {
  // Three points fix a pose only together with the surface's curvature; six equations are the least there
  // must be.
  if (points.size() < static_cast<std::size_t>(std::max(3, free)))
    return InspectionError{Error::too_few_points};
  if (!settings.weights.empty() && settings.weights.size() != points.size())
    return InspectionError{Error::too_few_points};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d& p = points[i];
    if (!std::isfinite(p.x() + p.y() + p.z())) return InspectionError{Error::not_finite, i};
    if (!settings.weights.empty() && !(settings.weights[i] >= 0 && std::isfinite(settings.weights[i])))
      return InspectionError{Error::not_finite, i};
  }
  if (!settings.start.matrix().allFinite()) return InspectionError{Error::not_finite};
  return std::nullopt;
}

class Alignment {
 public:
  Alignment(const PreparedSurface& design, std::span<const Vector3d> points, const LocalizationSettings& s)
      : settings_(s), free_(s.fixed), system_(design, points, s.weights), pose_(s.start) {}

  std::expected<Localization, InspectionError> run() {
    const auto& spread = system_.moments().spread;
    if (!(spread[1] > flat_spread * spread[2])) return failed(Error::collinear);
    if (free_.count > 0) {
      // As the pose gets better other points turn out to stand beyond the border, and some of those not to.
      for (int round = 0; round < most_rounds; ++round) {
        if (!settle(coarse_mm)) return failed(Error::not_converged);
        if (!system_.leave_out_beyond(settings_.border_tolerance_mm)) break;
      }
      beyond_ = static_cast<std::size_t>(std::ranges::count(system_.taking_part(), 0));
      if (sums_.beyond_border > 0 && !settle(settings_.settled_mm)) return failed(Error::not_converged);
      if (settings_.robust && !settle_robustly()) return failed(Error::not_converged);
    }
    if (settings_.side != AllowedSide::both) {
      if (const auto fault = settle_on_side()) return failed(*fault);
    }
    return result();
  }

 private:
  static std::unexpected<InspectionError> failed(Error error) {
    return std::unexpected(InspectionError{error});
  }

  PointPlaneSums pass(double tukey_mm = 0) {
    ++iterations_;
    return system_.pass(pose_, tukey_mm);
  }

  // The step that the normal equations ask for; with `damping` relative to their mean diagonal.
  Vector step_of(const PointPlaneSums& sums, double damping) const {
    Square normal = free_.of(sums.normal);
    const double mean = normal.trace() / 6;
    // Where a direction is not determined at all it stays at rest, and the final check will say so.
    normal.diagonal().array() += (damping + 1e-14) * mean;
    return -normal.ldlt().solve(free_.of(sums.gradient));
  }

  // rms way of the points: |y|, for y carries the turn in mm at the radius of gyration.
  void move(const Vector& y) {
    const double radius = system_.moments().radius;
    const Vector3d turn = y.tail<3>() / radius, shift = y.head<3>();
    const double angle = turn.norm();
    const Vector3d centre = pose_ * system_.moments().centroid;
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    if (angle > 0) rotation = Eigen::AngleAxisd(angle, turn / angle);
    const Eigen::Quaterniond whole = (rotation * Eigen::Quaterniond(pose_.linear())).normalized();
    pose_.linear() = whole.toRotationMatrix();
    pose_.translation() = centre + shift - pose_.linear() * system_.moments().centroid;
  }

  // The tangent planes that continue the design beyond its border turn when feet move along the border, which
  // the equations leave out. While such points take part, the sum need not fall at every step, and it is
  // enough to settle within `beyond_mm`.
  bool settle(double beyond_mm) {
    double damping = 0;
    sums_ = pass();
    while (iterations_ < settings_.most_iterations) {
      const Vector step = step_of(sums_, damping);
      if (!step.allFinite()) return false;
      const RigidMotion before = pose_;
      move(step);
      const double length = step.norm();
      if (length < (sums_.beyond_border > 0 ? beyond_mm : settings_.settled_mm))
        return true;  // what is left is far below; no need to look again
      const PointPlaneSums next = pass();
      if (next.square <= sums_.square || length < (sums_.beyond_border > 0 ? trusted_mm : unseen_mm)) {
        sums_ = next;
        damping = damping > least_damping ? 0.1 * damping : 0;
      } else {
        pose_ = before;
        damping = std::max(first_damping, more_damping * damping);
        if (damping > most_damping) return false;
      }
    }
    return false;
  }

  // Iteratively reweighted; the width follows the residuals, and the weights the width, until nothing moves.
  bool settle_robustly() {
    std::vector<double> sizes;
    sizes.reserve(system_.distances().size());
    system_.pass(pose_);
    while (iterations_ < settings_.most_iterations) {
      sizes.clear();
      for (std::size_t i = 0; i < system_.distances().size(); ++i) {
        if (!system_.taking_part()[i]) continue;
        const double w = settings_.weights.empty() ? 1 : settings_.weights[i];
        sizes.push_back(std::sqrt(w) * std::abs(system_.distances()[i]));
      }
      const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
      std::nth_element(sizes.begin(), middle, sizes.end());
      tukey_mm_ = std::max(tukey_factor * sigma_from_mad * *middle, 1e-9);
      sums_ = pass(tukey_mm_);
      const Vector step = step_of(sums_, 0);
      if (!step.allFinite()) return false;
      move(step);
      if (step.norm() < settings_.settled_mm) {
        system_.pass(pose_);
        outliers_ = system_.leave_out_farther(tukey_mm_);
        return true;
      }
    }
    return false;
  }

  std::optional<Error> settle_on_side() {
    const double sign = settings_.side == AllowedSide::above ? 1 : -1;
    const std::size_t count = system_.distances().size();
    system_.keep_rows();
    std::vector<std::array<double, 6>> rows(count);
    std::vector<double> bounds(count);
    double before = std::numeric_limits<double>::infinity(), share = 1;
    while (iterations_ < settings_.most_iterations) {
      sums_ = pass(tukey_mm_);
      double broken = 0;
      for (std::size_t i = 0; i < count; ++i) {
        if (system_.taking_part()[i])
          broken = std::max(broken, -settings_.tolerance_mm - sign * system_.distances()[i]);
      }
      if (free_.count == 0) {
        if (broken > penetration_mm) return Error::no_feasible_pose;
        return std::nullopt;
      }
      // y = -H^-1 g + L'^-1 z with H = L L' turns the quadratic program into one of least distance.
      const Eigen::LLT<Square> factor(free_.of(sums_.normal) / sums_.weight);
      if (factor.info() != Eigen::Success) return Error::undetermined_pose;
      const Vector lone = -factor.solve(free_.of(sums_.gradient)) / sums_.weight;
      for (std::size_t i = 0; i < count; ++i) {
        Vector row = sign * free_.of(Vector6(Vector6::Map(system_.rows()[i].data())));
        bounds[i] = -settings_.tolerance_mm - sign * system_.distances()[i] - row.dot(lone);
        factor.matrixL().solveInPlace(row);
        Vector6::Map(rows[i].data()) = row;
      }
      const auto least = least_distance(rows, bounds, system_.taking_part());
      if (!least) return Error::no_feasible_pose;
      Vector step = least->z;
      factor.matrixU().solveInPlace(step);
      step += lone;
      const double length = step.norm();
      if (length < settings_.settled_mm && broken < penetration_mm) {
        note_contacts(*least);
        return std::nullopt;  // not moved any more: this pose has been seen to hold its bounds
      }
      // Steps that do not shrink swing about the solution; half of them does not.
      share = length > 0.9 * before ? std::max(0.25, 0.5 * share) : share;
      before = length;
      move(share * step);
    }
    return Error::not_converged;
  }

  void note_contacts(const LeastDistance& least) {
    double all = 0;
    for (int k = 0; k < least.active_count; ++k) all += least.active[static_cast<std::size_t>(k)].multiplier;
    for (int k = 0; k < std::min(least.active_count, 6); ++k) {
      const ActiveRow& active = least.active[static_cast<std::size_t>(k)];
      contacts_[static_cast<std::size_t>(k)] = {active.row, system_.feet()[active.row],
                                                active.multiplier / all};
    }
    contact_count_ = std::min(least.active_count, 6);
  }

  std::expected<Localization, InspectionError> result() {
    // The covariance wants all points with their plain weights. The last pass saw the pose but for a step too
    // short to matter, unless its weights were robust or there was nothing to settle.
    const bool seen = tukey_mm_ == 0 && sums_.points > 0;
    const PointPlaneSums sums = seen ? sums_ : system_.pass(pose_);
    Localization found;
    found.design_from_plate = pose_;
    found.iterations = iterations_;
    found.rms_mm = std::sqrt(sums.square / sums.weight);
    found.points = sums.points;
    found.beyond_border = beyond_;
    found.outliers = outliers_;
    found.centroid = pose_ * system_.moments().centroid;
    found.contacts = contacts_;
    found.contact_count = contact_count_;

    const double spare = static_cast<double>(sums.points) - free_.count;
    found.sigma_mm =
        settings_.sigma_mm > 0 ? settings_.sigma_mm : (spare > 0 ? std::sqrt(sums.square / spare) : 0);
    double variance = found.sigma_mm * found.sigma_mm;
    if (tukey_mm_ > 0) {
      const PointPlaneSums robust = system_.pass(pose_, tukey_mm_);
      const double count = static_cast<double>(robust.points), slope = robust.psi_slope / count;
      const double factor = robust.psi_square / std::max(1.0, spare) / (slope * slope);
      if (settings_.sigma_mm == 0) found.sigma_mm = tukey_mm_ / tukey_factor;
      variance = settings_.sigma_mm > 0
                     ? variance * factor * tukey_factor * tukey_factor / (tukey_mm_ * tukey_mm_)
                     : factor;
    }
    if (free_.count == 0) return found;
    const Axes axes(free_.of(sums.normal));
    if (!(axes.values[0] > undetermined * axes.values[free_.count - 1]))
      return failed(Error::undetermined_pose);
    describe(found, axes.values, axes.vectors, variance, sums.mean_normal);
    return found;
  }

  void describe(Localization& found, const Vector& values, const Square& vectors, double variance,
                const Vector3d& normal) const {
    const double radius = system_.moments().radius;
    found.direction_count = free_.count;
    const double best = std::sqrt(variance / values[free_.count - 1]);
    for (int k = 0; k < free_.count; ++k) {
      const Vector unit = vectors.col(k);
      PoseDirection& direction = found.directions[static_cast<std::size_t>(k)];
      direction.sigma_mm = std::sqrt(variance / values[k]);
      direction.weak = direction.sigma_mm > weak_ratio * best;
      direction.motion = direction.sigma_mm * unit;
      direction.motion.tail<3>() /= radius;
      found.covariance += direction.motion * direction.motion.transpose();

      const Vector3d shift = unit.head<3>(), turn = unit.tail<3>();
      const double lift = std::pow(shift.dot(normal), 2), spin = std::pow(turn.dot(normal), 2);
      const double slide = shift.squaredNorm() - lift, tilt = turn.squaredNorm() - spin;
      const double most = std::max({slide, spin, lift, tilt});
      direction.kind = most == slide  ? MotionKind::slide
                       : most == spin ? MotionKind::spin
                       : most == lift ? MotionKind::lift
                                      : MotionKind::tilt;
    }
  }

  const LocalizationSettings& settings_;
  const FreeDirections free_;
  PointPlaneSystem system_;
  RigidMotion pose_;
  PointPlaneSums sums_;
  double tukey_mm_ = 0;
  int iterations_ = 0;
  std::size_t beyond_ = 0, outliers_ = 0;
  std::array<Contact, 6> contacts_{};
  int contact_count_ = 0;
};

}  // namespace

std::expected<Localization, InspectionError> localize(const PreparedSurface& design,
                                                      std::span<const Vector3d> plate_points,
                                                      const LocalizationSettings& settings) {
  const FreeDirections free(settings.fixed);
  if (const auto fault = fault_of(plate_points, settings, free.count)) return std::unexpected(*fault);
  return Alignment(design, plate_points, settings).run();
}

}  // namespace moldloft::geometry
