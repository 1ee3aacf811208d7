#include "firmware_like/gateway/progress_text.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

using tasks::Awaited;

double seconds(hal::Duration d) { return std::chrono::duration<double>(d).count(); }

std::string state_text(const tasks::CellProgress& p) {
  std::string state{tasks::to_string(p.state)};
  if (p.phase != tasks::Phase::none) state += fmt::format(" / {}", tasks::to_string(p.phase));
  return state;
}

// Where a run is does not depend on the state's name when it measures: the phase says it.
std::string short_state(const tasks::CellProgress& p) {
  const bool measures = p.state == tasks::CellState::execute && p.phase != tasks::Phase::none;
  return std::string{measures ? tasks::to_string(p.phase) : tasks::to_string(p.state)};
}

// An estimate is called one, and its digits pretend nothing.
std::string left_text(const tasks::CellProgress& p) {
  if (p.state != tasks::CellState::execute || p.time_left < hal::Duration{0}) return "";
  const double left = seconds(p.time_left);
  if (p.left_is_planned) return fmt::format("left {:.0f} s", left);
  const double step = left < 60 ? 5 : left < 600 ? 10 : 60;
  return fmt::format("left about {:.0f} s", std::max(step, std::round(left / step) * step));
}

// The last line of a run says what ended it; this line says what only holds it up.
std::string held_up_by(const tasks::CellProgress& p) {
  const bool goes_on_by_itself =
      p.cause == tasks::HoldCause::scanner || p.cause == tasks::HoldCause::recorder;
  return !p.why.empty() && goes_on_by_itself ? std::string{p.why.view()} : "";
}

// Where there is no room for more.
std::string_view awaited_short(const tasks::CellProgress& p, const Surroundings& around) {
  switch (p.awaited) {
    case Awaited::scanner:
      return "awaits scanner";
    case Awaited::robot:
      return "awaits robot";
    case Awaited::both:
      return "awaits robot and scanner";
    case Awaited::calibration:
      return "robot calibrates";
    case Awaited::arm_at_rest:
      return "awaits rest";
    case Awaited::disk:
      return "awaits disk";
    case Awaited::word_unhold:
      return around.has_operator ? "awaits unhold" : "";
    case Awaited::word_clear:
      return around.has_operator ? "awaits clear" : "";
    case Awaited::nothing:
      break;
  }
  return "";
}

// What a device has come to names it by its address, or speaks of it as "the robot ...": it is named once all the same.
std::string awaited_device(std::string_view kind, std::string_view address, std::string_view why) {
  if (why.empty()) return fmt::format("the {} at {}", kind, address);
  const std::string name = fmt::format("the {}", kind);
  if (why.starts_with(name + " ")) return fmt::format("{}, which{}", name, why.substr(name.size()));
  return fmt::format("{}: {}", name, why);
}

std::string both_awaited(const tasks::CellProgress& p, const Surroundings& around) {
  const std::string robot = awaited_device("robot", around.robot, p.robot_why);
  const bool has_clause = robot.find(", which") != std::string::npos;
  return fmt::format("waiting for {}{} and {}", robot, has_clause ? "," : "",
                     awaited_device("scanner", around.scanner, p.awaited_why));
}

// What is waited for, beside the cell's reason to stand where that has been told. A device that was lost is waited for
// in that reason's own words; what it has come to since is news only where it is something else.
std::string awaited_beside(std::string_view reason, const tasks::CellProgress& p,
                           const Surroundings& around) {
  if (reason.empty() || p.cause != tasks::HoldCause::scanner || p.awaited != Awaited::scanner)
    return awaited_text(p, around);
  const std::string_view lost_for = reason.substr(0, reason.rfind("; "));
  const bool is_news = !p.awaited_why.empty() && !p.awaited_why.view().starts_with(lost_for);
  return is_news ? fmt::format("now: {}", p.awaited_why.view()) : "";
}

std::size_t columns_of(std::string_view text) {
  std::size_t count = 0;
  for (const char c : text) count += (static_cast<unsigned char>(c) & 0xC0u) != 0x80u ? 1 : 0;
  return count;
}

std::string cut_to(std::size_t columns, std::string_view text) {
  if (columns_of(text) <= columns) return std::string{text};
  constexpr std::string_view dots = "...";
  const std::size_t keep = columns > dots.size() ? columns - dots.size() : columns;
  std::size_t count = 0, end = 0;
  for (; end < text.size(); ++end) {
    const bool begins = (static_cast<unsigned char>(text[end]) & 0xC0u) != 0x80u;
    if (begins && count++ == keep) break;
  }
  return std::string{text.substr(0, end)} + (columns > dots.size() ? std::string{dots} : "");
}

}  // namespace

