// A motion of four joints along one trapezoid of speed: all start and stop together, none exceeds its own
// speed or acceleration. Positions in the joints' own units (rad or mm), time in seconds.
//
// With distances d_i, speeds v_i and accelerations a_i the common profile s(t) from 0 to 1 has v = min v_i /
// d_i and a = min a_i / d_i. It takes 1 / v + v / a where the speed is reached (v^2 <= a), 2 / sqrt(a) where
// it is not. For one joint alone this is the fastest motion there is.
//
// Allocation   none
// Failure      none
#pragma once

#include <array>

namespace moldloft::host_sim {

constexpr std::size_t joint_count = 4;
using Joints = std::array<double, joint_count>;

struct JointLimit {
  const char* name;
  double low, high;
  double speed, acceleration;  // per second, per second squared
};
using JointLimits = std::array<JointLimit, joint_count>;

class JointMotion {
 public:
  JointMotion() = default;
  explicit JointMotion(const Joints& standing_at) : from_(standing_at), to_(standing_at) {}
  // `speed_share` in (0, 1] scales speeds and accelerations alike, as V+'s SPEED does.
  JointMotion(const Joints& from, const Joints& to, const JointLimits&, double speed_share);

  double duration_s() const noexcept { return duration_; }
  Joints at(double t_s) const noexcept;
  double progress(double t_s) const noexcept;  // s(t), 0 to 1

  // The arm brakes from t on with the profile's own acceleration; duration_s() becomes when it stands.
  void brake_at(double t_s) noexcept;

 private:
  double profile(double t) const noexcept;
  double profile_speed(double t) const noexcept;

  Joints from_{}, to_{};
  double duration_ = 0;
  double peak_ = 0, acceleration_ = 0, ramp_ = 0;  // of s
  double planned_ = 0;                             // duration before any braking
  double braked_at_ = -1, braked_from_ = 0, braked_speed_ = 0;
};

}  // namespace moldloft::host_sim
