#include "hal/robot/robot_line.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

// Text in memory that is there: substr() throws beyond the end, where none of these looks, and to_chars() and
// from_chars() lie in the standard library.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::hal::robot_line {
namespace {

using namespace std::string_view_literals;

constexpr std::array<std::pair<Verb, std::string_view>, 12> verbs{{{Verb::mov, "MOV"},
                                                                   {Verb::cal, "CAL"},
                                                                   {Verb::syn, "SYN"},
                                                                   {Verb::png, "PNG"},
                                                                   {Verb::sta, "STA"},
                                                                   {Verb::pos, "POS"},
                                                                   {Verb::stp, "STP"},
                                                                   {Verb::ack, "ACK"},
                                                                   {Verb::don, "DON"},
                                                                   {Verb::err, "ERR"},
                                                                   {Verb::nak, "NAK"},
                                                                   {Verb::evt, "EVT"}}};

constexpr std::array<std::pair<Refusal, std::string_view>, 3> refusals{
    {{Refusal::checksum, "CK"}, {Refusal::sequence, "SQ"}, {Refusal::not_synchronised, "SY"}}};

constexpr std::int64_t largest_code = 999'999;
// Six digits before the point: 999.999 m and 999,999 degrees are far beyond any arm, and six such fields
// fit a line.
constexpr std::int64_t largest_thousandths = 999'999'999;

std::string_view name_of(Verb verb) {
  return std::ranges::find(verbs, verb, &std::pair<Verb, std::string_view>::first)->second;
}

std::optional<Verb> verb_of(std::string_view name) {
  const auto* found = std::ranges::find(verbs, name, &std::pair<Verb, std::string_view>::second);
  if (found == verbs.end()) return std::nullopt;
  return found->first;
}

bool is_numbered(Verb verb) { return verb == Verb::mov || verb == Verb::cal; }
bool is_question(Verb verb) { return verb >= Verb::syn && verb <= Verb::stp; }

// ---- writing

class LineWriter {
 public:
  explicit LineWriter(char start) { put(start); }

  void put(char c) noexcept {
    if (size_ < text_.size()) {
      text_[size_++] = c;
    } else {
      good_ = false;
    }
  }
  void put(std::string_view text) noexcept {
    for (const char c : text) put(c);
  }
  void word(std::string_view text) noexcept {
    put(' ');
    put(text);
  }
  void integer(std::int64_t value, std::int64_t limit) noexcept {
    if (value > limit || value < -limit) {
      good_ = false;
      return;
    }
    std::array<char, 24> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    word({digits.data(), static_cast<std::size_t>(end - digits.data())});
  }
  void number(int value) noexcept {  // always four digits
    good_ = good_ && value >= 0 && value <= last_number;
    for (const int power : {1000, 100, 10, 1}) put(static_cast<char>('0' + value / power % 10));
  }
  // Three decimals through a whole number of thousandths: no locale, no heap, and never "-0.000".
  void decimal(double value) noexcept {
    // Compared as a double first: a number that no integer holds must not reach llround().
    const std::int64_t thousandths =
        std::abs(value) < 1e6 ? std::llround(value * 1000) : largest_thousandths + 1;
    if (std::abs(thousandths) > largest_thousandths) {
      good_ = false;
      return;
    }
    const std::int64_t size = std::abs(thousandths);
    std::array<char, 24> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), size / 1000).ptr;
    put(' ');
    if (thousandths < 0) put('-');
    put({digits.data(), static_cast<std::size_t>(end - digits.data())});
    put('.');
    for (const std::int64_t power : {100, 10, 1}) put(static_cast<char>('0' + size / power % 10));
  }
  void pose(const Pose& pose) noexcept {
    for (const double mm : {pose.x_mm, pose.y_mm, pose.z_mm}) decimal(mm);
    for (const double angle : {pose.yaw, pose.pitch, pose.roll}) decimal(angle / degree);
  }
  // An empty line says that the message cannot be written: a pose that is not finite, a number out of range.
  Line finish() noexcept {
    if (!good_) return {};
    const std::uint16_t sum = fletcher16(view().substr(1));
    put(" *"sv);
    std::array<char, 8> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), sum).ptr;
    put({digits.data(), static_cast<std::size_t>(end - digits.data())});
    put('\n');
    return good_ ? Line{view()} : Line{};
  }

 private:
  std::string_view view() const noexcept { return {text_.data(), size_}; }

  std::array<char, max_length + 1> text_{};
  std::size_t size_ = 0;
  bool good_ = true;
};

// ---- reading

// The words of a checked line, one space between them.
class Words {
 public:
  explicit Words(std::string_view text) : rest_{text} {}

