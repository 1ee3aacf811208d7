// A flight recorder's dump as text, one line a tick. It shows the wake-up and its lateness, a picture of the
// tick, the costs, the bytes of the links, and the transitions.
//
//         time s   late us  0                                   1000 us
//      12.345678       3.1  13~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~....   surface 71 x, longest 13  scanner 1460 in
//
// A digit is the control task of that number in the legend, ~ background work, . nothing of ours, > beyond the tick,
// ! the tick of the trigger.
//
// Thread       any
// Allocation   yes
#pragma once

#include "hal/record/flight_dump.hpp"

#include <string>

namespace moldloft::firmware_like {

struct TimelineRange {
  int ticks_before = 40;  // of the tick that the trigger came in, or of the last where it was a signal
  bool all = false;
};

// `tick` is the scheduler's, for the picture's scale; taken from the dump's own ticks when zero.
std::string flight_timeline(const hal::FlightDump&, const TimelineRange&, hal::Duration tick = {});

}  // namespace moldloft::firmware_like
