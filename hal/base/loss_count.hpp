// What a device's driver threw away or repeated, counted under a name for people. The report of a run holds
// the counts. Garbled lines point to a cable, stale frames to a scanner that is too slow.
//
// Thread       any, when the control thread has come to rest
// Allocation   yes
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace moldloft::hal {

struct LossCount {
  std::string_view what;    // in the plural: "garbled lines"
  std::uint64_t count = 0;  // since the program's start
};
using LossCounts = std::vector<LossCount>;

}  // namespace moldloft::hal
