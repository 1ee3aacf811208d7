#include "host_sim/devices/robot_server.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace moldloft::host_sim {

namespace robot_line = hal::robot_line;
using robot_line::Error;
using robot_line::Event;
using robot_line::Refusal;
using robot_line::Reply;
using robot_line::Verb;

namespace {

constexpr hal::Duration event_period = std::chrono::seconds{1};  // of EVT, until SYN
constexpr hal::Duration time_pretended =
    std::chrono::milliseconds{300};  // of a motion that does not take place

}  // namespace

RobotServer::RobotServer(hal::ByteLink& link, ArmDrive drive, const RobotTimes& times, const RobotWhim* whim)
    : link_(link), drive_(std::move(drive)), times_(times), whim_(whim) {}

void RobotServer::step(hal::Instant now) {
  const hal::LinkState link = link_.state();
  if (link == hal::LinkState::open) {
    connected_ = true;
    receive(now);
  } else {
    connected_ = false;
    line_used_ = out_used_ = 0;
    if (link != hal::LinkState::opening) link_.open();
  }
  watch(now);
  if (working_ && now >= busy_until_) finish_work(now);
  flush();
}

void RobotServer::power_cycle(hal::Instant now) {
  drive_.stop(now);
  if (working_) busy_until_ = stands_at_ = std::max(now, drive_.stands_at());
  fate_ = Fate::none;
  synchronised_ = calibrated_ = calibrating_ = working_ = false;
  last_number_ = last_error_ = event_ = 0;
  line_used_ = out_used_ = 0;
}

void RobotServer::press_emergency_stop(hal::Instant now) {
  emergency_stop_ = true;
  raise(Event::emergency_stop, now);
}

void RobotServer::switch_power(bool on, hal::Instant now) {
  if (power_ && !on) raise(Event::power_lost, now);
  power_ = on;
}

void RobotServer::turn_key(bool manual, hal::Instant now) {
  manual_ = manual;
  if (manual) abort_work(Error::manual, now);
}

void RobotServer::receive(hal::Instant now) {
  std::array<std::byte, 256> bytes;
  while (const std::size_t count = link_.read(bytes)) {
    for (std::size_t k = 0; k < count; ++k) {
      const char c = static_cast<char>(bytes[k]);
      if (c == '\n') {
        if (line_too_long_) {
          refuse(0, Refusal::checksum);
        } else if (line_used_ > 0) {
          take_line({line_.data(), line_used_}, now);
        }
        line_used_ = 0;
        line_too_long_ = false;
      } else if (c == '\r') {
        continue;
      } else if (line_used_ < robot_line::max_length) {
        line_[line_used_++] = c;
      } else {
        line_too_long_ = true;
      }
    }
  }
}

void RobotServer::take_line(std::string_view line, hal::Instant now) {
  ++counters_.lines;
  const auto command = robot_line::parse_command(line);
  if (!command) return refuse(0, Refusal::checksum);
  last_line_ = now;
  if (command->number == 0) return answer_question(*command, now);
  take_numbered(*command, now);
}

void RobotServer::answer_question(const robot_line::Command& question, hal::Instant now) {
  Reply reply;
  reply.answers = question.verb;
  switch (question.verb) {
    case Verb::syn:  // a motion under way goes on: the host sees it in STA, and ends it by STP
      fate_ = Fate::none;
      last_number_ = event_ = 0;
      executions_.fill(0);
      synchronised_ = true;
      reply.nonce = question.nonce;
      break;
    case Verb::sta:
      reply.status.power = power_ && !emergency_stop_;
      reply.status.emergency_stop = emergency_stop_;
      reply.status.moving = !stands(now);
      reply.status.mode = manual_       ? robot_line::Status::Mode::manual
                          : calibrated_ ? robot_line::Status::Mode::calibrated
                                        : robot_line::Status::Mode::automatic;
      reply.status.last_error = last_error_;
      break;
    case Verb::pos:
      reply.pose = said_pose(now);
      break;
    case Verb::stp:
      abort_work(Error::stopped, now);
      break;
    default:
      break;  // PNG says only that both are there
  }
  send(reply);
}

void RobotServer::take_numbered(const robot_line::Command& command, hal::Instant now) {
  if (!synchronised_) return refuse(command.number, Refusal::not_synchronised);
  if (command.number == last_number_) {
    ++counters_.repeats;
    return send_fate();
  }
  const bool is_next = command.number == robot_line::next_number(last_number_);
  if (!is_next || !stands(now)) return refuse(command.number, Refusal::sequence);
  last_number_ = command.number;
  execute(command, now);
  send_fate();
}

