// What campaigns have in common: runs side by side, rows in order as they come, and the limits that a plate
// is measured within.
//
// Thread       as many runs at a time as there are processors, each in a thread of its own; `show` by one at a time
#pragma once

#include "firmware_like/process/console.hpp"
#include "firmware_like/process/json_text.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace moldloft::host_sim {

// What every plate of the standard campaign must keep to (README, "What it reaches").
constexpr double max_normal_rms_mm = 0.02, max_normal_max_mm = 0.08, max_outline_mm = 0.3,
                 max_corner_mm = 0.3;

// Of a summary's `truth`; 0 where there is none.
inline double truth_figure(const firmware_like::Json& truth, const char* key) {
  return truth.contains(key) ? truth[key].get<double>() : 0;
}

inline bool within_limits(const firmware_like::Json& truth) {
  return truth_figure(truth, "normal_rms_mm") <= max_normal_rms_mm &&
         truth_figure(truth, "normal_max_mm") <= max_normal_max_mm &&
         truth_figure(truth, "outline_max_mm") <= max_outline_mm &&
         truth_figure(truth, "corner_max_mm") <= max_corner_mm;
}

// Row i is run(i). Rows are shown in the order of the table, whichever run ends first.
template <typename Row, typename Run, typename Show>
std::vector<Row> rows_of(std::size_t count, Run run, Show show) {
  std::vector<Row> rows(count);
  std::vector<bool> ready(count, false);
  std::atomic<std::size_t> next{0};
  std::mutex showing;
  std::size_t shown = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      Row row = run(i);
      const std::lock_guard lock{showing};
      rows[i] = std::move(row);
      ready[i] = true;
      for (; shown < count && ready[shown]; ++shown) {
        show(rows[shown]);
        firmware_like::flush_shown();
      }
    }
  };
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
  for (auto& thread : threads) thread.join();
  return rows;
}

}  // namespace moldloft::host_sim
