#include "host_sim/cell/cell_options.hpp"

#include "firmware_like/commands/option_values.hpp"

#include <cstdint>
#include <limits>
#include <string>

namespace moldloft::host_sim {

namespace {

// Plates beyond these are no plates of a cell; what its arm can reach is found out when the plate is put down.
const firmware_like::Limits<double> length{1, 10'000, "mm"}, shift{-10'000, 10'000, "mm"};

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
  if (command.count("--design") > 0 && command.count("--plate") > 0)
    throw CLI::ValidationError("--design",
                               "and --plate both say what the plate was to become: give one of them");
  if (command.count("--formed") > 0 && command.count("--design") == 0)
    throw CLI::ValidationError("--formed",
                               "says how the plate differs from its design: --design is wanted too");
  if (!is_mesh(cell)) {
    if (command.count("--unit") > 0)
      throw CLI::ValidationError("--unit",
                                 "is for mesh files; the plate '" + cell.plate + "' is a formula in mm");
    return;
  }
  for (const char* option :
       {"--outline", "--width", "--depth", "--top-width", "--shear", "--amplitude", "--radius"}) {
    if (command.count(option) > 0)
      throw CLI::ValidationError(option,
                                 "is for plates by formula; the mesh " + cell.plate + " has its own shape");
  }
}

}  // namespace

void add_cell_options(CLI::App& command, CellDescription& cell) {
  command
      .add_option("--plate", cell.plate,
                  "flat, cylinder, saddle, twist, dome, wave, or a mesh: FILE.ply, FILE.stl")
      ->capture_default_str();
  add_named(command, "--unit", cell.unit, unit_named, "unit of the mesh file: mm (default), cm, m or inch");
  add_named(command, "--outline", cell.outline, outline_named,
            "square (default), rectangle, trapezoid or parallelogram");
  using firmware_like::add_number;
  using firmware_like::add_number_with_default;
  add_number(command, "--width", cell.sizes.width_mm, length, "lower side, mm");
  add_number(command, "--depth", cell.sizes.depth_mm, length, "extent across it, mm");
  add_number(command, "--top-width", cell.sizes.top_width_mm, length, "trapezoid: upper side, mm");
  add_number(command, "--shear", cell.sizes.shear_mm, shift, "parallelogram: shift of the upper side, mm");
  add_number_with_default(command, "--thickness", cell.thickness_mm, {0.5, 200.0, "mm"}, "mm");
  add_number_with_default(command, "--amplitude", cell.amplitude_mm, {-500.0, 500.0, "mm"},
                          "of saddle, twist, dome, wave, mm");
  add_number_with_default(command, "--radius", cell.radius_mm, {1.0, 1e6, "mm"}, "of the cylinder, mm");
  add_named(command, "--arm", cell.arm, arm_named, "scara (default) or gantry");
  add_number_with_default(command, "--seed", cell.seed, {0, std::numeric_limits<std::uint64_t>::max()},
                          "draws placement, noise and errors");
  command.add_option_function<std::string>(
      "--design",
      [&cell](const std::string& shape) {
        const auto known = shape_named(shape);
        if (!known) throw CLI::ValidationError("--design", known.error().what);
        cell.plate = shape;
        cell.has_design = true;
      },
      "what the plate was to become, a shape as --plate: the run gets design.json");
  command.add_option_function<std::string>(
      "--formed",
      [&cell](const std::string& text) {
        const auto mistakes = mistakes_from(text);
        if (!mistakes) throw CLI::ValidationError("--formed", mistakes.error().what);
        cell.formed = *mistakes;
      },
      "what it became: 'wave, springback 0.9, twist 3 mm, dent 5 mm at 9,8'");
  command.parse_complete_callback([&command, &cell] { refuse_contradictions(command, cell); });
}

void add_fault_option(CLI::App& command, CellDescription& cell) {
  command
      .add_option_function<std::vector<std::string>>(
          "--fault",
          [&cell](const std::vector<std::string>& texts) {
            for (const auto& text : texts) {
              const auto faults = faults_from(text);
              if (!faults) throw CLI::ValidationError("--fault", faults.error().what);
              cell.faults.insert(cell.faults.end(), faults->begin(), faults->end());
            }
          },
          "what is wrong on purpose: WHAT [SIZE] [at N | from N], ...")
      ->allow_extra_args(false);
}

}  // namespace moldloft::host_sim
