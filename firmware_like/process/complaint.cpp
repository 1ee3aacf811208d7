#include "firmware_like/process/complaint.hpp"

#include "firmware_like/process/console.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace moldloft::firmware_like {

int complain(std::string_view what, std::string_view program, Priority priority) {
  say(marked(priority, fmt::format("{}: {}\n", program, hal::printable(what))));
  return exit_failed;
}

int complain_all(std::string_view what, std::string_view program) {
  std::string lines;
  for (std::size_t begin = 0; begin <= what.size();) {
    const std::size_t end = std::min(what.find('\n', begin), what.size());
    lines += (begin == 0 ? "" : "\n") + hal::printable(what.substr(begin, end - begin));
    begin = end + 1;
  }
  say(marked(Priority::error, fmt::format("{}: {}\n", program, lines)));
  return exit_failed;
}

}  // namespace moldloft::firmware_like
