#include "firmware_like/config/config.hpp"

#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <vector>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

std::vector<std::string> example_lines() {
  std::ifstream file{MOLDLOFT_SOURCE_DIR "/firmware_like/cell.example.toml"};
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  REQUIRE(lines.size() > 40);
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const auto& line : lines) text += line + "\n";
  return text;
}

CellConfig parsed(const std::string& text) {
  const auto config = parse_config(text, "cell.toml");
  REQUIRE_MESSAGE(config.has_value(), config.error().what);
  return *config;
}

std::string refusal(const std::string& text) {
  const auto config = parse_config(text, "cell.toml");
  return config ? "" : config.error().what;
}

// Every value of a configuration, so that two can be compared and no key can be read into nothing.
std::string values(const CellConfig& c) {
  std::string mount;
  for (int i = 0; i < 16; ++i)
    mount += fmt::format("{:.12f} ", c.scanner.tip_from_scanner.matrix()(i / 4, i % 4));
  const auto range = [](const tasks::Range& r) { return fmt::format("{}..{}", r.min, r.max); };
  const auto& s = c.scanner;
  const auto& w = c.robot.workspace;
  return fmt::format("{} {} {} {} ", c.name, c.tick.count(), static_cast<int>(c.missed_ticks),
                     c.device_timeout.count()) +
         fmt::format("{} {} {} {:.9f} ", c.scanner_wait.count(), c.disk_wait.count(),
                     c.robot.arrival.distance_mm, c.robot.arrival.turn_rad) +
         fmt::format("{} {} {} {} {} {} {} {} {} {} {} ", s.driver, s.place.link + s.place.host, s.place.port,
                     s.encoding, s.max_stripes, s.max_points_per_stripe, s.field_x_mm, s.field_y_mm,
                     s.noise_mm, s.depth_mm, mount) +
         fmt::format("{} {} {} {} {} ", c.robot.driver, c.robot.place.link + c.robot.place.device,
                     c.robot.place.baud, c.robot.speed_percent, c.robot.repeatability_z_mm) +
         fmt::format("{} {} {} {} {} {} {} ", range(w.x_mm), range(w.y_mm), range(w.z_mm), range(w.reach_mm),
                     w.parked_mm, w.max_step_mm, w.max_speed_percent) +
         fmt::format("{} {} {} {} ", c.plate.table_z_mm, c.plate.thickness_mm, c.plate.largest_x_mm,
                     c.plate.largest_y_mm) +
         fmt::format("{} {} {} {:.9f} ", c.start.centre.x(), c.start.centre.y(), c.start.centre.z(),
                     c.start.head_yaw) +
         fmt::format("{} {} {} {} ", c.tracking_overlap_mm, c.tracking_crossing_deg, c.seek_step_mm,
                     c.seek_limit_mm) +
         fmt::format("{} {} {} {} {} ", c.scan_overlap_mm, c.scan_margin_mm, c.unseen_percent,
                     c.finest_span_mm, c.fit_tolerance_mm) +
         fmt::format("{} {} {} {} {}", c.realtime.lock_memory, c.realtime.heap_reserve_mib,
                     c.realtime.priority, c.realtime.cpu, c.realtime.cpu_latency_us);
}

std::string key_of(const std::string& line) { return line.substr(0, line.find(' ')); }
bool is_key(const std::string& line) {
  return !line.empty() && line[0] != '#' && line[0] != '[' && line.find('=') != std::string::npos;
}

