#include "tasks/cell/arm_gate.hpp"

#include <utility>

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

std::optional<hal::Message> ArmGate::found(const hal::Pose& reported) {
  const auto no = refuse_standing(reported, workspace_);
  in_doubt_ = no.has_value();
  if (!no) standing_ = reported;
  return no;
}

std::optional<hal::Message> ArmGate::has_arrived(const hal::Pose& reported, const hal::Pose& target) {
  // An arm that was stopped on its way stands where it says: the next step is measured from there.
  if (is_finite(reported)) standing_ = reported;
  const auto no = refuse_arrival(reported, target, arrival_);
  in_doubt_ = no.has_value();
  return no;
}

std::optional<hal::Message> ArmGate::still_stands(const hal::Pose& reported) {
  const auto no = refuse_drift(reported, standing_, arrival_);
  if (no) in_doubt_ = true;
  return no;
}

void ArmGate::clear_fault(hal::Instant now) {
  if (robot_.state() == hal::RobotState::faulted || std::exchange(in_doubt_, false)) robot_.reset(now);
}

}  // namespace moldloft::tasks
