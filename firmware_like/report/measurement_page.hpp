// report.html: what was measured, whether it is true, where it differs from the design, by what it was made, and how
// punctual the controller was. One page to look at and to print; it loads nothing, and holds no script.
//
// Thread       any
// Blocking     write_report() reads and writes a run's folder; the page itself is pure
// Allocation   yes
// Failure      one line: which file, and what is wrong with it
#pragma once

#include "firmware_like/process/failure.hpp"
#include "firmware_like/results/run_result.hpp"

#include <expected>
#include <filesystem>
#include <string>
#include <string_view>

namespace moldloft::firmware_like {

// `overview` is the picture as SVG, may be empty; `inspection` is inspection.json's content, null where the plate was
// not compared with a design.
std::string measurement_page(const RunResult&, std::string_view overview, const Json& inspection);

// Makes the page of a run's folder anew, with what stands there now.
std::expected<void, Failure> write_report(const std::filesystem::path& folder);

}  // namespace moldloft::firmware_like
