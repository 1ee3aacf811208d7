// One of the counts that a driver reports, by its name.
#pragma once

#include "hal/base/loss_count.hpp"

#include <doctest/doctest.h>

#include <algorithm>

namespace moldloft::hal {

inline std::uint64_t loss_of(const auto& device, std::string_view what) {
  const LossCounts counts = device.losses();
  const auto found = std::ranges::find(counts, what, &LossCount::what);
  REQUIRE_MESSAGE(found != counts.end(), "the driver counts no ", what);
  return found->count;
}

}  // namespace moldloft::hal
