// Goes through a text word by word and knows the line: LF, CRLF and CR end lines, blanks and tabs end words.
//
// Cost         linear; a number about 30 ns
// Allocation   none; words are views of the text
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace moldloft::host_sim {

class TextCursor {
 public:
  explicit TextCursor(std::string_view text, std::size_t first_line = 1)
      : at_(text.data()), end_(text.data() + text.size()), line_(first_line) {}

  std::size_t line() const { return line_; }
  std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - at_); }

  // The next word of this line; empty when the line has no more.
  std::string_view word_on_line();
  // The next word, on whatever line; empty at the end of the text.
  std::string_view word();
  // What is left of this line, without blanks around it; then the next line begins. False at the end of the text.
  bool line_rest(std::string_view& rest);

 private:
  const char* at_;
  const char* end_;
  std::size_t line_;
};

std::string lower_case(std::string_view);

// A number as programs write them: with a plus, an exponent of E or D, "nan", "-1.#IND". Nothing for other words.
std::optional<double> number_in(std::string_view word);
// Why a word is no number, for a person: a decimal comma is named.
std::string why_no_number(std::string_view word);

}  // namespace moldloft::host_sim
