#include "host_sim/cell_options.hpp"

#include <string>

namespace moldloft::host_sim {

namespace {

// An option whose words are looked up; an unknown word is refused with the words that are known.
template <typename Value, typename Lookup>
CLI::Option* add_named(CLI::App& command, const std::string& name, Value& value, Lookup lookup,
                       const std::string& about) {
  return command.add_option_function<std::string>(
      name,
      [&value, lookup, name](const std::string& word) {
        const auto found = lookup(word);
        if (!found) throw CLI::ValidationError(name, found.error().what);
        value = *found;
      },
      about);
}

std::expected<LengthUnit, SimError> unit_named(std::string_view name) {
  if (name == "mm") return LengthUnit::millimetre;
  if (name == "m") return LengthUnit::metre;
  return std::unexpected(SimError{"no unit is called '" + std::string(name) + "': choose mm or m"});
}

}  // namespace

void add_cell_options(CLI::App& command, CellDescription& cell) {
  command.add_option("--plate", cell.plate, "flat, cylinder, saddle, twist, dome, wave, or a mesh FILE.ply")
      ->capture_default_str();
  add_named(command, "--unit", cell.unit, unit_named, "unit of the mesh file: mm (default) or m");
  add_named(command, "--outline", cell.outline, outline_named,
            "square (default), rectangle, trapezoid or parallelogram");
  command.add_option("--width", cell.sizes.width_mm, "lower side, mm")->check(CLI::PositiveNumber);
  command.add_option("--depth", cell.sizes.depth_mm, "extent across it, mm")->check(CLI::PositiveNumber);
  command.add_option("--top-width", cell.sizes.top_width_mm, "trapezoid: upper side, mm")
      ->check(CLI::PositiveNumber);
  command.add_option("--shear", cell.sizes.shear_mm, "parallelogram: shift of the upper side, mm");
  command.add_option("--thickness", cell.thickness_mm, "mm")->capture_default_str();
  command.add_option("--amplitude", cell.amplitude_mm, "of saddle, twist, dome, wave, mm")
      ->capture_default_str();
  command.add_option("--radius", cell.radius_mm, "of the cylinder, mm")->capture_default_str();
  add_named(command, "--arm", cell.arm, arm_named, "scara (default) or gantry");
  command.add_option("--seed", cell.seed, "draws placement, noise and errors")->capture_default_str();
}

}  // namespace moldloft::host_sim
