#include "host_sim/cell/cell_config.hpp"

#include "firmware_like/config/config.hpp"
#include "hal/base/printable_text.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <fstream>

namespace moldloft::host_sim {
namespace {

constexpr std::string_view first_words = "# A simulated cell with a ";

// A margin and a round number, as a person would put it.
double roomy(double length_mm) { return std::ceil(length_mm * 1.1 / 50) * 50; }

std::string workspace(const CellDescription& d) {
  if (d.arm == ArmKind::gantry) {
    const Eigen::Vector3d low = d.gantry.low_mm, high = low + d.gantry.size_mm;
    return fmt::format(
        "x_mm = [{}, {}]\ny_mm = [{}, {}]\nz_mm = [{}, {}]\nreach_mm = [0, 100000]\nmax_step_mm = 4000\n",
        low.x(), high.x(), low.y(), high.y(), low.z(), high.z());
  }
  const double reach = d.scara.link_1_mm + d.scara.link_2_mm;
  // Folded as far as joint 2 goes, the wrist is this near to the axis.
  const double inner =
      std::sqrt(d.scara.link_1_mm * d.scara.link_1_mm + d.scara.link_2_mm * d.scara.link_2_mm +
                2 * d.scara.link_1_mm * d.scara.link_2_mm * std::cos(d.scara.j2_limit));
  return fmt::format(
      "x_mm = [{0}, {1}]\ny_mm = [{0}, {1}]\nz_mm = [{2}, {3}]\nreach_mm = [{4:.1f}, {1}]\nmax_step_mm = "
      "1600\n",
      -reach, reach, d.scara.tip_low_mm, d.scara.tip_low_mm + d.scara.stroke_mm, std::ceil(inner));
}

// A basic string of TOML: a plate may be called after a file, and a file's name may hold anything.
std::string toml_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : hal::printable(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string robot_place(const CellAddresses& a) {
  return a.robot_port == 0 ? "device = " + toml_string(a.robot_device)
                           : fmt::format("link = \"tcp\"\nhost = \"127.0.0.1\"\nport = {}", a.robot_port);
}

}  // namespace

bool is_generated_cell(const std::string& path) {
  std::ifstream file{path};
  std::string first;
  return std::getline(file, first) && first.starts_with(first_words);
}

std::string cell_toml(const CellDescription& d, const PlateInstance& plate, const CellAddresses& addresses) {
  const auto world_from_scanner = tasks::motion_of(start_pose(d)) * nominal_mount();
  const Eigen::Vector3d centre = world_from_scanner.translation();
  const Eigen::Vector3d axis = world_from_scanner.linear().col(0);
  const Eigen::Vector2d size = plate.plate->bounds().max - plate.plate->bounds().min;
  std::string t = fmt::format("{1}{0} arm.\nschema = 1\n\n[cell]\nname = \"simulated {0} cell\"\n",
                              d.arm == ArmKind::gantry ? "gantry" : "SCARA", first_words);
  t += fmt::format(
      "\n[scanner]\nhost = \"127.0.0.1\"\nport = {}\nmax_stripes = {}\nmax_points_per_stripe = {}\nfield_mm "
      "= [{}, {}]\nnoise_mm = {}\ndepth_mm = {}\n",
      addresses.scanner_port, d.optics.stripes, d.optics.points_per_stripe, d.optics.field_x_mm,
      d.optics.field_y_mm, d.optics.noise_mm, d.optics.depth_mm);
  if (d.scanner_driver != "psc1") t += fmt::format("driver = \"{}\"\n", d.scanner_driver);
  t += fmt::format("\n[scanner.mount]\ntranslation_mm = [{}]\nzyz_deg = [{}]\n",
                   fmt::join(firmware_like::default_mount_mm, ", "),
                   fmt::join(firmware_like::default_mount_zyz_deg, ", "));
  t += fmt::format("\n[robot]\n{}\nrepeatability_z_mm = {}\n\n[robot.workspace]\n{}", robot_place(addresses),
                   d.drive.errors.z_mm, workspace(d));
  t += fmt::format("\n[plate]\nthickness_mm = {}\ntable_z_mm = {}\nlargest_mm = [{}, {}]\n",
                   plate.plate->thickness_mm(), plate.table_z_mm, roomy(size.x()), roomy(size.y()));
  t += fmt::format("\n[start]\ncentre_mm = [{:.3f}, {:.3f}, {:.3f}]\nyaw_deg = {:.3f}\n", centre.x(),
                   centre.y(), centre.z(), std::atan2(axis.y(), axis.x()) / hal::degree);
  return t;
}

}  // namespace moldloft::host_sim
