#include "geometry/inspection/localization.hpp"

#include "geometry/tukey.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

namespace moldloft::geometry {

namespace {

using Eigen::Vector3d;
using Vector = Eigen::Matrix<double, 6, 1>;
using Square = Eigen::Matrix<double, 6, 6>;

constexpr double undetermined = 1e-11;     // least to largest eigenvalue of the normal matrix; slopes of 3e-6
constexpr double flat_spread = 1e-20;      // second to first principal mean square: 1e-10 of the length
constexpr double sigma_from_mad = 1.4826;  // of normal noise
constexpr double weak_ratio = 5;
constexpr double penetration_mm = 1e-9;
constexpr double least_damping = 1e-6, first_damping = 1e-3, more_damping = 30, most_damping = 1e12;
// Steps below these are taken without asking for a lower sum: rounding hides it, or points beyond
// the border do.
constexpr double unseen_mm = 1e-3, trusted_mm = 1;
constexpr double coarse_mm = 0.1;  // enough to tell which points stand beyond the border
constexpr int most_rounds = 8;     // of leaving such points out

// The search for a pose that half of the points agree on, on the equations linearized at hand.
constexpr int draws = 32, improvements = 2, most_searches = 4;
constexpr std::size_t most_searched = 128, fewest_searched = 14;
constexpr double left_out = 0.4;  // of the points, by a draw: more than the outliers that must be borne
constexpr double search_damping = 1e-7;  // sliding is weak, and must not be held back
constexpr double chance = 3;  // over the root of their number: by how much medians of good points differ
constexpr double searched_factor = 3;
constexpr double rough_share = 0.3;   // of the spread: steps below it do not change who is an outlier
constexpr double longest_step = 0.5;  // of the points' radius: a longer one would leave the design altogether
constexpr double clearly_nearer = 0.95, much_wider = 1.5;  // spreads from pass to pass
constexpr int rough_passes = 12, most_idle = 3;

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

// Eigenvalues of a symmetric matrix, ascending, and its eigenvectors, by Jacobi's rotations (Golub and
// Van Loan, 8.5): every rotation makes one pair of entries zero, and six sweeps leave nothing that a
// double could show.
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

std::optional<Flaw> fault_of(std::span<const Vector3d> points, const LocalizationSettings& settings,
                             int free) {
  // Three points fix a pose only together with the surface's curvature; six equations are the least
  // there must be.
  if (points.size() < static_cast<std::size_t>(std::max(3, free))) return Flaw{Error::too_few_points};
  if (!settings.weights.empty() && settings.weights.size() != points.size()) return Flaw{Error::sizes_differ};
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!can_be_measured(points[i]))
      return Flaw{points[i].allFinite() ? Error::too_large : Error::not_finite, i};
    if (settings.weights.empty()) continue;
    if (!std::isfinite(settings.weights[i])) return Flaw{Error::not_finite, i};
    if (settings.weights[i] < 0) return Flaw{Error::negative_weight, i};
  }
  if (!settings.start.matrix().allFinite()) return Flaw{Error::not_finite};
  const Eigen::Matrix3d turn = settings.start.linear();
  if (!(turn.transpose() * turn).isIdentity(1e-6) || turn.determinant() < 0 ||
      !can_be_measured(settings.start.translation()) || !(settings.tolerance_mm >= 0) ||
      !(settings.border_tolerance_mm >= 0) || !(settings.sigma_mm >= 0) || !(settings.settled_mm > 0))
    return Flaw{Error::impossible_setting};
  return std::nullopt;
}

class Alignment {
 public:
  Alignment(const PreparedSurface& design, std::span<const Vector3d> points, const LocalizationSettings& s)
      : settings_(s), free_(s.fixed), system_(design, points, s.weights), pose_(s.start) {}

