#include "host_sim/runs/day.hpp"

#include "firmware_like/config/device_makes.hpp"
#include "firmware_like/controller/controller.hpp"
#include "firmware_like/controller/result_of.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/run/run_folder.hpp"
#include "hal/links/cable.hpp"
#include "host_sim/cell/cell_config.hpp"
#include "host_sim/cell/world_clock.hpp"
#include "host_sim/runs/judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <malloc.h>
#include <unistd.h>

namespace moldloft::host_sim {

using firmware_like::flush_shown;
using firmware_like::say;
using firmware_like::show;
namespace {

namespace fs = std::filesystem;
using firmware_like::Json;

constexpr int ticks_between_drains = 10;
constexpr hal::Duration longest_plate = std::chrono::minutes{10};
constexpr std::size_t heap_tolerance = 64 * 1024;

int entries_of(const char* folder) {
  std::error_code failed;
  int count = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator{folder, failed}) ++count;
  return count;
}

std::size_t resident_bytes() {
  std::ifstream statm{"/proc/self/statm"};
  std::size_t all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

// A folder of the day's own, gone at its end.
struct Scratch {
  Scratch() : path{fs::temp_directory_path() / fmt::format("moldloft-day-{}", ::getpid())} {
    fs::create_directories(path);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  fs::path path;
};

class DayRun {
 public:
  DayRun(const DayOptions& options, const PlateInstance& plate, const firmware_like::CellConfig& config)
      : options_{options},
        plate_{plate},
        config_{config},
        world_{options.cell, plate, scanner_cable_.device(), robot_cable_.device()},
        controller_{std::make_unique<firmware_like::Controller>(config, clock_, scanner_cable_.host(),
                                                                robot_cable_.host())} {
    clock_.carry(world_);
  }

  std::expected<Day, SimError> run() {
    Day day;
    const auto end = hal::Duration{static_cast<std::int64_t>(options_.hours * 3600e9)};
    controller_->start();
    for (int row = 1; row <= options_.rows; ++row) {
      while (clock_.now() < end * row / options_.rows) {
        if (const auto done = one_plate(); !done) return std::unexpected{done.error()};
      }
      day.rows.push_back(row_now());
      if (options_.on_row) options_.on_row(day.rows.back());
    }
    day.flat = std::ranges::all_of(day.rows, [&](const DayRow& r) {
      const DayRow& first = day.rows.front();
      return r.heap_bytes <= first.heap_bytes + heap_tolerance && r.handles == first.handles &&
             r.threads == first.threads && r.recorder_lost == 0 && r.missed == 0 && r.off_beat_ns == 0;
    });
    return day;
  }

 private:
  std::expected<void, SimError> one_plate() {
    const hal::Instant begun = clock_.now();
    const fs::path folder = scratch_.path / fmt::format("plate-{}", plates_ + 1);
    auto run = firmware_like::create_run(folder, config_.text, *firmware_like::make_of(config_.scanner).codec,
                                         firmware_like::RunKind::simulated);
    if (!run) return std::unexpected{SimError{run.error().what}};
    if (plates_ > 0) controller_->cell().command(tasks::CellEvent::start);
    tick();
    while (!controller_->at_rest() && clock_.now() < begun + longest_plate) tick(run->store.get());
    const auto& cell = controller_->cell();
    if (cell.state() != tasks::CellState::complete)
      return std::unexpected{SimError{fmt::format("plate {} at {:.1f} h: {} ({})", plates_ + 1, hours(),
                                                  to_string(cell.state()), cell.why().view())}};
    const auto verdict =
        judge(plate_, controller_->surface().fit().surface(), controller_->surface().outline().corners);
    if (!verdict) return std::unexpected{verdict.error()};
    worst_normal_mm_ = std::max(worst_normal_mm_, verdict->normal_max_mm);
    ++plates_;
    // The plate is taken off and the next put on; the cell stands by and keeps its links alive.
    controller_->cell().command(tasks::CellEvent::reset);
    const hal::Duration every{static_cast<std::int64_t>(options_.every_s * 1e9)};
    do tick(run->store.get());
    while (clock_.now() < begun + every || cell.state() != tasks::CellState::idle);
    controller_->recorder().drain(*run->store);
    recorded_bytes_ += fs::file_size(folder / "run.db");
    run->store.reset();
    fs::remove_all(folder);
    return {};
  }

  void tick(hal::RunStore* store = nullptr) {
    controller_->tick();
    if (++ticks_ % ticks_between_drains == 0 && store != nullptr) controller_->recorder().drain(*store);
  }

  double hours() const {
    return std::chrono::duration<double>(const_cast<WorldClock&>(clock_).now()).count() / 3600;
  }

  DayRow row_now() {
    const auto& scheduler = controller_->scheduler();
    const auto& cell = controller_->cell();
    DayRow row;
    row.hours = hours();
    row.plates = plates_;
    row.ticks = scheduler.ticks();
    row.missed = scheduler.missed_ticks();
    for (const auto purpose : {hal::ShotPurpose::seek, hal::ShotPurpose::boundary, hal::ShotPurpose::surface})
      row.shots += static_cast<std::uint64_t>(cell.shots_taken(purpose));
    row.recorder_lost = controller_->recorder().lost();
    row.recorded_bytes = recorded_bytes_;
    row.off_beat_ns =
        (scheduler.next_tick() - static_cast<std::int64_t>(scheduler.ticks()) * config_.tick).count();
    row.heap_bytes = ::mallinfo2().uordblks + ::mallinfo2().hblkhd;
    row.resident_bytes = resident_bytes();
    row.handles = entries_of("/proc/self/fd");
    row.threads = entries_of("/proc/self/task");
    row.worst_normal_mm = worst_normal_mm_;
    return row;
  }

  const DayOptions& options_;
  const PlateInstance& plate_;
  const firmware_like::CellConfig& config_;
  Scratch scratch_;
  WorldClock clock_;
  hal::Cable scanner_cable_{clock_, {}}, robot_cable_{clock_, {.bytes_per_second = serial_bytes_per_second}};
  SimulatedWorld world_;
  std::unique_ptr<firmware_like::Controller> controller_;
  std::uint64_t plates_ = 0, ticks_ = 0, recorded_bytes_ = 0;
  double worst_normal_mm_ = 0;
};

Json json_of(const Day& day) {
  Json rows = Json::array();
  for (const DayRow& r : day.rows)
    rows.push_back({{"hours", r.hours},
                    {"plates", r.plates},
                    {"ticks", r.ticks},
                    {"missed_ticks", r.missed},
                    {"off_beat_ns", r.off_beat_ns},
                    {"shots", r.shots},
                    {"recorder_lost", r.recorder_lost},
                    {"recorded_bytes", r.recorded_bytes},
                    {"heap_bytes", r.heap_bytes},
                    {"resident_bytes", r.resident_bytes},
                    {"handles", r.handles},
                    {"threads", r.threads},
                    {"worst_normal_mm", r.worst_normal_mm}});
  return {{"flat", day.flat}, {"rows", rows}};
}

}  // namespace

std::expected<Day, SimError> run_day(const DayOptions& options) {
  const auto plate = placed_plate(options.cell);
  if (!plate) return std::unexpected{plate.error()};
  const auto config = firmware_like::parse_config(cell_toml(options.cell, *plate), "simulated cell");
  if (!config) return std::unexpected{SimError{config.error().what}};
  return DayRun{options, *plate, *config}.run();
}

namespace {

void print_head() {
  show(fmt::format("{:>6} {:>7} {:>10} {:>7} {:>8} {:>8} {:>5} {:>10} {:>10} {:>13} {:>8} {:>8} {:>10}\n",
                   "hours", "plates", "ticks", "missed", "off beat", "shots", "lost", "stored MB", "heap KiB",
                   "resident KiB", "handles", "threads", "worst mm"));
}

void print_row(const DayRow& r) {
  show(fmt::format(
      "{:>6.2f} {:>7} {:>10} {:>7} {:>5} ns {:>8} {:>5} {:>10.1f} {:>10} {:>13} {:>8} {:>8} {:>10.4f}\n",
      r.hours, r.plates, r.ticks, r.missed, r.off_beat_ns, r.shots, r.recorder_lost,
      static_cast<double>(r.recorded_bytes) * 1e-6, r.heap_bytes / 1024, r.resident_bytes / 1024, r.handles,
      r.threads, r.worst_normal_mm));
  flush_shown();
}

}  // namespace

int show_day(const DayOptions& asked) {
  DayOptions options = asked;
  if (!options.json) {
    print_head();
    options.on_row = print_row;
  }
  const auto day = run_day(options);
  if (!day) {
    say(fmt::format("moldloft-sim day: {}\n", day.error().what));
    return 1;
  }
  if (options.json) {
    show(fmt::format("{}\n", firmware_like::json_text(json_of(*day), 2)));
  } else {
    show(fmt::format("{}\n",
                     day->flat
                         ? "flat: heap, handles and threads as after the first row, nothing lost, on the beat"
                         : "NOT flat"));
  }
  return day->flat ? 0 : 1;
}

}  // namespace moldloft::host_sim
