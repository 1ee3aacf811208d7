#include "firmware_like/process/json_file.hpp"

#include <fmt/format.h>

#include <fstream>

namespace moldloft::firmware_like {

std::expected<Json, Failure> read_json(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) return std::unexpected(Failure{fmt::format("{}: cannot be opened", path.string())});
  Json json = Json::parse(file, nullptr, false);
  if (json.is_discarded()) return std::unexpected(Failure{fmt::format("{}: not JSON", path.string())});
  return json;
}

}  // namespace moldloft::firmware_like
