#include "tree/source_text.hpp"

#include <cctype>
#include <regex>

namespace moldloft::tree {
namespace {

class Blanker {
 public:
  Blanker(std::string_view text, bool literals_too) : text_{text}, out_{text}, literals_too_{literals_too} {}

  std::string run() {
    while (at_ < text_.size()) {
      if (starts("//"))
        blank_until("\n", true, false);
      else if (starts("/*"))
        blank_until("*/", true, true);
      else if (starts("R\"") && !in_a_word())
        raw_literal();
      else if (text_[at_] == '"')
        literal('"');
      else if (text_[at_] == '\'' && !in_a_word())
        literal('\'');  // 1'000 is a number
      else
        ++at_;
    }
    return out_;
  }

 private:
  bool starts(std::string_view s) const { return text_.substr(at_, s.size()) == s; }
  bool in_a_word() const { return at_ > 0 && std::isalnum(static_cast<unsigned char>(text_[at_ - 1])) != 0; }

  void blank(std::size_t end, bool really) {
    for (; at_ < end; ++at_) {
      if (really && text_[at_] != '\n') out_[at_] = ' ';
    }
  }
  void blank_until(std::string_view mark, bool really, bool with_mark) {
    const auto found = text_.find(mark, at_ + 2);
    blank(found == text_.npos ? text_.size() : found + (with_mark ? mark.size() : 0), really);
  }
  void raw_literal() {
    const auto open = text_.find('(', at_);
    if (open == text_.npos) return blank(text_.size(), false);
    blank_until(")" + std::string{text_.substr(at_ + 2, open - at_ - 2)} + "\"", literals_too_, true);
  }
  void literal(char quote) {
    std::size_t end = at_ + 1;
    while (end < text_.size() && text_[end] != quote && text_[end] != '\n') end += text_[end] == '\\' ? 2 : 1;
    ++at_;  // the quotes stay
    blank(std::min(end, text_.size()), literals_too_);
    ++at_;
  }

  std::string_view text_;
  std::string out_;
  bool literals_too_;
  std::size_t at_ = 0;
};

}  // namespace

std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const auto end = text.find('\n');
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
  }
  return lines;
}

std::string without_comments(std::string_view text) { return Blanker{text, false}.run(); }
std::string code_only(std::string_view text) { return Blanker{text, true}.run(); }

std::vector<Include> includes_of(std::string_view text) {
  static const std::regex pattern{R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])"};
  const std::string code = without_comments(text);
  std::vector<Include> includes;
  int number = 0;
  for (const auto line : lines_of(code)) {
    ++number;
    std::match_results<std::string_view::const_iterator> match;
    if (std::regex_search(line.begin(), line.end(), match, pattern)) {
      includes.push_back({number, match[1] == "\"", match[2].str()});
    }
  }
  return includes;
}

std::size_t width_of(std::string_view line) {
  std::size_t width = 0;
  for (const char c : line)
    width += (static_cast<unsigned char>(c) & 0xC0u) != 0x80u;  // not a continuation byte
  return width;
}

}  // namespace moldloft::tree
