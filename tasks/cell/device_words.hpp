// The messages about a device that is missing or does not fit, one line each.
//
// Pure, no allocation.
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/scanner/scanner.hpp"
#include "tasks/cell/cell_settings.hpp"

#include <optional>
#include <string_view>

namespace moldloft::tasks {

// Of the device that is missing: its driver says why, and may have named it already.
hal::Message why_not_ready(std::string_view device, std::string_view why) MOLDLOFT_NONBLOCKING;

// For a scanner that is lost: what the cell waits for, and how to end the wait.
hal::Message waiting_for_scanner(std::string_view why, hal::Duration limit) MOLDLOFT_NONBLOCKING;

// Nothing when the scanner is the configured one: memory plan, tracker's steps and zig-zag are made for its field of
// view. Else one line that says what to correct.
std::optional<hal::Message> refuse_scanner(const hal::ScannerInfo&, const CellSettings&) MOLDLOFT_NONBLOCKING;

}  // namespace moldloft::tasks
