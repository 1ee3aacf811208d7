// A plate that is formed step by step and measured after each pass: what a heating did, and whether the shape comes.
// After each pass a part of what is missing is left, so the truth is known; inspection has to see it.
//
// Blocking     computes, and writes a run's folder for each pass, with its inspection
// Failure      one line; a pass that is not measured ends the row
#pragma once

#include "firmware_like/inspection/inspection.hpp"
#include "host_sim/cell/cell_description.hpp"

#include <expected>
#include <filesystem>
#include <functional>
#include <vector>

namespace moldloft::host_sim {

struct PassesOptions {
  CellDescription
      cell;  // its `formed` is the plate before the first pass; without one it has half of its shape
  int passes = 5;
  double left_after_pass = 0.4;  // of what was missing before it
  std::filesystem::path out;     // a folder for pass-1, pass-2, ...
  double limit_mm = 1;
};

struct Pass {
  int number = 0;
  firmware_like::Spread measured,
      truth;  // inside the border: of the measured plate, and of the plate as it is
  double worst_mm = 0, true_worst_mm = 0;
  bool within = false;
};

std::expected<std::vector<Pass>, SimError> run_passes(const PassesOptions&,
                                                      const std::function<void(const Pass&)>& on_pass = {});
int show_passes(const PassesOptions&);  // the exit code: 0 when each pass came nearer

}  // namespace moldloft::host_sim
