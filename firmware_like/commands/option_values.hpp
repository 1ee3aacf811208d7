// Numbers on the command line, with limits. A refusal names the option, the value given, and what is allowed.
// A number stands alone and whole: "-1" for a count, "nan", "inf", "5mm" and "" are refused.
//
// Thread       the main thread, before anything is begun
// Allocation   yes
// Failure      CLI::ValidationError, which command_line.hpp words
#pragma once

#include "firmware_like/process/number_text.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <string>
#include <type_traits>

namespace moldloft::firmware_like {

template <typename Number>
std::string out_of_limits(std::string_view option, std::string_view word, const Limits<Number>& limits) {
  return fmt::format("{}: '{}' given; a {}number from {} to {}{}{} is wanted", option, word,
                     std::is_integral_v<Number> ? "whole " : "", limits.min, limits.max,
                     limits.unit.empty() ? "" : " ", limits.unit);
}

// Binds `value`, which is left alone when the option is not given.
template <typename Number>
CLI::Option* add_number(CLI::App& command, const std::string& name, Number& value,
                        const Limits<Number>& limits, const std::string& about) {
  const auto read = [&value, name, limits](const std::string& word) {
    Number given{};
    if (!read_number(word, limits, given)) throw CLI::ValidationError(out_of_limits(name, word, limits));
    value = given;
  };
  return command.add_option_function<std::string>(name, read, about)
      ->type_name(fmt::format("{} in [{} - {}]", std::is_integral_v<Number> ? "INT" : "FLOAT", limits.min,
                              limits.max));
}

// The same, and --help shows the default.
template <typename Number>
CLI::Option* add_number_with_default(CLI::App& command, const std::string& name, Number& value,
                                     const Limits<Number>& limits, const std::string& about) {
  return add_number(command, name, value, limits, about)->default_str(fmt::format("{}", value));
}

}  // namespace moldloft::firmware_like
