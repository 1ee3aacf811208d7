#include "firmware_like/display.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "firmware_like/console.hpp"
#include "firmware_like/stop_signals.hpp"

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;
constexpr auto display_period = 100ms;

}  // namespace

std::string progress_line(const tasks::CellProgress& p) {
  std::string state{tasks::to_string(p.state)};
  if (p.phase != tasks::Phase::none) state += fmt::format(" / {}", tasks::to_string(p.phase));
  std::string line = fmt::format("{:7.1f} s  {:<24}", std::chrono::duration<double>(p.now).count(), state);
  line += fmt::format("  boundary shots {:>3}", p.boundary_shots);
  if (p.surface_planned > 0) line += fmt::format("  surface {:>3}/{}", p.surface_shots, p.surface_planned);
  if (p.retaken > 0) line += fmt::format("  retaken {}", p.retaken);
  if (p.time_left >= hal::Duration{0})
    line += fmt::format("  left {:.0f} s", std::chrono::duration<double>(p.time_left).count());
  // What ends the run is said once, by its last line; what only holds it up is said here.
  const bool goes_on_by_itself =
      p.cause == tasks::HoldCause::scanner || p.cause == tasks::HoldCause::recorder;
  if (!p.why.empty() && goes_on_by_itself) line += fmt::format("  {}", p.why.view());
  return line;
}

std::string status_line(const tasks::CellProgress& p) {
  std::string line{tasks::to_string(p.state)};
  if (p.phase != tasks::Phase::none) line += fmt::format(" / {}", tasks::to_string(p.phase));
  if (p.boundary_shots > 0) line += fmt::format(", {} boundary shots", p.boundary_shots);
  if (p.surface_planned > 0)
    line += fmt::format(", {} of {} surface shots", p.surface_shots, p.surface_planned);
  // After a stop the reason of a hold before it is history.
  if (!p.why.empty() && p.state != tasks::CellState::stopping && p.state != tasks::CellState::stopped)
    line += fmt::format(": {}", p.why.view());
  return line;
}

DisplayThread::DisplayThread(const tasks::Cell& cell, std::string head)
    : cell_{cell}, terminal_{isatty(STDERR_FILENO) != 0}, head_{std::move(head)}, thread_{[this] {
        work();
      }} {}

DisplayThread::~DisplayThread() {
  ending_ = true;
  thread_.join();
}

void DisplayThread::work() {
  while (!ending_) {
    show(cell_.progress());
    clock_.sleep_until(clock_.now() + display_period);
  }
  show(cell_.progress());
  if (terminal_) say(begun_ ? "\n" : "\r\x1b[K");
}

void DisplayThread::show(const tasks::CellProgress& p) {
  const bool begins = p.state == tasks::CellState::execute || p.state == tasks::CellState::held;
  if (!begun_ && begins) {
    begun_ = true;
    say(fmt::format("{}{}\n", terminal_ ? "\r\x1b[K" : "", head_));
  }
  if (StopSignals::suspension_was_asked()) {
    say(fmt::format("{}moldloft: ctrl-Z does nothing while the arm may move; ctrl-C stops and saves\n",
                    terminal_ ? "\r\x1b[K" : ""));
  }
  const std::string line = progress_line(p);
  if (terminal_) {
    say("\r\x1b[K" + line);
    return;
  }
  // Everything but the clock: a log gets a line when something has happened.
  std::string content = line.substr(line.find('s') + 1);
  if (const auto left = content.find("  left"); left != std::string::npos) content.resize(left);
  if (!begun_ || content == last_) return;
  last_ = content;
  say(line + "\n");
}

}  // namespace moldloft::firmware_like
