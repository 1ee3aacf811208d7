#include "tree/wing_rules.hpp"

#include "tree/source_text.hpp"

#include <algorithm>
#include <map>
#include <regex>
#include <set>

namespace moldloft::tree {
namespace {

constexpr std::size_t most_components = 20;  // of a folder

// Floors of a room's wings. The simulation stands on plates, optics and devices before a cell can run.
std::size_t most_floors(std::string_view room) { return room == "host_sim" ? 7 : 6; }

// What a wing may link besides wings: the files that stand in the room's own folder.
constexpr std::string_view ground = "ground";
// The only room whose own folder holds such files: what other programs include from it keeps its name.
constexpr std::string_view room_with_ground = "geometry";

const Wing* find_wing(std::span<const Wing> wings, std::string_view room, std::string_view name) {
  const auto found =
      std::ranges::find_if(wings, [&](const Wing& w) { return w.room == room && w.name == name; });
  return found == wings.end() ? nullptr : &*found;
}

// "hal/links/tcp_link.cpp": links; empty where the file stands in no folder of its room.
std::string_view second_folder(std::string_view path) {
  const std::string_view room = first_folder(path);
  return room.empty() ? room : first_folder(path.substr(room.size() + 1));
}

bool sees(std::span<const Wing> wings, const Wing& from, std::string_view to, std::set<std::string>& passed) {
  if (from.name == to || (to.empty() && from.room == room_with_ground)) return true;
  if (!passed.insert(from.name).second) return false;
  return std::ranges::any_of(from.links, [&](const std::string& link) {
    const Wing* next = find_wing(wings, from.room, link);
    return next != nullptr && sees(wings, *next, to, passed);
  });
}

// How many wings stand below this one; `above` holds those that are being looked at.
std::size_t floor_of(std::span<const Wing> wings, const Wing& wing, std::set<std::string>& above,
                     bool& circle) {
  if (!above.insert(wing.name).second) {
    circle = true;
    return 0;
  }
  std::size_t floor = 1;
  for (const auto& link : wing.links) {
    const Wing* below = find_wing(wings, wing.room, link);
    if (below != nullptr) floor = std::max(floor, 1 + floor_of(wings, *below, above, circle));
  }
  above.erase(wing.name);
  return floor;
}

}  // namespace

std::vector<Wing> wings_in(std::string_view cmake_text) {
  static const std::regex declared{R"(^ *moldloft_wing\((\w+)\s+(\w+)([^)]*)\))", std::regex::multiline};
  const std::string text{cmake_text};
  std::vector<Wing> wings;
  for (std::sregex_iterator it{text.begin(), text.end(), declared}, end; it != end; ++it) {
    Wing wing{.room = it->str(1), .name = it->str(2), .links = {}};
    const std::regex link{"moldloft::" + wing.room + R"(_(\w+))"};
    const std::string links = it->str(3);
    for (std::sregex_iterator l{links.begin(), links.end(), link}, none; l != none; ++l)
      wing.links.push_back(l->str(1));
    wings.push_back(std::move(wing));
  }
  return wings;
}

Findings wing_include_findings(std::string_view path, std::string_view text, std::span<const Wing> wings) {
  const Wing* own = find_wing(wings, first_folder(path), second_folder(path));
  if (own == nullptr || !is_source(path)) return {};
  Findings findings;
  for (const auto& include : includes_of(text)) {
    const std::string_view to = second_folder(include.name);
    std::set<std::string> passed;
    if (first_folder(include.name) != own->room || sees(wings, *own, to, passed)) continue;
    findings.push_back(std::string{path} + ":" + std::to_string(include.line) + ": includes " + include.name +
                       ", and " + own->room + "/CMakeLists.txt does not let " + own->name + " see it");
  }
  return findings;
}

Findings wing_order_findings(std::span<const Wing> wings) {
  Findings findings;
  for (const auto& wing : wings) {
    const std::string name = wing.room + "/" + wing.name;
    for (const auto& link : wing.links) {
      if (link != ground && find_wing(wings, wing.room, link) == nullptr)
        findings.push_back(name + ": links " + link + ", which is no wing of the room");
    }
    std::set<std::string> above;
    bool circle = false;
    const std::size_t floor = floor_of(wings, wing, above, circle);
    if (circle) findings.push_back(name + ": stands in or above a circle of wings");
    if (floor > most_floors(wing.room))
      findings.push_back(name + ": on floor " + std::to_string(floor) + ", " +
                         std::to_string(most_floors(wing.room)) + " is the most");
  }
  return findings;
}

Findings wing_content_findings(std::span<const std::string> paths, std::span<const Wing> wings) {
  Findings findings;
  std::map<std::string, std::set<std::string>> components;  // of each folder of a room
  for (const auto& path : paths) {
    const std::string_view room = first_folder(path);
    if (!is_room(room) || !is_source(path)) continue;
    const bool has_wings = std::ranges::any_of(wings, [&](const Wing& w) { return w.room == room; });
    const std::string name = path.substr(path.rfind('/') + 1);
    if (has_wings && find_wing(wings, room, second_folder(path)) == nullptr && name != "main.cpp" &&
        !(room == room_with_ground && second_folder(path).empty()))
      findings.push_back(path + ": stands in no wing of its room");
    components[path.substr(0, path.rfind('/'))].insert(name.substr(0, name.rfind('.')));
  }
  for (const auto& [folder, names] : components) {
    if (names.size() > most_components)
      findings.push_back(folder + ": " + std::to_string(names.size()) + " components, " +
                         std::to_string(most_components) + " is the most");
  }
  return findings;
}

}  // namespace moldloft::tree
