// A day of the cell: one controller, one clock and one world in virtual time, plate after plate, and a table of what
// must not grow: memory, file handles, losses, the distance of the ticks from their beat.
//
// Blocking     computes, and writes each plate's store into a folder that it takes away again
// Failure      one line; a plate that does not complete ends the day
#pragma once

#include "host_sim/cell/cell_description.hpp"

#include <functional>

namespace moldloft::host_sim {

// What stood at the end of one row.
struct DayRow {
  double hours = 0;
  std::uint64_t plates = 0, ticks = 0, missed = 0, shots = 0, recorder_lost = 0, recorded_bytes = 0;
  std::int64_t off_beat_ns = 0;  // of the next tick, from the count of ticks
  std::size_t heap_bytes = 0;    // in use
  std::size_t resident_bytes = 0;
  int handles = 0, threads = 0;
  double worst_normal_mm = 0;  // of all plates so far, against the truth
};

struct DayOptions {
  CellDescription cell;
  double hours = 24;  // of cell time
  // From the start of one plate to the start of the next; a plate that takes longer is followed at once.
  double every_s = 120;
  int rows = 24;  // of the table, at equal distances
  bool json = false;
  std::function<void(const DayRow&)> on_row = {};  // as soon as it stands
};

struct Day {
  std::vector<DayRow> rows;
  // From the first row on: heap within 64 KiB, handles and threads the same, nothing lost or off the beat.
  bool flat = false;
};

std::expected<Day, SimError> run_day(const DayOptions&);
int show_day(const DayOptions&);  // the program's exit code: 0 when all plates completed and the day was flat

}  // namespace moldloft::host_sim