  std::string_view next() noexcept {
    if (done_) {
      good_ = false;
      return {};
    }
    const auto end = rest_.find(' ');
    const auto word = rest_.substr(0, end);
    done_ = end == std::string_view::npos;
    rest_.remove_prefix(done_ ? rest_.size() : end + 1);
    good_ = good_ && !word.empty();
    return word;
  }
  std::int64_t integer(std::int64_t least, std::int64_t most) noexcept {
    const auto word = next();
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    good_ =
        good_ && error == std::errc{} && end == word.data() + word.size() && value >= least && value <= most;
    return good_ ? value : 0;
  }
  int number() noexcept {
    const auto word = next();
    good_ =
        good_ && word.size() == 4 && std::ranges::all_of(word, [](char c) { return c >= '0' && c <= '9'; });
    if (!good_) return 0;
    int value = 0;
    for (const char c : word) value = 10 * value + (c - '0');
    return value;
  }
  // [-]digits[.digits], at most six before and three after the point, as a whole number of thousandths.
  double decimal() noexcept {
    auto word = next();
    const bool negative = word.starts_with('-');
    if (negative) word.remove_prefix(1);
    const auto point = word.find('.');
    const auto whole = word.substr(0, point);
    const auto part = point == std::string_view::npos ? std::string_view{} : word.substr(point + 1);
    const bool shaped = !whole.empty() && whole.size() <= 6 && part.size() <= 3 &&
                        (point == std::string_view::npos || !part.empty());
    std::int64_t thousandths = 0;
    bool digits = true;
    for (const auto text : {whole, part, "000"sv.substr(std::min<std::size_t>(part.size(), 3))}) {
      for (const char c : text) {
        digits = digits && c >= '0' && c <= '9';
        thousandths = digits && shaped ? 10 * thousandths + (c - '0') : 0;
      }
    }
    good_ = good_ && shaped && digits;
    return static_cast<double>(negative ? -thousandths : thousandths) / 1000;
  }
  Pose pose() noexcept {
    Pose pose;
    for (double* mm : {&pose.x_mm, &pose.y_mm, &pose.z_mm}) *mm = decimal();
    for (double* angle : {&pose.yaw, &pose.pitch, &pose.roll}) *angle = decimal() * degree;
    return pose;
  }
  bool done() const noexcept { return done_; }
  bool good() const noexcept { return good_; }

 private:
  std::string_view rest_;
  bool done_ = false;
  bool good_ = true;
};

// Takes a line apart as far as both sides share it; gives the text that the checksum covers.
std::expected<std::string_view, Flaw> checked_text(char start, std::string_view line) {
  if (line.size() > max_length) return std::unexpected{Flaw::length};
  if (line.empty() || line.front() != start) return std::unexpected{Flaw::start};
  const auto printable = [](char c) { return c >= 32 && c <= 126 && c != '"'; };
  if (!std::ranges::all_of(line, printable)) return std::unexpected{Flaw::characters};
  const auto star = line.rfind(" *");
  if (star == std::string_view::npos) return std::unexpected{Flaw::checksum};
  const auto text = line.substr(1, star - 1);
  const auto digits = line.substr(star + 2);
  std::uint32_t sum = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), sum);
  const bool plain = !digits.empty() && (digits.front() != '0' || digits.size() == 1);
  if (error != std::errc{} || end != digits.data() + digits.size() || !plain || sum != fletcher16(text)) {
    return std::unexpected{Flaw::checksum};
  }
  return text;
}

void read_answer(Words& words, Reply& reply) {
  switch (reply.answers) {
    case Verb::syn:
      reply.nonce = static_cast<std::uint32_t>(words.integer(0, largest_nonce));
      break;
    case Verb::sta:
      reply.status.power = words.integer(0, 1) != 0;
      reply.status.emergency_stop = words.integer(0, 1) != 0;
      reply.status.moving = words.integer(0, 1) != 0;
      reply.status.mode = static_cast<Status::Mode>(words.integer(0, 2));
      reply.status.last_error = static_cast<int>(words.integer(-largest_code, largest_code));
      break;
    case Verb::pos:
      reply.pose = words.pose();
      break;
    default:
      break;
  }
}

void read_refusal(Words& words, Reply& reply) {
  const auto name = words.next();
  const auto* found = std::ranges::find(refusals, name, &std::pair<Refusal, std::string_view>::second);
  if (found == refusals.end()) {
    words.next();  // runs beyond the end, or leaves a rest that nobody reads: not good either way
    reply.last_number = -1;
    return;
  }
  reply.refusal = found->first;
  if (reply.refusal == Refusal::sequence) reply.last_number = words.number();
}

}  // namespace

