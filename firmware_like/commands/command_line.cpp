#include "firmware_like/commands/command_line.hpp"

#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {
namespace {

using Words = std::vector<std::string>;

// How many letters have to be put in, taken out or exchanged (Levenshtein).
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t corner = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = corner + (a[i - 1] == b[j - 1] ? 0 : 1);
      corner = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
    }
  }
  return row.back();
}

// "; did you mean --out?", where one of `known` is near enough.
std::string suggestion(std::string_view word, const Words& known) {
  constexpr std::size_t longest = 40;
  if (known.empty() || word.size() > longest) return {};
  const auto near = [&](const std::string& k) { return k.starts_with(word) ? 1 : distance(word, k); };
  const auto best = std::ranges::min_element(known, {}, near);
  return near(*best) <= 2 ? fmt::format("; did you mean {}?", *best) : "";
}

Words commands_of(const CLI::App& app) {
  Words names;
  for (const auto* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

Words options_of(const CLI::App& app) {
  Words names;
  for (const auto* option : app.get_options()) {
    for (const auto& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

// As much of what was typed as a line holds.
std::string shown(std::string_view word, std::size_t longest = 60) {
  std::string text;
  for (const char c : word.substr(0, longest)) text += c >= 0x20 && c < 0x7F ? c : '?';
  return word.size() > longest ? text + "..." : text;
}

bool names_option(std::string_view word, std::string_view option) {
  return word == option || (word.starts_with(option) && word[option.size()] == '=');
}

// The option that stands twice, if one does: which of the two was meant cannot be known.
std::string given_twice(const Words& words, const Words& options) {
  for (const auto& option : options) {
    const auto n = std::ranges::count_if(words, [&](const auto& word) { return names_option(word, option); });
    if (n > 1) return fmt::format("{} is given {} times; give it once", option, n);
  }
  return {};
}

std::string what_is_wrong(const CLI::App& app, const CLI::App& command, const CLI::ParseError& e,
                          const Words& words) {
  const bool top = &command == &app;
  if (top && words.empty()) return fmt::format("say what to do: {}", fmt::join(commands_of(app), ", "));
  if (top && words.front().starts_with("-"))
    return fmt::format("'{}' is no option here{}", shown(words.front()),
                       suggestion(words.front(), options_of(app)));
  if (top)
    return fmt::format("'{}' is no command{}; there are {}", shown(words.front()),
                       suggestion(words.front(), commands_of(app)), fmt::join(commands_of(app), ", "));
  if (const std::string twice = given_twice(words, options_of(command)); !twice.empty()) return twice;
  if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError)) {
    const Words rest = app.remaining(true);
    const auto option = std::ranges::find_if(rest, [](const auto& word) { return word.starts_with("-"); });
    if (option != rest.end())
      return fmt::format("'{}' is no option here{}", shown(*option),
                         suggestion(option->substr(0, option->find('=')), options_of(command)));
    if (!rest.empty()) return fmt::format("'{}' is one word too many", shown(rest.front()));
  }
  constexpr std::size_t longest_line = 300;
  return shown(e.what(), longest_line);
}

}  // namespace

std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv) {
  app.get_formatter()->column_width(26);
  try {
    app.parse(argc, argv);
    return {};
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {
      std::ostringstream help;
      app.exit(e, help, help);
      show(help.str());
      return exit_done;
    }
    const auto parsed = app.get_subcommands();
    const CLI::App& command = parsed.empty() ? app : *parsed.front();
    const std::string name = parsed.empty() ? app.get_name() : app.get_name() + " " + command.get_name();
    const Words words(argv + std::min(argc, 1), argv + argc);
    return complain(fmt::format("{}; {} --help explains", what_is_wrong(app, command, e, words), name), name);
  }
}

}  // namespace moldloft::firmware_like