// Another value of the same kind that every key takes.
std::string changed(const std::string& line) {
  static const std::vector<std::pair<std::string, std::string>> other = {{"name", "\"port side\""},
                                                                         {"tick_us", "2000"},
                                                                         {"missed_ticks", "\"stop\""},
                                                                         {"device_timeout_s", "2.5"},
                                                                         {"scanner_wait_s", "60"},
                                                                         {"disk_wait_s", "61"},
                                                                         {"arrival_mm", "1"},
                                                                         {"arrival_deg", "0.5"},
                                                                         {"host", "\"10.0.0.7\""},
                                                                         {"port", "4015"},
                                                                         {"encoding", "\"float32\""},
                                                                         {"max_stripes", "90"},
                                                                         {"max_points_per_stripe", "400"},
                                                                         {"field_mm", "[110, 120]"},
                                                                         {"noise_mm", "0.06"},
                                                                         {"depth_mm", "70"},
                                                                         {"translation_mm", "[1, 141, 301]"},
                                                                         {"zyz_deg", "[1, 180, 181]"},
                                                                         {"device", "\"/dev/ttyUSB0\""},
                                                                         {"baud", "9600"},
                                                                         {"speed_percent", "50"},
                                                                         {"repeatability_z_mm", "0.02"},
                                                                         {"x_mm", "[-700, 700]"},
                                                                         {"y_mm", "[-700, 700]"},
                                                                         {"z_mm", "[250, 550]"},
                                                                         {"reach_mm", "[210, 790]"},
                                                                         {"parked_mm", "100"},
                                                                         {"max_step_mm", "1400"},
                                                                         {"max_speed_percent", "90"},
                                                                         {"thickness_mm", "8"},
                                                                         {"table_z_mm", "-1.5"},
                                                                         {"largest_mm", "[600, 700]"},
                                                                         {"centre_mm", "[501, 1, 11]"},
                                                                         {"yaw_deg", "30"},
                                                                         {"overlap_mm", "12"},
                                                                         {"crossing_deg", "50"},
                                                                         {"seek_step_mm", "60"},
                                                                         {"seek_limit_mm", "2000"},
                                                                         {"margin_mm", "3"},
                                                                         {"finest_span_mm", "12"},
                                                                         {"tolerance_mm", "0.01"},
                                                                         {"unseen_percent", "3"},
                                                                         {"lock_memory", "false"},
                                                                         {"heap_reserve_mib", "8"},
                                                                         {"priority", "49"},
                                                                         {"cpu", "0"},
                                                                         {"cpu_latency_us", "-1"}};
  if (key_of(line) == "link")
    return !line.starts_with("link = \"tcp\"") ? "link = \"tcp\""
                                               : "link = \"serial\"\ndevice = \"/dev/ttyS9\"";
  for (const auto& [key, value] : other) {
    if (key == key_of(line)) return key + " = " + value;
  }
  return {};
}

}  // namespace

TEST_CASE("the example is accepted, and every value in it is the default") {
  const auto lines = example_lines();
  CHECK(values(parsed(joined(lines))) == values(default_config()));
  CHECK(values(parsed("")) == values(default_config()));
}

TEST_CASE("every key of the example is read: another value makes another configuration") {
  const auto lines = example_lines();
  const std::string before = values(default_config());
  int keys = 0, fixed = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!is_key(lines[i])) continue;
    CAPTURE(lines[i]);
    ++keys;
    auto other = lines;
    other[i] = changed(lines[i]);
    // A limit below the speed is refused: the speed goes down with it.
    if (key_of(lines[i]) == "max_speed_percent")
      std::ranges::find_if(other, [](const auto& l) {
        return l.starts_with("speed_percent");
      })->replace(0, 19, "speed_percent = 90");
    if (other[i].empty()) {
      ++fixed;  // schema and the two drivers know one value each
      continue;
    }
    CHECK(values(parsed(joined(other))) != before);
    other = lines;
    other.erase(other.begin() + static_cast<std::ptrdiff_t>(i));
    CHECK(values(parsed(joined(other))) == before);
  }
  CHECK(keys == 53);
  CHECK(fixed == 3);
}

TEST_CASE("the mount is Rz Ry Rz and then the translation") {
  const auto mount = parsed(
                         "[scanner.mount]\ntranslation_mm = [1, 2, 3]\nzyz_deg = [90, 90, "
                         "0]\n[robot.workspace]\nz_mm = [0, 600]")
                         .scanner.tip_from_scanner;
  CHECK((mount * Eigen::Vector3d{0, 0, 0} - Eigen::Vector3d{1, 2, 3}).norm() < 1e-12);
  // The scanner's z is turned by 90 degrees about y to x, then about z to y.
  CHECK((mount.linear() * Eigen::Vector3d{0, 0, 1} - Eigen::Vector3d{0, 1, 0}).norm() < 1e-12);
  CHECK((mount.linear() * Eigen::Vector3d{0, 1, 0} - Eigen::Vector3d{-1, 0, 0}).norm() < 1e-12);
}