std::string awaited_text(const tasks::CellProgress& p, const Surroundings& around) {
  switch (p.awaited) {
    case Awaited::nothing:
      return "";
    case Awaited::scanner:
      return "waiting for " + awaited_device("scanner", around.scanner, p.awaited_why);
    case Awaited::robot:
      return "waiting for " + awaited_device("robot", around.robot, p.awaited_why);
    case Awaited::both:
      return both_awaited(p, around);
    case Awaited::calibration:
      return "the robot calibrates";
    case Awaited::arm_at_rest:
      return "waiting for the arm to come to rest";
    case Awaited::disk:
      return p.why.empty() ? "waiting for the disk to take records again" : "";  // that says it
    case Awaited::word_unhold:
      return around.has_operator ? "waiting for an operator: moldloft tell unhold, or stop" : "";
    case Awaited::word_clear:
      return around.has_operator
                 ? "waiting for an operator: moldloft tell clear when the cell is safe, or stop"
                 : "";
  }
  return "";
}

std::string progress_line(const tasks::CellProgress& p, const Surroundings& around) {
  std::string line = fmt::format("{:7.1f} s  {:<24}", seconds(p.now), state_text(p));
  line += fmt::format("  boundary shots {:>3}", p.boundary_shots);
  if (p.surface_planned > 0) line += fmt::format("  surface {:>3}/{}", p.surface_shots, p.surface_planned);
  if (p.retaken > 0) line += fmt::format("  retaken {}", p.retaken);
  const std::string held_up = held_up_by(p);
  for (const auto& part : {left_text(p), held_up, awaited_beside(held_up, p, around)})
    if (!part.empty()) line += "  " + part;
  return line;
}

std::string progress_line_within(std::size_t columns, const tasks::CellProgress& p,
                                 const Surroundings& around) {
  const std::string left = left_text(p), held_up = held_up_by(p);
  const std::string awaited = awaited_beside(held_up, p, around);
  const std::string shots = p.surface_planned > 0
                                ? fmt::format("surface {}/{}", p.surface_shots, p.surface_planned)
                            : p.boundary_shots > 0 ? fmt::format("edge {}", p.boundary_shots)
                                                   : "";
  const auto joined = [&](std::initializer_list<std::string_view> parts) {
    std::string line = fmt::format("{:.0f} s", seconds(p.now));
    for (const auto part : parts)
      if (!part.empty()) line += fmt::format("  {}", part);
    return line;
  };
  // What is waited for comes before what is left, which comes before the shots.
  const std::string_view waits = awaited_short(p, around);
  const std::array<std::string, 6> shorter = {
      progress_line(p, around),
      joined({state_text(p), shots, left, held_up, awaited}),
      joined({short_state(p), shots, left, held_up.empty() ? waits : held_up}),
      joined({short_state(p), shots, left, waits}),
      joined({short_state(p), left, waits}),
      joined({short_state(p), waits.empty() ? left : waits})};
  for (const auto& line : shorter)
    if (columns_of(line) <= columns) return line;
  return cut_to(columns, shorter.back());
}

std::string status_line(const tasks::CellProgress& p, const Surroundings& around) {
  std::string line = state_text(p);
  if (p.boundary_shots > 0) line += fmt::format(", {} boundary shots", p.boundary_shots);
  if (p.surface_planned > 0)
    line += fmt::format(", {} of {} surface shots", p.surface_shots, p.surface_planned);
  // After a stop the reason of a hold before it is history.
  const bool is_history = p.state == tasks::CellState::stopping || p.state == tasks::CellState::stopped;
  const std::string_view reason = is_history ? std::string_view{} : p.why.view();
  if (!reason.empty()) line += fmt::format(": {}", reason);
  if (const auto awaited = awaited_beside(reason, p, around); !awaited.empty())
    line += fmt::format("; {}", awaited);
  return line;
}

std::string notice_line(const tasks::Notice& notice) {
  constexpr std::array<const char*, 4> words = {"goes on", "warning", "held", "aborted"};
  return fmt::format("moldloft: {} at {:.3f} s: {}\n", words[static_cast<std::size_t>(notice.kind)],
                     seconds(notice.at), notice.text.view());
}

}  // namespace moldloft::firmware_like