std::string_view to_string(Flaw flaw) {
  switch (flaw) {
    case Flaw::none:
      return "no flaw";
    case Flaw::start:
      return "does not begin with the right character";
    case Flaw::length:
      return "longer than 120 characters";
    case Flaw::characters:
      return "a character that has no place in a line";
    case Flaw::checksum:
      return "checksum wrong";
    case Flaw::number:
      return "number wrong for this verb";
    case Flaw::verb:
      return "unknown verb";
    case Flaw::fields:
      return "wrong fields for this verb";
  }
  return "unknown flaw";
}

std::uint16_t fletcher16(std::string_view text) noexcept {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  for (const char c : text) {
    a = (a + static_cast<unsigned char>(c)) % 255;
    b = (b + a) % 255;
  }
  return static_cast<std::uint16_t>(b * 256 + a);
}

Line format(const Command& command) noexcept {
  LineWriter line{'>'};
  line.number(command.number);
  line.word(name_of(command.verb));
  if (command.verb == Verb::mov) {
    line.pose(command.pose);
    line.integer(command.speed_percent, 100);
  }
  if (command.verb == Verb::syn) line.integer(command.nonce, largest_nonce);
  return line.finish();
}

Line format(const Reply& reply) noexcept {
  LineWriter line{'<'};
  line.number(reply.number);
  const bool answer = reply.number == 0 && reply.verb == Verb::ack;
  const Verb verb = answer ? reply.answers : reply.verb;
  line.word(name_of(verb));
  switch (verb) {
    case Verb::syn:
      line.integer(reply.nonce, largest_nonce);
      break;
    case Verb::sta:
      for (const bool flag : {reply.status.power, reply.status.emergency_stop, reply.status.moving})
        line.integer(flag, 1);
      line.integer(std::to_underlying(reply.status.mode), 2);
      line.integer(reply.status.last_error, largest_code);
      break;
    case Verb::pos:
    case Verb::don:
      line.pose(reply.pose);
      break;
    case Verb::err:
    case Verb::evt:
      line.integer(reply.code, largest_code);
      break;
    case Verb::nak:
      line.word(
          std::ranges::find(refusals, reply.refusal, &std::pair<Refusal, std::string_view>::first)->second);
      if (reply.refusal == Refusal::sequence) {
        line.put(' ');
        line.number(reply.last_number);
      }
      break;
    default:
      break;
  }
  return line.finish();
}

std::expected<Command, Flaw> parse_command(std::string_view line) noexcept {
  const auto text = checked_text('>', line);
  if (!text) return std::unexpected{text.error()};
  Words words{*text};
  Command command;
  command.number = words.number();
  if (!words.good()) return std::unexpected{Flaw::number};
  const auto verb = verb_of(words.next());
  if (!verb || !(is_numbered(*verb) || is_question(*verb))) return std::unexpected{Flaw::verb};
  command.verb = *verb;
  if (is_numbered(*verb) != (command.number != 0)) return std::unexpected{Flaw::number};
  if (*verb == Verb::mov) {
    command.pose = words.pose();
    command.speed_percent = static_cast<int>(words.integer(1, 100));
  }
  if (*verb == Verb::syn) command.nonce = static_cast<std::uint32_t>(words.integer(0, largest_nonce));
  if (!words.good() || !words.done()) return std::unexpected{Flaw::fields};
  return command;
}

std::expected<Reply, Flaw> parse_reply(std::string_view line) noexcept {
  const auto text = checked_text('<', line);
  if (!text) return std::unexpected{text.error()};
  Words words{*text};
  Reply reply;
  reply.number = words.number();
  if (!words.good()) return std::unexpected{Flaw::number};
  const auto verb = verb_of(words.next());
  if (!verb || is_numbered(*verb)) return std::unexpected{Flaw::verb};
  const bool numbered = *verb == Verb::ack || *verb == Verb::don || *verb == Verb::err;
  const bool either = *verb == Verb::nak;
  if (!either && numbered != (reply.number != 0)) return std::unexpected{Flaw::number};
  if (is_question(*verb)) {
    reply.answers = *verb;
    read_answer(words, reply);
  } else {
    reply.verb = *verb;
  }
  if (*verb == Verb::don) {
    reply.pose = words.pose();
  }
  if (*verb == Verb::err || *verb == Verb::evt) {
    reply.code = static_cast<int>(words.integer(-largest_code, largest_code));
  }
  if (*verb == Verb::nak) read_refusal(words, reply);
  if (!words.good() || !words.done() || reply.last_number < 0) return std::unexpected{Flaw::fields};
  return reply;
}

}  // namespace moldloft::hal::robot_line
