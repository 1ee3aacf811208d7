// timing.json as a page, or the last part of one, to look at and to print. Nothing is loaded: the style stands in it,
// the histograms are inline SVG, and there is no script. It follows the reader's light or dark setting.
//
// Thread       any
// Allocation   yes
// Failure      throws Json::exception where a report lacks what every report has: one of another version
#pragma once

#include "firmware_like/process/json_text.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace moldloft::firmware_like {

// `first` is HTML that stands before the timing: what else the page is about.
std::string timing_page(const Json& timing, std::string_view title, std::string_view about = "",
                        std::string_view first = "");
std::string page_title(const std::filesystem::path& folder);  // "Timing of plate-17"

}  // namespace moldloft::firmware_like
