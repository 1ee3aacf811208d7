// Files written as a whole; everything that writes files does it here. A reader finds the old content or the
// new, never half of it, and a full disk leaves the old.
//
// A link is followed and stays; the file behind it keeps its mode. What is no regular file (a device, a pipe,
// /dev/stdout) is written into, never replaced. A folder that is missing is not made.
//
// Blocking     yes: a disk; up to ten seconds at a pipe that nobody reads
// Failure      one line: which file, why, what to do
#pragma once

#include "firmware_like/process/failure.hpp"

#include <expected>
#include <filesystem>
#include <string_view>

namespace moldloft::firmware_like {

enum class Existing {
  replaced,
  kept,  // a file that says something else is left alone, and that is a failure: the person has to say --force
};

std::expected<void, Failure> write_file(const std::filesystem::path&, std::string_view content,
                                        Existing = Existing::replaced);

// Whether what is written there comes out where standard output goes: words about it belong elsewhere then.
bool is_standard_output(const std::filesystem::path&);

}  // namespace moldloft::firmware_like
