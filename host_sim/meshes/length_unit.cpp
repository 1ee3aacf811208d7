#include "host_sim/meshes/length_unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace moldloft::host_sim {

namespace {

struct Unit {
  LengthUnit unit;
  std::string_view word, plural;
  double mm;
};

constexpr std::array<Unit, 4> units = {{{LengthUnit::millimetre, "mm", "millimetres", 1},
                                        {LengthUnit::metre, "m", "metres", 1000},
                                        {LengthUnit::inch, "inch", "inches", 25.4},
                                        {LengthUnit::centimetre, "cm", "centimetres", 10}}};
// What a plate is likely to measure along its longer side.
constexpr double likely_from_mm = 100, likely_to_mm = 6000;

std::string number(double mm) { return mm < 100 ? fmt::format("{:.3g}", mm) : fmt::format("{:.0f}", mm); }

}  // namespace

double millimetres_in(LengthUnit unit) {
  return std::find_if(units.begin(), units.end(), [&](const Unit& u) { return u.unit == unit; })->mm;
}

std::expected<LengthUnit, SimError> unit_named(std::string_view name) {
  if (name == "in") return LengthUnit::inch;
  const auto found = std::find_if(units.begin(), units.end(), [&](const Unit& u) { return u.word == name; });
  if (found != units.end()) return found->unit;
  return std::unexpected(SimError{fmt::format("no unit is called '{}': choose mm, cm, m or inch", name)});
}

std::optional<std::string> doubt_about_unit(double a_mm, double b_mm, LengthUnit given) {
  const double a = std::max(a_mm, b_mm), b = std::min(a_mm, b_mm);
  if (a >= shortest_plate_mm && a <= longest_plate_mm) return std::nullopt;
  std::string asked, words;
  for (const auto& u : units) {
    const double scale = u.mm / millimetres_in(given);
    if (u.unit == given || scale * a < likely_from_mm || scale * a > likely_to_mm) continue;
    asked += fmt::format("{} {} ({} x {} mm)?", asked.empty() ? "" : " or", u.plural, number(scale * a),
                         number(scale * b));
    words += fmt::format("{}--unit {}", words.empty() ? "" : " or ", u.word);
  }
  std::string line = fmt::format("{} x {} mm is no plate:", number(a), number(b));
  if (words.empty())
    return line + fmt::format(" its longer side must lie between {} and {} mm; check the file's unit",
                              shortest_plate_mm, longest_plate_mm);
  return line + asked + " give " + words;
}

}  // namespace moldloft::host_sim
