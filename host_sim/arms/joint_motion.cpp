#include "host_sim/arms/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace moldloft::host_sim {

JointMotion::JointMotion(const Joints& from, const Joints& to, const JointLimits& limits, double speed_share)
    : from_(from), to_(to) {
  constexpr double standing = 1e-12;  // rad or mm: rounding, not a distance
  double peak = std::numeric_limits<double>::infinity(), acceleration = peak;
  for (std::size_t i = 0; i < joint_count; ++i) {
    const double distance = std::abs(to[i] - from[i]);
    if (distance < standing) continue;
    peak = std::min(peak, speed_share * limits[i].speed / distance);
    acceleration = std::min(acceleration, speed_share * limits[i].acceleration / distance);
  }
  if (!std::isfinite(peak)) return;
  acceleration_ = acceleration;
  peak_ = std::min(peak, std::sqrt(acceleration));
  ramp_ = peak_ / acceleration_;
  planned_ = duration_ = 1.0 / peak_ + ramp_;
}

double JointMotion::profile(double t) const noexcept {
  if (t <= 0) return 0;
  if (t >= planned_) return 1;
  if (t < ramp_) return 0.5 * acceleration_ * t * t;
  const double left = planned_ - t;
  if (left < ramp_) return 1.0 - 0.5 * acceleration_ * left * left;
  return peak_ * (t - 0.5 * ramp_);
}

double JointMotion::profile_speed(double t) const noexcept {
  if (t <= 0 || t >= planned_) return 0;
  return std::min({peak_, acceleration_ * t, acceleration_ * (planned_ - t)});
}

double JointMotion::progress(double t) const noexcept {
  if (planned_ == 0) return 1;
  if (braked_at_ < 0 || t <= braked_at_) return profile(t);
  const double since = std::min(t, duration_) - braked_at_;
  return braked_from_ + braked_speed_ * since - 0.5 * acceleration_ * since * since;
}

Joints JointMotion::at(double t) const noexcept {
  const double s = progress(t);
  if (s >= 1) return to_;
  Joints joints;
  for (std::size_t i = 0; i < joint_count; ++i) joints[i] = from_[i] + s * (to_[i] - from_[i]);
  return joints;
}

void JointMotion::brake_at(double t) noexcept {
  if (t >= duration_ || braked_at_ >= 0) return;
  braked_at_ = std::max(t, 0.0);
  braked_from_ = profile(braked_at_);
  braked_speed_ = profile_speed(braked_at_);
  duration_ = braked_at_ + braked_speed_ / acceleration_;
}

}  // namespace moldloft::host_sim
