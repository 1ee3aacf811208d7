#include "firmware_like/config/plate_name.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace moldloft::firmware_like {
namespace {

// The text with U+FFFD for what is not UTF-8.
std::string repaired(std::string_view text) {
  using nlohmann::json;
  return json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace)).get<std::string>();
}

unsigned char byte(char c) { return static_cast<unsigned char>(c); }
bool goes_on(char c) { return (byte(c) & 0xC0) == 0x80; }  // not the first byte of a character

// A character that moves the cursor, rings the bell or begins an escape sequence; U+0080 to U+009F do so too.
bool is_control(std::string_view text, std::size_t i) {
  return byte(text[i]) < 0x20 || byte(text[i]) == 0x7F ||
         (byte(text[i]) == 0xC2 && i + 1 < text.size() && byte(text[i + 1]) < 0xA0);
}

std::size_t characters(std::string_view text) {
  return text.size() - static_cast<std::size_t>(std::ranges::count_if(text, goes_on));
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(' ');
  return begin == text.npos ? "" : text.substr(begin, text.find_last_not_of(' ') - begin + 1);
}

}  // namespace

std::size_t first_byte_not_utf8(std::string_view text) {
  const std::string good = repaired(text);
  if (good == text) return text.npos;
  return static_cast<std::size_t>(std::ranges::mismatch(good, text).in2 - text.begin());
}

std::expected<std::string, std::string> one_line(std::string_view text, std::string_view what,
                                                 std::size_t longest) {
  text = trimmed(text);
  const auto refused = [&](const std::string& why) {
    return std::unexpected{fmt::format("{}: {}", what, why)};
  };
  if (text.empty()) return refused("the text is blank; leave the option out, or write something");
  if (characters(text) > longest)
    return refused(fmt::format("{} characters are too many, {} at most", characters(text), longest));
  if (const auto at = first_byte_not_utf8(text); at != text.npos)
    return refused(fmt::format("byte {} (0x{:02X}) is not UTF-8; set the terminal to UTF-8, or write ASCII",
                               at + 1, byte(text[at])));
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_control(text, i))
      return refused(
          fmt::format("character {} is a control character (0x{:02X}); write one line of plain text",
                      characters(text.substr(0, i)) + 1, byte(text[i])));
  }
  return std::string{text};
}

std::string name_of_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  const auto whole = std::filesystem::absolute(folder, failed).lexically_normal();
  const auto named = whole.has_filename() ? whole : whole.parent_path();
  const std::string text = repaired(named.filename().string());
  std::string name;
  for (std::size_t i = 0, size = 1, count = 0; i < text.size() && count < longest_plate_name;
       i += size, ++count) {
    for (size = 1; i + size < text.size() && goes_on(text[i + size]);) ++size;
    name += is_control(text, i) ? "?" : text.substr(i, size);
  }
  const std::string_view kept = trimmed(name);
  return kept.empty() ? "plate" : std::string{kept};
}

}  // namespace moldloft::firmware_like
