#include "hal/base/printable_text.hpp"

#include "hal/scanner/psc1.hpp"

#include <doctest/doctest.h>

#include <random>

using namespace moldloft::hal;
using namespace std::string_literals;

namespace {

// RFC 3629 read once more, by the table of its section 4 instead of by arithmetic on the code.
bool is_utf8(std::string_view text) {
  const auto in = [&](std::size_t i, int low, int high) {
    return i < text.size() && static_cast<unsigned char>(text[i]) >= low &&
           static_cast<unsigned char>(text[i]) <= high;
  };
  for (std::size_t i = 0; i < text.size();) {
    const auto tail = [&](std::size_t from, std::size_t to) {
      for (std::size_t k = from; k <= to; ++k)
        if (!in(i + k, 0x80, 0xBF)) return false;
      return true;
    };
    if (in(i, 0x00, 0x7F)) {
      i += 1;
    } else if (in(i, 0xC2, 0xDF) && tail(1, 1)) {
      i += 2;
    } else if (((in(i, 0xE0, 0xE0) && in(i + 1, 0xA0, 0xBF)) ||
                (in(i, 0xED, 0xED) && in(i + 1, 0x80, 0x9F)) ||
                ((in(i, 0xE1, 0xEC) || in(i, 0xEE, 0xEF)) && tail(1, 1))) &&
               tail(2, 2)) {
      i += 3;
    } else if (((in(i, 0xF0, 0xF0) && in(i + 1, 0x90, 0xBF)) ||
                (in(i, 0xF4, 0xF4) && in(i + 1, 0x80, 0x8F)) || (in(i, 0xF1, 0xF3) && tail(1, 1))) &&
               tail(2, 3)) {
      i += 4;
    } else {
      return false;
    }
  }
  return true;
}

bool has_control(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x20 || c == 0x7F) return true;
    if (c == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0)
      return true;  // C1
  }
  return false;
}

}  // namespace

TEST_CASE("what is fit to be read stays as it is") {
  for (const std::string& text :
       {""s, "61 °C"s, "Blech Ä 12, 側板, 🚢"s, "<b>&\"'%s {} \\ $(x)"s, "-> \u00A0 <-"s})
    CHECK(printable(text) == text);
}

TEST_CASE("a device's Latin-1 is read as what it meant") {
  CHECK(printable("laser 61 \xB0"s + "C") == "laser 61 °C");
  CHECK(printable("Pr\xFC"s + "fung, \xDF, \xA0") == "Prüfung, ß, ?");
  CHECK(printable("half \xC3") == "half Ã");  // a character that somebody cut in two
}

TEST_CASE("line ends and tabs become blanks, other controls, NUL and marks without a shape a question mark") {
  CHECK(printable("a\nb\r\nc\td") == "a b  c d");
  CHECK(printable("a\0b\x1b[2Jc\x7F"s) == "a?b?[2Jc?");
  CHECK(printable("a\u0085b\u2028c\u202Ed\uFEFFe\uFFFEf") == "a?b?c?d?e?f");
}

TEST_CASE("overlong forms, surrogates and what lies beyond Unicode never pass for a character") {
  CHECK(printable("\xC0\xAF") == "À¯");       // an overlong slash
  CHECK(printable("\xE0\x80\xAF") == "à?¯");  // the same in three bytes
  CHECK(printable("\xED\xA0\x80") == "í??");  // a lone surrogate; 0xA0 alone is a blank that shows nothing
  CHECK(printable("\xF4\x90\x80\x80") == "ô???");  // U+110000
  CHECK(printable("\xF8\x88\x80\x80\x80") == "ø????");
}

TEST_CASE("a text that is too long is cut between characters, and says so") {
  const std::string degrees = "°°°°°°°°°°";  // two bytes each
  CHECK(printable(degrees, 20) == degrees);
  CHECK(printable(degrees, 19) == "°°°°°°°°...");
  CHECK(printable(degrees, 18) == "°°°°°°°...");  // 15 bytes would end within a character
  CHECK(printable(std::string(100'000, 'x'), 10) == "xxxxxxx...");
  CHECK(printable(std::string(100'000, '\xB0')).size() <= longest_printable);
  CHECK(printable(std::string(100'000, '\0')).size() == longest_printable);
  CHECK(printable("abcdef", 2) == "ab");
}

TEST_CASE("a fixed text is cut between characters, however it is made") {
  CHECK(FixedText<4>{"abc°"}.view() == "abc");
  CHECK(FixedText<5>{"abc°"}.view() == "abc°");
  CHECK(FixedText<5>{"abc°d"}.view() == "abc°");
  CHECK(FixedText<6>{"abc側板"}.view() == "abc側");
  CHECK(FixedText<4>::format("abc{}", "°").view() == "abc");
  CHECK(FixedText<6>::format("{}🚢", "abc").view() == "abc");
  CHECK(FixedText<4>{"abcdef"}.view() == "abcd");
  CHECK(printable_text<3>("\xB0\xB0\xB0").view() == "°");
}

TEST_CASE("any bytes at all come out as one line of valid UTF-8, and a second time as the same") {
  std::mt19937 random{7};
  for (int round = 0; round < 20'000; ++round) {
    std::string text(random() % 40, '\0');
    for (char& c : text) c = static_cast<char>(random() % 3 == 0 ? random() % 128 : 0x80 + random() % 128);
    const std::string fit = printable(text);
    CAPTURE(text);
    CHECK(is_utf8(fit));
    CHECK_FALSE(has_control(fit));
    CHECK(printable(fit) == fit);
  }
}

TEST_CASE("the text of a scanner's ERROR is printable as soon as it is decoded") {
  const psc1::ErrorReply sent{.status = psc1::Status::sensor_fault,
                              .shot_id = 7,
                              .text =
                                  "laser\n61 \xB0"
                                  "C\x1b"};
  std::array<std::byte, 256> wire;
  const std::size_t size = psc1::encode(1, sent, wire);
  const auto payload =
      std::span{wire}.subspan(psc1::header_size, size - psc1::header_size - psc1::payload_crc_size);
  const auto read = psc1::decode_error(payload);
  REQUIRE(read.has_value());
  CHECK(read->text.view() == "laser 61 °C?");
}
