#include "host_sim/meshes/mesh_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace moldloft::host_sim {

namespace {

namespace fs = std::filesystem;

std::expected<std::string, std::string> bytes_of_file(const std::string& path) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found || path.empty())
    return std::unexpected("does not exist: give the path of a PLY or STL file");
  if (error) return std::unexpected("cannot be opened (" + error.message() + ")");
  if (fs::is_directory(status)) return std::unexpected("is a folder: give the path of a PLY or STL file");
  if (!fs::is_regular_file(status))
    return std::unexpected("is a pipe or a device: give the path of a PLY or STL file");
  const auto size = fs::file_size(path, error);
  if (error) return std::unexpected("cannot be read (" + error.message() + ")");
  if (size == 0) return std::unexpected("is empty: export it anew");
  if (size > most_mesh_bytes)
    return std::unexpected(
        fmt::format("has {:.1f} GB, more than a plate's mesh needs: export it coarser", 1e-9 * size));
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file)
    return std::unexpected("cannot be opened (" + std::error_code(errno, std::generic_category()).message() +
                           ")");
  std::string bytes(size, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(size));
  if (file.bad() || static_cast<std::uintmax_t>(file.gcount()) != size)
    return std::unexpected("cannot be read whole");
  return bytes;
}

// Text of 16-bit characters as bytes; what is not ASCII becomes a question mark.
std::string narrowed(std::string_view wide, bool big_endian) {
  std::string text;
  text.reserve(wide.size() / 2);
  for (std::size_t k = 0; k + 1 < wide.size(); k += 2) {
    const char high = wide[k + (big_endian ? 0 : 1)], low = wide[k + (big_endian ? 1 : 0)];
    text += high == '\0' && static_cast<unsigned char>(low) < 128 ? low : '?';
  }
  return text;
}

}  // namespace

std::expected<MeshFile, SimError> read_mesh_file(const std::string& path) {
  const auto refused = [&](std::string_view why) {
    return std::unexpected(SimError{fmt::format("{}: {}", path, why)});
  };
  auto read = bytes_of_file(path);
  if (!read) return refused(read.error());
  std::string_view bytes{*read};
  if (is_binary_stl(bytes)) return read_binary_stl(path, bytes);
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
  const bool big = bytes.starts_with("\xfe\xff"), little = bytes.starts_with("\xff\xfe");
  if (big || little) {
    *read = narrowed(bytes.substr(2), big);
    bytes = *read;
  }
  if (begins_as_ply(bytes)) return read_ply(path, bytes);
  if (begins_as_text_stl(bytes)) return read_text_stl(path, bytes);
  if (bytes.starts_with("\x1f\x8b") || bytes.starts_with("PK\x03\x04"))
    return refused("is compressed: unpack it first");
  return refused(
      "is neither a PLY nor an STL file (if it is binary STL, its length does not fit its count of facets)");
}

}  // namespace moldloft::host_sim
