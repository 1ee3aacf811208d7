// The driver of a robot that speaks the numbered lines of PROTOCOLS.md, on any byte link.
//
//     link open -> SYN -> STA -> POS -> ready -> MOV or CAL -> ACK -> DON -> ready
//
// The way through it is the table in line_table.cpp. A command has one number for its whole life and is
// repeated as the same line until its fate is known. A robot that keeps PROTOCOLS.md moves once for a number,
// however often it comes. When the fate cannot be known that way (robot restarted, link gone for good), the
// command is given up and never repeated. After SYN the cell learns from `ready` where the arm stands.
//
// Thread, blocking, allocation, failure: as Robot says
#pragma once

#include "hal/base/event_queue.hpp"
#include "hal/links/device_session.hpp"
#include "hal/robot/line_table.hpp"
#include "hal/robot/robot.hpp"
#include "hal/robot/robot_line.hpp"

#include <array>
#include <cstddef>
#include <optional>

namespace moldloft::hal {

class LineRobot final : public Robot {
 public:
  struct Settings {
    int baud = 115200;          // of the line, for the time that a line takes on it
    Duration ping_period = 1s;  // the robot stops after 3 s without a line: two may be lost
    Duration ack_timeout =
        500ms;        // for an interpreted program to read, check and answer; line times come on top
    int resends = 3;  // of a line without an answer, before the robot is asked how it stands
    Duration silent_limit = 3s;     // the robot's own watchdog; an arm that heard nothing has stopped by then
    Duration done_timeout = 60s;    // of one command; the longest path at the lowest speed takes less
    // After DON, before an arm that still has nothing to do is asked where it stands. A robot that said DON too
    // early, or only repeats its target, shows by then. After that once in two seconds.
    Duration stand_check = 50ms;
    Duration garble_pause = 20ms;   // after a garbled reply, before the same line goes again
    Duration connect_timeout = 2s;  // where the line is a terminal server's socket
    Duration first_back_off = 100ms;  // of opening the port again; doubles with each failure
    Duration last_back_off = 2s;
    // Of SYN; each time that SYN begins anew counts on. The program gives another one at each start: an answer to an
    // earlier program must not pass for one to this.
    std::uint32_t first_nonce = 1;
  };

  LineRobot(ByteLink&, const Settings&);

  void start(Instant now) override;
  void receive(Instant now) override;
  void transmit(Instant now) override;
  bool move(const Pose& target, int speed_percent, Instant now) override;
  bool calibrate(Instant now) override;
  void stop(Instant now) override;
  void reset(Instant now) override;
  std::optional<RobotEvent> next_event() override { return events_.pop(); }
  RobotState state() const override;
  std::string_view why() const override { return why_; }
  LossCounts losses() const override;
  std::size_t plan_bytes() const override { return sizeof *this + session_.plan_bytes(); }

 private:
  static constexpr std::size_t shown_of_line =
      40;  // of a line in a message: verb and fields, with room for the reason

  using Phase = LinePhase;
  using Cue = LineCue;

  void cue(Cue, Instant now);
  LineContext context() const MOLDLOFT_NONBLOCKING;
  void carry_out(LineAction, Instant now) MOLDLOFT_NONBLOCKING;

  // actions
  void report_loss(Instant now) MOLDLOFT_NONBLOCKING;
  void report_silence(Instant now) MOLDLOFT_NONBLOCKING;
  void start_sync(Instant now) MOLDLOFT_NONBLOCKING;
  void send_syn(Instant now) MOLDLOFT_NONBLOCKING;
  void ask_status(Instant now) MOLDLOFT_NONBLOCKING;
  void send_stop(Instant now) MOLDLOFT_NONBLOCKING;
  void ask_pose(Instant now) MOLDLOFT_NONBLOCKING;
  void announce() MOLDLOFT_NONBLOCKING;
  void send_command(Instant now) MOLDLOFT_NONBLOCKING;
  void resend_command(Instant now) MOLDLOFT_NONBLOCKING;
  void report_moving() MOLDLOFT_NONBLOCKING;
  void await_done() MOLDLOFT_NONBLOCKING;
  void report_done(Instant now) MOLDLOFT_NONBLOCKING;
  void report_refused() MOLDLOFT_NONBLOCKING;
  void report_stopped_and_sync(Instant now) MOLDLOFT_NONBLOCKING;
  void report_fault() MOLDLOFT_NONBLOCKING;

  // what arrives
  void take_bytes(std::span<const std::byte> bytes, Instant now);
  void take_line(std::string_view line, Instant now);
  void garbled(std::string_view line, robot_line::Flaw, Instant now);
  void on_answer(const robot_line::Reply&, Instant now);
  void on_status(const robot_line::Status&, Instant now);
  void on_numbered(const robot_line::Reply&, Instant now);
  void on_refusal(const robot_line::Reply&, Instant now);
  void fault(Instant now, int code, const Message& text);

  std::optional<Message> instead_of_lines() const;
  void watch(Instant now);
  void on_pose(const Pose&, Instant now);
  void ask_where_it_stands(Instant now);
  void sign_of_life(Instant now);
  bool has_command() const { return phase_ == Phase::commanded || phase_ == Phase::moving; }
  bool begin(robot_line::Command command, Instant now);
  bool ask(robot_line::Verb verb, Instant now);
  bool send(std::string_view line, Instant now);

  DeviceSession session_;
  const Settings settings_;
  const Duration answer_time_;  // ack_timeout and two of the longest lines
  EventQueue<RobotEvent, 16> events_;

  Phase phase_ = Phase::offline;
  bool latched_ = false;         // a fault that no operator has cleared yet
  bool announced_ = false;       // ready was reported and not taken back by lost
  bool stop_wanted_ = false;     // STP is not answered yet
  bool stop_requested_ = false;  // since the command was sent: ERR is then no fault
  int number_ = 0;               // of the last command
  std::uint32_t nonce_;
  robot_line::Line command_;  // as it goes over the wire, each time
  int resends_ = 0;
  Instant answer_due_{0};  // of the line that the phase waits on
  Instant stop_due_{0};
  Instant done_due_{0};
  Instant stand_due_ = Instant::max();  // of the question where the arm stands
  bool stand_asked_ = false, moved_once_ = false, status_asked_last_ = false;
  int unfit_answers_ = 0;  // to the command, with a right checksum and wrong fields
  robot_line::Status status_;
  Pose pose_;     // last reported
  int code_ = 0;  // of the last error or event
  Message text_;  // what the next event says
  Message why_ = "not started yet";

  std::array<char, robot_line::max_length> incoming_{};
  std::size_t incoming_size_ = 0;
  bool overlong_ = false;                    // the line on its way is too long: nothing of it counts
  std::uint64_t unread_ = 0;                 // characters since the last line that could be read
  std::array<char, shown_of_line> shown_{};  // of the last line that could not, its beginning
  std::size_t shown_size_ = 0;
  robot_line::Flaw flaw_{};           // of that line
  std::uint64_t garbled_lines_ = 0;   // received, and thrown away
  std::uint64_t repeated_lines_ = 0;  // sent again because no answer came
};

}  // namespace moldloft::hal
