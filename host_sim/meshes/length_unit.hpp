// The units in which a mesh file may be written, and which of them a size speaks for.
#pragma once

#include "host_sim/base/sim_error.hpp"

#include <expected>
#include <optional>
#include <string>
#include <string_view>

namespace moldloft::host_sim {

enum class LengthUnit { millimetre, centimetre, metre, inch };

double millimetres_in(LengthUnit);
std::expected<LengthUnit, SimError> unit_named(std::string_view);  // mm, cm, m, inch or in

// A plate whose longer side is outside these limits was read in the wrong unit. A smaller one cannot be
// tracked with a field of 102 mm, and no mill rolls a larger one.
constexpr double shortest_plate_mm = 60, longest_plate_mm = 20'000;

// When a plate of a x b mm, read in `given`, cannot be right: what is wrong and which unit would make a plate of it.
std::optional<std::string> doubt_about_unit(double a_mm, double b_mm, LengthUnit given);

}  // namespace moldloft::host_sim
