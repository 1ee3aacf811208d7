#include "firmware_like/gateway/cell_search.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <vector>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;

constexpr const char* socket_name = "control";

struct Found {
  std::vector<std::string> living, forbidden, left;  // left: by processes that have died
};

void look_at(const fs::path& path, Found& found) {
  std::error_code failed;
  if (!fs::is_socket(path, failed) && failed != std::errc::permission_denied) return;
  const int why = try_socket(path.string());
  (why == 0 ? found.living : why == EACCES ? found.forbidden : found.left).push_back(path.string());
}

std::string nothing_found(const fs::path& folder, const Found& found, const std::error_code& unread) {
  std::string line = fmt::format("no running cell was found: looked for {0}/{1} and {0}/*/{1}",
                                 folder.string(), socket_name);
  if (unread && unread != std::errc::no_such_file_or_directory)
    line += fmt::format(" ({}: {})", folder.string(), unread.message());
  if (!found.left.empty())
    line += fmt::format("; nobody listens at {} any more", fmt::join(found.left, ", "));
  return line + "; a cell elsewhere is told with the --control that it was started with";
}

}  // namespace

int try_socket(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) return ENAMETOOLONG;
  path.copy(address.sun_path, path.size());
  const int file = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (file < 0) return errno;
  const int why =
      ::connect(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? 0 : errno;
  ::close(file);
  return why;
}

std::expected<std::string, std::string> running_cell(const fs::path& folder) {
  Found found;
  std::error_code unread;
  std::vector<fs::path> folders{folder};
  for (fs::directory_iterator entry{folder, unread}, end; !unread && entry != end; entry.increment(unread)) {
    std::error_code ignored;
    if (entry->is_directory(ignored)) folders.push_back(entry->path());
  }
  std::ranges::sort(folders);
  for (const auto& place : folders) look_at(place / socket_name, found);

  if (found.living.size() == 1 && found.forbidden.empty()) return found.living.front();
  if (found.living.empty() && found.forbidden.empty())
    return std::unexpected{nothing_found(folder, found, unread)};
  if (found.living.empty())
    return std::unexpected{
        fmt::format("{}: Permission denied; only members of the group that owns the socket may "
                    "command the cell",
                    fmt::join(found.forbidden, ", "))};
  std::ranges::copy(found.forbidden, std::back_inserter(found.living));
  std::ranges::sort(found.living);
  return std::unexpected{fmt::format("{} cells run: {}; say which one with --control", found.living.size(),
                                     fmt::join(found.living, ", "))};
}

}  // namespace moldloft::firmware_like
