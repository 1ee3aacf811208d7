#include "firmware_like/config/config.hpp"

#include "firmware_like/config/device_makes.hpp"
#include "firmware_like/config/plate_name.hpp"
#include "firmware_like/config/task_table.hpp"
#include "firmware_like/config/toml_section.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>

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

void read_place(TomlSection& s, LinkConfig& c) {
  s.choice("link", c.link, link_names());
  s.text("host", c.host);
  s.integer("port", c.port, 1, 65535);
  s.text("device", c.device);
  s.integer("baud", c.baud, 1200, 921600);
}

// A make with one encoding only has no such key. Where the make is not known, nothing is said of its encoding.
void read_encoding(TomlSection& s, ScannerConfig& c) {
  const ScannerMake* make = find_scanner_make(c.driver);
  if (make == nullptr) return s.text("encoding", c.encoding);
  c.encoding = make->encodings.empty() ? "" : make->encodings.front();
  if (!make->encodings.empty()) s.choice("encoding", c.encoding, make->encodings);
}

void read_scanner(TomlSection s, ScannerConfig& c) {
  s.choice("driver", c.driver, scanner_names());
  read_place(s, c.place);
  read_encoding(s, c);
  s.integer("max_stripes", c.max_stripes, 1, 1000);
  s.integer("max_points_per_stripe", c.max_points_per_stripe, 8, 4096);
  std::array<double, 2> field{c.field_x_mm, c.field_y_mm};
  s.numbers("field_mm", field, 5, 2000);
  c.field_x_mm = field[0];
  c.field_y_mm = field[1];
  s.number("noise_mm", c.noise_mm, 1e-4, 5);
  s.number("depth_mm", c.depth_mm, 1, 5000);
  TomlSection mount = s.section("mount");
  std::array<double, 3> translation = default_mount_mm, zyz = default_mount_zyz_deg;
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
  s.choice("driver", c.driver, robot_names());
  read_place(s, c.place);
  s.integer("speed_percent", c.speed_percent, 1, 100);
  s.number("repeatability_z_mm", c.repeatability_z_mm, 0, 10);
  s.number("arrival_mm", c.arrival.distance_mm, 0.01, 1000);
  double arrival_deg = c.arrival.turn_rad / degree;
  s.number("arrival_deg", arrival_deg, 0.01, 180);
  c.arrival.turn_rad = arrival_deg * degree;
  TomlSection w = s.section("workspace");
  read_range(w, "x_mm", c.workspace.x_mm);
  read_range(w, "y_mm", c.workspace.y_mm);
  read_range(w, "z_mm", c.workspace.z_mm);
  read_range(w, "reach_mm", c.workspace.reach_mm);
  w.number("parked_mm", c.workspace.parked_mm, 0, 1e5);
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
  cell.label("name", c.name);
  int tick_us = static_cast<int>(c.tick.count() / 1000);
  cell.integer("tick_us", tick_us, static_cast<int>(shortest_tick.count() / 1000),
               static_cast<int>(longest_tick.count() / 1000));
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
  double wait_s = std::chrono::duration<double>(c.scanner_wait).count();
  cell.number("scanner_wait_s", wait_s, 1, 86400);
  c.scanner_wait = std::chrono::duration_cast<hal::Duration>(std::chrono::duration<double>(wait_s));
  double disk_s = std::chrono::duration<double>(c.disk_wait).count();
  cell.number("disk_wait_s", disk_s, 1, 86400);
  c.disk_wait = std::chrono::duration_cast<hal::Duration>(std::chrono::duration<double>(disk_s));
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

  TomlSection audit = file.section("audit");
  audit.number("unseen_percent", c.unseen_percent, 0, 100);
  audit.finish();
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

// Where every key stands. A contradiction between keys is reported with the line of one of them.
void note_lines(const toml::table& table, const std::string& prefix, std::map<std::string, int>& into) {
  for (const auto& [key, value] : table) {
    const std::string name = prefix + std::string{key.str()};
    into.emplace(name, static_cast<int>(value.source().begin.line));
    if (const auto* inner = value.as_table()) note_lines(*inner, name + ".", into);
  }
}

std::string line_at(const std::string& text, int line) {
  std::istringstream lines{text};
  std::string found;
  for (int i = 0; i < line && std::getline(lines, found); ++i) continue;
  if (found.ends_with('\r')) found.pop_back();
  return found;
}

// Whether a line stands for itself: a key with a value that neither begins nor ends something longer. Without such a
// line the rest of the file still means what it meant.
bool stands_alone(std::string_view line) {
  static constexpr std::string_view letters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-. \t";
  const auto equals = line.find_first_not_of(letters);
  if (equals == line.npos) return line.find_first_not_of(" \t\r") != line.npos;  // a word and no value
  const auto count = [&](char c) { return std::ranges::count(line, c); };
  return equals > 0 && line[equals] == '=' && count('[') == count(']') && count('{') == count('}') &&
         line.find("\"\"\"") == line.npos && line.find("'''") == line.npos;
}

// Whether an array or a table that was begun before this line is still open there: what follows is read as its inside.
bool inside_brackets(const std::string& text, int line) {
  std::istringstream lines{text};
  std::string one;
  long open = 0;
  for (int i = 1; i < line && std::getline(lines, one); ++i) {
    char quote = 0;
    for (const char c : one) {
      if (quote != 0)
        quote = c == quote ? 0 : quote;
      else if (c == '"' || c == '\'')
        quote = c;
      else if (c == '#')
        break;
      else
        open += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    }
  }
  return open != 0;
}

// The file with its line `line` empty.
std::string without_line(const std::string& text, int line) {
  std::istringstream lines{text};
  std::string kept, one;
  for (int i = 1; std::getline(lines, one); ++i) kept += (i == line ? "" : one) + "\n";
  return kept;
}

// The first byte that is not UTF-8 makes the parser stop there; people save files in Latin-1 and in UTF-16.
std::optional<ConfigFinding> wrong_encoding(const std::string& text) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    return ConfigFinding{Severity::error, 1, "is UTF-16; save the file as UTF-8", {}};
  const auto at = first_byte_not_utf8(text);
  if (at == text.npos) return {};
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
  return ConfigFinding{Severity::error,
                       static_cast<int>(line),
                       fmt::format("byte 0x{:02X} is not UTF-8; save the file as UTF-8, or write ASCII",
                                   static_cast<unsigned char>(text[at])),
                       {}};
}

