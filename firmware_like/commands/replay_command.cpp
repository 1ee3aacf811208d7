#include "firmware_like/commands/replay_command.hpp"

#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/report/flight_timeline.hpp"
#include "firmware_like/run/flight_files.hpp"
#include "firmware_like/run/run_folder.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;

int show_timelines(const ReplayOptions& options) {
  const bool is_file = fs::is_regular_file(options.run);
  if (!is_file && !fs::is_directory(options.run))
    return complain(fmt::format("{}: no such run or dump", options.run));
  const std::vector<fs::path> dumps =
      is_file ? std::vector<fs::path>{options.run} : flight_dumps(options.run);
  if (dumps.empty()) {
    show(fmt::format(
        "{}: the flight recorder was never frozen: no overrun, no missed tick, no abort, no crash\n",
        hal::printable(options.run)));
    return exit_done;
  }
  for (const fs::path& path : dumps) {
    const auto dump = hal::read_flight_dump(path);
    if (!dump) return complain(dump.error().what);
    show(fmt::format("{}\n{}\n", hal::printable(path.string()),
                     flight_timeline(*dump, {.ticks_before = options.ticks, .all = options.all_ticks})));
  }
  return exit_done;
}

std::string_view to_string(hal::ShotPurpose purpose) {
  return purpose == hal::ShotPurpose::seek       ? "seek"
         : purpose == hal::ShotPurpose::boundary ? "boundary"
                                                 : "surface";
}

int show_events(const ReplayOptions& options) {
  const auto run = open_run(options.run);
  if (!run) return complain(run.error().what);
  const auto events = run->store->events();
  const auto shots = run->store->shots();
  if (!events) return complain(events.error().what);
  if (!shots) return complain(shots.error().what);

  std::vector<std::pair<hal::Instant, std::string>> lines;
  for (const auto& e : *events) {
    std::string line = fmt::format("{:<8} {:<16}", e.source.view(), e.event.view());
    if (!e.to.empty()) line += fmt::format(" {} -> {}", e.from.view(), e.to.view());
    if (!e.text.empty()) line += fmt::format("  {}", e.text.view());
    lines.emplace_back(e.at, std::move(line));
  }
  for (const auto& s : *shots)
    lines.emplace_back(s.at, fmt::format("{:<8} {} at x {:.1f} y {:.1f} z {:.1f} mm, {} bytes", "frame",
                                         to_string(s.purpose), s.reported.x_mm, s.reported.y_mm,
                                         s.reported.z_mm, s.payload_bytes));
  std::ranges::stable_sort(lines, {}, &std::pair<hal::Instant, std::string>::first);
  for (auto& [at, line] : lines) {
    line.erase(line.find_last_not_of(' ') + 1);
    show(fmt::format("{:>11.3f} s  {}\n", std::chrono::duration<double>(at).count(), line));
  }
  return exit_done;
}

}  // namespace

int replay_run(const ReplayOptions& options) {
  return options.timeline ? show_timelines(options) : show_events(options);
}

}  // namespace moldloft::firmware_like
