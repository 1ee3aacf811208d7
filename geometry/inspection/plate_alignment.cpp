#include "geometry/inspection/plate_alignment.hpp"

#include "geometry/tukey.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace moldloft::geometry {
namespace {

using Eigen::Vector3d;
using Square = Eigen::Matrix<double, 6, 6>;

constexpr double sigma_from_median = 1.4826;  // of normal noise
constexpr double least_scale_mm = 2e-4;       // of the biweight: below it rounding would be an outlier
constexpr double settled_mm = 1e-6, nearly_settled_mm = 1e-3;  // way of the points by a step
constexpr double undetermined = 1e-4;   // eigenvalue against the largest: slopes below 1 %
constexpr double difference_mm = 0.05;  // for second derivatives: small against any curvature
constexpr double grown = 1 + 1e-9, first_damping = 1e-3, more_damping = 10, most_damping = 1e6;

// One equation: the distance, and how a small motion changes it.
struct Equation {
  Vector6 row;
  double distance = 0, weight = 0;  // 0: takes no part
};

double spread(const std::vector<Equation>& equations) {
  std::vector<double> sizes;
  for (const auto& e : equations) {
    if (e.weight > 0) sizes.push_back(std::abs(e.distance));
  }
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::ranges::nth_element(sizes, middle);
  return sigma_from_median * *middle;
}

class Alignment {
 public:
  Alignment(const DesignFaces& design, const PlateToAlign& plate, const PlateAlignmentSettings& settings)
      : design_{design}, plate_{plate}, settings_{settings}, points_(plate.points.size()) {
    edges_.reserve(plate.edges.size());
    centroid_ = Vector3d::Zero();
    for (const auto& p : plate.points) centroid_ += p;
    centroid_ /= static_cast<double>(plate.points.size());
    double square = 0;
    for (const auto& p : plate.points) square += (p - centroid_).squaredNorm();
    radius_ = std::sqrt(square / static_cast<double>(plate.points.size()));
  }

  std::expected<PlateAlignment, Flaw> run();

 private:
  void look(const RigidMotion&);  // all equations at a pose
  void add_edge(const Vector3d& q, const Vector3d& centre);
  void weigh();
  void sum(Matrix6& normal, Vector6& gradient, double& square) const;
  RigidMotion moved(const RigidMotion&, const Vector6& step) const;
  void describe(const RigidMotion&, PlateAlignment&);
  Matrix6 second_derivatives(const RigidMotion&);
  Matrix6 error_sums() const;

  const DesignFaces& design_;
  const PlateToAlign& plate_;
  const PlateAlignmentSettings& settings_;
  Vector3d centroid_;  // plate frame
  double radius_ = 1;
  std::vector<Equation> points_, edges_;
  std::size_t beyond_ = 0;
};

Vector6 row_of(const Vector3d& normal, const Vector3d& arm, double radius) {
  Vector6 row;
  row << normal, arm.cross(normal) / radius;
  return row;
}

void Alignment::look(const RigidMotion& pose) {
  const Vector3d c = pose * centroid_;
  beyond_ = 0;
  edges_.clear();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Vector3d q = pose * plate_.points[i];
    const auto foot = design_.foot(q);
    const bool beyond = !settings_.points_belong && foot.overhang_mm > settings_.border_tolerance_mm;
    beyond_ += beyond ? 1 : 0;
    points_[i] = {.row = row_of(foot.normal, q - c, radius_),
                  .distance = foot.signed_mm,
                  .weight = beyond || !foot.converged ? 0.0 : 1.0};
    if (settings_.points_belong && foot.overhang_mm > 0) add_edge(q, c);
  }
  if (!settings_.with_border) return;
  for (const auto& p : plate_.edges) add_edge(pose * p, c);
}

void Alignment::add_edge(const Vector3d& q, const Vector3d& c) {
  const auto border = design_.border_near(q);
  edges_.push_back({.row = row_of(border.outward, q - c, radius_),
                    .distance = border.outward.dot(q - border.at),
                    .weight = 1});
}

// Weights of each kind sum to 1, so that neither drowns the other.
void Alignment::weigh() {
  for (auto* kind : {&points_, &edges_}) {
    if (settings_.robust) {
      const double scale = std::max(least_scale_mm, spread(*kind));
      for (auto& e : *kind) e.weight *= tukey_weight(e.distance, scale);
    }
    double all = 0;
    for (const auto& e : *kind) all += e.weight;
    if (all <= 0) continue;
    for (auto& e : *kind) e.weight /= all;
  }
}

