#include "firmware_like/controller.hpp"

#include "firmware_like/drivers.hpp"

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;

// A run of missed ticks this long is no hiccup any more: commands would come late by as much.
constexpr std::uint32_t max_misses_in_a_row = 50;

tasks::CellSettings settings_for(const CellConfig& config, const ControllerOptions& options) {
  tasks::CellSettings s = cell_settings(config);
  s.epoch = options.epoch;
  s.devices = options.devices;
  return s;
}

// A frame of float32 points with intensity and its tables.
std::size_t largest_frame(const CellConfig& c) {
  const auto points = static_cast<std::size_t>(c.scanner.max_stripes) *
                      static_cast<std::size_t>(c.scanner.max_points_per_stripe);
  const std::size_t bytes_a_point = c.scanner.encoding == hal::psc1::Encoding::int16 ? 7 : 13;
  return points * bytes_a_point + static_cast<std::size_t>(c.scanner.max_stripes) * 16 + 4096;
}

hal::Recorder::Sizes recorder_sizes(const CellConfig& c) {
  hal::Recorder::Sizes sizes;
  sizes.largest_frame_bytes = largest_frame(c);
  // Four frames: a disk may stand still for three shots before the cell has to wait for it.
  sizes.bulk_bytes = 4 * (sizes.largest_frame_bytes + sizes.largest_frame_bytes / 16);
  return sizes;
}

}  // namespace

Controller::Controller(const CellConfig& config, hal::Clock& clock, hal::ByteLink& scanner_link,
                       hal::ByteLink& robot_link, const ControllerOptions& options)
    : config_{config},
      recorder_{recorder_sizes(config)},
      scanner_link_{scanner_link, hal::LinkId::scanner, recorder_, clock},
      robot_link_{robot_link, hal::LinkId::robot, recorder_, clock},
      scanner_{make_scanner(config.scanner, scanner_link_)},
      robot_{make_robot(config.robot, robot_link_)},
      surface_{surface_settings(config)},
      cell_{settings_for(config, options), clock, *scanner_, *robot_, recorder_, surface_, options.archive},
      receive_scanner_{Row{this, &Controller::receive_scanner}},
      receive_robot_{Row{this, &Controller::receive_robot}},
      transmit_robot_{Row{this, &Controller::transmit_robot}},
      transmit_scanner_{Row{this, &Controller::transmit_scanner}},
      health_{Row{this, &Controller::watch_health}},
      scheduler_{clock, {.tick = config.tick}} {
  // The order of the rows is the order in a tick: bytes in, decide, bytes out, look after ourselves.
  scheduler_.add({.name = "scanner in", .budget = 200us}, receive_scanner_);
  scheduler_.add({.name = "robot in", .budget = 50us}, receive_robot_);
  scheduler_.add({.name = "cell", .budget = 300us}, cell_);
  scheduler_.add({.name = "robot out", .budget = 50us}, transmit_robot_);
  scheduler_.add({.name = "scanner out", .budget = 50us}, transmit_scanner_);
  scheduler_.add(
      {.name = "health", .period_ticks = 100, .budget = 20us, .criticality = tasks::Criticality::ordinary},
      health_);
  scheduler_.add_background({.name = "surface", .quantum = 200us}, surface_);
}

void Controller::start() {
  cell_.command(tasks::CellEvent::start);
  scheduler_.start();
}

bool Controller::tick() { return scheduler_.run_tick() && !at_rest(); }

// A cell that holds for a person has come to rest as far as one run of the program goes: what to do is in why().
bool Controller::at_rest() const {
  switch (cell_.state()) {
    case tasks::CellState::complete:
    case tasks::CellState::stopped:
    case tasks::CellState::aborted:
      return true;
    case tasks::CellState::held:
      return cell_.cause() == tasks::HoldCause::person || cell_.cause() == tasks::HoldCause::measurement;
    default:
      return false;
  }
}

void Controller::watch_health(hal::Instant) {
  if (scheduler_.misses_in_a_row() <= max_misses_in_a_row) return;
  cell_.abort(hal::Message::format(
      "{} ticks in a row came too late (last cause: {}): give the controller a core of its own",
      scheduler_.misses_in_a_row(), scheduler_.name_of(scheduler_.last_miss_cause())));
}

MemoryPlan Controller::memory() const {
  const auto fixed = [](const char* name, std::size_t bytes) { return MemoryItem{name, bytes, bytes}; };
  return {
      {"recorder rings", recorder_.plan_bytes(), recorder_.high_water_bytes()},
      fixed("cell and tracker", cell_.plan_bytes()),
      fixed("outline", surface_.outline_bytes()),
      {"boundary reserve", surface_.reserve_bytes(), surface_.reserve_used_bytes()},
      fixed("surface fit", surface_.fit_bytes()),
      fixed("scheduler", sizeof(tasks::Scheduler)),
  };
}

}  // namespace moldloft::firmware_like
