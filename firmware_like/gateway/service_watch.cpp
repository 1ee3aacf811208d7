#include "firmware_like/gateway/service_watch.hpp"

#include "firmware_like/process/console.hpp"
#include "firmware_like/process/journal.hpp"
#include "firmware_like/process/json_text.hpp"
#include "firmware_like/process/wall_time.hpp"
#include "firmware_like/process/whole_file.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;

// The arm stops by itself after 3 s without a line (hal/PROTOCOLS.md): by then the culprit must have been named.
constexpr hal::Duration longest_standstill = 1s;

// Results of the largest plate are written in a few seconds, even to a slow disk; who takes longer than this hangs.
constexpr hal::Duration longest_winding_up = 60s;

// People read it; the journal of the manager's messages should stay readable too.
constexpr hal::Duration status_period = 1s;

double seconds(hal::Duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

// Half of the manager's time, so that the culprit is told before the kill.
ServiceWatch::ServiceWatch(ServiceNotify& notify, std::filesystem::path report)
    : notify_{notify},
      report_{std::move(report)},
      limit_{notify.watchdog() > 0ns ? std::min(longest_standstill, notify.watchdog() / 2)
                                     : longest_standstill} {}

void ServiceWatch::look(const LoopSight& sight, hal::Instant now) {
  const hal::Duration passed = last_look_ ? std::min(now - *last_look_, 2 * period) : 0ns;
  last_look_ = now;
  if (sight.ended) {
    if (!std::exchange(stopping_, true)) notify_.stopping(sight.status);
    winding_up_ += passed;
    if (winding_up_ < longest_winding_up) notify_.feed();
    return;
  }
  if (sight.ticks != ticks_) {
    ticks_ = sight.ticks;
    if (told_) tell_recovery(sight, now);
    standing_ = 0ns;
    if (!std::exchange(ready_, true)) {
      notify_.ready(sight.status);
      status_ = sight.status;
      last_status_ = now;
    }
  } else if (ready_) {
    standing_ += passed;
  }
  if (standing_ >= limit_) {
    if (!std::exchange(told_, true)) tell_culprit(sight);
    return;
  }
  if (ready_) notify_.feed();
  say_status(sight, now);
}

void ServiceWatch::say_status(const LoopSight& sight, hal::Instant now) {
  if (!ready_ || sight.status == status_ || (last_status_ && now - *last_status_ < status_period)) return;
  status_ = sight.status;
  last_status_ = now;
  notify_.status(status_);
}

void ServiceWatch::tell_culprit(const LoopSight& sight) {
  const std::string line = fmt::format("the control loop has stood in '{}' for {:.1f} s, after {} ticks",
                                       sight.task, seconds(standing_), ticks_);
  say(marked(Priority::error, fmt::format("moldloft: {}\n", line)));
  notify_.status(line);
  const Json report = {{"schema", 1},
                       {"task", std::string{sight.task}},
                       {"ticks", ticks_},
                       {"stood_s", seconds(standing_)},
                       {"time", now_utc()}};
  if (const auto written = write_file(report_, json_text(report, 2) + "\n"); !written)
    say(marked(Priority::error, fmt::format("moldloft: {}\n", written.error().what)));
}

void ServiceWatch::tell_recovery(const LoopSight& sight, hal::Instant now) {
  told_ = false;
  say(marked(Priority::notice,
             fmt::format("moldloft: the control loop goes on after {:.1f} s\n", seconds(standing_))));
  notify_.status(sight.status);
  status_ = sight.status;
  last_status_ = now;
}

}  // namespace moldloft::firmware_like
