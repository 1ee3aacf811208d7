// The rules of the tree (its arrows, its names, its measures) as functions on paths and text, so that a test
// can feed them what is wrong as well as the tree itself. Every finding is one line: where, and what to do.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::tree {

using Findings = std::vector<std::string>;

// ---- one file; `path` is relative to the top of the tree
Findings include_findings(std::string_view path, std::string_view text);  // include_rules.cpp
Findings banned_findings(std::string_view path, std::string_view text);
Findings size_findings(std::string_view path, std::string_view text);
Findings width_findings(std::string_view path, std::string_view text);
Findings pragma_findings(std::string_view path, std::string_view text);
Findings name_findings(std::string_view path);
Findings test_name_findings(std::string_view path, std::string_view text);
Findings include_order_findings(std::string_view path, std::string_view text);  // style_rules.cpp
Findings comment_findings(std::string_view path, std::string_view text);
Findings function_findings(std::string_view path, std::string_view text);

// ---- the tree; paths of all files, relative to its top
Findings top_level_findings(std::span<const std::string> paths);
Findings readme_findings(std::span<const std::string> paths);

Findings file_findings(std::string_view path, std::string_view text);  // all rules for one file
Findings tree_findings(std::span<const std::string> paths);            // all rules for the tree

bool is_source(std::string_view path);  // .hpp, .cpp, .c
bool is_header(std::string_view path);
bool is_room(std::string_view name);
std::string_view first_folder(
    std::string_view path);  // "hal/base/clock.hpp": hal; empty for a file at the top

}  // namespace moldloft::tree
