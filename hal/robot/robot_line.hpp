// The robot's wire: ASCII lines with a number and a Fletcher-16 checksum, as pure functions on text. The
// specification is PROTOCOLS.md; this is its code.
//
//     >0123 MOV 412.350 -88.120 155.000 0.000 180.000 35.000 50 *31910       host to robot
//     <0123 DON 412.348 -88.121 155.001 0.001 180.000 34.998 *31027          robot to host
//
// Thread       any: no state
// Allocation   none; formatters write into the caller's line
// Failure      a line that is not one gives the reason; a line never exceeds 120 characters
#pragma once

#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/robot/pose.hpp"

#include <cstdint>
#include <expected>
#include <string_view>

namespace moldloft::hal::robot_line {

constexpr std::uint16_t default_port = 4015;  // where the lines go over TCP
constexpr std::size_t max_length = 120;       // a V+ string holds 128 characters
constexpr int last_number = 9999;             // 0001 follows 9999; 0000 marks the lines that change nothing
// V+ keeps numbers in single precision: integers are exact up to here.
constexpr std::uint32_t largest_nonce = (1u << 24) - 1;

using Line = FixedText<max_length + 1>;  // with its LF

enum class Verb {
  mov,
  cal,  // host, numbered: change something
  syn,
  png,
  sta,
  pos,
  stp,  // host, 0000: harmless, answered at any time
  ack,
  don,
  err,
  nak,
  evt,  // robot
};

enum class Refusal { checksum, sequence, not_synchronised };  // NAK CK, NAK SQ last, NAK SY

// Robot status as STA reports it.
struct Status {
  bool power = false, emergency_stop = false, moving = false;
  enum class Mode { manual = 0, automatic = 1, calibrated = 2 } mode = Mode::manual;
  int last_error = 0;

  friend bool operator==(const Status&, const Status&) = default;
};

struct Command {  // a host line
  int number = 0;
  Verb verb = Verb::png;
  Pose pose{};              // MOV
  int speed_percent = 0;    // MOV
  std::uint32_t nonce = 0;  // SYN
};

// What EVT says, unasked, once a second until the next SYN. Positive, so that they never meet V+'s own error
// numbers, which are negative and pass through ERR and STA as they are.
enum class Event : int { emergency_stop = 1, power_lost = 2, watchdog = 3, motion_failed = 4 };

// What ERR says where the controller has no number of its own for it.
enum class Error : int {
  out_of_reach = 1,
  bad_value = 2,
  not_calibrated = 3,
  stopped = 4,
  arm_off = 5,
  manual = 6
};

// An answer to a 0000 line has number 0, verb ack and the question in `answers`; on the wire it begins with
// the question's own verb ("<0000 STA 1 0 0 2 0").
struct Reply {  // a robot line
  int number = 0;
  Verb verb = Verb::ack;
  Pose pose{};               // DON, and the answer to POS
  Verb answers = Verb::ack;  // for 0000 lines: which question is answered (syn, png, sta, pos, stp)
  Status status{};           // STA
  std::uint32_t nonce = 0;   // SYN
  int code = 0;              // ERR, EVT
  Refusal refusal{};         // NAK
  int last_number = 0;       // NAK SQ
};

enum class Flaw { none, start, length, characters, checksum, number, verb, fields };
std::string_view to_string(Flaw) MOLDLOFT_NONBLOCKING;

std::uint16_t fletcher16(std::string_view text) noexcept;  // "abcde" gives 51440

// With LF; empty if it cannot be said (not finite, or outside of what a field holds).
Line format(const Command&) noexcept MOLDLOFT_NONBLOCKING;
Line format(const Reply&) noexcept;
std::expected<Command, Flaw> parse_command(std::string_view line) noexcept;  // without CR and LF
std::expected<Reply, Flaw> parse_reply(std::string_view line) noexcept MOLDLOFT_NONBLOCKING;

constexpr int next_number(int number) noexcept { return number == last_number ? 1 : number + 1; }

}  // namespace moldloft::hal::robot_line
