#include "tasks/cell/cycle_account.hpp"

namespace moldloft::tasks {

void CycleAccount::begin(hal::Instant now) {
  until_ = now;
  counts_ = true;
}

void CycleAccount::pass(hal::Instant now, hal::RobotState robot, hal::ScannerState scanner) {
  if (!counts_) return;
  const hal::Duration past = now - until_;
  until_ = now;
  times_.total += past;
  if (robot == hal::RobotState::moving) return;
  times_.standing += past;
  const bool scanner_works =
      scanner == hal::ScannerState::exposing || scanner == hal::ScannerState::computing;
  if (!scanner_works) times_.idle += past;
}

}  // namespace moldloft::tasks