void RobotServer::execute(const robot_line::Command& command, hal::Instant now) {
  const auto failed = [this](Error error, std::string_view why) {
    fate_ = Fate::failed;
    fate_code_ = last_error_ = std::to_underlying(error);
    last_refusal_ = why;
  };
  if (emergency_stop_ || !power_) return failed(Error::arm_off, "the arm has no power");
  if (manual_) return failed(Error::manual, "the arm is in manual mode");
  if (command.verb == Verb::cal) {
    ++counters_.calibrations;
    if (calibrated_) return begin_work(now, now, now);
    calibrating_ = true;
    return begin_work(now, now + times_.calibration, now + times_.calibration);
  }
  if (!calibrated_) return failed(Error::not_calibrated, "the arm is not calibrated");
  if (whim_ != nullptr && whim_->stays()) {
    begin_work(now, now + time_pretended, now + time_pretended);
    fate_pose_ = command.pose;
    return;
  }
  if (const auto started = drive_.start(command.pose, command.speed_percent, now); !started) {
    return failed(Error::out_of_reach, started.error().text);
  }
  ++counters_.motions;
  counters_.most_executions =
      std::max(counters_.most_executions, ++executions_[static_cast<std::size_t>(command.number)]);
  begin_work(now, drive_.stands_at(), drive_.settled_at());
}

void RobotServer::begin_work(hal::Instant now, hal::Instant stands_at, hal::Instant until) {
  fate_ = Fate::under_way;
  working_ = true;
  abort_code_ = 0;
  busy_from_ = now;
  stands_at_ = stands_at;
  busy_until_ = until;
}

void RobotServer::finish_work(hal::Instant now) {
  working_ = false;
  calibrated_ |= calibrating_ && abort_code_ == 0;
  calibrating_ = false;
  ++commands_done_;
  if (fate_ != Fate::under_way) return;  // SYN has forgotten it
  fate_ = abort_code_ == 0 ? Fate::done : Fate::failed;
  if (whim_ == nullptr || !whim_->stays()) fate_pose_ = said_pose(now);
  if (abort_code_ != 0) fate_code_ = last_error_ = abort_code_;
  send_fate();
}

hal::Pose RobotServer::said_pose(hal::Instant now) const {
  const hal::Pose encoders = drive_.reported_pose(now);
  return whim_ == nullptr ? encoders : whim_->says(encoders);
}

// Brakes. The command's number is answered by ERR once the arm stands.
void RobotServer::abort_work(Error error, hal::Instant now) {
  if (!working_ || abort_code_ != 0) return;
  drive_.stop(now);
  abort_code_ = std::to_underlying(error);
  stands_at_ = busy_until_ = std::max(now, drive_.stands_at());
}

void RobotServer::watch(hal::Instant now) {
  if (synchronised_ && now - last_line_ >= times_.watchdog) {
    ++counters_.watchdogs;
    raise(Event::watchdog, now);
  }
  repeat_event(now);
}

// Stops whatever is under way; numbered lines are refused until SYN.
void RobotServer::raise(Event event, hal::Instant now) {
  abort_work(event == Event::watchdog ? Error::stopped : Error::arm_off, now);
  synchronised_ = false;
  event_ = std::to_underlying(event);
  event_said_ = now - event_period;
  repeat_event(now);
}

void RobotServer::repeat_event(hal::Instant now) {
  if (event_ == 0 || now - event_said_ < event_period) return;
  event_said_ = now;
  Reply reply;
  reply.verb = Verb::evt;
  reply.code = event_;
  send(reply);
}

void RobotServer::send_fate() {
  Reply reply;
  reply.number = last_number_;
  switch (fate_) {
    case Fate::none:
      return;
    case Fate::under_way:
      reply.verb = Verb::ack;
      break;
    case Fate::done:
      reply.verb = Verb::don;
      reply.pose = fate_pose_;
      break;
    case Fate::failed:
      reply.verb = Verb::err;
      reply.code = fate_code_;
      break;
  }
  send(reply);
}

void RobotServer::refuse(int number, Refusal refusal) {
  ++counters_.refused;
  Reply reply;
  reply.number = number;
  reply.verb = Verb::nak;
  reply.refusal = refusal;
  reply.last_number = last_number_;
  send(reply);
}

// A line that does not fit is left out whole: the host asks again for what it misses.
void RobotServer::send(const Reply& reply) {
  const auto line = robot_line::format(reply);
  const std::string_view text = line.view();
  if (!connected_ || out_used_ + text.size() > out_.size()) return;
  text.copy(out_.data() + out_used_, text.size());
  out_used_ += text.size();
}

void RobotServer::flush() {
  const std::size_t taken = link_.write(std::as_bytes(std::span{out_}.first(out_used_)));
  std::memmove(out_.data(), out_.data() + taken, out_used_ - taken);
  out_used_ -= taken;
}

}  // namespace moldloft::host_sim
