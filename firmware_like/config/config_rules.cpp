#include "firmware_like/config/config_rules.hpp"

#include "firmware_like/config/cell_settings.hpp"
#include "firmware_like/config/config.hpp"
#include "firmware_like/config/device_makes.hpp"
#include "firmware_like/config/plate_name.hpp"
#include "tasks/cell/motion_guard.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

namespace moldloft::firmware_like {
namespace {

using Finding = ConfigFinding;
using MaybeFinding = std::optional<Finding>;

MaybeFinding error(std::vector<std::string> keys, std::string what) {
  return Finding{Severity::error, 0, std::move(what), std::move(keys)};
}
MaybeFinding warning(std::vector<std::string> keys, std::string what) {
  return Finding{Severity::warning, 0, std::move(what), std::move(keys)};
}

double smaller_field(const CellConfig& c) { return std::min(c.scanner.field_x_mm, c.scanner.field_y_mm); }

// No table at all is written as a table far below.
bool has_table(const CellConfig& c) { return c.plate.table_z_mm > -500; }

// Where a length is too large a part of the field's smaller side.
MaybeFinding beyond_field(const CellConfig& c, MaybeFinding (*of)(std::vector<std::string>, std::string),
                          std::string_view section, std::string_view name, double length_mm, double part,
                          std::string_view what_it_does) {
  if (length_mm <= part * smaller_field(c)) return {};
  const std::string share = part == 1 ? "" : part == 0.5 ? "half of " : fmt::format("{} of ", part);
  return of({fmt::format("{}.{}", section, name), "scanner.field_mm"},
            fmt::format("[{}] {}: {} is more than {}[scanner] field_mm{}", section, name, length_mm, share,
                        what_it_does));
}

// "[scanner] host: ...", of the section's own place.
struct Placed {
  const char* section;
  const LinkConfig& place;

