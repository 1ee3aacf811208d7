// One shot after another: drive there, expose, let the scanner compute while the arm goes on to
// the next place.
//
// The machine knows two resources, the arm and the scanner. An order is a pose to shoot from; the next order may come
// as soon as EXPOSED is seen (the arm is free then), the next exposure only when the frame before has arrived.
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/base/transition.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace moldloft::tasks {

enum class ShotState : std::uint8_t {
  parked,             // arm stands, scanner free, nothing wanted
  driving,            // to the ordered pose, scanner free
  in_place,           // at the ordered pose, scanner free: waits until an exposure is allowed
  exposing,           // the arm must stand
  computing,          // exposed; the arm is free and has no order
  driving_computing,  // on the way to the next pose while the frame before is still awaited
  in_place_computing,
};
constexpr int shot_state_count = 7;

enum class ShotEvent : std::uint8_t {
  order,    // the next pose is known
  arrived,  // the arm has stopped and settled
  clear,    // scanner ready, recorder and fit have room: an exposure is allowed
  exposed,
  frame,
  failed,  // the driver gave the shot up
};
constexpr int shot_event_count = 6;

enum class ShotAction : std::uint8_t {
  none,
  drive,
  note_pose,
  trigger,
  release_arm,
  deliver,
  release_and_deliver,
  give_up,
};

struct ShotContext {};
using ShotTransition = hal::Transition<ShotState, ShotEvent, ShotAction, ShotContext>;
std::span<const ShotTransition> shot_transitions() MOLDLOFT_NONBLOCKING;
std::span<const hal::Ignored<ShotState, ShotEvent>> shot_ignored();

std::string_view to_string(ShotState) MOLDLOFT_NONBLOCKING;
std::string_view to_string(ShotEvent) MOLDLOFT_NONBLOCKING;
std::string_view to_string(ShotAction);

}  // namespace moldloft::tasks
