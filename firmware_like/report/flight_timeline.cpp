#include "firmware_like/report/flight_timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <span>

namespace moldloft::firmware_like {
namespace {

using hal::FlightDump;
using hal::FlightEvent;
using hal::FlightKind;

constexpr std::size_t picture_width = 40;

double micros(double ns) { return ns / 1000; }
double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

// One tick of the dump: its own event and those up to the next.
struct Tick {
  FlightEvent woken;
  std::span<const FlightEvent> events;
  std::uint64_t number = 0;
};

// The dump's whole ticks; what came before its first one is half a tick.
std::vector<Tick> ticks_of(const FlightDump& dump) {
  std::vector<Tick> ticks;
  const std::span<const FlightEvent> all{dump.events};
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].kind != FlightKind::tick) continue;
    std::size_t end = i + 1;
    while (end < all.size() && all[end].kind != FlightKind::tick) ++end;
    ticks.push_back({.woken = all[i], .events = all.subspan(i + 1, end - i - 1)});
  }
  return ticks;
}

// The scheduler's step is the usual distance between two ticks' due times.
std::int64_t step_of(const std::vector<Tick>& ticks) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const auto due = [&](const Tick& t) { return t.woken.at_ns - t.woken.value; };
    steps.push_back(due(ticks[i]) - due(ticks[i - 1]));
  }
  if (steps.empty()) return 1'000'000;
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  return std::max<std::int64_t>(steps[steps.size() / 2], 1);
}

char symbol_of(std::uint8_t task) {
  constexpr std::string_view digits = "123456789abcdefg";
  return task < digits.size() ? digits[task] : '~';
}

std::string picture_of(const Tick& tick, std::int64_t step) {
  std::string picture(picture_width, '.');
  const std::int64_t due = tick.woken.at_ns - tick.woken.value;
  bool beyond = false;
  for (const FlightEvent& e : tick.events) {
    if (e.kind != FlightKind::task && e.kind != FlightKind::background) continue;
    const auto column = [&](std::int64_t at) {
      return (at - due) * static_cast<std::int64_t>(picture_width) / step;
    };
    const std::int64_t first = column(e.at_ns), last = column(e.at_ns + e.value);
    beyond = beyond || e.at_ns + e.value > due + step;
    for (std::int64_t c = std::max<std::int64_t>(first, 0);
         c <= last && c < static_cast<std::int64_t>(picture_width); ++c) {
      char& place = picture[static_cast<std::size_t>(c)];
      // A task that takes less than a column must not vanish under the next; a long one is not hidden by a short.
      if (place == '.' || (place == '~' && e.kind == FlightKind::task)) place = symbol_of(e.id);
    }
  }
  return picture + (beyond ? '>' : ' ');
}

// What took time, the longest first; short and usual ones are in the picture.
std::string costs_of(const FlightDump& dump, const Tick& tick) {
  constexpr std::uint32_t worth_telling_ns = 5'000;
  struct Sum {
    std::uint32_t count = 0, largest = 0;
  };
  std::map<std::uint8_t, Sum> background;
  std::vector<std::pair<std::uint32_t, std::string>> parts;
  for (const FlightEvent& e : tick.events) {
    if (e.kind == FlightKind::task && e.value >= worth_telling_ns)
      parts.emplace_back(e.value, fmt::format("{} {:.0f}", dump.name_of(e.id), micros(e.value)));
    if (e.kind == FlightKind::background) {
      Sum& sum = background[e.id];
      ++sum.count, sum.largest = std::max(sum.largest, e.value);
    }
  }
  for (const auto& [id, sum] : background)
    parts.emplace_back(sum.largest, fmt::format("{} {} x, longest {:.0f}", dump.name_of(id), sum.count,
                                                micros(sum.largest)));
  std::ranges::stable_sort(parts, std::greater{}, &std::pair<std::uint32_t, std::string>::first);
  std::string text;
  for (const auto& [cost, part] : parts) text += (text.empty() ? "" : ", ") + part;
  return text;
}

