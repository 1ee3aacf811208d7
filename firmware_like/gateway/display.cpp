#include "firmware_like/gateway/display.hpp"

#include "firmware_like/process/console.hpp"
#include "firmware_like/process/journal.hpp"
#include "firmware_like/process/number_text.hpp"
#include "firmware_like/process/stop_signals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <sys/ioctl.h>
#include <unistd.h>

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;
constexpr auto display_period = 100ms;

}  // namespace

bool renews_lines(int file, const char* term) {
  const std::string_view kind = term == nullptr ? "" : term;
  return ::isatty(file) != 0 && !kind.empty() && kind != "dumb";
}

std::size_t terminal_columns(int file, const char* columns) {
  winsize size{};
  if (::ioctl(file, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const Limits<std::size_t> sensible{1, 10'000};
  std::size_t told = 0;
  return columns != nullptr && read_number(columns, sensible, told) ? told : 80;
}

DisplayThread::DisplayThread(const tasks::CellPort& cell, std::string head, Surroundings around)
    : cell_{cell},
      terminal_{renews_lines(STDERR_FILENO, std::getenv("TERM"))},
      head_{std::move(head)},
      around_{std::move(around)},
      thread_{[this] { work(); }} {}

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
  if (terminal_) {
    // The last column stays free: a line that fills it would wrap on some terminals. Asked each time, since
    // windows are resized.
    const auto columns = terminal_columns(STDERR_FILENO, std::getenv("COLUMNS"));
    say(fmt::format("\r\x1b[K{}", progress_line_within(std::max<std::size_t>(columns, 2) - 1, p, around_)));
    return;
  }
  // A log gets a line when something has happened, not when time has passed. In the journal nothing has to stand alone.
  const std::string content = fmt::format("{}, {} retaken", status_line(p, around_), p.retaken);
  if ((!begun_ && !stderr_is_journal()) || content == last_) return;
  last_ = content;
  say(progress_line(p, around_) + "\n");
}

}  // namespace moldloft::firmware_like
