#include "host_sim/faults/fault.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

namespace moldloft::host_sim {

namespace {

using K = FaultKind;

constexpr std::array<FaultWord, 16> words{{
    {K::robot_lies, "robot-lies", "mm", "it says another place than it stands at", 0.001, 1e5},
    {K::robot_tilts, "robot-tilts", "degrees", "it says another attitude than it has", 0.001, 180},
    {K::robot_slips, "robot-slips", "mm", "it stands elsewhere than it says", 0.001, 1000},
    {K::robot_leans, "robot-leans", "degrees", "it is tilted and does not say so", 0.001, 45},
    {K::robot_drifts, "robot-drifts", "mm a shot", "it slips more with each shot", 0.0001, 100},
    {K::robot_stays, "robot-stays", "", "it confirms motions and does not move", 0, 0},
    {K::scanner_blind, "scanner-blind", "of the field", "so much of the field shows nothing", 0.01, 1},
    {K::scanner_freezes, "scanner-freezes", "", "it sends the same frame again and again", 0, 0},
    {K::scanner_scales, "scanner-scales", "per cent", "lengths come out so much too large", -50, 100},
    {K::scanner_mirrors, "scanner-mirrors", "", "left and right are exchanged", 0, 0},
    {K::noise, "noise", "times", "so much noisier than configured", 0.01, 1000},
    {K::plate_pushed, "plate-pushed", "mm", "the plate is pushed along the table", 0.001, 1000},
    {K::plate_turned, "plate-turned", "degrees", "the plate is turned on the table", 0.001, 180},
    {K::plate_lifted, "plate-lifted", "mm", "the plate is lifted", 0.001, 1000},
    {K::mount_yawed, "mount-yawed", "degrees", "the scanner is mounted turned about its own axis", -180, 180},
    {K::mount_shifted, "mount-shifted", "mm", "the scanner is mounted beside its place", 0.001, 1000},
}};

// One word, without it what is left.
std::string_view next_word(std::string_view& rest) {
  const auto begin = std::min(rest.find_first_not_of(' '), rest.size());
  rest.remove_prefix(begin);
  const auto end = std::min(rest.find(' '), rest.size());
  const auto word = rest.substr(0, end);
  rest.remove_prefix(end);
  return word;
}

template <typename Number>
std::optional<Number> number_of(std::string_view word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

SimError refusal(std::string_view text, std::string_view why) { return {fmt::format("'{}': {}", text, why)}; }

std::string known_names() {
  std::string names;
  for (const auto& w : words) names += fmt::format("{}{}", names.empty() ? "" : ", ", w.name);
  return names;
}

// "at 7", "from surface", nothing.
bool read_when(std::string_view rest, Fault& fault) {
  const auto when = next_word(rest);
  if (when.empty()) return true;
  if (when != "at" && when != "from") return false;
  fault.when = when == "at" ? Fault::When::at : Fault::When::from;
  const auto shot = next_word(rest);
  if (!next_word(rest).empty()) return false;
  fault.of_surface = shot == "surface";
  if (fault.of_surface) return true;
  const auto number = number_of<std::uint64_t>(shot);
  if (!number || *number < 1) return false;
  fault.shot = *number;
  return true;
}

std::expected<Fault, SimError> fault_from(std::string_view text) {
  std::string_view rest = text;
  const auto name = next_word(rest);
  const auto word = std::ranges::find(words, name, &FaultWord::name);
  if (word == words.end())
    return std::unexpected(refusal(text, fmt::format("no fault is called so; known are {}", known_names())));
  Fault fault{.kind = word->kind};
  if (!word->unit.empty()) {
    const auto size = number_of<double>(next_word(rest));
    if (!size || !(*size >= word->least && *size <= word->most) || *size == 0)
      return std::unexpected(refusal(
          text, fmt::format("{} wants its size, {} to {} {}", name, word->least, word->most, word->unit)));
    fault.size = *size;
  }
  if (!read_when(rest, fault))
    return std::unexpected(refusal(
        text,
        "behind the size only 'at N', 'from N', 'at surface' or 'from surface' may stand, N from 1 on"));
  return fault;
}

}  // namespace

std::span<const FaultWord> fault_words() { return words; }

const FaultWord& word_of(FaultKind kind) { return *std::ranges::find(words, kind, &FaultWord::kind); }

std::expected<std::vector<Fault>, SimError> faults_from(std::string_view text) {
  std::vector<Fault> faults;
  while (true) {
    const auto comma = text.find(',');
    const auto fault = fault_from(text.substr(0, comma));
    if (!fault) return std::unexpected(fault.error());
    faults.push_back(*fault);
    if (comma == text.npos) return faults;
    text.remove_prefix(comma + 1);
  }
}

std::string text_of(const Fault& fault) {
  const auto& word = word_of(fault.kind);
  std::string text{word.name};
  if (!word.unit.empty()) text += fmt::format(" {:.6g}", fault.size);
  if (fault.when == Fault::When::drawn) return text;
  text += fault.when == Fault::When::at ? " at " : " from ";
  return text + (fault.of_surface ? "surface" : fmt::format("{}", fault.shot));
}

std::string text_of(const std::vector<Fault>& faults) {
  std::string text;
  for (const auto& fault : faults) text += (text.empty() ? "" : ", ") + text_of(fault);
  return text;
}

}  // namespace moldloft::host_sim
