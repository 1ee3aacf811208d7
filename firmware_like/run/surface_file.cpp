#include "firmware_like/run/surface_file.hpp"

#include "firmware_like/process/json_file.hpp"

#include <fmt/format.h>

namespace moldloft::firmware_like {

using geometry::BSplineSurface;

Json surface_json(const BSplineSurface& s) {
  Json control = Json::array();
  for (int i = 0; i < s.control_u(); ++i) {
    Json row = Json::array();
    for (int k = 0; k < s.control_v(); ++k) row.push_back({s.x(i, k), s.y(i, k), s.z(i, k)});
    control.push_back(row);
  }
  return {{"schema", 1},          {"unit", "mm"},         {"frame", "world"},  {"degree", {3, 3}},
          {"knots_u", s.knots_u}, {"knots_v", s.knots_v}, {"control", control}};
}

std::expected<BSplineSurface, Failure> read_surface(const std::filesystem::path& path) {
  const auto json = read_json(path);
  if (!json) return std::unexpected(json.error());
  const auto refused = [&](std::string_view why) {
    return std::unexpected(Failure{fmt::format("{}: {}", path.string(), why)});
  };
  try {
    if (json->at("schema") != 1 || json->at("unit") != "mm") return refused("schema 1 in mm is needed");
    if (json->at("degree") != Json::array({3, 3})) return refused("the surface must be bicubic");
    BSplineSurface surface;
    surface.knots_u = json->at("knots_u").get<std::vector<double>>();
    surface.knots_v = json->at("knots_v").get<std::vector<double>>();
    const auto& control = json->at("control");
    const auto rows = static_cast<Eigen::Index>(control.size());
    const auto columns = rows > 0 ? static_cast<Eigen::Index>(control.at(0).size()) : 0;
    if (rows < 4 || columns < 4 || surface.knots_u.size() != static_cast<std::size_t>(rows) + 4 ||
        surface.knots_v.size() != static_cast<std::size_t>(columns) + 4) {
      return refused("knots and control points do not fit together");
    }
    for (auto* net : {&surface.x, &surface.y, &surface.z}) net->resize(rows, columns);
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (static_cast<Eigen::Index>(control[static_cast<std::size_t>(i)].size()) != columns) {
        return refused("rows of control points differ in length");
      }
      for (Eigen::Index j = 0; j < columns; ++j) {
        const auto& point = control[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
        surface.x(i, j) = point.at(0);
        surface.y(i, j) = point.at(1);
        surface.z(i, j) = point.at(2);
      }
    }
    return surface;
  } catch (const nlohmann::json::exception& error) {
    return refused(error.what());
  }
}

}  // namespace moldloft::firmware_like
