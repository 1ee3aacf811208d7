#include "tree/rules.hpp"

#include "tree/source_text.hpp"

#include <algorithm>
#include <regex>
#include <set>

namespace moldloft::tree {
namespace {

constexpr std::size_t most_header_lines = 200;  // of code and comment: what one reads in a sitting
constexpr std::size_t most_file_lines = 600;
constexpr std::size_t widest_line = 120;

const std::set<std::string, std::less<>> top_level = {"firmware_like", "tasks", "hal",       "geometry",
                                                      "host_sim",      "tests", "toolchain", ".ci",
                                                      ".git",          "build", "out"};
const std::set<std::string, std::less<>> built = {".git", "build", "out", ".ci"};  // nothing to explain

// Words that say nothing about what is inside.
const std::set<std::string, std::less<>> empty_names = {"utils",   "util",    "common",   "helper",
                                                        "helpers", "manager", "managers", "misc"};

// A word of code, the rooms it is banned from, and the files where it has its place.
struct Ban {
  std::string pattern;
  std::vector<std::string_view> where;  // prefixes of paths
  std::vector<std::string_view> but;    // ... except these
  std::string instead;
};
const std::vector<std::string_view> rooms = {"geometry/", "hal/", "tasks/", "firmware_like/", "host_sim/"};
const std::vector<std::string_view> rooms_and_tests = {"geometry/",      "hal/",      "tasks/",
                                                       "firmware_like/", "host_sim/", "tests/"};
const std::vector<Ban> bans = {
    {R"(\b(sleep_for|usleep|nanosleep|clock_nanosleep|sleep)\s*\(|\bthis_thread::sleep_until\b)",
     rooms_and_tests,
     {"hal/base/clock.", "tests/realtime/realtime_"},  // which count those who do it all the same
     "waiting is done by hal::Clock::sleep_until alone"},
    {R"(\b(steady_clock|system_clock|high_resolution_clock)::now\b|\bclock_gettime\b|\bgettimeofday\b)",
     rooms,
     {"hal/base/clock."},
     "time is read through hal::Clock"},
    {R"(\bstd::j?thread\b|\bpthread_create\b|\bstd::async\b)",
     {"geometry/", "hal/", "tasks/"},
     {},
     "threads are started in firmware_like and host_sim"},
    {R"(\bstd::function\b)", {"hal/", "tasks/"}, {}, "a template or a pointer: std::function may allocate"},
    {R"(\brobot_?(\(\))?(\.|->)move\s*\()",
     {"tasks/", "firmware_like/"},
     {"tasks/cell/arm_gate."},
     "a target is sent by ArmGate::send_checked, past the motion guard"},
    {R"(\.dump\(\d*\)|->dump\(\d*\))",
     {"firmware_like/", "host_sim/"},
     {"firmware_like/process/json_text."},
     "json_text(): dump() throws where a string is no UTF-8"},
    {R"(\bstd::(cout|cerr|clog|cin)\b)", rooms, {}, "fmt::print in the programs, a value elsewhere"},
};

bool starts_with_one_of(std::string_view path, const std::vector<std::string_view>& prefixes) {
  return std::ranges::any_of(prefixes, [&](std::string_view prefix) { return path.starts_with(prefix); });
}

std::string at_line(std::string_view path, std::size_t line) {
  return std::string{path} + ":" + std::to_string(line) + ": ";
}

std::vector<std::string> words_of(std::string_view path) {
  std::vector<std::string> words(1);
  for (const char c : path) {
    if (c == '/' || c == '_' || c == '-' || c == '.')
      words.emplace_back();
    else
      words.back() += c;
  }
  return words;
}

void append(Findings& all, Findings more) { all.insert(all.end(), more.begin(), more.end()); }

}  // namespace

std::string_view first_folder(std::string_view path) {
  const auto slash = path.find('/');
  return slash == path.npos ? std::string_view{} : path.substr(0, slash);
}

bool is_header(std::string_view path) { return path.ends_with(".hpp"); }
bool is_source(std::string_view path) {
  return is_header(path) || path.ends_with(".cpp") || path.ends_with(".c");
}

Findings banned_findings(std::string_view path, std::string_view text) {
  Findings findings;
  if (!is_source(path)) return findings;
  const std::string code = code_only(text);
  for (const auto& ban : bans) {
    if (!starts_with_one_of(path, ban.where) || starts_with_one_of(path, ban.but)) continue;
    const std::regex pattern{ban.pattern};
    std::size_t number = 0;
    for (const auto line : lines_of(code)) {
      ++number;
      std::match_results<std::string_view::const_iterator> match;
      if (!std::regex_search(line.begin(), line.end(), match, pattern)) continue;
      findings.push_back(at_line(path, number) + match.str(0) + ": " + ban.instead);
    }
  }
  return findings;
}

Findings size_findings(std::string_view path, std::string_view text) {
  Findings findings;
  if (!is_source(path) && !path.ends_with(".md")) return findings;
  const auto lines = lines_of(text);
  const auto filled = static_cast<std::size_t>(std::ranges::count_if(
      lines, [](std::string_view l) { return l.find_first_not_of(" \t\r") != l.npos; }));
  if (is_header(path) && filled > most_header_lines) {
    findings.push_back(std::string{path} + ": a header of " + std::to_string(filled) +
                       " lines; it holds more than one idea");
  }
  if (lines.size() > most_file_lines) {
    findings.push_back(std::string{path} + ": " + std::to_string(lines.size()) +
                       " lines; it holds more than one idea");
  }
  return findings;
}

Findings width_findings(std::string_view path, std::string_view text) {
  Findings findings;
  if (!is_source(path)) return findings;
  bool table = false;  // tables are lined up by hand, and as wide as they are
  std::size_t number = 0;
  for (const auto line : lines_of(text)) {
    ++number;
    if (line.find("// clang-format off") != line.npos) table = true;
    if (line.find("// clang-format on") != line.npos) table = false;
    const auto width = width_of(line);
    if (!table && width > widest_line)
      findings.push_back(at_line(path, number) + std::to_string(width) + " columns");
  }
  return findings;
}

Findings pragma_findings(std::string_view path, std::string_view text) {
  if (!is_header(path)) return {};
  const std::string code = code_only(text);
  for (const auto line : lines_of(code)) {
    if (line.find_first_not_of(" \t\r") == line.npos) continue;
    if (line.starts_with("#pragma once")) return {};
    break;
  }
  return {std::string{path} +
          ": after the comment that states its contract a header begins with #pragma once"};
}

Findings name_findings(std::string_view path) {
  for (const auto& word : words_of(path)) {
    if (empty_names.contains(word))
      return {std::string{path} + ": '" + word + "' does not say what is inside"};
  }
  return {};
}

// CMake splits a list at semicolons: ctest would look for two halves of a name, run no case, and call it passed.
Findings test_name_findings(std::string_view path, std::string_view text) {
  Findings findings;
  if (!path.starts_with("tests/") || !is_source(path)) return findings;
  static const std::regex name{R"(^TEST_CASE\(\s*((?:"(?:[^"\\\n]|\\.)*"\s*)+))", std::regex::multiline};
  const std::string code = without_comments(text);
  for (std::sregex_iterator it{code.begin(), code.end(), name}, end; it != end; ++it) {
    if (it->str(1).find(';') == std::string::npos) continue;
    const auto line = std::count(code.begin(), code.begin() + it->position(0), '\n') + 1;
    findings.push_back(at_line(path, static_cast<std::size_t>(line)) +
                       "a semicolon in a test's name: ctest would never run it");
  }
  return findings;
}

Findings top_level_findings(std::span<const std::string> paths) {
  std::set<std::string> folders;
  for (const auto& path : paths) {
    const auto folder = first_folder(path);
    if (!folder.empty() && !top_level.contains(folder)) folders.emplace(folder);
  }
  Findings findings;
  for (const auto& folder : folders)
    findings.push_back(folder + "/: no folder of this name stands at the top");
  return findings;
}

Findings readme_findings(std::span<const std::string> paths) {
  std::set<std::string> without{""};  // the top itself
  for (const auto& path : paths) {
    const auto folder = first_folder(path);
    if (!folder.empty() && !built.contains(folder)) without.emplace(folder);
  }
  for (const auto& path : paths) {
    if (path == "README.md") without.erase("");
    if (path == std::string{first_folder(path)} + "/README.md")
      without.erase(std::string{first_folder(path)});
  }
  Findings findings;
  for (const auto& folder : without) findings.push_back(folder + "/: a README.md of a page is missing");
  return findings;
}

Findings file_findings(std::string_view path, std::string_view text) {
  Findings all = include_findings(path, text);
  append(all, banned_findings(path, text));
  append(all, size_findings(path, text));
  append(all, width_findings(path, text));
  append(all, pragma_findings(path, text));
  append(all, name_findings(path));
  append(all, test_name_findings(path, text));
  append(all, include_order_findings(path, text));
  append(all, comment_findings(path, text));
  append(all, function_findings(path, text));
  return all;
}

Findings tree_findings(std::span<const std::string> paths) {
  Findings all = top_level_findings(paths);
  append(all, readme_findings(paths));
  return all;
}

}  // namespace moldloft::tree
