#include "package/own_robot.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

// Text in memory that is there: from_chars() lies in the standard library, which the compiler cannot see through.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace own {

using hal::Instant;
using hal::Pose;
using hal::RobotEvent;
using hal::RobotState;
using Kind = RobotEvent::Kind;
using News = hal::DeviceSession::News;

namespace {

constexpr int stopped_code = 1;
constexpr double farthest_mm = 10'000;     // a coordinate beyond it is no place of any arm
constexpr std::size_t outbox_bytes = 480;  // four of the longest lines: a command, a question, two stops

// Six numbers and nothing behind them.
std::optional<Pose> pose_from(std::string_view text) {
  std::array<double, 6> values{};
  for (double& value : values) {
    if (text.empty() || text.front() != ' ') return std::nullopt;
    text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  }
  if (!text.empty()) return std::nullopt;
  return Pose{values[0],
              values[1],
              values[2],
              values[3] * hal::degree,
              values[4] * hal::degree,
              values[5] * hal::degree};
}

std::optional<int> code_from(std::string_view text) {
  int code = 0;
  if (text.empty() || text.front() != ' ') return std::nullopt;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), code);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return code;
}

}  // namespace

OwnRobot::OwnRobot(hal::ByteLink& link, const Settings& settings)
    : session_{link,
               {.heartbeat = settings.question,
                .silent_limit = settings.silence,
                .outbox_bytes = outbox_bytes}},
      settings_{settings} {}

// ---- what the cell asks

bool OwnRobot::move(const Pose& target, int speed_percent, Instant now) {
  const double most = std::max({std::abs(target.x_mm), std::abs(target.y_mm), std::abs(target.z_mm)});
  if (state_ != RobotState::ready || !is_finite(target) || most > farthest_mm) return false;
  if (speed_percent < 1 || speed_percent > 100) return false;
  say(Line::format("M {:.3f} {:.3f} {:.3f} {:.3f} {:.3f} {:.3f} {}", target.x_mm, target.y_mm, target.z_mm,
                   target.yaw / hal::degree, target.pitch / hal::degree, target.roll / hal::degree,
                   speed_percent));
  state_ = RobotState::commanded;
  command_until_ = now + settings_.answer;
  return true;
}

bool OwnRobot::calibrate(Instant) {
  if (state_ != RobotState::ready) return false;
  events_.push({.kind = Kind::done, .calibrated = true});
  return true;
}

void OwnRobot::stop(Instant) { say("S"); }

void OwnRobot::reset(Instant) {
  latched_ = false;
  if (state_ != RobotState::faulted) return;
  state_ = RobotState::synchronising;
  say("?");
}

// ---- bytes in, bytes out

void OwnRobot::receive(Instant now) {
  const auto news = session_.receive();
  if (news == News::lost) return lose(session_.why(), now);
  if (news == News::opened) {
    state_ = latched_ ? RobotState::faulted : RobotState::synchronising;
    session_.heard(now), session_.said(now);
    say("?");
  }
  std::array<std::byte, 256> bytes{};  // a line of 115200 baud brings 12 in a tick
  const std::size_t count = session_.read(bytes);
  for (std::size_t i = 0; i < count; ++i) {
    const char c = static_cast<char>(bytes[i]);
    if (c == '\n') {
      if (!take({in_.data(), in_size_}, now)) ++unexpected_lines_;
      in_size_ = 0;
    } else if (c != '\r') {
      in_[std::min(in_size_, in_.size() - 1)] = c;  // a line that is too long is none of ours
      in_size_ = std::min(in_size_ + 1, in_.size());
    }
  }
}

void OwnRobot::transmit(Instant now) {
  if (session_.transmit(now) == News::no_connection) return lose("the arm's port does not open", now);
  if (!session_.is_open()) return;
  if (session_.is_silent(now)) return lose("the arm does not answer", now);
  if (has_command() && now >= command_until_)
    fail("the arm does not say how its command ended: look, then clear");
  if (session_.heartbeat_due(now)) session_.said(now), say("?");
  session_.flush();
}

// A line that finds no room is as good as lost on the way; the time-out that follows takes care of it.
void OwnRobot::say(std::string_view words) {
  if (!session_.is_open()) return;
  const Line line = Line::format("{}\n", words);
  session_.write(std::as_bytes(std::span{line.view()}));
}

bool OwnRobot::take(std::string_view line, Instant now) {
  const char kind = line.empty() ? '\0' : line.front();
  const std::string_view rest = line.empty() ? line : line.substr(1);
  const auto pose = kind == 'P' || kind == 'D' ? pose_from(rest) : std::nullopt;
  if (kind == 'P' && pose) {
    session_.heard(now), session_.greeted();
    if (state_ != RobotState::synchronising) return true;
    state_ = RobotState::ready;
    events_.push({.kind = Kind::ready, .pose = *pose, .calibrated = true});
  } else if (kind == 'A' && rest.empty() && state_ == RobotState::commanded) {
    state_ = RobotState::moving;
    command_until_ = now + settings_.motion;
    events_.push({.kind = Kind::moving});
  } else if (kind == 'D' && pose && state_ == RobotState::moving) {
    state_ = RobotState::ready;
    events_.push({.kind = Kind::done, .pose = *pose, .calibrated = true});
  } else if (const auto code = kind == 'E' && has_command() ? code_from(rest) : std::nullopt) {
    state_ = RobotState::ready;
    events_.push({.kind = Kind::refused,
                  .code = *code,
                  .text = *code == stopped_code
                              ? hal::Message{"the motion was stopped before it arrived"}
                              : hal::Message::format("the arm refuses: its error {}", *code)});
  } else {
    return false;
  }
  return true;
}

// ---- the link and the faults

void OwnRobot::lose(std::string_view why, Instant now) {
  why_ = hal::Message::format("robot: {}", why);
  session_.lose(now);
  if (state_ != RobotState::offline) events_.push({.kind = Kind::lost, .text = why_});
  state_ = RobotState::offline;
  in_size_ = 0;
}

void OwnRobot::fail(std::string_view why) {
  why_ = hal::Message::format("robot: {}", why);
  latched_ = true;
  state_ = RobotState::faulted;
  events_.push({.kind = Kind::fault, .text = why_});
}

}  // namespace own
