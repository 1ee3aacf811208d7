#include "host_sim/arms/gantry_arm.hpp"

#include <cmath>
#include <numbers>

namespace moldloft::host_sim {

namespace {

class GantryArm final : public Arm {
 public:
  explicit GantryArm(const GantrySettings& s) : s_(s) {
    const Eigen::Vector3d high = s.low_mm + s.size_mm;
    limits_ = {{{"x axis", s.low_mm.x(), high.x(), s.xy_speed_mm, s.xy_acceleration_mm},
                {"y axis", s.low_mm.y(), high.y(), s.xy_speed_mm, s.xy_acceleration_mm},
                {"z axis", s.low_mm.z(), high.z(), s.z_speed_mm, s.z_acceleration_mm},
                {"flange", -s.turn_limit, s.turn_limit, s.turn_speed, s.turn_acceleration}}};
  }

  std::string_view name() const override { return "gantry"; }
  const JointLimits& limits() const override { return limits_; }

  Joints home() const override {
    const Eigen::Vector3d p = s_.low_mm + s_.size_mm.cwiseProduct(Eigen::Vector3d{0.5, 0.5, 1.0});
    return {p.x(), p.y(), p.z(), 0.0};
  }

  std::expected<Joints, MotionError> joints_for(const hal::Pose& tip,
                                                const Joints& standing_at) const override {
    const auto heading = heading_of(tip);
    if (!heading) return std::unexpected(heading.error());
    double turn = standing_at[3] + geometry::wrapped_angle(*heading - standing_at[3]);
    if (turn > s_.turn_limit) turn -= 2 * std::numbers::pi;
    if (turn < -s_.turn_limit) turn += 2 * std::numbers::pi;
    const Joints joints = {tip.x_mm, tip.y_mm, tip.z_mm, turn};
    if (const auto inside = check_limits(limits_, joints); !inside) return std::unexpected(inside.error());
    return joints;
  }

  geometry::RigidMotion world_from_tip(const Joints& j) const override { return tip_of(j, 0.0); }
  geometry::RigidMotion true_world_from_tip(const Joints& j) const override {
    return tip_of(j, s_.squareness_error);
  }

 private:
  static geometry::RigidMotion tip_of(const Joints& j, double lean) {
    geometry::RigidMotion motion = geometry::turned_about_z(j[3], {j[0] - lean * j[1], j[1], j[2]});
    motion.linear() *= Eigen::DiagonalMatrix<double, 3>(1.0, -1.0, -1.0);
    return motion;
  }

  GantrySettings s_;
  JointLimits limits_;
};

}  // namespace

std::unique_ptr<Arm> make_gantry(const GantrySettings& settings) {
  return std::make_unique<GantryArm>(settings);
}

}  // namespace moldloft::host_sim