TEST_CASE("what is wrong is told in one line with file, line, key and what is allowed") {
  CHECK(refusal("[robot]\n\nbauds = 9600\n") ==
        "cell.toml:3: [robot] bauds: unknown key; known here: arrival_deg, arrival_mm, baud, device, driver, "
        "host, link, port, "
        "repeatability_z_mm, speed_percent, workspace");
  CHECK(refusal("\nrobots = 1\n") ==
        "cell.toml:2: robots: unknown key; known here: audit, cell, fit, plate, realtime, robot, scan, "
        "scanner, "
        "schema, "
        "start, tracking");
  CHECK(refusal("[scanner.mount]\nx = 1\n") ==
        "cell.toml:2: [scanner.mount] x: unknown key; known here: translation_mm, zyz_deg");
  CHECK(refusal("[scanner]\nport = 4014.5\n") == "cell.toml:2: [scanner] port: a whole number is wanted");
  CHECK(refusal("[scanner]\nport = \"4014\"\n") == "cell.toml:2: [scanner] port: a whole number is wanted");
  CHECK(refusal("[scanner]\nport = 70000\n") == "cell.toml:2: [scanner] port: 70000 is outside 1 to 65535");
  CHECK(refusal("[scanner]\nhost = 7\n") == "cell.toml:2: [scanner] host: a text in quotes is wanted");
  CHECK(refusal("[scanner]\nencoding = \"int8\"\n") ==
        "cell.toml:2: [scanner] encoding: 'int8' is not one of: int16, float32");
  CHECK(refusal("[scanner]\nfield_mm = [102]\n") ==
        "cell.toml:2: [scanner] field_mm: an array of 2 numbers is wanted");
  CHECK(refusal("[scanner]\nfield_mm = [102, \"102\"]\n") ==
        "cell.toml:2: [scanner] field_mm: an array of 2 numbers is wanted");
  CHECK(refusal("[scanner]\nfield_mm = [102, 1]\n") ==
        "cell.toml:2: [scanner] field_mm: 1 is outside 5 to 2000");
  CHECK(refusal("[plate]\nthickness_mm = -6\n") ==
        "cell.toml:2: [plate] thickness_mm: -6 is outside 0.5 to 200");
  CHECK(refusal("[plate]\nthickness_mm = nan\n") ==
        "cell.toml:2: [plate] thickness_mm: nan is outside 0.5 to 200");
  CHECK(refusal("[plate]\nthickness_mm = true\n") == "cell.toml:2: [plate] thickness_mm: a number is wanted");
  CHECK(refusal("[realtime]\nlock_memory = 1\n") ==
        "cell.toml:2: [realtime] lock_memory: true or false is wanted");
  CHECK(refusal("[realtime]\npriority = 99\n") == "cell.toml:2: [realtime] priority: 99 is outside 0 to 98");
  CHECK(refusal("schema = 2\n") == "cell.toml:1: schema: 2 is outside 1 to 1");
  CHECK(refusal("scanner = 3\n") == "cell.toml:1: scanner: a table is wanted");
  CHECK(refusal("[scanner]\nmount = [0, 140, 300]\n") == "cell.toml:2: [scanner] mount: a table is wanted");
  CHECK(refusal("[robot.workspace]\nz_mm = [600, 200]\n") ==
        "cell.toml:2: [robot.workspace] z_mm: from 600 to 200 is no range: the smaller number comes first");
}

TEST_CASE("values that are possible alone but not together are told with the line that has one of them") {
  CHECK(refusal("[scan]\noverlap_mm = 60\n") ==
        "cell.toml:2: [scan] overlap_mm: 60 is more than half of [scanner] field_mm");
  CHECK(refusal("[scanner]\nfield_mm = [18, 18]\n") ==
        "cell.toml:2: [scan] overlap_mm: 10 is more than half of [scanner] field_mm\n"
        "cell.toml:2: [tracking] overlap_mm: 45 is more than 0.45 of [scanner] field_mm");
  CHECK(refusal("[tracking]\noverlap_mm = 50\n") ==
        "cell.toml:2: [tracking] overlap_mm: 50 is more than 0.45 of [scanner] field_mm");
  CHECK(refusal("[scanner]\nfield_mm = [80, 80]\n") ==
        "cell.toml:2: [tracking] overlap_mm: 45 is more than 0.45 of [scanner] field_mm");
  CHECK(refusal("\n[plate]\nlargest_mm = [6000, 6000]\n")
            .starts_with("cell.toml:3: [plate] largest_mm: asks for "));
}

TEST_CASE("a file that is not TOML is refused with its line, in one line") {
  for (const char* text : {"schema = 1\n[cell\n", "schema = 1\nname name\n", "schema = 1\nschema = 1\n",
                           "x = \"\n", "\x89PNG\r\n\x1a\n"}) {
    const std::string why = refusal(text);
    CAPTURE(why);
    CHECK(why.starts_with("cell.toml:"));
    CHECK(why.find('\n') == std::string::npos);
  }
  CHECK(refusal("schema = 1\n[cell\n").starts_with("cell.toml:2: "));
}

TEST_CASE("a text that cannot be shown on one line, or is too long for a path, is refused by its key") {
  CHECK(refusal("[scanner]\nhost = \"a\\nb\"\n") ==
        "cell.toml:2: [scanner] host: holds a control character: write it without");
  CHECK(refusal("[robot]\ndevice = \"/dev/tty\\u0000\"\n") ==
        "cell.toml:2: [robot] device: holds a control character: write it without");
  CHECK(refusal("[robot]\ndevice = \"" + std::string(5000, 'x') + "\"\n") ==
        "cell.toml:2: [robot] device: 5000 bytes long; 4095 at most");
  CHECK(refusal("\"a\\u001b[2J\" = 1\n").starts_with("cell.toml:1: a?[2J: unknown key; known here: "));
  // A name is for people alone, and runs of earlier versions may have any: it is made fit to be shown.
  CHECK(parsed("[cell]\nname = \"a\\nb\\u0000\"\n").name == "a b?");
  CHECK(parsed("[cell]\nname = \"" + std::string(5000, 'x') + "\"\n").name == std::string(97, 'x') + "...");
  CHECK(parsed("[cell]\nname = \"Blech Ä 12 <b> 側板\"\n").name == "Blech Ä 12 <b> 側板");
}

