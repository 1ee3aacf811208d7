// What a person should read of what happened in the control thread: a hold, an abort or a warning with its reason.
// A plain value, trivially copyable.
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/fixed_text.hpp"

#include <cstdint>

namespace moldloft::tasks {

struct Notice {
  enum class Kind : std::uint8_t { goes_on, warning, hold, abort };
  hal::Instant at{0};
  Kind kind{};
  hal::Message text;
};

}  // namespace moldloft::tasks