  std::expected<Localization, Flaw> run() {
    const auto& spread = system_.moments().spread;
    if (!(spread[1] > flat_spread * spread[2])) return failed(Error::collinear);
    if (free_.count > 0 && settings_.robust) {
      if (!settle_among_outliers()) return failed(Error::not_converged);
    } else if (free_.count > 0) {
      // As the pose gets better other points turn out to stand beyond the border, and some of those not to.
      for (int round = 0; round < most_rounds; ++round) {
        if (!settle(coarse_mm)) return failed(Error::not_converged);
        if (!system_.leave_out_beyond(settings_.border_tolerance_mm)) break;
      }
      beyond_ = static_cast<std::size_t>(std::ranges::count(system_.taking_part(), 0));
      if (sums_.beyond_border > 0 && !settle(settings_.settled_mm)) return failed(Error::not_converged);
    }
    if (settings_.side != AllowedSide::both) {
      if (const auto fault = settle_on_side()) return failed(*fault);
    }
    return result();
  }

 private:
  static std::unexpected<Flaw> failed(Error error) { return std::unexpected(Flaw{error}); }

  PointPlaneSums pass(double tukey_mm = 0) {
    ++iterations_;
    return system_.pass(pose_, tukey_mm);
  }

  // The step that the normal equations ask for; with `damping` relative to their mean diagonal.
  Vector step_of(const Matrix6& whole_normal, const Vector6& gradient, double damping) const {
    Square normal = free_.of(whole_normal);
    const double mean = normal.trace() / 6;
    // Where a direction is not determined at all it stays at rest, and the final check will say so.
    normal.diagonal().array() += (damping + 1e-14) * mean;
    return -normal.ldlt().solve(free_.of(gradient));
  }
  Vector step_of(const PointPlaneSums& sums, double damping) const {
    return step_of(sums.normal, sums.gradient, damping);
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

  double weight_of(std::size_t i) const { return settings_.weights.empty() ? 1 : settings_.weights[i]; }

  // The standard deviation that the median size of the residuals below `within` tells. Beyond the border the way
  // back to it counts: else nothing would fit as well as a plate that has slid off into the design's tangent plane.
  double spread_mm(double within = std::numeric_limits<double>::infinity()) {
    sizes_.clear();
    for (std::size_t i = 0; i < system_.distances().size(); ++i) {
      const double w = weight_of(i);
      if (!system_.taking_part()[i] || !(w > 0)) continue;
      const double over = system_.overhangs()[i], distance = std::abs(system_.distances()[i]);
      const double size =
          std::sqrt(w) * (over > settings_.border_tolerance_mm ? std::hypot(distance, over) : distance);
      if (size < within) sizes_.push_back(size);
    }
    return sigma_from_mad * median_of(sizes_);
  }
  static double median_of(std::vector<double>& sizes) {
    if (sizes.empty()) return 0;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return *middle;
  }

  // Plain least squares would be drawn to the outliers, and from there may never settle: the weights are robust
  // from the second pass on, and a few of the points are asked whether another pose suits half of all better.
  bool settle_among_outliers() {
    system_.keep_rows();
    sizes_.reserve(system_.distances().size());
    double spread = settle_roughly(true);
    double longest = longest_step * system_.moments().radius;
    for (int round = 0; round < most_searches; ++round) {
      const RigidMotion before = pose_;
      if (!search(longest)) break;
      const double found = settle_roughly(false);
      if (found < spread) {
        spread = found;
      } else {  // farther than the equations hold
        pose_ = before;
        pass();
        longest *= 0.4;
      }
    }
    for (int round = 0; round < most_rounds; ++round) {
      pass();
      if (!system_.leave_out_beyond(settings_.border_tolerance_mm)) break;
      settle_roughly(false);
    }
    beyond_ = static_cast<std::size_t>(std::ranges::count(system_.taking_part(), 0));
    return settle_robustly();
  }

  // Damped until it is no longer than that; `damping` is what it took.
  Vector bounded_step(const Matrix6& normal, const Vector6& gradient, double longest, double& damping) const {
    Vector step = step_of(normal, gradient, damping);
    while (step.norm() > longest && damping < most_damping) {
      damping = std::max(first_damping, more_damping * damping);
      step = step_of(normal, gradient, damping);
    }
    return step;
  }

  // Reweighted steps until they are short beside the residuals' spread, which is the answer, or until it shrinks no
  // more; then back to where it was least. The width lags one pass behind; a step that widens the spread much is taken
  // back and damped. The first weights are plain ones far away, where all points are.
  double settle_roughly(bool plain_first) {
    sums_ = pass();
    double spread = spread_mm(), least = spread, damping = 0;
    RigidMotion best = pose_;
    // After a search narrower: outliers that stand close together widen the spread.
    const double factor = plain_first ? tukey_cutoff : searched_factor;
    if (!plain_first) sums_ = pass(std::max(factor * spread, 1e-9));
    for (int k = 0, idle = 0; k < rough_passes && idle < most_idle && iterations_ < settings_.most_iterations;
         ++k) {
      const Vector step =
          bounded_step(sums_.normal, sums_.gradient, longest_step * system_.moments().radius, damping);
      if (!step.allFinite()) break;
      const RigidMotion before = pose_;
      move(step);
      const PointPlaneSums next = pass(std::max(factor * spread, 1e-9));
      const double next_spread = spread_mm();
      if (next_spread < least) best = pose_;
      idle = next_spread < clearly_nearer * least ? 0 : idle + 1;
      least = std::min(least, next_spread);
      if (next_spread > much_wider * spread && step.norm() > unseen_mm) {
        pose_ = before;
        damping = std::max(first_damping, more_damping * damping);
        continue;
      }
      sums_ = next, spread = next_spread, damping = damping > least_damping ? 0.1 * damping : 0;
      if (step.norm() < std::max(rough_share * spread, settings_.settled_mm)) break;
    }
    if (clearly_nearer * spread < least) return least;
    pose_ = best;
    pass();
    return spread_mm();
  }

  // A residual and its derivatives, both times the root of its weight.
  struct Equation {
    double distance;
    Vector6 row;
    double size = 0;
  };

  // Least squares over them, in the small motion.
  Vector least_squares(std::span<Equation* const> equations, double longest) const {
    Matrix6 normal = Matrix6::Zero();
    Vector6 gradient = Vector6::Zero();
    for (const Equation* e : equations) {
      for (int k = 0; k < 6; ++k) normal.col(k).tail(6 - k) += e->row[k] * e->row.tail(6 - k);
      gradient += e->distance * e->row;
    }
    normal.triangularView<Eigen::StrictlyUpper>() = normal.transpose();
    double damping = search_damping;
    return bounded_step(normal, gradient, longest, damping);
  }

  // The `share` of them with the least sizes come first, and are the answer; the last of these is the largest.
  static std::span<Equation*> smallest(std::span<Equation*> equations, double share) {
    const auto last = static_cast<std::ptrdiff_t>(share * static_cast<double>(equations.size()));
    std::nth_element(equations.begin(), equations.begin() + last, equations.end(),
                     [](const Equation* a, const Equation* b) { return a->size < b->size; });
    return equations.first(static_cast<std::size_t>(last) + 1);
  }

  // The half with the smallest residuals after a small motion: the last one's is the median.
  static std::span<Equation*> better_half(std::span<Equation*> equations, const Vector6& motion) {
    for (Equation* e : equations) e->size = std::abs(e->distance + e->row.dot(motion));
    return smallest(equations, 0.5);
  }

  // A draw leaves out what lies together, for scattered outliers are borne by the weights: all towards one end of the
  // plate, or all round one place. Lever arms say where a point lies.
  static std::span<Equation*> draw(std::span<Equation*> equations, bool round, std::minstd_rand& random) {
    const auto lever = [](const Equation* e) { return Vector3d(e->row.tail<3>()); };
    const Vector3d here = lever(equations[random() % equations.size()]),
                   there = lever(equations[random() % equations.size()]);
    for (Equation* e : equations)
      e->size = round ? -(lever(e) - here).squaredNorm() : lever(e).dot(there - here);
    return smallest(equations, 1 - left_out);
  }

  // Moves to the pose of the least median of squares (Rousseeuw 1984), sought by draws that are improved on the better
  // half of all (Rousseeuw and Van Driessen 2006), where that is clearly less.
  bool search(double longest) {
    std::vector<Equation> equations;
    const std::size_t count = system_.distances().size(),
                      stride = (count + most_searched - 1) / most_searched;
    for (std::size_t i = 0; i < count; i += stride) {
      const double root = std::sqrt(weight_of(i));
      if (!system_.taking_part()[i] || !(root > 0)) continue;
      equations.push_back({root * system_.distances()[i], root * Vector6::Map(system_.rows()[i].data())});
    }
    if (equations.size() < fewest_searched) return false;
    std::vector<Equation*> order;
    for (Equation& e : equations) order.push_back(&e);
    std::minstd_rand random;  // always the same draws
    const double clearly_less = std::max(0.3, 1 - chance / std::sqrt(static_cast<double>(order.size())));
    double least = clearly_less * better_half(order, Vector6::Zero()).back()->size;
    Vector best = Vector::Zero();
    for (int k = 0; k < draws; ++k) {
      Vector motion = least_squares(draw(order, k % 3 == 0, random), longest);
      for (int again = 0; again < improvements; ++again)
        motion = least_squares(better_half(order, motion), longest);
      const double median = better_half(order, motion).back()->size;
      if (median < least) least = median, best = motion;
    }
    if (best.isZero(0)) return false;
    move(best);
    return true;
  }

  // Iteratively reweighted; the width follows the residuals, and the weights the width, until nothing moves. Outliers
  // are no part of the spread: their share would widen it.
  bool settle_robustly() {
    system_.pass(pose_);
    while (iterations_ < settings_.most_iterations) {
      tukey_mm_ = std::max(tukey_cutoff * spread_mm(tukey_cutoff * spread_mm()), 1e-9);
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

  std::expected<Localization, Flaw> result() {
    // The covariance wants all points with their plain weights. The last pass saw the pose but for a step too
    // short to matter, unless its weights were robust or there was nothing to settle.
    const bool seen = tukey_mm_ == 0 && sums_.points > 0;
    const PointPlaneSums sums = seen ? sums_ : system_.pass(pose_);
    // What is left beside the border and the outliers must still determine the pose.
    if (sums.points < static_cast<std::size_t>(std::max(3, free_.count)) || !(sums.weight > 0))
      return failed(Error::too_few_points);
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
      if (settings_.sigma_mm == 0) found.sigma_mm = tukey_mm_ / tukey_cutoff;
      variance = settings_.sigma_mm > 0
                     ? variance * factor * tukey_cutoff * tukey_cutoff / (tukey_mm_ * tukey_mm_)
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
  std::vector<double> sizes_;  // room for medians
  RigidMotion pose_;
  PointPlaneSums sums_;
  double tukey_mm_ = 0;
  int iterations_ = 0;
  std::size_t beyond_ = 0, outliers_ = 0;
  std::array<Contact, 6> contacts_{};
  int contact_count_ = 0;
};

}  // namespace

std::expected<Localization, Flaw> localize(const PreparedSurface& design,
                                           std::span<const Vector3d> plate_points,
                                           const LocalizationSettings& settings) {
  const FreeDirections free(settings.fixed);
  if (const auto fault = fault_of(plate_points, settings, free.count)) return std::unexpected(*fault);
  return Alignment(design, plate_points, settings).run();
}

}  // namespace moldloft::geometry
