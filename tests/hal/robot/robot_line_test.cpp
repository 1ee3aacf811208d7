#include "hal/robot/robot_line.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

using namespace moldloft::hal;
using namespace moldloft::hal::robot_line;

namespace {

std::string text(const Line& line) { return std::string{line.view()}; }

const Pose target{
    .x_mm = 412.35, .y_mm = -88.12, .z_mm = 155, .yaw = 0, .pitch = 180 * degree, .roll = 35 * degree};

}  // namespace

TEST_CASE("Fletcher-16 covers what stands between > or < and the star's space") {
  CHECK(fletcher16("abcde") == 51440);  // published test vectors
  CHECK(fletcher16("abcdef") == 8279);
  CHECK(fletcher16("abcdefgh") == 1575);
  CHECK(fletcher16("0123 ACK") == 7606);
  CHECK(fletcher16("0000 NAK CK") == 33642);
  CHECK(fletcher16("0123 ERR -1012") == 49122);
  CHECK(fletcher16("0125 NAK SQ 0123") == 9583);
  CHECK(fletcher16("0000 STA") == 18889);
  CHECK(fletcher16("0000 SYN 48213") == 23294);
  CHECK(fletcher16("0000 STA 1 0 0 2 0") == 45662);
}

TEST_CASE("the lines of the design, letter by letter") {
  CHECK(text(format(Command{.number = 123, .verb = Verb::mov, .pose = target, .speed_percent = 50})) ==
        ">0123 MOV 412.350 -88.120 155.000 0.000 180.000 35.000 50 *31910\n");
  CHECK(text(format(Command{.verb = Verb::sta})) == ">0000 STA *18889\n");
  CHECK(text(format(Command{.verb = Verb::syn, .nonce = 48213})) == ">0000 SYN 48213 *23294\n");
  CHECK(text(format(Reply{.number = 123, .verb = Verb::ack})) == "<0123 ACK *7606\n");
  const Pose done{.x_mm = 412.348,
                  .y_mm = -88.121,
                  .z_mm = 155.001,
                  .yaw = 0.001 * degree,
                  .pitch = 180 * degree,
                  .roll = 34.998 * degree};
  CHECK(text(format(Reply{.number = 123, .verb = Verb::don, .pose = done})) ==
        "<0123 DON 412.348 -88.121 155.001 0.001 180.000 34.998 *31027\n");
  CHECK(text(format(Reply{.number = 123, .verb = Verb::err, .code = -1012})) == "<0123 ERR -1012 *49122\n");
  CHECK(text(format(Reply{.verb = Verb::nak, .refusal = Refusal::checksum})) == "<0000 NAK CK *33642\n");
  CHECK(text(format(
            Reply{.number = 125, .verb = Verb::nak, .refusal = Refusal::sequence, .last_number = 123})) ==
        "<0125 NAK SQ 0123 *9583\n");
  CHECK(text(format(
            Reply{.answers = Verb::sta, .status = {.power = true, .mode = Status::Mode::calibrated}})) ==
        "<0000 STA 1 0 0 2 0 *45662\n");
}

TEST_CASE("every command and reply reads back as what was written") {
  for (const Verb verb : {Verb::syn, Verb::png, Verb::sta, Verb::pos, Verb::stp}) {
    const auto line = text(format(Command{.verb = verb, .nonce = 77}));
    const auto command = parse_command(line.substr(0, line.size() - 1));
    REQUIRE(command);
    CHECK(command->verb == verb);
    CHECK(command->nonce == (verb == Verb::syn ? 77 : 0));
  }
  const auto moved = parse_command(">0123 MOV 412.350 -88.120 155.000 0.000 180.000 35.000 50 *31910");
  REQUIRE(moved);
  CHECK(moved->number == 123);
  CHECK(moved->pose == target);
  CHECK(moved->speed_percent == 50);
  CHECK(parse_command(text(format(Command{.number = 9999, .verb = Verb::cal})).substr(0, 9 + 7))->verb ==
        Verb::cal);

  const auto status = parse_reply("<0000 STA 1 0 0 2 0 *45662");
  REQUIRE(status);
  CHECK(status->verb == Verb::ack);
  CHECK(status->answers == Verb::sta);
  CHECK(status->status == Status{.power = true, .mode = Status::Mode::calibrated});
  CHECK(parse_reply("<0123 ERR -1012 *49122")->code == -1012);
  CHECK(parse_reply("<0000 NAK CK *33642")->refusal == Refusal::checksum);
  CHECK(parse_reply("<0125 NAK SQ 0123 *9583")->last_number == 123);
  const auto event = text(format(Reply{.verb = Verb::evt, .code = static_cast<int>(Event::emergency_stop)}));
  CHECK(event.starts_with("<0000 EVT 1 *"));
  CHECK(parse_reply(event.substr(0, event.size() - 1))->code == 1);
  const auto refused =
      text(format(Reply{.number = 9, .verb = Verb::nak, .refusal = Refusal::not_synchronised}));
  CHECK(refused.starts_with("<0009 NAK SY *"));
  CHECK(parse_reply(refused.substr(0, refused.size() - 1))->refusal == Refusal::not_synchronised);
}

