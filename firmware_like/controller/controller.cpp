#include "firmware_like/controller/controller.hpp"

#include "firmware_like/config/cell_settings.hpp"
#include "firmware_like/config/device_makes.hpp"
#include "firmware_like/config/task_table.hpp"

#include <array>
#include <utility>

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;

// A run of missed ticks this long is no hiccup any more: commands would come late by as much.
constexpr std::uint32_t max_misses_in_a_row = 50;

tasks::CellSettings settings_for(const CellConfig& config, const ControllerOptions& options) {
  tasks::CellSettings s = cell_settings(config);
  s.epoch = options.epoch;
  s.devices = options.devices;
  // An operator who can command the cell decides how long it waits for a lost scanner or a full disk.
  if (options.attended) s.scanner_wait = s.disk_wait = hal::Duration::max();
  return s;
}

}  // namespace

Controller::Controller(const CellConfig& config, hal::Clock& clock, hal::ByteLink& scanner_link,
                       hal::ByteLink& robot_link, const ControllerOptions& options)
    : config_{config},
      clock_{clock},
      begin_held_{options.begin_held},
      attended_{options.attended},
      recorder_{recorder_sizes(config), &flight_},
      scanner_link_{scanner_link, hal::LinkId::scanner, recorder_, clock},
      robot_link_{robot_link, hal::LinkId::robot, recorder_, clock},
      scanner_{make_scanner(config.scanner, scanner_link_)},
      robot_{make_robot(config.robot, robot_link_, options.nonce)},
      surface_{surface_settings(config)},
      cell_{settings_for(config, options), *scanner_, *robot_, recorder_, surface_, options.archive},
      receive_scanner_{Row{this, &Controller::receive_scanner}},
      receive_robot_{Row{this, &Controller::receive_robot}},
      transmit_robot_{Row{this, &Controller::transmit_robot}},
      transmit_scanner_{Row{this, &Controller::transmit_scanner}},
      health_{Row{this, &Controller::watch_health}},
      scheduler_{
          clock, {.tick = config.tick, .guard = slack_guard, .missed = config.missed_ticks}, &flight_} {
  const std::array<tasks::Task*, task_table.size()> rows{&receive_scanner_, &receive_robot_,    &cell_,
                                                         &transmit_robot_,  &transmit_scanner_, &health_};
  for (std::size_t i = 0; i < rows.size(); ++i) scheduler_.add(task_table[i], *rows[i]);
  scheduler_.add_background(surface_work, surface_);
}

void Controller::start() {
  cell_.command(begin_held_ ? tasks::CellEvent::start_held : tasks::CellEvent::start);
  scheduler_.start();
}

void Controller::stop_for_good() noexcept {
  dismiss_operator();
  cell_.command(tasks::CellEvent::stop);
}

bool Controller::tick() {
  // The policy `stop` ends what the cell does, not the ticks: the arm has to be told, and the records saved.
  if (!scheduler_.run_tick()) cell_.abort(missed_tick_text());
  if (cell_.state() == tasks::CellState::aborting || cell_.state() == tasks::CellState::aborted)
    report_abort();
  return !at_rest();
}

hal::Message Controller::missed_tick_text() const {
  const auto& miss = scheduler_.last_miss();
  return hal::Message::format(
      "{} ticks missed at {:.3f} s, {} ({}), and missed_ticks is \"stop\": clear when the cell is safe",
      miss.lost, std::chrono::duration<double>(miss.at).count(), tasks::to_string(miss.cause),
      scheduler_.name_of(miss.task));
}

// The flight recorder keeps what led to the first abort.
void Controller::report_abort() {
  if (std::exchange(abort_reported_, true)) return;
  flight_.trigger(hal::FlightCause::abort, tasks::Scheduler::no_task, clock_.now());
}

// The clock is read once more only in the tick that sends what a frame has decided.
void Controller::transmit_robot(hal::Instant now) {
  robot_->transmit(now);
  if (cell_.waits_for_sending()) cell_.commands_sent(clock_.now());
}

// A cell that waits for a person ends this run of the program, unless a person can command it. why() says
// what to do. What was measured leads to the same end each time, whoever is there, and a memory plan is made
// at the start.
bool Controller::at_rest() const {
  const bool repeats = cell_.cause() >= tasks::HoldCause::plan;
  switch (cell_.state()) {
    case tasks::CellState::complete:
    case tasks::CellState::stopped:
      return true;
    case tasks::CellState::aborted:
      return repeats || !attended_ || dismissed_;
    case tasks::CellState::clearing:
      return dismissed_;
    case tasks::CellState::held:
      return repeats || (cell_.cause() == tasks::HoldCause::person && !attended_);
    default:
      return false;
  }
}

void Controller::watch_health(hal::Instant) {
  if (scheduler_.misses_in_a_row() <= max_misses_in_a_row) return;
  cell_.abort(hal::Message::format(
      "{} ticks in a row came too late (last cause: {}): give the controller a core of its own",
      scheduler_.misses_in_a_row(), scheduler_.name_of(scheduler_.last_miss().task)));
}

MemoryPlan Controller::memory() const {
  const auto fixed = [](const char* name, std::size_t bytes) { return MemoryItem{name, bytes, bytes}; };
  return {
      {"recorder rings", recorder_.plan_bytes(), recorder_.high_water_bytes()},
      fixed("scanner driver", scanner_->plan_bytes()),
      fixed("robot driver", robot_->plan_bytes()),
      fixed("cell and tracker", cell_.plan_bytes()),
      fixed("outline", surface_.outline_bytes()),
      {"boundary reserve", surface_.reserve_bytes(), surface_.reserve_used_bytes()},
      fixed("surface fit", surface_.fit_bytes()),
      fixed("scheduler", sizeof(tasks::Scheduler)),
      fixed("flight recorder", flight_.plan_bytes()),
  };
}

}  // namespace moldloft::firmware_like
