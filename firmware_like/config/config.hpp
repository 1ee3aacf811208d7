// The cell's configuration: one TOML file a cell, every key explained in cell.example.toml beside this file.
//
// Strict on purpose, because a misspelt limit that silently keeps its default is how arms meet plates. An
// unknown key, a wrong type, an impossible value or a contradiction gives one line with file, line, key and
// what is allowed.
#pragma once

#include "firmware_like/config/config_rules.hpp"
#include "firmware_like/config/device_links.hpp"
#include "firmware_like/config/realtime_config.hpp"
#include "tasks/cell/cell.hpp"

#include <array>
#include <expected>
#include <map>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

// Where the scanner sits on the robot's tip unless the configuration says otherwise: 140 mm off the flange,
// turned by half a turn.
inline constexpr std::array<double, 3> default_mount_mm{0, 140, 300}, default_mount_zyz_deg{0, 180, 180};

// TCP ports of the makes that are meant where nothing is said (hal/PROTOCOLS.md).
inline constexpr int default_scanner_port = 4014, default_robot_port = 4015;

struct ConfigError {
  std::string what;  // "cell.toml:12: [robot] baud: ...", a line for each error
};

struct ScannerConfig {
  std::string driver = "psc1";
  LinkConfig place{.link = "tcp", .port = default_scanner_port};
  std::string encoding = "int16";  // of the points on the link: one of its make's words (device_makes.hpp)
  int max_stripes = 100;
  int max_points_per_stripe = 500;
  double field_x_mm = 102, field_y_mm = 102;
  double noise_mm = 0.051;
  double depth_mm = 60;                    // z is measured within +-this
  geometry::RigidMotion tip_from_scanner;  // the mount
};

struct RobotConfig {
  std::string driver = "line";
  LinkConfig place{.link = "serial", .port = default_robot_port};
  int speed_percent = 100;
  double repeatability_z_mm = 0.013;
  tasks::Workspace workspace;
  tasks::Arrival arrival;
};

struct PlateConfig {
  double table_z_mm = 0;  // what the plate lies on
  double thickness_mm = 6;
  double largest_x_mm = 500, largest_y_mm = 500;  // the memory plan is made for this
};

struct CellConfig {
  std::string path, text;                // where it came from and as it stood there; kept in the run store
  std::map<std::string, int> key_lines;  // "robot.baud" -> 12, of the keys that stand there
  std::string name = "cell";
  hal::Duration tick = std::chrono::milliseconds{1};
  tasks::MissedTickPolicy missed_ticks = tasks::MissedTickPolicy::skip_keep_phase;
  hal::Duration device_timeout = std::chrono::seconds{10};
  hal::Duration scanner_wait = std::chrono::seconds{300};  // long enough for a scanner to boot, twice
  hal::Duration disk_wait =
      std::chrono::seconds{600};  // long enough for a person to find what can be deleted
  ScannerConfig scanner;
  RobotConfig robot;
  PlateConfig plate;
  tasks::ShotPlace start;
  double tracking_overlap_mm = 45;
  double tracking_crossing_deg = 45;
  double seek_step_mm = 70;
  double seek_limit_mm = 3000;
  double scan_overlap_mm = 10;
  double scan_margin_mm = 2;
  double finest_span_mm = 10;  // of the surface's net
  double fit_tolerance_mm = 0.005;
  double unseen_percent = 2;  // of the plate's area; a result of which more was not seen is not trusted
  RealtimeConfig realtime;
};

CellConfig default_config();
std::expected<CellConfig, ConfigError> load_config(const std::string& path);

// All errors of a text and all that looks like a slip, by line. The configuration holds the values that
// could be read.
struct ExaminedConfig {
  CellConfig config;
  std::vector<ConfigFinding> findings;
};
ExaminedConfig examine_config(const std::string& text, const std::string& path);
std::expected<std::string, ConfigError> read_config(const std::string& path);  // the file's text
std::expected<CellConfig, ConfigError> parse_config(const std::string& text, const std::string& path);

// The first key whose value differs between two configurations and would make a run measure differently
// ("start.yaw_deg"); empty when there is none. Places of devices, real-time settings, the memory plan, names
// and comments make no difference.
std::string first_difference(const std::string& text, const std::string& other);

}  // namespace moldloft::firmware_like
