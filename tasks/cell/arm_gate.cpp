#include "tasks/cell/arm_gate.hpp"

namespace moldloft::tasks {

ArmGate::Sending ArmGate::send_checked(const hal::Pose& target, hal::Instant now) {
  if (const auto no = refuse(target)) return {.outcome = Outcome::refused, .why = *no};
  if (!robot_.move(target, speed_percent_, now)) return {.outcome = Outcome::not_taken};
  return {.outcome = Outcome::sent};
}

std::optional<hal::Message> ArmGate::refuse(const hal::Pose& target) const {
  return refuse_target(target, standing_, speed_percent_, workspace_);
}

bool ArmGate::rests() const {
  return robot_.state() != hal::RobotState::moving && robot_.state() != hal::RobotState::commanded;
}

void ArmGate::clear_fault(hal::Instant now) {
  if (robot_.state() == hal::RobotState::faulted) robot_.reset(now);
}

}  // namespace moldloft::tasks
