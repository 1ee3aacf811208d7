// One shot after another: the arm drives to a place, the scanner exposes there, and while it computes the arm drives on
// to the next place.
//
// The machine knows two resources, the arm and the scanner. An order is a pose to shoot from. The arm is free after
// EXPOSED, so the next order may come then. The next exposure waits until the frame before has arrived.
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/base/transition.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace moldloft::tasks {

enum class ShotState : std::uint8_t {
  parked,              // the arm stands, the scanner is free, nothing is ordered
  driving,             // the arm drives to the ordered pose, the scanner is free
  in_place,            // the arm stands there and waits until an exposure is allowed
  exposing,            // the arm must stand
  computing,           // the frame is awaited; the arm is free and has no order
  driving_computing,   // the frame is awaited while the arm drives to the next pose
  in_place_computing,  // the frame is awaited while the arm stands at the next pose
};
constexpr int shot_state_count = 7;

enum class ShotEvent : std::uint8_t {
  order,    // the next pose is known
  arrived,  // the arm has stopped and settled
  clear,    // an exposure is allowed: the scanner is ready, recorder and fit have room
  exposed,
  frame,
  failed,   // the driver has given the shot up
  doubted,  // the arm has moved although it was sent nowhere
};
constexpr int shot_event_count = 7;

enum class ShotAction : std::uint8_t {
  none,
  drive,
  note_pose,
  trigger,
  release_arm,
  deliver,
  release_and_deliver,
  give_up,
  drive_again,
  drop_and_drive_again,
};

struct ShotContext {};
using ShotTransition = hal::Transition<ShotState, ShotEvent, ShotAction, ShotContext>;
std::span<const ShotTransition> shot_transitions() MOLDLOFT_NONBLOCKING;
std::span<const hal::Ignored<ShotState, ShotEvent>> shot_ignored();

std::string_view to_string(ShotState) MOLDLOFT_NONBLOCKING;
std::string_view to_string(ShotEvent) MOLDLOFT_NONBLOCKING;
std::string_view to_string(ShotAction);

}  // namespace moldloft::tasks
