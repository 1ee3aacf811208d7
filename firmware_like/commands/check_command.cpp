#include "firmware_like/commands/check_command.hpp"

#include "firmware_like/controller/cell_claim.hpp"
#include "firmware_like/controller/controller.hpp"
#include "firmware_like/controller/device_check.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/realtime/control_thread.hpp"
#include "firmware_like/realtime/environment.hpp"
#include "hal/links/cable.hpp"
#include "hal/links/serial_link.hpp"
#include "hal/links/tcp_link.hpp"
#include "tasks/planning/tool_pose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <random>
#include <sys/stat.h>
#include <unistd.h>

namespace moldloft::firmware_like {
namespace {

constexpr double mib = 1 << 20;

// What the check says, counted: the last line and the exit code follow from it.
struct Findings {
  std::string path;
  int errors = 0, warnings = 0;

  void tell(const ConfigFinding& finding) {
    ConfigFinding told = finding;
    const bool wrong = finding.severity == Severity::error;
    ++(wrong ? errors : warnings);
    if (!wrong) told.what = "warning: " + told.what;
    say(fmt::format("{}\n", finding_text(path, told)));
  }
  void tell(Severity severity, const CellConfig& config, const std::string& key, const std::string& what) {
    const auto line = config.key_lines.find(key);
    tell({severity, line == config.key_lines.end() ? 0 : line->second, what, {}});
  }
};

// What a section says of its device's place, and this machine does not have.
void look_for(const std::string& section, const LinkConfig& place, const ExaminedConfig& examined,
              Findings& findings) {
  const std::string name = key_of_place(place), key = section + "." + name;
  const bool is_wrong = std::ranges::any_of(examined.findings, [&](const ConfigFinding& f) {
    return f.severity == Severity::error && !f.keys.empty() && f.keys.front() == key;
  });
  if (is_wrong) return;
  const auto wrong = [&](const std::string& why) {
    findings.tell(Severity::error, examined.config, key, fmt::format("[{}] {}: {}", section, name, why));
  };
  if (place.link == "tcp") {
    if (!hal::is_known_host(place.host))
      wrong(fmt::format("'{}' is neither an address nor a name in /etc/hosts; write the address in numbers",
                        place.host));
    return;
  }
  const std::string& device = place.device;
  struct stat about {};
  if (::stat(device.c_str(), &about) != 0)
    wrong(errno == ENOENT ? fmt::format("{} does not exist; is the {}'s cable plugged in, is the name right?",
                                        device, section)
                          : fmt::format("{} cannot be looked at: {}", device, strerrordesc_np(errno)));
  else if (!S_ISCHR(about.st_mode))
    wrong(device + " is no serial port");
  else if (::access(device.c_str(), R_OK | W_OK) != 0)
    wrong(device + " gives this user no permission; join the group that owns it (often dialout)");
}

void look_at_machine(const ExaminedConfig& examined, Findings& findings) {
  look_for("scanner", examined.config.scanner.place, examined, findings);
  look_for("robot", examined.config.robot.place, examined, findings);
}

double available_mib() {
  std::ifstream file{"/proc/meminfo"};
  for (std::string key; file >> key;) {
    double kib = 0;
    if (key == "MemAvailable:" && file >> kib) return kib / 1024;
  }
  return 0;
}

void print_memory(const CellConfig& c, Findings& findings) {
  MemoryPlan plan;
  try {
    hal::VirtualClock clock;
    hal::Cable none{clock, {}};
    plan =
        std::make_unique<Controller>(c, clock, none.host(), none.host(), ControllerOptions{.devices = false})
            ->memory();
  } catch (const std::bad_alloc&) {
    return findings.tell(Severity::error, c, "plate.largest_mm",
                         "[plate] largest_mm: the memory plan is larger than what this machine has");
  }
  show(fmt::format("memory plan\n"));
  for (const auto& item : plan)
    show(fmt::format("  {:<22}{:>10.1f} MiB\n", item.subsystem, static_cast<double>(item.plan_bytes) / mib));
  const double total = static_cast<double>(total_plan(plan)) / mib, there = available_mib();
  show(fmt::format("  {:<22}{:>10.1f} MiB of {:.0f} available\n", "in all", total, there));
  if (there > 0 && total > there)
    findings.tell(Severity::warning, c, "plate.largest_mm",
                  fmt::format("[plate] largest_mm: the memory plan asks for {:.0f} MiB, {:.0f} are available",
                              total, there));
}

void print_limits(const CellConfig& c) {
  const auto& w = c.robot.workspace;
  const auto range = [](const tasks::Range& r) { return fmt::format("{:g} to {:g} mm", r.min, r.max); };
  const hal::Pose tip = tasks::tip_pose_for(c.start, c.scanner.tip_from_scanner);
  show(fmt::format(
      "limits\n  tip x                 {}\n  tip y                 {}\n  tip z                 {}\n",
      range(w.x_mm), range(w.y_mm), range(w.z_mm)));
  show(fmt::format("  reach                 {}\n  longest step          {:g} mm\n", range(w.reach_mm),
                   w.max_step_mm));
  show(fmt::format("  speed                 {} % of at most {} %\n", c.robot.speed_percent,
                   w.max_speed_percent));
  show(fmt::format("  largest plate         {:g} x {:g} mm\n", c.plate.largest_x_mm, c.plate.largest_y_mm));
  show(fmt::format("  start                 looks at {:g} {:g} {:g} mm, tip at {:.1f} {:.1f} {:.1f} mm\n",
                   c.start.centre.x(), c.start.centre.y(), c.start.centre.z(), tip.x_mm, tip.y_mm, tip.z_mm));
}

// Asked for as a run would, and given back at once.
void print_setup(const CellConfig& c) {
  SetupRows rows;
  {
    const ProcessSetup process{c.realtime};
    const ControlThread control{c.realtime, [] {}};
    rows = process.rows();
    std::ranges::copy(control.setup(), std::back_inserter(rows));
  }
  show(fmt::format("real-time set-up\n"));
  for (const auto& row : rows)
    show(fmt::format(
        "  {:<22}{}{}\n", to_string(row.item), row.got,
        row.ok ? "" : fmt::format("; not got: {}{}{}", row.wanted, row.hint.empty() ? "" : ": ", row.hint)));
  const Verdict verdict = verdict_on(read_environment(c.realtime.cpu), rows, c.realtime);
  show(fmt::format("  {:<22}{}\n", "timing figures",
                   verdict.representative ? "representative" : "not representative: " + verdict.why()));
}

void print_devices(const CellConfig& c, Findings& findings) {
  const auto claim = claim_cell(c);
  if (!claim) return findings.tell({Severity::error, 0, claim.error(), {}});
  hal::SteadyClock clock;
  const auto scanner = make_link(c.scanner.place), robot = make_link(c.robot.place);
  std::random_device any;
  const auto reports = try_devices(c, clock, *scanner, *robot, any() | 1u);
  show(fmt::format("devices\n"));
  const auto show_device = [&](const char* name, const LinkConfig& place, const DeviceReport& report) {
    const std::string where = place_of(place), key = fmt::format("{}.{}", name, key_of_place(place));
    if (report.ok)
      show(fmt::format("  {:<22}{}\n", name, report.text));
    else
      findings.tell(Severity::error, c, key, fmt::format("{} ({}): {}", name, where, report.text));
    for (const auto& warning : report.warnings) findings.tell({Severity::warning, 0, warning, {}});
  };
  show_device("scanner", c.scanner.place, reports.scanner);
  show_device("robot", c.robot.place, reports.robot);
}

std::string counted(int n, const char* what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

}  // namespace

int check_cell(const CheckOptions& options) {
  const auto text = read_config(options.config);
  if (!text) return complain(text.error().what);
  const ExaminedConfig examined = examine_config(*text, options.config);
  Findings findings{.path = options.config};
  for (const auto& finding : examined.findings) findings.tell(finding);
  const bool readable = findings.errors == 0;
  look_at_machine(examined, findings);
  if (readable) {
    print_memory(examined.config, findings);
    print_limits(examined.config);
    print_setup(examined.config);
  }
  if (readable && options.connect) print_devices(examined.config, findings);
  if (!readable && options.connect)
    say(fmt::format("{}: not connected before its errors are mended\n", options.config));
  flush_shown();
  const std::string verdict = fmt::format("{}: {}, {}\n", options.config,
                                          findings.errors > 0 ? counted(findings.errors, "error") : "good",
                                          counted(findings.warnings, "warning"));
  findings.errors > 0 ? say(verdict) : show(verdict);
  return findings.errors > 0 ? exit_failed : exit_done;
}

}  // namespace moldloft::firmware_like
