#include "host_sim/cell/world.hpp"

#include <algorithm>
#include <utility>

namespace moldloft::host_sim {

namespace {

struct Span {
  hal::Instant from, to;
  hal::Duration length() const { return std::max(to - from, hal::Duration{0}); }
  Span within(const Span& other) const { return {std::max(from, other.from), std::min(to, other.to)}; }
};

OpticsSettings noisier(OpticsSettings optics, double factor) {
  optics.noise_mm *= factor;
  return optics;
}

}  // namespace

SimulatedWorld::SimulatedWorld(const CellDescription& cell, PlateInstance plate,
                               hal::ByteLink& scanner_device, hal::ByteLink& robot_device)
    : has_faults_(!cell.faults.empty()),
      faults_(cell.faults, cell.seed),
      put_down_(std::move(plate)),
      plate_(put_down_),
      tip_from_scanner_(faults_.mounted(cell.tip_from_scanner)),
      robot_(robot_device, ArmDrive(make_arm(cell), cell.drive, cell.seed), cell.robot_times,
             has_faults_ ? this : nullptr),
      exposure_(cell.scanner_times.exposure),
      scanner_(cell.make_scanner(scanner_device, Optics(noisier(cell.optics, faults_.noise_factor())), *this,
                                 cell.scanner_times, cell.seed)) {
  look_at_faults(hal::Instant{0});
}

// Whoever moves a plate or an arm does so between two exposures.
void SimulatedWorld::look_at_faults(hal::Instant now) {
  const std::uint64_t exposed = scanner_->counters().exposures;
  const bool exposes = exposed > 0 && now < scanner_->busy_from() + exposure_;
  const std::uint64_t shot = exposed + (exposes ? 0 : 1);
  const bool of_surface = surface_from_ > 0 && shot >= surface_from_;
  faults_.next_shot_is(shot, of_surface ? shot - surface_from_ + 1 : 0);
  if (std::exchange(set_out_, robot_.busy_from()) != robot_.busy_from()) faults_.arm_sets_out();
  plate_ = faults_.lies(put_down_);
}

void SimulatedWorld::step(hal::Instant now) {
  account(now);
  robot_.step(now);
  scanner_->step(now);
  if (has_faults_) look_at_faults(now);
  const auto& robot = robot_.counters();
  began_ |= robot.motions + robot.calibrations + scanner_->counters().exposures > 0;
  const std::uint64_t done = robot_.commands_done() + scanner_->counters().frames_sent;
  if (done != done_) at_last_done_ = so_far_;
  done_ = done;
}

geometry::RigidMotion SimulatedWorld::world_from_scanner(hal::Instant at) const {
  return world_from_tip(at) * tip_from_scanner_;
}

// The time since the last step, split by what the devices did in it.
void SimulatedWorld::account(hal::Instant now) {
  const Span step{accounted_, now};
  accounted_ = now;
  if (!began_) return;
  const auto exposed = scanner_->busy_from() + exposure_;
  const Span arm = Span{robot_.busy_from(), robot_.busy_until()}.within(step);
  const Span eye = Span{scanner_->busy_from(), scanner_->busy_until()}.within(step);
  so_far_.total += step.length();
  so_far_.moving += Span{robot_.busy_from(), robot_.stands_at()}.within(step).length();
  so_far_.settling += Span{robot_.stands_at(), robot_.busy_until()}.within(step).length();
  so_far_.exposing +=
      Span{scanner_->busy_from(), std::min(exposed, scanner_->busy_until())}.within(step).length();
  so_far_.computing += Span{exposed, scanner_->busy_until()}.within(step).length();
  so_far_.idle += step.length() - arm.length() - eye.length() + arm.within(eye).length();
}

}  // namespace moldloft::host_sim
