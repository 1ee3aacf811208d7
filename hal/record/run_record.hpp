// What a run remembers, as the control thread hands it over: link bytes, events, shots.
//
// The control thread writes into rings (recorder.hpp), another thread or the simulation's idle time drains them into
// the run store (run_store.hpp).
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/robot/pose.hpp"

#include <cstdint>

namespace moldloft::hal {

enum class LinkId : std::uint8_t { scanner = 0, robot = 1 };
enum class Direction : std::uint8_t { received = 0, sent = 1 };

// Every byte of a link and a direction has an offset: how many went before it since the run began.
struct LinkBytes {
  Instant at{0};
  LinkId link{};
  Direction direction{};
  std::uint64_t offset = 0;
  std::uint32_t size = 0;  // the bytes follow the record
};

struct EventRecord {
  Instant at{0};
  FixedText<16> source{};  // the machine or driver that speaks
  FixedText<24> event{};
  FixedText<24> from{}, to{};  // states, where the event is a transition
  Message text{};
};

enum class ShotPurpose : std::uint8_t { seek = 0, boundary = 1, surface = 2 };

// A shot points into the recorded bytes: the FRAME payload is the `payload_bytes` received bytes of the scanner link
// from `payload_offset` on. So a frame is stored once, as it came.
struct ShotRecord {
  Instant at{0};  // when its last byte had been read
  std::uint32_t shot_id = 0;
  ShotPurpose purpose{};
  std::uint16_t attempts = 1;    // 1: the first exposure was good
  Pose commanded{}, reported{};  // world_from_tip
  std::uint64_t payload_offset = 0;
  std::uint32_t payload_bytes = 0;
};

}  // namespace moldloft::hal
