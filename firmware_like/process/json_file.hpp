// A file of ours that is JSON, as a value.
//
// Blocking     reads a file
// Failure      one line: which file, and what is wrong with it
#pragma once

#include "firmware_like/process/failure.hpp"
#include "firmware_like/process/json_text.hpp"

#include <expected>
#include <filesystem>

namespace moldloft::firmware_like {

std::expected<Json, Failure> read_json(const std::filesystem::path&);

}  // namespace moldloft::firmware_like
