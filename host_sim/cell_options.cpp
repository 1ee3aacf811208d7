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

// Options that say what a plate is not asked for: a mesh has its own outline, a formula its own unit.
void refuse_contradictions(const CLI::App& command, const CellDescription& cell) {
  if (!is_mesh(cell)) {
    if (command.count("--unit") > 0)
      throw CLI::ValidationError("--unit", "is for mesh files; the plate '" + cell.plate + "' is a formula in mm");
    return;
  }
  for (const char* option : {"--outline", "--width", "--depth", "--top-width", "--shear", "--amplitude", "--radius"}) {
    if (command.count(option) > 0)
      throw CLI::ValidationError(option, "is for plates by formula; the mesh " + cell.plate + " has its own shape");
  }
}

}  // namespace

void add_cell_options(CLI::App& command, CellDescription& cell) {
  command.add_option("--plate", cell.plate, "flat, cylinder, saddle, twist, dome, wave, or a mesh: FILE.ply, FILE.stl")
      ->capture_default_str();
  add_named(command, "--unit", cell.unit, unit_named, "unit of the mesh file: mm (default), cm, m or inch");
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
  command.parse_complete_callback([&command, &cell] { refuse_contradictions(command, cell); });
}

}  // namespace moldloft::host_sim
