#include "hal/robot/line_robot.hpp"

#include "hal/base/printable_text.hpp"

#include <algorithm>
#include <cassert>
#include <optional>
#include <utility>

namespace moldloft::hal {

using namespace robot_line;

namespace {

constexpr Instant never = Instant::max();

// The arm stops by itself after 3 s without a line (PROTOCOLS.md); pings must fit into that with one lost.
constexpr Duration robot_watchdog = 3s;

constexpr std::size_t bytes_a_tick = 1024;  // a line of 115200 baud brings 12 in a tick

// 8N1: ten bits a character. The longest line out and the longest answer back.
constexpr Duration time_of_two_lines(int baud) { return 2 * max_length * 10 * Duration{1s} / baud; }

constexpr const char* in_manual_mode = "robot: it is in manual mode; switch it to automatic, then go on";

Message text_of_event(int code) {
  switch (static_cast<Event>(code)) {
    case Event::emergency_stop:
      return "robot: emergency stop pressed; release it, switch power on, then clear";
    case Event::power_lost:
      return "robot: arm power is off; switch it on, then clear";
    case Event::watchdog:
      return "robot: stopped because no line came for 3 s; clear to synchronise again";
    case Event::motion_failed:
      return "robot: the motion failed; look at the arm, then clear";
  }
  return Message::format("robot: event {}; look at the arm, then clear", code);
}

Message text_of_error(int code) {
  switch (static_cast<Error>(code)) {
    case Error::out_of_reach:
      return "robot refuses: the target is out of reach";
    case Error::not_calibrated:
      return "robot refuses: it is not calibrated";
    case Error::bad_value:
      return "robot refuses: a value of the command is out of range";
    case Error::stopped:
      return "the motion was stopped before it arrived";
    case Error::arm_off:
      return "robot refuses: arm power is off";
    case Error::manual:
      return in_manual_mode;
  }
  return Message::format("robot: error {} (the controller's own number)", code);
}

}  // namespace

LineRobot::LineRobot(ByteLink& link, const Settings& settings)
    : session_{link,
               {.connect_timeout = settings.connect_timeout,
                .first_back_off = settings.first_back_off,
                .last_back_off = settings.last_back_off,
                .heartbeat = settings.ping_period,
                .silent_limit = settings.silent_limit,
                .outbox_bytes = 1024}},
      settings_{settings},
      answer_time_{settings.ack_timeout + time_of_two_lines(settings.baud)},
      nonce_{settings.first_nonce} {
  assert(settings.baud > 0 && settings.resends >= 0);
  assert(2 * settings.ping_period < robot_watchdog);
}

void LineRobot::cue(Cue what, Instant now) {
  const auto* row = find_transition(line_transitions(), phase_, what, context());
  if (row == nullptr) return;
  phase_ = row->to;
  carry_out(row->action, now);
}

LineContext LineRobot::context() const {
  return {.latched = latched_,
          .stopping = stop_requested_,
          .stop_known = !stop_wanted_,
          .has_resends = resends_ < settings_.resends};
}

// ---- what the cell asks

void LineRobot::start(Instant now) {
  if (session_.state() == DeviceSession::State::closed) why_ = "the robot has not answered SYN yet";
  session_.start(now);
}
void LineRobot::reset(Instant now) { cue(Cue::reset, now); }

bool LineRobot::move(const Pose& target, int speed_percent, Instant now) {
  if (!is_finite(target) || speed_percent < 1 || speed_percent > 100) return false;
  return begin({.verb = Verb::mov, .pose = target, .speed_percent = speed_percent}, now);
}

bool LineRobot::calibrate(Instant now) { return begin({.verb = Verb::cal}, now); }

bool LineRobot::begin(Command command, Instant now) {
  if (phase_ != Phase::ready) return false;
  command.number = next_number(number_);
  const Line line = format(command);
  if (line.empty()) return false;
  number_ = command.number;
  command_ = line;
  stop_requested_ = false;
  cue(Cue::command, now);
  return true;
}

// Goes out with the next transmit(), before anything else that is due, and again until it is answered.
void LineRobot::stop(Instant now) {
  stop_requested_ = true;
  stop_wanted_ = true;
  stop_due_ = now;
}

RobotState LineRobot::state() const {
  switch (phase_) {
    case Phase::offline:
      return RobotState::offline;
    case Phase::syncing:
    case Phase::checking:
    case Phase::locating:
      return RobotState::synchronising;
    case Phase::ready:
      return RobotState::ready;
    case Phase::commanded:
      return RobotState::commanded;
    case Phase::moving:
      return RobotState::moving;
    case Phase::faulted:
      return RobotState::faulted;
  }
  return RobotState::offline;
}

// ---- actions of the table

void LineRobot::carry_out(LineAction action, Instant now) {
  switch (action) {
    case LineAction::none:
      return;
    case LineAction::report_loss:
      return report_loss(now);
    case LineAction::report_silence:
      return report_silence(now);
    case LineAction::start_sync:
      return start_sync(now);
    case LineAction::send_syn:
      return send_syn(now);
    case LineAction::ask_status:
      return ask_status(now);
    case LineAction::send_stop:
      return send_stop(now);
    case LineAction::ask_pose:
      return ask_pose(now);
    case LineAction::announce:
      return announce();
    case LineAction::send_command:
      return send_command(now);
    case LineAction::resend_command:
      return resend_command(now);
    case LineAction::resend_afresh:
      // The robot is there and stands, yet no answer came: nothing but a bad line explains it, and the line may go on.
      resends_ = 0;
      return resend_command(now);
    case LineAction::report_moving:
      return report_moving();
    case LineAction::await_done:
      return await_done();
    case LineAction::report_done:
      return report_done(now);
    case LineAction::report_refused:
      return report_refused();
    case LineAction::report_stopped_and_sync:
      return report_stopped_and_sync(now);
    case LineAction::report_fault:
      return report_fault();
    case LineAction::unlatch:
      latched_ = false;
      return;
  }
}

void LineRobot::report_loss(Instant now) {
  if (std::exchange(announced_, false))
    events_.push({.kind = RobotEvent::Kind::lost, .pose = pose_, .text = why_});
  session_.lose(now);
}

// The port is still there: the robot's program may only be restarting. SYN goes out until it answers.
void LineRobot::report_silence(Instant now) {
  why_ = instead_of_lines().value_or(
      Message::format("the robot has been silent for {} ms", session_.silence(now) / 1ms));
  if (std::exchange(announced_, false))
    events_.push({.kind = RobotEvent::Kind::lost, .pose = pose_, .text = why_});
  start_sync(now);
}

void LineRobot::start_sync(Instant now) {
  latched_ = false;
  nonce_ = nonce_ >= largest_nonce ? 0 : nonce_ + 1;
  number_ = 0;
  send_syn(now);
}

// The same nonce again: an answer that comes late still counts.
void LineRobot::send_syn(Instant now) {
  if (session_.is_silent(now)) why_ = instead_of_lines().value_or("the robot does not answer SYN");
  answer_due_ = now + answer_time_;
  send(format(Command{.verb = Verb::syn, .nonce = nonce_}), now);
}

void LineRobot::ask_status(Instant now) {
  answer_due_ = now + answer_time_;
  ask(Verb::sta, now);
}

void LineRobot::send_stop(Instant now) {
  why_ = "the robot says that it moves; STP was sent, and no motion before it stands";
  answer_due_ = now + answer_time_;
  ask(Verb::stp, now);
}

void LineRobot::ask_pose(Instant now) {
  answer_due_ = now + answer_time_;
  ask(Verb::pos, now);
}

void LineRobot::announce() {
  session_.greeted();
  announced_ = true;
  stand_asked_ = moved_once_ = false;
  why_ = "";
  events_.push({.kind = RobotEvent::Kind::ready,
                .pose = pose_,
                .calibrated = status_.mode == Status::Mode::calibrated,
                .code = status_.last_error,
                .text = {}});
}

void LineRobot::send_command(Instant now) {
  resends_ = unfit_answers_ = 0;
  stand_due_ = never;
  stand_asked_ = moved_once_ = false;
  answer_due_ = now + answer_time_;
  done_due_ = now + settings_.done_timeout;
  send(command_, now);
}

void LineRobot::resend_command(Instant now) {
  ++resends_;
  ++repeated_lines_;
  answer_due_ = now + answer_time_;
  send(command_, now);
}

void LineRobot::report_moving() {
  await_done();
  events_.push({.kind = RobotEvent::Kind::moving, .pose = pose_, .text = {}});
}

void LineRobot::await_done() { answer_due_ = never; }

void LineRobot::report_done(Instant now) {
  stand_due_ = now + settings_.stand_check;
  events_.push({.kind = RobotEvent::Kind::done, .pose = pose_, .calibrated = true, .text = {}});
}

void LineRobot::report_refused() {
  events_.push(
      {.kind = RobotEvent::Kind::refused, .pose = pose_, .code = code_, .text = text_of_error(code_)});
}

// Whether the robot ever saw the command is unknown, and so is the number that it expects next:
// SYN settles both.
void LineRobot::report_stopped_and_sync(Instant now) {
  code_ = std::to_underlying(Error::stopped);
  report_refused();
  start_sync(now);
}

void LineRobot::report_fault() {
  latched_ = true;
  why_ = text_;
  const bool manual = code_ == std::to_underlying(Error::manual);
  events_.push({.kind = manual ? RobotEvent::Kind::manual : RobotEvent::Kind::fault,
                .pose = pose_,
                .code = code_,
                .text = text_});
}

// ---- what arrives

void LineRobot::receive(Instant now) {
  const DeviceSession::News news = session_.receive();
  if (news == DeviceSession::News::lost) {
    why_ = session_.why();
    return cue(Cue::link_lost, now);
  }
  if (news == DeviceSession::News::opened) {
    incoming_size_ = 0;
    overlong_ = false;
    return cue(Cue::link_open, now);
  }
  if (!session_.is_open()) return;
  std::array<std::byte, bytes_a_tick> bytes;
  const std::size_t count = session_.read(bytes);
  unread_ += count;
  take_bytes(std::span{bytes}.first(count), now);
}

void LineRobot::take_bytes(std::span<const std::byte> bytes, Instant now) {
  for (const std::byte byte : bytes) {
    const char c = static_cast<char>(byte);
    if (c == '\r') continue;  // V+ writes CR LF
    if (c == '\n') {
      if (overlong_) {
        garbled({incoming_.data(), incoming_size_}, Flaw::length, now);
      } else if (incoming_size_ > 0) {
        take_line({incoming_.data(), incoming_size_}, now);
      }
      incoming_size_ = 0;
      overlong_ = false;
    } else if (incoming_size_ == incoming_.size()) {
      overlong_ = true;
    } else {
      incoming_[incoming_size_++] = c;
    }
  }
}

void LineRobot::take_line(std::string_view line, Instant now) {
  const auto reply = parse_reply(line);
  if (!reply) return garbled(line, reply.error(), now);
  session_.heard(now);
  unread_ = shown_size_ = 0;
  switch (reply->verb) {
    case Verb::nak:
      return on_refusal(*reply, now);
    case Verb::evt:
      return fault(now, reply->code, text_of_event(reply->code));
    default:
      break;
  }
  reply->number == 0 ? on_answer(*reply, now) : on_numbered(*reply, now);
}

// Whatever it was, the same line again brings it back; soon, but not so soon that noise and repeats
// feed each other.
void LineRobot::garbled(std::string_view line, Flaw flaw, Instant now) {
  ++garbled_lines_;
  flaw_ = flaw;
  shown_size_ = std::min(line.size(), shown_.size());
  std::copy_n(line.data(), shown_size_, shown_.data());
  // SYN was answered, so the line is good: what comes now is of another form than it should have.
  if (phase_ == Phase::checking || phase_ == Phase::locating) why_ = *instead_of_lines();
  answer_due_ = std::min(answer_due_, now + settings_.garble_pause);
  // Noise does not bring the right checksum time and again: the robot's program writes numbers that no field holds.
  if (flaw == Flaw::fields && has_command() && ++unfit_answers_ > settings_.resends)
    fault(now, 0, *instead_of_lines());
}

// What has come since the last line that could be read.
std::optional<Message> LineRobot::instead_of_lines() const {
  if (unread_ == 0) return std::nullopt;
  const bool no_line_end = shown_size_ == 0 || overlong_;
  const std::string_view shown =
      no_line_end ? std::string_view{incoming_.data(), std::min<std::size_t>(incoming_size_, shown_of_line)}
                  : std::string_view{shown_.data(), shown_size_};
  return Message::format("the robot's answer cannot be read, {} ({} characters): \"{}\"",
                         no_line_end ? "it has no line end" : to_string(flaw_), unread_,
                         printable_text<2 * shown_of_line>(shown).view());
}

void LineRobot::on_answer(const Reply& reply, Instant now) {
  switch (reply.answers) {
    case Verb::syn:
      if (reply.nonce == nonce_)
        cue(Cue::synced, now);
      else if (phase_ == Phase::syncing)
        why_ =
            Message::format("the robot answers SYN {} with SYN {}: it must send the number back as it came",
                            nonce_, reply.nonce);
      break;
    case Verb::sta:
      on_status(reply.status, now);
      break;
    case Verb::pos:
      on_pose(reply.pose, now);
      break;
    case Verb::stp:
      stop_wanted_ = false;
      break;
    default:
      break;
  }
}

// An arm that stands has moved when two answers in a row say so: one may be an old line that came twice.
void LineRobot::on_pose(const Pose& pose, Instant now) {
  if (phase_ == Phase::locating) {
    pose_ = pose;
    return cue(Cue::located, now);
  }
  if (phase_ != Phase::ready || !std::exchange(stand_asked_, false)) return;
  const bool moved = pose != pose_;
  if (moved && moved_once_) {
    pose_ = pose;
    events_.push({.kind = RobotEvent::Kind::stands, .pose = pose_, .calibrated = true, .text = {}});
  } else if (moved) {
    stand_due_ = now;
  }
  moved_once_ = moved && !moved_once_;
}

void LineRobot::on_status(const Status& status, Instant now) {
  status_ = status;
  if (status.emergency_stop) {
    fault(now, std::to_underlying(Event::emergency_stop),
          text_of_event(std::to_underlying(Event::emergency_stop)));
  } else if (!status.power) {
    fault(now, std::to_underlying(Event::power_lost), text_of_event(std::to_underlying(Event::power_lost)));
  } else if (status.mode == Status::Mode::manual) {
    fault(now, std::to_underlying(Error::manual), in_manual_mode);  // whoever has the pendant has the arm
  } else {
    cue(status.moving ? Cue::in_motion : Cue::stands_still, now);
  }
}

void LineRobot::on_numbered(const Reply& reply, Instant now) {
  if (!has_command() || reply.number != number_) return;  // an earlier command's answer once more
  switch (reply.verb) {
    case Verb::ack:
      return cue(Cue::acked, now);
    case Verb::don:
      pose_ = reply.pose;
      return cue(Cue::done, now);
    case Verb::err:
      // After ACK the arm was on its way: where it stands now nobody planned, unless a stop was asked for.
      if ((phase_ == Phase::moving && !stop_requested_) || reply.code == std::to_underlying(Error::manual))
        return fault(now, reply.code, text_of_error(reply.code));
      code_ = reply.code;
      return cue(Cue::error, now);
    default:
      return;
  }
}

void LineRobot::on_refusal(const Reply& reply, Instant now) {
  switch (reply.refusal) {
    case Refusal::checksum:
      if (stop_wanted_) stop_due_ = now;
      if (answer_due_ != never) answer_due_ = now;
      return;
    case Refusal::not_synchronised:
      if (!has_command() || reply.number != number_) return;
      return fault(now, 0,
                   "the robot has restarted: what became of the last command is unknown; look, then clear");
    case Refusal::sequence:
      if (!has_command() || reply.number != number_) return;
      return fault(now, 0,
                   Message::format("the robot expects the number after {:04}, not {:04}: a second host?",
                                   reply.last_number, number_));
  }
}

void LineRobot::fault(Instant now, int code, const Message& text) {
  code_ = code;
  text_ = text;
  cue(Cue::fault, now);
}

// ---- time

void LineRobot::transmit(Instant now) {
  watch(now);
  session_.flush();
}

void LineRobot::watch(Instant now) {
  if (session_.transmit(now) == DeviceSession::News::no_connection) {
    why_ = "the robot's port does not open";
    return cue(Cue::link_lost, now);
  }
  if (!session_.is_open()) return;
  if (stop_wanted_ && now >= stop_due_) {
    stop_due_ = now + answer_time_;
    ask(Verb::stp, now);
  }
  if (phase_ > Phase::syncing && session_.is_silent(now)) cue(Cue::silent, now);
  if (has_command() && now >= done_due_) {
    stop(now);
    fault(now, 0,
          Message::format("the robot did not finish a command within {} s", settings_.done_timeout / 1s));
  }
  const bool waits = phase_ != Phase::ready && phase_ != Phase::faulted;
  if (waits && now >= answer_due_) cue(Cue::late, now);
  if (phase_ == Phase::ready && now >= stand_due_) ask_where_it_stands(now);
  if (session_.heartbeat_due(now)) sign_of_life(now);
}

void LineRobot::ask_where_it_stands(Instant now) {
  stand_due_ = never;
  stand_asked_ = ask(Verb::pos, now);
}

// Questions, where there is something to learn: how the robot is, and where an arm stands that has nothing to do.
void LineRobot::sign_of_life(Instant now) {
  if (has_command()) return void(ask(Verb::sta, now));
  if (phase_ != Phase::ready) return void(ask(Verb::png, now));
  status_asked_last_ = !status_asked_last_;
  status_asked_last_ ? void(ask(Verb::sta, now)) : ask_where_it_stands(now);
}

bool LineRobot::ask(Verb verb, Instant now) { return send(format(Command{.verb = verb}), now); }

// A line goes into the buffer whole or not at all; one that finds no room is as good as lost on the way.
bool LineRobot::send(std::string_view line, Instant now) {
  if (line.empty() || !session_.write(std::as_bytes(std::span{line}))) return false;
  session_.said(now);
  return true;
}

LossCounts LineRobot::losses() const {
  return {{"garbled lines", garbled_lines_},
          {"repeated lines", repeated_lines_},
          {"lost events", events_.dropped()}};
}

}  // namespace moldloft::hal
