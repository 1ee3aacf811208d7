#include "firmware_like/config.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "firmware_like/memory_plan.hpp"
#include "firmware_like/task_table.hpp"
#include "firmware_like/toml_section.hpp"

namespace moldloft::firmware_like {
namespace {

constexpr double degree = std::numbers::pi / 180;

geometry::RigidMotion mount_from(const std::array<double, 3>& translation_mm,
                                 const std::array<double, 3>& zyz_deg) {
  geometry::RigidMotion mount = geometry::RigidMotion::Identity();
  mount.linear() =
      geometry::rotation_from_zyz({zyz_deg[0] * degree, zyz_deg[1] * degree, zyz_deg[2] * degree});
  mount.translation() << translation_mm[0], translation_mm[1], translation_mm[2];
  return mount;
}

void read_scanner(TomlSection s, ScannerConfig& c) {
  s.choice("driver", c.driver, {"psc1"});
  s.text("host", c.host);
  s.integer("port", c.port, 1, 65535);
  std::string encoding = "int16";
  s.choice("encoding", encoding, {"int16", "float32"});
  c.encoding = encoding == "int16" ? hal::psc1::Encoding::int16 : hal::psc1::Encoding::float32;
  s.integer("max_stripes", c.max_stripes, 1, 1000);
  s.integer("max_points_per_stripe", c.max_points_per_stripe, 8, 4096);
  std::array<double, 2> field{c.field_x_mm, c.field_y_mm};
  s.numbers("field_mm", field, 5, 2000);
  c.field_x_mm = field[0];
  c.field_y_mm = field[1];
  s.number("noise_mm", c.noise_mm, 1e-4, 5);
  s.number("depth_mm", c.depth_mm, 1, 5000);
  TomlSection mount = s.section("mount");
  std::array<double, 3> translation{0, 140, 300}, zyz{0, 180, 180};
  mount.numbers("translation_mm", translation, -2000, 2000);
  mount.numbers("zyz_deg", zyz, -360, 360);
  mount.finish();
  c.tip_from_scanner = mount_from(translation, zyz);
  s.finish();
}

void read_range(TomlSection& s, std::string_view key, tasks::Range& range) {
  std::array<double, 2> v{range.min, range.max};
  s.range(key, v, -1e5, 1e5);
  range = {v[0], v[1]};
}

void read_robot(TomlSection s, RobotConfig& c) {
  s.choice("driver", c.driver, {"line"});
  s.text("device", c.device);
  s.integer("baud", c.baud, 1200, 921600);
  s.integer("speed_percent", c.speed_percent, 1, 100);
  s.number("repeatability_z_mm", c.repeatability_z_mm, 0, 10);
  TomlSection w = s.section("workspace");
  read_range(w, "x_mm", c.workspace.x_mm);
  read_range(w, "y_mm", c.workspace.y_mm);
  read_range(w, "z_mm", c.workspace.z_mm);
  read_range(w, "reach_mm", c.workspace.reach_mm);
  w.number("max_step_mm", c.workspace.max_step_mm, 1, 1e5);
  w.integer("max_speed_percent", c.workspace.max_speed_percent, 1, 100);
  w.finish();
  s.finish();
}

void read_realtime(TomlSection s, RealtimeConfig& c) {
  s.flag("lock_memory", c.lock_memory);
  s.integer("heap_reserve_mib", c.heap_reserve_mib, 0, 1024);
  s.integer("priority", c.priority, 0, 98);
  s.integer("cpu", c.cpu, -1, 1023);
  s.integer("cpu_latency_us", c.cpu_latency_us, -1, 1'000'000);
  s.finish();
}

void read_rest(TomlSection& file, CellConfig& c) {
  TomlSection cell = file.section("cell");
  cell.text("name", c.name);
  int tick_us = static_cast<int>(c.tick.count() / 1000);
  cell.integer("tick_us", tick_us, static_cast<int>(shortest_tick.count() / 1000), 100000);
  c.tick = std::chrono::microseconds{tick_us};
  std::string missed{"skip"};
  cell.choice("missed_ticks", missed, {"skip", "catch_up_once", "reanchor", "stop"});
  c.missed_ticks = missed == "skip"            ? tasks::MissedTickPolicy::skip_keep_phase
                   : missed == "catch_up_once" ? tasks::MissedTickPolicy::catch_up_once
                   : missed == "reanchor"      ? tasks::MissedTickPolicy::reanchor
                                               : tasks::MissedTickPolicy::stop;
  double timeout_s = std::chrono::duration<double>(c.device_timeout).count();
  cell.number("device_timeout_s", timeout_s, 0.1, 3600);
  c.device_timeout = std::chrono::duration_cast<hal::Duration>(std::chrono::duration<double>(timeout_s));
  cell.finish();

  TomlSection plate = file.section("plate");
  plate.number("thickness_mm", c.plate.thickness_mm, 0.5, 200);
  plate.number("table_z_mm", c.plate.table_z_mm, -1e5, 1e5);
  std::array<double, 2> largest{c.plate.largest_x_mm, c.plate.largest_y_mm};
  plate.numbers("largest_mm", largest, 50, 10000);
  c.plate.largest_x_mm = largest[0];
  c.plate.largest_y_mm = largest[1];
  plate.finish();

  TomlSection start = file.section("start");
  std::array<double, 3> centre{c.start.centre.x(), c.start.centre.y(), c.start.centre.z()};
  start.numbers("centre_mm", centre, -1e5, 1e5);
  c.start.centre << centre[0], centre[1], centre[2];
  double yaw_deg = c.start.head_yaw / degree;
  start.number("yaw_deg", yaw_deg, -360, 360);
  c.start.head_yaw = yaw_deg * degree;
  start.finish();

  TomlSection tracking = file.section("tracking");
  tracking.number("overlap_mm", c.tracking_overlap_mm, 2, 500);
  tracking.number("crossing_deg", c.tracking_crossing_deg, 30, 90);
  tracking.number("seek_step_mm", c.seek_step_mm, 5, 1000);
  tracking.number("seek_limit_mm", c.seek_limit_mm, 5, 1e5);
  tracking.finish();

  TomlSection scan = file.section("scan");
  scan.number("overlap_mm", c.scan_overlap_mm, 0, 500);
  scan.number("margin_mm", c.scan_margin_mm, 0, 100);
  scan.finish();

  TomlSection fit = file.section("fit");
  fit.number("finest_span_mm", c.finest_span_mm, 1, 500);
  fit.number("tolerance_mm", c.fit_tolerance_mm, 0, 10);
  fit.finish();
}

// Every key with its value as text, "scanner.mount.zyz_deg" -> "[ 0, 180, 180 ]".
void flatten(const toml::table& table, const std::string& prefix, std::map<std::string, std::string>& into) {
  for (const auto& [key, value] : table) {
    const std::string name = prefix + std::string{key.str()};
    if (const auto* inner = value.as_table()) {
      flatten(*inner, name + ".", into);
      continue;
    }
    std::ostringstream text;
    value.visit([&](const auto& node) { text << node; });
    into[name] = text.str();
  }
}

// What no key can say alone. The error names the line of the first of `keys` that stands in the file: the others have
// their defaults.
std::string impossible(const toml::table& table, const std::string& path,
                       std::initializer_list<std::string_view> keys, std::string_view what) {
  std::string line;
  for (const auto key : keys) {
    const auto node = table.at_path(key);
    if (node && line.empty()) line = fmt::format(":{}", node.node()->source().begin.line);
  }
  return fmt::format("{}{}: {}", path, line, what);
}

std::optional<std::string> check_together(const toml::table& table, const CellConfig& c) {
  const double field = std::min(c.scanner.field_x_mm, c.scanner.field_y_mm);
  if (2 * c.scan_overlap_mm > field) {
    return impossible(
        table, c.path, {"scan.overlap_mm", "scanner.field_mm"},
        fmt::format("[scan] overlap_mm: {} is more than half of [scanner] field_mm", c.scan_overlap_mm));
  }
  // The next field is centred on the boundary's continuation: with more overlap than this the tracker would
  // hardly advance.
  if (2 * c.tracking_overlap_mm > 0.9 * field) {
    return impossible(table, c.path, {"tracking.overlap_mm", "scanner.field_mm"},
                      fmt::format("[tracking] overlap_mm: {} is more than 0.45 of [scanner] field_mm",
                                  c.tracking_overlap_mm));
  }
  const tasks::CellSettings cell = cell_settings(c);
  if (const std::size_t shots = static_cast<std::size_t>(cell.tracker.max_shots) + cell.max_surface_shots;
      shots > tasks::max_shot_number) {
    return impossible(
        table, c.path, {"plate.largest_mm", "scanner.field_mm", "tracking.overlap_mm"},
        fmt::format("[plate] largest_mm: asks for {} shots of this field, a run takes {} at most", shots,
                    tasks::max_shot_number));
  }
  return std::nullopt;
}

}  // namespace

std::string first_difference(const std::string& text, const std::string& other) {
  std::map<std::string, std::string> a, b;
  flatten(toml::parse(text), "", a);
  flatten(toml::parse(other), "", b);
  for (auto* keys : {&a, &b}) {
    for (const char* no_matter : {"cell.name", "cell.device_timeout_s", "scanner.host", "scanner.port",
                                  "robot.device", "robot.baud", "plate.largest_mm"}) {
      keys->erase(no_matter);
    }
    std::erase_if(*keys, [](const auto& key) { return key.first.starts_with("realtime."); });
  }
  for (const auto& [key, value] : a) {
    if (const auto same = b.find(key); same == b.end() || same->second != value) return key;
  }
  for (const auto& [key, value] : b) {
    if (!a.contains(key)) return key;
  }
  return {};
}

CellConfig default_config() {
  CellConfig c;
  c.scanner.tip_from_scanner = mount_from({0, 140, 300}, {0, 180, 180});
  c.start.centre << 500, 0, 10;
  // A SCARA of 800 mm: a limit that is left out must be a limit all the same.
  c.robot.workspace = {.x_mm = {-800, 800},
                       .y_mm = {-800, 800},
                       .z_mm = {200, 600},
                       .reach_mm = {200, 800},
                       .max_step_mm = 1500};
  return c;
}

std::expected<CellConfig, ConfigError> parse_config(const std::string& text, const std::string& path) {
  CellConfig config = default_config();
  config.path = path;
  config.text = text;
  std::optional<std::string> error;
  try {
    const toml::table table = toml::parse(text, path);
    TomlSection file{&table, "", path, error};
    int schema = 1;
    file.integer("schema", schema, 1, 1);
    read_scanner(file.section("scanner"), config.scanner);
    read_robot(file.section("robot"), config.robot);
    read_rest(file, config);
    read_realtime(file.section("realtime"), config.realtime);
    file.finish();
    if (!error) error = check_together(table, config);
  } catch (const toml::parse_error& e) {
    error = fmt::format("{}:{}: {}", path, e.source().begin.line, e.description());
  }
  if (error) return std::unexpected{ConfigError{*error}};
  return config;
}

std::expected<CellConfig, ConfigError> load_config(const std::string& path) {
  std::ifstream file{path};
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) {
    return std::unexpected{
        ConfigError{fmt::format("{}: cannot be read; give the path of a cell configuration", path)}};
  }
  return parse_config(text.str(), path);
}

}  // namespace moldloft::firmware_like