TEST_CASE("a configuration is loaded with its path and its text, which the run keeps") {
  const hal::TemporaryFolder folder;
  std::ofstream{folder.file("cell.toml")} << "[cell]\nname = \"loft\"\n";
  const auto config = load_config(folder.file("cell.toml"));
  REQUIRE(config.has_value());
  CHECK(config->path == folder.file("cell.toml"));
  CHECK(config->text == "[cell]\nname = \"loft\"\n");
  CHECK(config->name == "loft");
}

TEST_CASE(
    "two configurations differ where a run would measure otherwise, not in addresses, memory, names and "
    "comments") {
  const std::string text =
      "[scanner]\nport = 4014\nfield_mm = [102, 102]\n[scanner.mount]\nzyz_deg = [0, 180, "
      "180]\n[start]\nyaw_deg = 0\n";
  const auto replaced = [&](const std::string& old, const std::string& by) {
    std::string other = text;
    return other.replace(other.find(old), old.size(), by);
  };
  CHECK(first_difference(text, text) == "");
  CHECK(first_difference(text, replaced("4014", "4015")) == "");
  CHECK(first_difference(
            text, "# at the window\n[cell]\nname = \"b\"\n[robot]\ndevice = \"/dev/ttyS1\"\n" + text) == "");
  CHECK(first_difference(text, "[realtime]\npriority = 20\ncpu = 1\n" + text) == "");
  CHECK(first_difference(text, "[plate]\nlargest_mm = [900, 900]\n" + text) == "");
  CHECK(first_difference(text, "[plate]\nthickness_mm = 9\n" + text) == "plate.thickness_mm");
  CHECK(first_difference(text, replaced("yaw_deg = 0", "yaw_deg = 1")) == "start.yaw_deg");
  CHECK(first_difference(text, replaced("[0, 180, 180]", "[0, 180, 181]")) == "scanner.mount.zyz_deg");
  CHECK(first_difference(text, text + "centre_mm = [1, 2, 3]\n") == "start.centre_mm");
  CHECK(first_difference(text + "centre_mm = [1, 2, 3]\n", text) == "start.centre_mm");
}

TEST_CASE("any device may be reached by any link, and two devices cannot be at one place") {
  const auto robot_over_tcp =
      parse_config("schema = 1\n[robot]\nlink = \"tcp\"\nhost = \"10.0.0.7\"\n", "c.toml");
  REQUIRE_MESSAGE(robot_over_tcp.has_value(), robot_over_tcp.error().what);
  CHECK(place_of(robot_over_tcp->robot.place) == "10.0.0.7:4015");
  CHECK(place_of(robot_over_tcp->scanner.place) == "127.0.0.1:4014");
  const auto scanner_on_a_port =
      parse_config("schema = 1\n[scanner]\nlink = \"serial\"\ndevice = \"/dev/ttyS1\"\n", "c.toml");
  REQUIRE_MESSAGE(scanner_on_a_port.has_value(), scanner_on_a_port.error().what);
  CHECK(place_of(scanner_on_a_port->scanner.place) == "/dev/ttyS1");
  const auto refusal = [](const std::string& text) {
    return parse_config("schema = 1\n" + text, "c.toml").error().what;
  };
  CHECK(refusal("[robot]\nlink = \"tcp\"\nport = 4014\n") ==
        "c.toml:4: [robot] host: 127.0.0.1:4014 is the scanner's too; each device has a place of its own");
  CHECK(refusal("[scanner]\nlink = \"serial\"\n") ==
        "c.toml:3: [robot] device: /dev/ttyS0 is the scanner's too; each device has a place of its own");
  CHECK(refusal("[robot]\nlink = \"tcp\"\nhost = \"\"\n") ==
        "c.toml:4: [robot] host: is empty; write the robot's address");
  CHECK(refusal("[robot]\nlink = \"usb\"\n") == "c.toml:3: [robot] link: 'usb' is not one of: tcp, serial");
  // What does not count is not judged.
  CHECK(parse_config("schema = 1\n[robot]\nhost = \"\"\n", "c.toml").has_value());
  CHECK(first_difference("[robot]\nlink = \"tcp\"\n", "[robot]\nlink = \"serial\"\n") == "");
}
