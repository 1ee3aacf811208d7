#include "firmware_like/results/stored_result.hpp"

#include "firmware_like/process/json_file.hpp"
#include "firmware_like/results/summary.hpp"
#include "firmware_like/run/surface_file.hpp"

#include <fmt/format.h>

#include <span>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;

Json points_json(std::span<const Eigen::Vector2d> points) {
  Json all = Json::array();
  for (const auto& p : points) all.push_back({p.x(), p.y()});
  return all;
}

Json places_json(std::span<const tasks::ShotPlace> places) {
  Json all = Json::array();
  for (const auto& p : places) all.push_back({p.centre.x(), p.centre.y(), p.centre.z(), p.head_yaw});
  return all;
}

std::vector<Eigen::Vector2d> points_in(const Json& j) {
  std::vector<Eigen::Vector2d> points;
  for (const auto& p : j) points.emplace_back(p.at(0).get<double>(), p.at(1).get<double>());
  return points;
}

std::vector<tasks::ShotPlace> places_in(const Json& j) {
  std::vector<tasks::ShotPlace> places;
  for (const auto& p : j)
    places.push_back(
        {{p.at(0).get<double>(), p.at(1).get<double>(), p.at(2).get<double>()}, p.at(3).get<double>()});
  return places;
}

Json outline_json(const geometry::Outline& outline) {
  Json sides = Json::array();
  for (const auto& side : outline.sides) {
    sides.push_back({{"degree", side.degree}, {"knots", side.knots}, {"control", points_json(side.control)}});
  }
  return {{"max_mm", outline.max_mm}, {"corners", points_json(outline.corners)}, {"sides", sides}};
}

void read_outline(const Json& j, geometry::Outline& outline) {
  outline.max_mm = j.at("max_mm");
  for (std::size_t i = 0; i < outline.sides.size(); ++i) {
    const auto& from = j.at("sides").at(i);
    auto& side = outline.sides[i];
    side.degree = from.at("degree");
    side.knots = from.at("knots").get<std::vector<double>>();
    side.control = points_in(from.at("control"));
    // The summary's corners are rounded for people.
    outline.corners[i] = points_in(j.at("corners")).at(i);
  }
}

// Where the file says more of a measured plate than the summary does, that goes there.
std::expected<RunTrack, Failure> read_track(const fs::path& path, std::optional<MeasuredPlate>& measured) {
  const auto j = read_json(path);
  if (!j) return std::unexpected{j.error()};
  try {
    if (measured && j->contains("outline")) read_outline(j->at("outline"), measured->outline);
    return RunTrack{.edge_points = points_in(j->at("edge_points")),
                    .corners = points_in(j->at("corners")),
                    .boundary_places = places_in(j->at("boundary_shots")),
                    .surface_places = places_in(j->at("surface_shots")),
                    .field_x_mm = j->at("field").at(0),
                    .field_y_mm = j->at("field").at(1)};
  } catch (const Json::exception& error) {
    return std::unexpected{Failure{fmt::format("{}: {}", path.string(), error.what())}};
  }
}

}  // namespace

Json track_json(const RunResult& result) {
  const RunTrack& track = result.track;
  Json j = {{"schema", 1},
            {"unit", "mm"},
            {"frame", "world"},
            {"field", {track.field_x_mm, track.field_y_mm}},
            {"edge_points", points_json(track.edge_points)},
            {"corners", points_json(track.corners)},
            {"boundary_shots", places_json(track.boundary_places)},
            {"surface_shots", places_json(track.surface_places)}};
  if (result.measured) j["outline"] = outline_json(result.measured->outline);
  return j;
}

std::expected<RunResult, Failure> read_result(const fs::path& folder) {
  const auto summary = read_json(folder / "summary.json");
  if (!summary) return std::unexpected{summary.error()};
  auto result = read_summary(*summary);
  if (!result)
    return std::unexpected{
        Failure{fmt::format("{}: {}", (folder / "summary.json").string(), result.error().what)}};
  if (result->measured && fs::exists(folder / "surface.json")) {
    auto surface = read_surface(folder / "surface.json");
    if (!surface) return std::unexpected{surface.error()};
    result->measured->surface = std::move(*surface);
  }
  if (fs::exists(folder / "track.json")) {
    auto track = read_track(folder / "track.json", result->measured);
    if (!track) return std::unexpected{track.error()};
    result->track = std::move(*track);
  }
  auto timing = read_json(folder / "timing.json");
  if (!timing) return std::unexpected{timing.error()};
  result->timing = std::move(*timing);
  return result;
}

}  // namespace moldloft::firmware_like
