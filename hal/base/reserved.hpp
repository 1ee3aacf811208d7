// Adding to a vector on the control thread: within the room that its constructor has reserved.
//
// Blocking     never
// Allocation   none
// Failure      a vector without room is a mistake in the memory plan: asserts
#pragma once

#include "hal/base/realtime.hpp"

#include <cassert>
#include <utility>
#include <vector>

namespace moldloft::hal {

template <typename T, typename Value>
void add_within_reserve(std::vector<T>& vector, Value&& value) MOLDLOFT_NONBLOCKING {
  assert(vector.size() < vector.capacity());
  // The branch of push_back() that would grow the vector is never taken; the compiler cannot know.
  checked_at_run_time([&] { vector.push_back(std::forward<Value>(value)); });
}

}  // namespace moldloft::hal
