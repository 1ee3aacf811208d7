#include "geometry/inspection/alignment_starts.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace moldloft::geometry {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int turns = 24;
constexpr int most_steps = 25;
constexpr std::size_t most_edges = 96, most_border = 384;  // what a coarse start needs
constexpr std::size_t most_starts = 8;
constexpr double settled_share = 1e-4;                // of the plate's radius
constexpr double same_turn = 0.1, same_share = 0.05;  // starts nearer than that are one: rad, of the radius
constexpr double worse = 3, slack_share = 0.02;       // than the best one: starts beyond do not count

struct PlanSample {
  Vector2d at, outward;
};

// Two axes across a normal.
Eigen::Matrix<double, 2, 3> plan_axes(const Vector3d& normal) {
  const Vector3d helper = std::abs(normal.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d x = (helper - normal * normal.dot(helper)).normalized();
  Eigen::Matrix<double, 2, 3> axes;
  axes.row(0) = x.transpose();
  axes.row(1) = normal.cross(x).transpose();
  return axes;
}

struct PlanMotion {
  double turn = 0;
  Vector2d shift = Vector2d::Zero();
  double rms = std::numeric_limits<double>::infinity();
};

const PlanSample& nearest(const std::vector<PlanSample>& border, const Vector2d& q) {
  const PlanSample* best = &border.front();
  double least = std::numeric_limits<double>::infinity();
  for (const auto& sample : border) {
    const double d = (q - sample.at).squaredNorm();
    if (d < least) least = d, best = &sample;
  }
  return *best;
}

// The edges, about their middle, moved onto the border, about its middle.
PlanMotion settle(const std::vector<Vector2d>& edges, const std::vector<PlanSample>& border, double turn,
                  double radius) {
  PlanMotion motion{.turn = turn};
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::Rotation2Dd rotation{motion.turn};
    Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
    Vector3d gradient = Vector3d::Zero();
    double square = 0;
    for (const auto& p : edges) {
      const Vector2d q = rotation * p, at = q + motion.shift;
      const auto& sample = nearest(border, at);
      const double e = sample.outward.dot(at - sample.at);
      const Vector3d row{sample.outward.x(), sample.outward.y(),
                         (q.x() * sample.outward.y() - q.y() * sample.outward.x()) / radius};
      normal += row * row.transpose();
      gradient += e * row;
      square += (at - sample.at).squaredNorm();
    }
    motion.rms = std::sqrt(square / static_cast<double>(edges.size()));
    const Vector3d move = -normal.ldlt().solve(gradient);
    motion.shift += move.head<2>();
    motion.turn += move.z() / radius;
    if (move.norm() < settled_share * radius) break;
  }
  return motion;
}

bool are_one(const PlanMotion& a, const PlanMotion& b, double radius) {
  return std::abs(wrapped_angle(a.turn - b.turn)) < same_turn &&
         (a.shift - b.shift).norm() < same_share * radius;
}

}  // namespace

std::vector<AlignmentStart> alignment_starts(const DesignFaces& design, std::span<const Vector3d> edges,
                                             const Vector3d& plate_up) {
  std::vector<AlignmentStart> starts;
  if (edges.size() < 3 || design.border().empty()) return starts;
  const auto axes = plan_axes(design.up());
  Vector3d middle_border = Vector3d::Zero(), middle = Vector3d::Zero();
  double length = 0;
  for (const auto& s : design.border()) middle_border += s.length_mm * s.at, length += s.length_mm;
  middle_border /= length;
  for (const auto& p : edges) middle += p;
  middle /= static_cast<double>(edges.size());
  std::vector<PlanSample> border;
  const std::size_t stride = design.border().size() / most_border + 1;
  for (std::size_t i = 0; i < design.border().size(); i += stride) {
    const auto& s = design.border()[i];
    border.push_back({axes * (s.at - middle_border), (axes * s.outward).normalized()});
  }
  double radius = 0;
  for (const bool upside_down : {false, true}) {
    const auto plate_axes = plan_axes(plate_up.normalized());
    std::vector<Vector2d> plan;
    for (std::size_t i = 0; i < edges.size(); i += edges.size() / most_edges + 1) {
      Vector2d p = plate_axes * (edges[i] - middle);
      if (upside_down) p.y() = -p.y();
      radius = std::max(radius, p.norm());
      plan.push_back(p);
    }
    if (!(radius > 0)) return starts;
    std::vector<PlanMotion> found;
    for (int k = 0; k < turns; ++k) {
      const auto motion = settle(plan, border, 2 * std::numbers::pi * k / turns, radius);
      const auto same =
          std::ranges::find_if(found, [&](const auto& f) { return are_one(f, motion, radius); });
      if (same == found.end()) {
        found.push_back(motion);
      } else if (motion.rms < same->rms) {
        *same = motion;
      }
    }
    // Axes of the plate as columns, turned over where it lies the other way up, onto those of the design.
    Eigen::Matrix3d plate_basis, design_basis;
    plate_basis << plate_axes, (upside_down ? -1 : 1) * plate_up.normalized().transpose();
    if (upside_down) plate_basis.row(1) *= -1;
    design_basis << axes, design.up().transpose();
    for (const auto& f : found) {
      RigidMotion motion = RigidMotion::Identity();
      motion.linear() = design_basis.transpose() *
                        Eigen::AngleAxisd{f.turn, Vector3d::UnitZ()}.toRotationMatrix() * plate_basis;
      motion.translation() = middle_border + axes.transpose() * f.shift - motion.linear() * middle;
      starts.push_back({motion, f.rms, upside_down});
    }
  }
  std::ranges::stable_sort(starts, {}, &AlignmentStart::border_rms_mm);
  if (starts.empty()) return starts;
  const double most = worse * starts.front().border_rms_mm + slack_share * radius;
  std::erase_if(starts, [&](const auto& s) { return s.border_rms_mm > most; });
  if (starts.size() > most_starts) starts.resize(most_starts);
  return starts;
}

}  // namespace moldloft::geometry