// What can be read of a text, and what makes it no TOML. A wrong line that ends by itself is passed over, so
// that the errors after it are found as well. After any other the rest would be misread.
std::optional<toml::table> parsed_table(std::string text, std::vector<ConfigFinding>& findings) {
  constexpr int most_errors = 50;
  for (int errors = 0; errors < most_errors; ++errors) {
    try {
      return toml::parse(text);
    } catch (const toml::parse_error& e) {
      const int line = static_cast<int>(e.source().begin.line);
      findings.push_back({Severity::error, line, std::string{e.description()}, {}});
      if (inside_brackets(text, line) || !stands_alone(line_at(text, line))) return {};
      text = without_line(text, line);
    }
  }
  return {};
}

// A rule that leans on a key whose own value is wrong says nothing.
void add_contradictions(const CellConfig& config, std::vector<ConfigFinding>& findings) {
  const std::vector<ConfigFinding> wrong = findings;
  const auto is_wrong = [&](const std::string& key) {
    return std::ranges::any_of(wrong, [&](const ConfigFinding& f) {
      return !f.keys.empty() && (f.keys.front() == key || key.starts_with(f.keys.front() + "."));
    });
  };
  for (auto& finding : contradictions(config)) {
    if (std::ranges::none_of(finding.keys, is_wrong)) findings.push_back(std::move(finding));
  }
}

}  // namespace

std::string first_difference(const std::string& text, const std::string& other) {
  std::map<std::string, std::string> a, b;
  flatten(toml::parse(text), "", a);
  flatten(toml::parse(other), "", b);
  for (auto* keys : {&a, &b}) {
    for (const char* no_matter :
         {"cell.name", "cell.device_timeout_s", "cell.scanner_wait_s", "cell.disk_wait_s", "robot.arrival_mm",
          "robot.arrival_deg", "robot.workspace.parked_mm", "plate.largest_mm", "audit.unseen_percent"}) {
      keys->erase(no_matter);
    }
    for (const char* section : {"scanner", "robot"})
      for (const char* where : {"link", "host", "port", "device", "baud"})
        keys->erase(fmt::format("{}.{}", section, where));
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
  c.scanner.tip_from_scanner = mount_from(default_mount_mm, default_mount_zyz_deg);
  c.start.centre << 500, 0, 10;
  // The reach of a SCARA of 800 mm: a limit that is left out must still be a limit.
  c.robot.workspace = {.x_mm = {-800, 800},
                       .y_mm = {-800, 800},
                       .z_mm = {200, 600},
                       .reach_mm = {200, 800},
                       .max_step_mm = 1500};
  return c;
}

ExaminedConfig examine_config(const std::string& text, const std::string& path) {
  ExaminedConfig examined{.config = default_config(), .findings = {}};
  CellConfig& config = examined.config;
  config.path = path;
  config.text = text;
  if (auto encoding = wrong_encoding(text)) {
    examined.findings.push_back(std::move(*encoding));
    return examined;
  }
  const auto table = parsed_table(text, examined.findings);
  if (!table) return examined;
  note_lines(*table, "", config.key_lines);
  TomlSection file{&*table, "", examined.findings};
  int schema = 1;
  file.integer("schema", schema, 1, 1);
  read_scanner(file.section("scanner"), config.scanner);
  read_robot(file.section("robot"), config.robot);
  read_rest(file, config);
  read_realtime(file.section("realtime"), config.realtime);
  file.finish();
  add_contradictions(config, examined.findings);
  std::ranges::stable_sort(examined.findings, {}, &ConfigFinding::line);
  return examined;
}

std::expected<CellConfig, ConfigError> parse_config(const std::string& text, const std::string& path) {
  auto examined = examine_config(text, path);
  std::string errors;
  for (const auto& finding : examined.findings) {
    if (finding.severity == Severity::error)
      errors += (errors.empty() ? "" : "\n") + hal::printable(finding_text(path, finding));
  }
  if (!errors.empty()) return std::unexpected{ConfigError{std::move(errors)}};
  return std::move(examined.config);
}

std::expected<std::string, ConfigError> read_config(const std::string& path) {
  constexpr std::size_t longest = 1u << 20;  // a cell is described in a few kilobytes; a device may never end
  const auto refused = [&](std::string_view why) {
    return std::unexpected{
        ConfigError{hal::printable(fmt::format("{}: {}; give the path of a cell configuration", path, why))}};
  };
  std::error_code failed;
  if (std::filesystem::is_directory(path, failed)) return refused("is a directory");
  errno = 0;
  std::ifstream file{path, std::ios::binary};
  if (!file) return refused(fmt::format("cannot be read: {}", strerrordesc_np(errno != 0 ? errno : EIO)));
  std::string text(longest + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return refused("cannot be read");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > longest) return refused("has more than 1 MiB");
  return text;
}

std::expected<CellConfig, ConfigError> load_config(const std::string& path) {
  const auto text = read_config(path);
  if (!text) return std::unexpected{text.error()};
  return parse_config(*text, path);
}

}  // namespace moldloft::firmware_like