void Alignment::sum(Matrix6& normal, Vector6& gradient, double& square) const {
  normal.setZero();
  gradient.setZero();
  square = 0;
  for (const auto* kind : {&points_, &edges_}) {
    for (const auto& e : *kind) {
      if (e.weight <= 0) continue;
      normal += e.weight * e.row * e.row.transpose();
      gradient += e.weight * e.distance * e.row;
      square += e.weight * e.distance * e.distance;
    }
  }
}

RigidMotion Alignment::moved(const RigidMotion& pose, const Vector6& step) const {
  const Vector3d c = pose * centroid_;
  const Vector3d turn = step.tail<3>() / radius_;
  RigidMotion small = RigidMotion::Identity();
  small.linear() = turn.norm() > 0 ? Eigen::AngleAxisd{turn.norm(), turn.normalized()}.toRotationMatrix()
                                   : Eigen::Matrix3d::Identity();
  small.translation() = c + step.head<3>() - small.linear() * c;
  RigidMotion result = small * pose;
  // Many small products drift off the rotations.
  result.linear() = Eigen::Quaterniond{result.linear()}.normalized().toRotationMatrix();
  return result;
}

// The sum of squares of what each error that stands for itself does to the gradient.
Matrix6 Alignment::error_sums() const {
  Matrix6 sums = Matrix6::Zero();
  const auto add = [&](const std::vector<Equation>& equations, std::span<const std::uint16_t> groups,
                       double group_sigma, double own_sigma) {
    std::map<std::uint16_t, Vector6> together;
    for (std::size_t i = 0; i < equations.size(); ++i) {
      const Vector6 g = equations[i].weight * equations[i].row;
      sums += own_sigma * own_sigma * g * g.transpose();
      if (i < groups.size()) together.try_emplace(groups[i], Vector6::Zero()).first->second += g;
    }
    for (const auto& [group, g] : together) sums += group_sigma * group_sigma * g * g.transpose();
  };
  add(points_, plate_.point_groups, settings_.group_sigma_mm, settings_.point_sigma_mm);
  add(edges_, plate_.edge_groups, settings_.edge_sigma_mm,
      plate_.edge_groups.empty() ? settings_.edge_sigma_mm : 0);
  return sums;
}

// Of half the sum of squares, by central differences of its gradient.
Matrix6 Alignment::second_derivatives(const RigidMotion& pose) {
  Matrix6 all, normal;
  double square = 0;
  for (int k = 0; k < 6; ++k) {
    std::array<Vector6, 2> gradients;
    for (const int side : {0, 1}) {
      look(moved(pose, (side == 0 ? -difference_mm : difference_mm) * Vector6::Unit(k)));
      weigh();
      sum(normal, gradients[static_cast<std::size_t>(side)], square);
    }
    all.col(k) = (gradients[1] - gradients[0]) / (2 * difference_mm);
  }
  return (all + all.transpose()) / 2;
}

void Alignment::describe(const RigidMotion& pose, PlateAlignment& out) {
  out.design_from_plate = pose;
  out.centroid = pose * centroid_;
  out.radius_mm = radius_;
  out.beyond_border = beyond_;
  double square = 0, weight = 0, border = 0, border_weight = 0;
  for (const auto& e : points_) {
    if (e.weight > 0) ++out.points, weight += e.weight, square += e.weight * e.distance * e.distance;
  }
  for (const auto& e : edges_) border_weight += e.weight, border += e.weight * e.distance * e.distance;
  out.outliers = points_.size() - out.points - beyond_;
  out.rms_mm = weight > 0 ? std::sqrt(square / weight) : 0;
  out.border_rms_mm = border_weight > 0 ? std::sqrt(border / border_weight) : 0;

  const Matrix6 errors = error_sums();
  Matrix6 normal, inverse = Matrix6::Zero();
  Vector6 gradient;
  sum(normal, gradient, square);
  const Eigen::SelfAdjointEigenSolver<Square> first{Square{normal}};
  // A plate that is far from its design pulls at its pose through the surface's curvature too: the full second
  // derivatives say how it answers to an error, where they can be had.
  const Eigen::SelfAdjointEigenSolver<Square> full{Square{second_derivatives(pose)}};
  const auto& eigen = full.eigenvalues()[0] > undetermined * full.eigenvalues()[5] ? full : first;
  for (int k = 0; k < 6; ++k) {
    const Vector6 direction = eigen.eigenvectors().col(k);
    if (eigen.eigenvalues()[k] < undetermined * eigen.eigenvalues()[5]) {
      out.undetermined.push_back(direction);
    } else {
      inverse += direction * direction.transpose() / eigen.eigenvalues()[k];
    }
  }
  Vector6 scale;
  scale << Vector3d::Ones(), Vector3d::Constant(1 / radius_);
  out.covariance = scale.asDiagonal() * (inverse * errors * inverse) * scale.asDiagonal();
}

