#include "tree/rules.hpp"
#include "tree/source_text.hpp"

#include <algorithm>

namespace moldloft::tree {
namespace {

using Names = std::vector<std::string_view>;

// host_sim -> firmware_like -> tasks -> { hal, geometry }; each room also sees itself.
struct Arrows {
  std::string_view room;
  Names sees;
};
const std::vector<Arrows> arrows = {
    {"geometry", {"geometry"}},
    {"hal", {"hal"}},
    {"tasks", {"tasks", "hal", "geometry"}},
    {"firmware_like", {"firmware_like", "tasks", "hal", "geometry"}},
    {"host_sim", {"host_sim", "firmware_like", "tasks", "hal", "geometry"}},
};

// Which rooms a library is for. `in_sources_only`: behind our own headers, so that it can be exchanged.
struct Library {
  std::string_view prefix;
  Names rooms;
  bool in_sources_only;
};
const std::vector<Library> libraries = {
    {"Eigen/", {"geometry", "tasks", "firmware_like", "host_sim"}, false},
    {"asio", {"hal", "host_sim"}, true},
    {"libserialport.h", {"hal"}, true},
    {"sanitizer/", {"hal"}, false},
    {"sqlite3.h", {"hal"}, false},
    {"fmt/", {"hal", "tasks", "firmware_like", "host_sim"}, false},
    {"nlohmann/", {"firmware_like", "host_sim"}, false},
    {"toml++/", {"firmware_like"}, false},
    {"systemd/", {"firmware_like"}, true},
    {"CLI/", {"firmware_like", "host_sim"}, false},
    {"boost/", {}, true},
    {"iostream", {}, true},  // its constructors run before main, and it formats by global state
};

// The operating system's headers: the world outside begins in hal; geometry and tasks compute.
const Names system_rooms = {"hal", "firmware_like", "host_sim"};

bool contains(const Names& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

bool is_header_of_the_system(std::string_view name) {
  return name.ends_with(".h") &&
         (name.find('/') == name.npos || name.starts_with("sys/") || name.starts_with("net") ||
          name.starts_with("arpa/") || name.starts_with("linux/"));
}

// The arrows that hold for a file: tests/hal sees what hal sees, and its own files under the same name.
const Arrows* arrows_for(std::string_view path) {
  if (path.starts_with("tests/")) path.remove_prefix(6);
  const auto found = std::ranges::find(arrows, first_folder(path), &Arrows::room);
  return found == arrows.end() ? nullptr : &*found;
}

std::string library_finding(std::string_view path, std::string_view room, std::string_view name) {
  // OpenCASCADE names its headers by their ending alone: the program that reads CAD files has them, and nothing else.
  if (name.ends_with(".hxx"))
    return path.starts_with("firmware_like/cad/") && !is_header(path)
               ? ""
               : "<" + std::string{name} + "> is OpenCASCADE's: that belongs into a .cpp of firmware_like/cad";
  for (const auto& library : libraries) {
    if (!name.starts_with(library.prefix)) continue;
    if (!contains(library.rooms, room))
      return "<" + std::string{name} + "> has no place in " + std::string{room};
    if (library.in_sources_only && is_header(path)) return "<" + std::string{name} + "> belongs into a .cpp";
    return {};
  }
  if (is_header_of_the_system(name)) {
    return contains(system_rooms, room)
               ? ""
               : "<" + std::string{name} + "> is the operating system's: that is hal's";
  }
  const bool standard = name.find_first_of("./") == name.npos;
  return standard ? ""
                  : "<" + std::string{name} +
                        "> is a library that no room has been given (tests/tree/include_rules.cpp)";
}

}  // namespace

bool is_room(std::string_view name) { return std::ranges::find(arrows, name, &Arrows::room) != arrows.end(); }

Findings include_findings(std::string_view path, std::string_view text) {
  Findings findings;
  const Arrows* allowed = arrows_for(path);
  if (allowed == nullptr || !is_source(path)) return findings;
  const bool in_tests = path.starts_with("tests/");
  for (const auto& include : includes_of(text)) {
    std::string what;
    const std::string_view target = first_folder(include.name);
    if (is_room(target)) {
      if (!contains(allowed->sees, target)) what = "includes " + include.name + " against the arrows";
    } else if (include.quoted && !in_tests) {
      what = "includes \"" + include.name + "\" without the room's name";
    } else if (!include.quoted && !in_tests) {
      what = library_finding(path, allowed->room, include.name);
    }
    if (!what.empty())
      findings.push_back(std::string{path} + ":" + std::to_string(include.line) + ": " + what);
  }
  return findings;
}

}  // namespace moldloft::tree
