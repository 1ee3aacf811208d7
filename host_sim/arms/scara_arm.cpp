#include "host_sim/arms/scara_arm.hpp"

#include <cmath>
#include <numbers>

namespace moldloft::host_sim {

namespace {

class ScaraArm final : public Arm {
 public:
  explicit ScaraArm(const ScaraSettings& s)
      : s_(s),
        limits_{{{"joint 1", -s.j1_limit, s.j1_limit, s.turn_speed, s.turn_acceleration},
                 {"joint 2", -s.j2_limit, s.j2_limit, s.turn_speed, s.turn_acceleration},
                 {"z (joint 3)", s.tip_low_mm, s.tip_low_mm + s.stroke_mm, s.z_speed_mm, s.z_acceleration_mm},
                 {"joint 4", -s.j4_limit, s.j4_limit, s.flange_speed, s.flange_acceleration}}} {}

  std::string_view name() const override { return "scara"; }
  const JointLimits& limits() const override { return limits_; }

  // Up, elbow bent by a right angle, the tip in front of the base on the x axis, its own x axis
  // along the world's.
  Joints home() const override {
    const double j2 = (s_.lefty ? -0.5 : 0.5) * std::numbers::pi;
    const double j1 = -std::atan2(s_.link_2_mm * std::sin(j2), s_.link_1_mm + s_.link_2_mm * std::cos(j2));
    return {j1, j2, s_.tip_low_mm + s_.stroke_mm, j1 + j2};
  }

  std::expected<Joints, MotionError> joints_for(const hal::Pose& tip,
                                                const Joints& standing_at) const override {
    const auto heading = heading_of(tip);
    if (!heading) return std::unexpected(heading.error());
    const double reach = std::hypot(tip.x_mm, tip.y_mm), a = s_.link_1_mm, b = s_.link_2_mm;
    const double cosine = (reach * reach - a * a - b * b) / (2 * a * b);
    if (cosine > 1) return too_far(reach);
    // Folded beyond joint 2's limit the tip is nearer to the base than the arm can hold it.
    if (cosine < std::cos(s_.j2_limit)) return too_close(reach);
    const double j2 = (s_.lefty ? -1 : 1) * std::acos(cosine);
    const double j1 = geometry::wrapped_angle(std::atan2(tip.y_mm, tip.x_mm) -
                                              std::atan2(b * std::sin(j2), a + b * std::cos(j2)));
    // Joint 4 turns about an axis that points down: it subtracts from the links' direction.
    const double j4 = nearest_turn(j1 + j2 - *heading, standing_at[3]);
    const Joints joints = {j1, j2, tip.z_mm, j4};
    if (const auto inside = check_limits(limits_, joints); !inside) return std::unexpected(inside.error());
    return joints;
  }

  geometry::RigidMotion world_from_tip(const Joints& j) const override {
    return tip_of(j, s_.link_1_mm, s_.link_2_mm, 0.0);
  }
  geometry::RigidMotion true_world_from_tip(const Joints& j) const override {
    return tip_of(j, s_.link_1_mm + s_.link_1_error_mm, s_.link_2_mm + s_.link_2_error_mm, s_.j2_zero_error);
  }

 private:
  static geometry::RigidMotion tip_of(const Joints& j, double a, double b, double j2_error) {
    const double elbow = j[0] + j[1] + j2_error;
    const Eigen::Vector3d at{a * std::cos(j[0]) + b * std::cos(elbow),
                             a * std::sin(j[0]) + b * std::sin(elbow), j[2]};
    // x axis in plan along the heading, z axis down: Rz(heading) Rx(pi).
    geometry::RigidMotion motion = geometry::turned_about_z(elbow - j[3], at);
    motion.linear() *= Eigen::DiagonalMatrix<double, 3>(1.0, -1.0, -1.0);
    return motion;
  }

  // The angle congruent to `angle`, inside joint 4's limits, nearest to where it stands.
  double nearest_turn(double angle, double standing_at) const {
    const double near = standing_at + geometry::wrapped_angle(angle - standing_at);
    constexpr double turn = 2 * std::numbers::pi;
    if (near > s_.j4_limit) return near - turn;
    if (near < -s_.j4_limit) return near + turn;
    return near;
  }

  std::unexpected<MotionError> too_far(double reach) const {
    return std::unexpected(
        MotionError{hal::Message::format("the tip would be {:.1f} mm from the base, the arm reaches {:.1f}",
                                         reach, s_.link_1_mm + s_.link_2_mm)});
  }
  std::unexpected<MotionError> too_close(double reach) const {
    const double a = s_.link_1_mm, b = s_.link_2_mm;
    return std::unexpected(MotionError{
        hal::Message::format("the tip would be {:.1f} mm from the base, joint 2 folds no further than {:.1f}",
                             reach, std::sqrt(a * a + b * b + 2 * a * b * std::cos(s_.j2_limit)))});
  }

  ScaraSettings s_;
  JointLimits limits_;
};

}  // namespace

std::unique_ptr<Arm> make_scara(const ScaraSettings& settings) {
  return std::make_unique<ScaraArm>(settings);
}

}  // namespace moldloft::host_sim