TEST_CASE("a pose comes back within half of the wire's last digit, and a second trip changes nothing") {
  std::mt19937 random{3};
  std::uniform_real_distribution<double> mm{-2000, 2000};
  std::uniform_real_distribution<double> angle{-3.2, 3.2};
  for (int i = 0; i < 2000; ++i) {
    const Pose pose{mm(random), mm(random), mm(random), angle(random), angle(random), angle(random)};
    const auto line = text(format(Reply{.number = 1, .verb = Verb::don, .pose = pose}));
    const auto back = parse_reply(line.substr(0, line.size() - 1));
    REQUIRE(back);
    REQUIRE(std::abs(back->pose.x_mm - pose.x_mm) <= 0.00050001);
    REQUIRE(std::abs(back->pose.roll - pose.roll) <= 0.00050001 * degree);
    REQUIRE(text(format(*back)) == line);
  }
}

TEST_CASE("minus zero is written as zero, and what cannot be written gives an empty line") {
  CHECK(text(format(Reply{.pose = {.x_mm = -0.0004}, .answers = Verb::pos}))
            .starts_with("<0000 POS 0.000 0.000 "));
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e6, -1e300}) {
    CHECK(
        format(Command{.number = 1, .verb = Verb::mov, .pose = {.x_mm = bad}, .speed_percent = 50}).empty());
    CHECK(
        format(Command{.number = 1, .verb = Verb::mov, .pose = {.roll = bad}, .speed_percent = 50}).empty());
  }
  CHECK(format(Command{.number = 10'000, .verb = Verb::cal}).empty());
  CHECK(format(Command{.number = -1, .verb = Verb::cal}).empty());
  CHECK(format(Command{.verb = Verb::syn, .nonce = 1u << 24}).empty());
}

TEST_CASE("the longest line there is stays within 120 characters") {
  const double far = 999'999.999;
  const Pose pose{-far, -far, -far, -far * degree, -far * degree, -far * degree};
  const Line line = format(Command{.number = 9999, .verb = Verb::mov, .pose = pose, .speed_percent = 100});
  CHECK(line.view().size() > 80);
  CHECK(line.view().size() <= max_length + 1);
  CHECK(parse_command(line.view().substr(0, line.view().size() - 1)));
}

TEST_CASE("every single bit that flips in a line is caught") {
  const std::string command = ">0123 MOV 412.350 -88.120 155.000 0.000 180.000 35.000 50 *31910";
  const std::string reply = "<0123 DON 412.348 -88.121 155.001 0.001 180.000 34.998 *31027";
  for (const auto& line : {command, reply}) {
    for (std::size_t bit = 0; bit < 8 * line.size(); ++bit) {
      auto flipped = line;
      flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
      CAPTURE(flipped);
      REQUIRE_FALSE(parse_command(flipped));
      REQUIRE_FALSE(parse_reply(flipped));
    }
  }
}

TEST_CASE("characters that are swapped, lost or doubled are caught") {
  const std::string line = ">0123 MOV 412.350 -88.120 155.000 0.000 180.000 35.000 50 *31910";
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    CAPTURE(i);
    auto swapped = line;
    std::swap(swapped[i], swapped[i + 1]);
    if (swapped != line) CHECK_FALSE(parse_command(swapped));
    auto lost = line;
    lost.erase(i, 1);
    CHECK_FALSE(parse_command(lost));
    auto doubled = line;
    doubled.insert(i, 1, line[i]);
    CHECK_FALSE(parse_command(doubled));
  }
}

TEST_CASE("a line that is not one says why") {
  const auto flaw = [](const std::string& body) {
    const auto parsed = parse_command(">" + body + " *" + std::to_string(fletcher16(body)));
    return parsed ? Flaw::none : parsed.error();
  };
  CHECK(flaw("0001 CAL") == Flaw::none);
  CHECK(flaw("0000 CAL") == Flaw::number);  // changes something: must be numbered
  CHECK(flaw("0001 STA") == Flaw::number);  // changes nothing: must not be
  CHECK(flaw("001 CAL") == Flaw::number);
  CHECK(flaw("+001 CAL") == Flaw::number);
  CHECK(flaw("0001 ACK") == Flaw::verb);  // the robot's word
  CHECK(flaw("0001 cal") == Flaw::verb);
  CHECK(flaw("0001") == Flaw::verb);
  CHECK(flaw("0001 CAL 1") == Flaw::fields);
  CHECK(flaw("0001 CAL ") == Flaw::fields);
  CHECK(flaw("0000 SYN 16777216") == Flaw::fields);  // V+ counts exactly to 2^24 only
  CHECK(flaw("0001 MOV 1 2 3 4 5 6 50") == Flaw::none);
  CHECK(flaw("0001 MOV 1 2 3 4 5 6 0") == Flaw::fields);
  CHECK(flaw("0001 MOV 1 2 3 4 5 6 101") == Flaw::fields);
  CHECK(flaw("0001 MOV 1 2 3 4 5 50") == Flaw::fields);
  CHECK(flaw("0001 MOV 1. 2 3 4 5 6 50") == Flaw::fields);
  CHECK(flaw("0001 MOV 1.0000 2 3 4 5 6 50") == Flaw::fields);
  CHECK(flaw("0001 MOV 1e3 2 3 4 5 6 50") == Flaw::fields);
  CHECK(flaw("0001 MOV nan 2 3 4 5 6 50") == Flaw::fields);
  CHECK(flaw("0001 MOV 1  2 3 4 5 6 50") == Flaw::fields);
  CHECK(parse_command("").error() == Flaw::start);
  CHECK(parse_command("<0123 ACK *7606").error() == Flaw::start);
  CHECK(parse_command(">" + std::string(120, 'a')).error() == Flaw::length);
  CHECK(parse_command(">0000 STA\t*18889").error() == Flaw::characters);
  CHECK(parse_command(">0000 STA *018889").error() == Flaw::checksum);
  CHECK(parse_command(">0000 STA *").error() == Flaw::checksum);
  CHECK(parse_reply("<0123 MOV *" + std::to_string(fletcher16("0123 MOV"))).error() == Flaw::verb);
  CHECK(parse_reply("<0001 STA 1 0 0 2 0 *" + std::to_string(fletcher16("0001 STA 1 0 0 2 0"))).error() ==
        Flaw::number);
  CHECK(parse_reply("<0001 NAK XX *" + std::to_string(fletcher16("0001 NAK XX"))).error() == Flaw::fields);
  CHECK(parse_reply("<0001 NAK XX Y *" + std::to_string(fletcher16("0001 NAK XX Y"))).error() ==
        Flaw::fields);
  CHECK(parse_reply("<0000 STA 1 0 0 3 0 *" + std::to_string(fletcher16("0000 STA 1 0 0 3 0"))).error() ==
        Flaw::fields);
}

TEST_CASE("random text never crashes the parsers, with a right checksum it still has to be a line") {
  std::mt19937 random{4};
  const std::string alphabet = "0123456789 -.MOVCALSYNPGTDERKQ*<>";
  for (int i = 0; i < 50'000; ++i) {
    std::string body;
    for (std::size_t k = random() % 130; k > 0; --k) body += alphabet[random() % alphabet.size()];
    (void)parse_command(body);
    (void)parse_reply(body);
    const std::string sum = " *" + std::to_string(fletcher16(body));
    if (const auto command = parse_command(">" + body + sum)) CHECK_FALSE(format(*command).empty());
    if (const auto reply = parse_reply("<" + body + sum)) CHECK_FALSE(format(*reply).empty());
  }
}

TEST_CASE("0001 follows 9999") {
  CHECK(next_number(0) == 1);
  CHECK(next_number(9998) == 9999);
  CHECK(next_number(9999) == 1);
}
