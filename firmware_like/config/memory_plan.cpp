#include "firmware_like/config/memory_plan.hpp"

namespace moldloft::firmware_like {

std::size_t total_plan(const MemoryPlan& plan) {
  std::size_t sum = 0;
  for (const auto& item : plan) sum += item.plan_bytes;
  return sum;
}

std::size_t total_high_water(const MemoryPlan& plan) {
  std::size_t sum = 0;
  for (const auto& item : plan) sum += item.high_water_bytes;
  return sum;
}

}  // namespace moldloft::firmware_like