  MaybeFinding wrong(const char* key, const std::string& why) const {
    return error({fmt::format("{}.{}", section, key)}, fmt::format("[{}] {}: {}", section, key, why));
  }
  MaybeFinding doubtful(const char* key, const std::string& why) const {
    return warning({fmt::format("{}.{}", section, key)}, fmt::format("[{}] {}: {}", section, key, why));
  }
};

MaybeFinding host(const Placed& of) {
  const std::string& h = of.place.host;
  const auto no = [&](const std::string& why) { return of.wrong("host", why); };
  if (h.empty()) return no(fmt::format("is empty; write the {}'s address", of.section));
  if (h.find("//") != h.npos) return no("is a URL; write the address alone, and the port into port");
  if (h.find_first_of(" \t/") != h.npos) return no("has a blank or a slash in it; write the address alone");
  const auto colon = h.find(':');
  if (h.front() == '[')
    return no(fmt::format("'{:.80}' has brackets; write the address alone, and the port into port", h));
  if (colon != h.npos && colon == h.rfind(':'))
    return no(fmt::format("'{:.80}' has a port in it; write the address alone, and the port into port", h));
  return {};
}

MaybeFinding device(const Placed& of) {
  if (!of.place.device.empty()) return {};
  return of.wrong("device", "is empty; write the serial port's path, such as /dev/ttyS0");
}

MaybeFinding baud(const Placed& of) {
  constexpr std::array usual = {1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};
  if (std::ranges::find(usual, of.place.baud) != usual.end()) return {};
  return of.doubtful("baud", fmt::format("{} is no usual rate; many ports refuse it or run at "
                                         "another (usual: 9600, 19200, 38400, 57600, 115200)",
                                         of.place.baud));
}

template <MaybeFinding (*rule)(const Placed&)>
MaybeFinding of_scanner(const CellConfig& c) {
  const bool counts = (c.scanner.place.link == "tcp") == (rule == host);
  return counts ? rule({"scanner", c.scanner.place}) : MaybeFinding{};
}

template <MaybeFinding (*rule)(const Placed&)>
MaybeFinding of_robot(const CellConfig& c) {
  const bool counts = (c.robot.place.link == "tcp") == (rule == host);
  return counts ? rule({"robot", c.robot.place}) : MaybeFinding{};
}

// Scanner and robot cannot be at one and the same place.
MaybeFinding same_place(const CellConfig& c) {
  const std::string place = place_of(c.scanner.place);
  if (c.scanner.place.link != c.robot.place.link || place != place_of(c.robot.place)) return {};
  const std::string key = key_of_place(c.robot.place);
  return error(
      {"robot." + key, "robot.port", "robot.link", "scanner." + key, "scanner.link"},
      fmt::format("[robot] {}: {} is the scanner's too; each device has a place of its own", key, place));
}

// A serial line brings a tenth of its baud rate in bytes. A scanner may send less than the configuration allows.
MaybeFinding frames_over_a_serial_line(const CellConfig& c) {
  const ScannerMake* make = find_scanner_make(c.scanner.driver);
  if (c.scanner.place.link != "serial" || make == nullptr || c.scanner.place.baud <= 0) return {};
  const std::size_t bytes = make->largest_frame_bytes(c.scanner);
  const double seconds = 10.0 * static_cast<double>(bytes) / c.scanner.place.baud,
               limit = std::chrono::duration<double>(make->frame_timeout).count();
  if (seconds <= limit) return {};
  return warning(
      {"scanner.baud", "scanner.link"},
      fmt::format(
          "[scanner] baud: a frame of {} bytes takes {:.1f} s at {} baud, and the driver waits {} s for "
          "it; take a faster link, or fewer points",
          bytes, seconds, c.scanner.place.baud, limit));
}

MaybeFinding speed(const CellConfig& c) {
  if (c.robot.speed_percent <= c.robot.workspace.max_speed_percent) return {};
  return error({"robot.speed_percent", "robot.workspace.max_speed_percent"},
               fmt::format("[robot] speed_percent: {} is over [robot.workspace] max_speed_percent, {}",
                           c.robot.speed_percent, c.robot.workspace.max_speed_percent));
}

MaybeFinding seek_over_step_limit(const CellConfig& c) {
  if (c.seek_step_mm <= c.robot.workspace.max_step_mm) return {};
  return error({"tracking.seek_step_mm", "robot.workspace.max_step_mm"},
               fmt::format("[tracking] seek_step_mm: {} is over [robot.workspace] max_step_mm, {}",
                           c.seek_step_mm, c.robot.workspace.max_step_mm));
}

MaybeFinding reach(const CellConfig& c) {
  const auto& w = c.robot.workspace;
  const auto nearest = [](const tasks::Range& r) {
    return r.contains(0) ? 0 : std::min(std::abs(r.min), std::abs(r.max));
  };
  const auto farthest = [](const tasks::Range& r) { return std::max(std::abs(r.min), std::abs(r.max)); };
  const double least = std::hypot(nearest(w.x_mm), nearest(w.y_mm));
  const double most = std::hypot(farthest(w.x_mm), farthest(w.y_mm));
  const auto no = [](const std::string& key, const std::string& why) {
    return error({"robot.workspace." + key, "robot.workspace.x_mm", "robot.workspace.y_mm"},
                 fmt::format("[robot.workspace] {}: {}", key, why));
  };
  for (const auto& [key, range] :
       {std::pair{"x_mm", w.x_mm}, std::pair{"y_mm", w.y_mm}, std::pair{"reach_mm", w.reach_mm}}) {
    if (range.min == range.max)
      return no(key, fmt::format("from {0} to {0} leaves the arm no room", range.min));
  }
  if (least > w.reach_mm.max || most < w.reach_mm.min)
    return no("reach_mm",
              fmt::format("{} to {} has nothing in common with x_mm and y_mm, which are {:.0f} to "
                          "{:.0f} from the axis",
                          w.reach_mm.min, w.reach_mm.max, least, most));
  return {};
}

// Where the tip has to stand to look at the start with the head turned so.
MaybeFinding start_outside(const CellConfig& c, double head_yaw) {
  const auto& w = c.robot.workspace;
  tasks::ShotPlace place = c.start;
  place.head_yaw = head_yaw;
  const hal::Pose tip = tasks::tip_pose_for(place, c.scanner.tip_from_scanner);
  const auto look = [&](const char* key, const char* what, double value,
                        const tasks::Range& range) -> MaybeFinding {
    if (range.contains(value)) return {};
    return error({"start.centre_mm", std::string{"robot.workspace."} + key, "scanner.mount.translation_mm",
                  "scanner.mount.zyz_deg"},
                 fmt::format("[start] centre_mm: target outside the workspace: {} {:.1f} mm of the tip that "
                             "looks there, limit {:.1f} to {:.1f} mm ([robot.workspace] {})",
                             what, value, range.min, range.max, key));
  };
  if (auto no = look("x_mm", "x", tip.x_mm, w.x_mm)) return no;
  if (auto no = look("y_mm", "y", tip.y_mm, w.y_mm)) return no;
  if (auto no = look("z_mm", "z", tip.z_mm, w.z_mm)) return no;
  return look("reach_mm", "reach", std::hypot(tip.x_mm, tip.y_mm), w.reach_mm);
}

// The cell takes the same stripes with the head turned by half a turn where only that is within reach.
MaybeFinding start_place(const CellConfig& c) {
  auto no = start_outside(c, c.start.head_yaw);
  return no && start_outside(c, geometry::wrapped_angle(c.start.head_yaw + 180 * hal::degree)) ? no
                                                                                               : std::nullopt;
}

// What lies lower than half a thickness over the table is the table.
MaybeFinding start_height(const CellConfig& c) {
  const double z = c.start.centre.z(), depth = c.scanner.depth_mm;
  const double lowest = c.plate.table_z_mm + c.plate.thickness_mm / 2,
               top = c.plate.table_z_mm + c.plate.thickness_mm;
  const std::vector<std::string> keys = {"start.centre_mm", "plate.table_z_mm", "plate.thickness_mm",
                                         "scanner.depth_mm"};
  if (z + depth < lowest)
    return error(
        keys, fmt::format("[start] centre_mm: z {} with [scanner] depth_mm {} ends at {} mm, below all that "
                          "counts as plate ({} mm and higher)",
                          z, depth, z + depth, lowest));
  if (has_table(c) && z - depth > top)
    return warning(keys,
                   fmt::format("[start] centre_mm: z {} with [scanner] depth_mm {} begins at {} mm, above a "
                               "plate that lies on the table ({} mm)",
                               z, depth, z - depth, top));
  return {};
}

MaybeFinding mount_in_metres(const CellConfig& c) {
  const double length = c.scanner.tip_from_scanner.translation().norm();
  if (length == 0 || length > 5) return {};
  return warning(
      {"scanner.mount.translation_mm"},
      fmt::format("[scanner.mount] translation_mm: the scanner sits {:.3g} mm from the tip; metres?",
                  length));
}

// The head looks straight down wherever it goes: a mount by which the stripes' heights are not along world z is a slip.
MaybeFinding mount_in_radians(const CellConfig& c) {
  const Eigen::Matrix3d down = geometry::rotation_from_zyz({0, hal::degree * 180, 0});
  const double tilt =
      std::acos(std::clamp((down * c.scanner.tip_from_scanner.linear().col(2)).z(), -1.0, 1.0)) / hal::degree;
  if (tilt < 30) return {};
  return warning(
      {"scanner.mount.zyz_deg"},
      fmt::format("[scanner.mount] zyz_deg: the scanner's z is tilted {:.0f} degrees from upright while the "
                  "tool points down; radians, or another order of angles?",
                  tilt));
}

MaybeFinding scan_overlap(const CellConfig& c) {
  return beyond_field(c, error, "scan", "overlap_mm", c.scan_overlap_mm, 0.5, "");
}

// The next field is centred on the boundary's continuation: with more overlap than this the tracker
// would hardly advance.
MaybeFinding tracking_overlap(const CellConfig& c) {
  return beyond_field(c, error, "tracking", "overlap_mm", c.tracking_overlap_mm, 0.45, "");
}

MaybeFinding shots(const CellConfig& c) {
  // Fields that hardly advance ask for more shots than can be counted: their own rules tell of it.
  if (scan_overlap(c) || tracking_overlap(c)) return {};
  const tasks::CellSettings cell = cell_settings(c);
  const std::size_t asked = static_cast<std::size_t>(cell.tracker.max_shots) + cell.max_surface_shots;
  if (asked <= tasks::max_shot_number) return {};
  return error({"plate.largest_mm", "scanner.field_mm", "tracking.overlap_mm"},
               fmt::format("[plate] largest_mm: asks for {} shots of this field, a run takes {} at most",
                           asked, tasks::max_shot_number));
}

MaybeFinding largest_plate(const CellConfig& c) {
  if (c.plate.largest_x_mm >= c.scanner.field_x_mm || c.plate.largest_y_mm >= c.scanner.field_y_mm) return {};
  return warning(
      {"plate.largest_mm", "scanner.field_mm"},
      fmt::format("[plate] largest_mm: {} x {} is smaller than [scanner] field_mm, {} x {}; a larger plate "
                  "outgrows the memory plan and holds the run",
                  c.plate.largest_x_mm, c.plate.largest_y_mm, c.scanner.field_x_mm, c.scanner.field_y_mm));
}

MaybeFinding step_across_the_plate(const CellConfig& c) {
  const double across = std::hypot(c.plate.largest_x_mm, c.plate.largest_y_mm);
  if (across <= c.robot.workspace.max_step_mm) return {};
  return warning(
      {"robot.workspace.max_step_mm", "plate.largest_mm"},
      fmt::format("[robot.workspace] max_step_mm: {} is less than the way across [plate] largest_mm, {:.0f}; "
                  "the last shot of the outline may lie farther from the first of the surface",
                  c.robot.workspace.max_step_mm, across));
}

MaybeFinding seek_step(const CellConfig& c) {
  return beyond_field(c, warning, "tracking", "seek_step_mm", c.seek_step_mm, 1,
                      "; the edge may lie between two looks");
}

MaybeFinding seek_limit(const CellConfig& c) {
  if (c.seek_limit_mm >= c.seek_step_mm) return {};
  return warning(
      {"tracking.seek_limit_mm", "tracking.seek_step_mm"},
      fmt::format("[tracking] seek_limit_mm: {} is less than one seek_step_mm, {}; the edge must show in the "
                  "first shot",
                  c.seek_limit_mm, c.seek_step_mm));
}

MaybeFinding scan_margin(const CellConfig& c) {
  return beyond_field(c, warning, "scan", "margin_mm", c.scan_margin_mm, 0.5,
                      "; whole rows of shots would see no plate");
}

MaybeFinding tolerance(const CellConfig& c) {
  const std::vector<std::string> keys = {"fit.tolerance_mm", "scanner.noise_mm"};
  if (c.fit_tolerance_mm > c.scanner.noise_mm)
    return warning(
        keys, fmt::format("[fit] tolerance_mm: {} is more than [scanner] noise_mm, {}; the surface would be "
                          "coarser than a single point",
                          c.fit_tolerance_mm, c.scanner.noise_mm));
  if (c.fit_tolerance_mm > 0 && c.fit_tolerance_mm < c.scanner.noise_mm / 1000)
    return warning(
        keys, fmt::format("[fit] tolerance_mm: {} is less than a thousandth of [scanner] noise_mm, {}; no "
                          "measurement shows so little, the finest net is taken",
                          c.fit_tolerance_mm, c.scanner.noise_mm));
  return {};
}

MaybeFinding finest_span(const CellConfig& c) {
  const double longer = std::max(c.plate.largest_x_mm, c.plate.largest_y_mm);
  if (8 * c.finest_span_mm <= longer) return {};
  return warning(
      {"fit.finest_span_mm", "plate.largest_mm"},
      fmt::format("[fit] finest_span_mm: {} divides [plate] largest_mm into fewer than the 8 spans that are "
                  "the least; finer ones are taken",
                  c.finest_span_mm));
}

MaybeFinding noise(const CellConfig& c) {
  if (c.scanner.noise_mm < c.plate.thickness_mm / 4) return {};
  return warning({"scanner.noise_mm", "plate.thickness_mm"},
                 fmt::format("[scanner] noise_mm: {} hides the step of a plate of {} mm at its edge",
                             c.scanner.noise_mm, c.plate.thickness_mm));
}

}  // namespace

std::vector<ConfigFinding> contradictions(const CellConfig& c) {
  std::vector<ConfigFinding> found;
  for (const auto rule : {of_scanner<host>,
                          of_scanner<device>,
                          of_scanner<baud>,
                          of_robot<host>,
                          of_robot<device>,
                          of_robot<baud>,
                          same_place,
                          frames_over_a_serial_line,
                          speed,
                          seek_over_step_limit,
                          reach,
                          start_place,
                          start_height,
                          mount_in_metres,
                          mount_in_radians,
                          scan_overlap,
                          tracking_overlap,
                          shots,
                          largest_plate,
                          step_across_the_plate,
                          seek_step,
                          seek_limit,
                          scan_margin,
                          tolerance,
                          finest_span,
                          noise}) {
    MaybeFinding finding = rule(c);
    if (!finding) continue;
    for (const auto& key : finding->keys) {
      const auto line = c.key_lines.find(key);
      if (finding->line == 0 && line != c.key_lines.end()) finding->line = line->second;
    }
    found.push_back(std::move(*finding));
  }
  return found;
}

std::string finding_text(const std::string& path, const ConfigFinding& finding) {
  const std::string line = finding.line > 0 ? fmt::format(":{}", finding.line) : "";
  return fmt::format("{}{}: {}", path, line, finding.what);
}

}  // namespace moldloft::firmware_like
