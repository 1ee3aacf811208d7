#include "firmware_like/gateway/service_thread.hpp"

#include "firmware_like/process/console.hpp"
#include "firmware_like/process/journal.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

namespace moldloft::firmware_like {
namespace {

Priority priority_of(const tasks::Notice& notice) {
  switch (notice.kind) {
    case tasks::Notice::Kind::abort:
      return Priority::error;
    case tasks::Notice::Kind::hold:
    case tasks::Notice::Kind::warning:
      return Priority::warning;
    case tasks::Notice::Kind::goes_on:
      break;
  }
  return Priority::notice;
}

}  // namespace

ServiceThread::ServiceThread(tasks::CellPort& cell, std::function<LoopPulse()> look_at_loop,
                             const std::filesystem::path& run_folder, Surroundings around)
    : cell_{cell},
      look_at_loop_{std::move(look_at_loop)},
      around_{std::move(around)},
      watch_{notify_, run_folder / "watchdog.json"},
      thread_{[this] { work(); }} {}

ServiceThread::~ServiceThread() {
  leaving_ = true;
  thread_.join();
}

void ServiceThread::work() {
  while (!leaving_) {
    const LoopPulse pulse = look_at_loop_();
    watch_.look({.ticks = pulse.ticks,
                 .task = pulse.task,
                 .status = status_line(cell_.progress(), around_),
                 .ended = ended_},
                clock_.now());
    pass_notices_on();
    clock_.sleep_until(clock_.now() + ServiceWatch::period);
  }
  pass_notices_on();
}

// On a terminal and in a file the progress says the same, and the run's last line what has ended it.
void ServiceThread::pass_notices_on() {
  while (const auto notice = cell_.next_notice()) {
    if (stderr_is_journal()) say(for_journal(priority_of(*notice), notice_line(*notice)));
  }
}

}  // namespace moldloft::firmware_like
