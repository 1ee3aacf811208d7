// The calendar's time, for what people read; nothing is measured with it.
#pragma once

#include <string>

namespace moldloft::firmware_like {

std::string now_utc();  // "2026-01-31T12:00:00Z"

}  // namespace moldloft::firmware_like
