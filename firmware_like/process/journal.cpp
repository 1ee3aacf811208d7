#include "firmware_like/process/journal.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <sys/stat.h>
#include <unistd.h>

namespace moldloft::firmware_like {

bool is_journal(int file, const char* journal_stream) {
  struct stat what {};
  if (journal_stream == nullptr || ::fstat(file, &what) != 0) return false;
  return fmt::format("{}:{}", what.st_dev, what.st_ino) == journal_stream;
}

bool stderr_is_journal() {
  static const bool it_is = is_journal(STDERR_FILENO, std::getenv("JOURNAL_STREAM"));
  return it_is;
}

std::string for_journal(Priority priority, std::string_view lines) {
  std::string out;
  while (!lines.empty()) {
    const auto end = lines.find('\n');
    const auto line = lines.substr(0, end);
    out += fmt::format("<{}>{}", static_cast<int>(priority), line);
    if (end == std::string_view::npos) break;
    out += '\n';
    lines.remove_prefix(end + 1);
  }
  return out;
}

std::string marked(Priority priority, std::string_view lines) {
  return stderr_is_journal() ? for_journal(priority, lines) : std::string{lines};
}

}  // namespace moldloft::firmware_like
