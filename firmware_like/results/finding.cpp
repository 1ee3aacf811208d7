#include "firmware_like/results/finding.hpp"

#include "hal/base/printable_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

constexpr std::array<std::string_view, 12> kind_names = {
    "outline",     "ragged_rim", "shot_missing", "unseen",         "shot_heights", "shot_edges",
    "plate_moved", "mount",      "noise",        "between_points", "memory_plan",  "net"};
constexpr std::array<std::string_view, 2> gravity_names = {"warning", "untrusted"};

template <typename Enum, std::size_t count>
Enum named(const std::array<std::string_view, count>& names, const Json& word) {
  const auto* found = std::ranges::find(names, word.get<std::string>());
  // As any other value that is not one of those that were written.
  if (found == names.end()) throw Json::type_error::create(302, "unknown finding " + json_text(word), &word);
  return static_cast<Enum>(found - names.begin());
}

// To a micrometre, so that the file is easy to read.
double rounded(double mm) { return std::round(mm * 1e3) / 1e3; }

}  // namespace

std::string_view to_string(FindingKind kind) { return kind_names[static_cast<std::size_t>(kind)]; }
std::string_view to_string(Gravity gravity) { return gravity_names[static_cast<std::size_t>(gravity)]; }

Json findings_json(const std::vector<Finding>& findings) {
  Json list = Json::array();
  for (const Finding& f : findings) {
    Json place = nullptr;
    if (f.place) place = {rounded(f.place->x()), rounded(f.place->y())};
    list.push_back({{"kind", std::string{to_string(f.kind)}},
                    {"gravity", std::string{to_string(f.gravity)}},
                    {"place_mm", place},
                    {"size_mm", rounded(f.size_mm)},
                    {"text", hal::printable(f.text)}});
  }
  return list;
}

std::vector<Finding> findings_in(const Json& list) {
  std::vector<Finding> findings;
  for (const Json& j : list) {
    Finding f{.kind = named<FindingKind>(kind_names, j.at("kind")),
              .gravity = named<Gravity>(gravity_names, j.at("gravity")),
              .place = {},
              .size_mm = j.at("size_mm"),
              .text = j.at("text")};
    if (const Json& place = j.at("place_mm"); !place.is_null())
      f.place = Eigen::Vector2d{place.at(0).get<double>(), place.at(1).get<double>()};
    findings.push_back(std::move(f));
  }
  return findings;
}

}  // namespace moldloft::firmware_like
