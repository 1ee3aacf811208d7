#include "host_sim/cell_options.hpp"

#include <map>
#include <string>

namespace moldloft::host_sim {

void add_cell_options(CLI::App& command, CellDescription& cell) {
  static const std::map<std::string, LengthUnit> units = {{"mm", LengthUnit::millimetre},
                                                          {"m", LengthUnit::metre}};
  static const std::map<std::string, ArmKind> arms = {{"scara", ArmKind::scara}, {"gantry", ArmKind::gantry}};
  static const std::map<std::string, OutlineKind> outlines = [] {
    std::map<std::string, OutlineKind> names;
    for (const auto name : outline_names()) names.emplace(name, *outline_named(name));
    return names;
  }();
  command.add_option("--plate", cell.plate, "flat, cylinder, saddle, twist, dome, wave, or a mesh FILE.ply")
      ->capture_default_str();
  command.add_option("--unit", cell.unit, "unit of the mesh file: mm or m")
      ->transform(CLI::CheckedTransformer(units));
  command.add_option("--outline", cell.outline, "square, rectangle, trapezoid or parallelogram")
      ->transform(CLI::CheckedTransformer(outlines));
  command.add_option("--width", cell.sizes.width_mm, "lower side, mm")->check(CLI::PositiveNumber);
  command.add_option("--depth", cell.sizes.depth_mm, "extent across it, mm")->check(CLI::PositiveNumber);
  command.add_option("--top-width", cell.sizes.top_width_mm, "trapezoid: upper side, mm")
      ->check(CLI::PositiveNumber);
  command.add_option("--shear", cell.sizes.shear_mm, "parallelogram: shift of the upper side, mm");
  command.add_option("--thickness", cell.thickness_mm, "mm")->capture_default_str();
  command.add_option("--amplitude", cell.amplitude_mm, "of saddle, twist, dome, wave, mm")
      ->capture_default_str();
  command.add_option("--radius", cell.radius_mm, "of the cylinder, mm")->capture_default_str();
  command.add_option("--arm", cell.arm, "scara or gantry")->transform(CLI::CheckedTransformer(arms));
  command.add_option("--seed", cell.seed, "draws placement, noise and errors")->capture_default_str();
}

}  // namespace moldloft::host_sim
