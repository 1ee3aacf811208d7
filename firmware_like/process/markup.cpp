#include "firmware_like/process/markup.hpp"

#include "hal/base/printable_text.hpp"

namespace moldloft::firmware_like {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : hal::printable(text)) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

}  // namespace moldloft::firmware_like
