#include "host_sim/faults/fault_acts.hpp"

#include "host_sim/base/random.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace moldloft::host_sim {

namespace {

bool moves_plate(FaultKind kind) {
  return kind == FaultKind::plate_pushed || kind == FaultKind::plate_turned ||
         kind == FaultKind::plate_lifted;
}

// A plate is pushed where it has been seen already and is looked at again.
constexpr std::uint64_t first_drawn = 6, last_drawn = 20;

bool is_due(const Fault& fault, std::uint64_t shot, std::uint64_t of_surface) {
  const std::uint64_t now = fault.of_surface ? of_surface : shot;
  const bool only_this = fault.when == Fault::When::at && !moves_plate(fault.kind);
  return only_this ? now == fault.shot : now >= fault.shot;
}

Eigen::Vector3d in_plan(double length_mm, double heading) {
  return {length_mm * std::cos(heading), length_mm * std::sin(heading), 0};
}

// About an axis in plan through the tip.
Eigen::AngleAxisd tilt(double degrees, double heading) {
  return {degrees * hal::degree, Eigen::Vector3d{std::cos(heading), std::sin(heading), 0}};
}

// A band across the stripes, from the left: what stays to see is cut off straight, as by something in the way.
void blind(hal::Frame& frame, double share) {
  float low = std::numeric_limits<float>::infinity(), high = -low;
  const std::span all{frame.y.data(), frame.point_count};
  for (const float y : all) {
    if (std::isfinite(y)) low = std::min(low, y), high = std::max(high, y);
  }
  const float until = low + static_cast<float>(share) * (high - low);
  for (std::size_t i = 0; i < frame.point_count; ++i) {
    if (share < 1 && !(frame.y[i] <= until)) continue;
    frame.x[i] = frame.y[i] = frame.z[i] = std::numeric_limits<float>::quiet_NaN();
  }
}

void scale(hal::Frame& frame, float factor) {
  for (auto* column : {&frame.x, &frame.y, &frame.z}) {
    for (float& value : std::span{column->data(), frame.point_count}) value *= factor;
  }
}

}  // namespace

FaultActs::FaultActs(const std::vector<Fault>& faults, std::uint64_t seed) {
  Random random(seed, Stream::faults);
  for (const Fault& given : faults) {
    Act act{.fault = given, .heading = random.uniform(-std::numbers::pi, std::numbers::pi)};
    const double drawn = random.uniform(first_drawn, last_drawn + 1);
    if (given.when == Fault::When::drawn && moves_plate(given.kind))
      act.fault.shot = static_cast<std::uint64_t>(drawn);
    acts_.push_back(act);
  }
}

void FaultActs::next_shot_is(std::uint64_t shot, std::uint64_t of_surface) {
  const bool is_new = shot != shot_;
  shot_ = shot;
  for (Act& act : acts_) {
    act.acts = is_due(act.fault, shot, of_surface);
    if (is_new && act.acts) ++act.shots;
    plate_moved_ |= act.acts && moves_plate(act.fault.kind);
  }
}

void FaultActs::arm_sets_out() {
  for (Act& act : acts_) act.is_said = act.acts;
}

const FaultActs::Act* FaultActs::acting(FaultKind kind) const {
  const auto found =
      std::ranges::find_if(acts_, [&](const Act& a) { return a.acts && a.fault.kind == kind; });
  return found == acts_.end() ? nullptr : &*found;
}

geometry::RigidMotion FaultActs::mounted(const geometry::RigidMotion& tip_from_scanner) const {
  geometry::RigidMotion mount = tip_from_scanner;
  for (const Act& act : acts_) {
    if (act.fault.kind == FaultKind::mount_yawed)
      mount.linear() =
          mount.linear() * Eigen::AngleAxisd(act.fault.size * hal::degree, Eigen::Vector3d::UnitZ());
    if (act.fault.kind == FaultKind::mount_shifted)
      mount.translation() += in_plan(act.fault.size, act.heading);
  }
  return mount;
}

double FaultActs::noise_factor() const {
  double factor = 1;
  for (const Act& act : acts_) {
    if (act.fault.kind == FaultKind::noise) factor *= act.fault.size;
  }
  return factor;
}

hal::Pose FaultActs::robot_says(const hal::Pose& encoders) const {
  hal::Pose says = encoders;
  for (const Act& act : acts_) {
    if (!act.is_said) continue;
    if (act.fault.kind == FaultKind::robot_tilts) says.pitch -= act.fault.size * hal::degree;
    if (act.fault.kind != FaultKind::robot_lies) continue;
    const Eigen::Vector3d off = in_plan(act.fault.size, act.heading);
    says.x_mm += off.x();
    says.y_mm += off.y();
  }
  return says;
}

geometry::RigidMotion FaultActs::arm_stands(const geometry::RigidMotion& world_from_tip) const {
  geometry::RigidMotion stands = world_from_tip;
  if (const Act* act = acting(FaultKind::robot_slips))
    stands.translation() += in_plan(act->fault.size, act->heading);
  if (const Act* act = acting(FaultKind::robot_drifts))
    stands.translation() += in_plan(act->fault.size * static_cast<double>(act->shots), act->heading);
  if (const Act* act = acting(FaultKind::robot_leans))
    stands.linear() = tilt(act->fault.size, act->heading) * stands.linear();
  return stands;
}

void FaultActs::spoil(hal::Frame& frame) {
  if (const Act* act = acting(FaultKind::scanner_scales))
    scale(frame, static_cast<float>(1 + act->fault.size / 100));
  if (acting(FaultKind::scanner_mirrors) != nullptr) {
    for (float& x : std::span{frame.x.data(), frame.point_count}) x = -x;
  }
  if (const Act* act = acting(FaultKind::scanner_blind)) blind(frame, act->fault.size);
  if (acting(FaultKind::scanner_freezes) != nullptr) {
    if (!frozen_) frozen_ = frame;
    frame = *frozen_;
  }
}

PlateInstance FaultActs::lies(const PlateInstance& as_put_down) const {
  PlateInstance plate = as_put_down;
  if (const Act* act = acting(FaultKind::plate_pushed)) {
    const Eigen::Vector3d off = in_plan(act->fault.size, act->heading);
    plate.x_mm += off.x();
    plate.y_mm += off.y();
  }
  if (const Act* act = acting(FaultKind::plate_turned)) plate.turn += act->fault.size * hal::degree;
  if (const Act* act = acting(FaultKind::plate_lifted)) plate.z_mm += act->fault.size;
  return plate;
}

}  // namespace moldloft::host_sim