std::string bytes_of(const Tick& tick) {
  constexpr std::array<std::string_view, 2> links{"scanner", "robot"};
  std::string text;
  for (const FlightKind kind : {FlightKind::received, FlightKind::sent})
    for (std::uint8_t link = 0; link < links.size(); ++link) {
      std::uint64_t bytes = 0;
      for (const FlightEvent& e : tick.events)
        if (e.kind == kind && e.id == link) bytes += e.value;
      if (bytes > 0)
        text += fmt::format("  {} {} {}", links[link], bytes, kind == FlightKind::received ? "in" : "out");
    }
  return text;
}

std::string transitions_of(const FlightDump& dump, std::int64_t from, std::int64_t end) {
  std::string text;
  for (const auto& t : dump.transitions) {
    if (t.at_ns < from || t.at_ns >= end) continue;
    text += fmt::format("  [{}: {}", hal::flight_text(t.source), hal::flight_text(t.event));
    if (t.to[0] != '\0') text += fmt::format(" {} -> {}", hal::flight_text(t.from), hal::flight_text(t.to));
    text += "]";
  }
  return text;
}

std::string missed_text(const FlightDump& dump, const Tick& tick) {
  for (const FlightEvent& e : tick.events)
    if (e.kind == FlightKind::missed) return fmt::format("  MISSED {} ({})", e.value, dump.name_of(e.id));
  return {};
}

std::string headline(const FlightDump& dump) {
  const auto& h = dump.header;
  std::string text = fmt::format("cause: {}", to_string(h.cause));
  if (h.cause == hal::FlightCause::signal) {
    text += fmt::format(" {}, running task: {}", h.signal, dump.name_of(h.running_task));
  } else if (h.cause != hal::FlightCause::none) {
    text += fmt::format(" in tick {} at {:.6f} s", h.tick, seconds(h.triggered_ns));
    if (h.task != 255) text += fmt::format(", task: {}", dump.name_of(h.task));
  }
  return text + "\n";
}

std::string legend(const FlightDump& dump) {
  std::string text = "tasks:";
  for (std::uint8_t task = 0; task < hal::flight_names; ++task)
    if (!dump.name_of(task).empty()) text += fmt::format("  {} {}", symbol_of(task), dump.name_of(task));
  return text + "\n";
}

}  // namespace

std::string flight_timeline(const FlightDump& dump, const TimelineRange& range, hal::Duration tick) {
  const std::vector<Tick> ticks = ticks_of(dump);
  std::string text = headline(dump) + legend(dump);
  if (ticks.empty()) return text + "no whole tick is in this dump\n";
  const std::int64_t step = tick.count() > 0 ? tick.count() : step_of(ticks);
  text += fmt::format("{} ticks of {:.0f} us, {:.3f} s to {:.3f} s\n\n", ticks.size(),
                      micros(static_cast<double>(step)), seconds(ticks.front().woken.at_ns),
                      seconds(ticks.back().woken.at_ns));
  text += fmt::format("{:>12}  {:>8}  0{:>{}} us\n", "time s", "late us",
                      fmt::format("{:.0f}", micros(static_cast<double>(step))), picture_width - 1);
  const bool triggered = dump.header.cause != hal::FlightCause::signal && dump.header.triggered_ns > 0;
  const std::int64_t about = triggered ? dump.header.triggered_ns : ticks.back().woken.at_ns;
  std::size_t trigger = 0;
  while (trigger + 1 < ticks.size() && ticks[trigger + 1].woken.at_ns <= about) ++trigger;
  const auto before = static_cast<std::size_t>(range.ticks_before);
  for (std::size_t i = range.all || trigger < before ? 0 : trigger - before; i < ticks.size(); ++i) {
    const Tick& t = ticks[i];
    const std::int64_t end = i + 1 < ticks.size() ? ticks[i + 1].woken.at_ns : INT64_MAX;
    const bool here = triggered && i == trigger;
    std::string line =
        fmt::format("{:>12.6f}  {:>8.1f}  {}{} {}{}{}{}", seconds(t.woken.at_ns), micros(t.woken.value),
                    picture_of(t, step), here ? '!' : ' ', costs_of(dump, t), bytes_of(t),
                    transitions_of(dump, t.woken.at_ns, end), missed_text(dump, t));
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace moldloft::firmware_like