std::expected<PlateAlignment, Flaw> Alignment::run() {
  PlateAlignment out;
  RigidMotion pose = settings_.start, before = pose;
  double damping = 0, last = std::numeric_limits<double>::infinity();
  Matrix6 normal;
  Vector6 gradient;
  double square = 0;
  bool settled = false;
  double last_step = 0;
  Eigen::SelfAdjointEigenSolver<Square> eigen;
  for (out.iterations = 0; out.iterations < settings_.most_iterations && !settled; ++out.iterations) {
    look(pose);
    weigh();
    sum(normal, gradient, square);
    if (std::ranges::count_if(points_, [](const Equation& e) { return e.weight > 0; }) < 6)
      return std::unexpected(Flaw{Error::too_few_points});
    if (!settings_.robust && square > grown * last && damping < most_damping) {
      damping = std::max(first_damping, more_damping * damping);
      pose = before;
      look(pose);
      weigh();
      sum(normal, gradient, square);
    } else {
      damping /= more_damping;
    }
    last = square;
    before = pose;
    eigen.compute(Square{normal});
    Vector6 step = Vector6::Zero();
    for (int k = 0; k < 6; ++k) {
      const double value = eigen.eigenvalues()[k], least = undetermined * eigen.eigenvalues()[5];
      if (value < least) continue;
      step -= eigen.eigenvectors().col(k) * (eigen.eigenvectors().col(k).dot(gradient) / (value + damping));
    }
    last_step = step.norm();
    settled = last_step < settled_mm && damping < first_damping;
    pose = moved(pose, step);
  }
  look(pose);
  weigh();
  describe(pose, out);
  // Which points count, and which sample of the border is the nearest, may change to and fro by a hair for ever.
  if (!settled && !settings_.robust && last_step > nearly_settled_mm)
    return std::unexpected(Flaw{Error::not_converged});
  return out;
}

}  // namespace

std::expected<PlateAlignment, Flaw> align(const DesignFaces& design, const PlateToAlign& plate,
                                          const PlateAlignmentSettings& settings) {
  if (plate.points.size() < 6) return std::unexpected(Flaw{Error::too_few_points});
  if ((!plate.point_groups.empty() && plate.point_groups.size() != plate.points.size()) ||
      (!plate.edge_groups.empty() && plate.edge_groups.size() != plate.edges.size()))
    return std::unexpected(Flaw{Error::sizes_differ});
  for (const auto points : {plate.points, plate.edges}) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!can_be_measured(points[i])) return std::unexpected(Flaw{Error::not_finite, i});
    }
  }
  return Alignment{design, plate, settings}.run();
}

std::expected<RigidMotion, Error> motion_between(std::span<const Vector3d> from,
                                                 std::span<const Vector3d> to) {
  if (from.size() != to.size()) return std::unexpected(Error::sizes_differ);
  if (from.size() < 3) return std::unexpected(Error::too_few_points);
  Vector3d middle_from = Vector3d::Zero(), middle_to = Vector3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (!can_be_measured(from[i]) || !can_be_measured(to[i])) return std::unexpected(Error::not_finite);
    middle_from += from[i];
    middle_to += to[i];
  }
  middle_from /= static_cast<double>(from.size());
  middle_to /= static_cast<double>(to.size());
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i)
    cross += (to[i] - middle_to) * (from[i] - middle_from).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd{cross, Eigen::ComputeFullU | Eigen::ComputeFullV};
  if (svd.singularValues()[1] < 1e-9 * svd.singularValues()[0] || !(svd.singularValues()[0] > 0))
    return std::unexpected(Error::collinear);
  const double hand = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  RigidMotion motion = RigidMotion::Identity();
  motion.linear() = svd.matrixU() * Vector3d{1, 1, hand}.asDiagonal() * svd.matrixV().transpose();
  motion.translation() = middle_to - motion.linear() * middle_from;
  return motion;
}

}  // namespace moldloft::geometry
