// The tree as it lies on the disk keeps its rules.
#include "tree/rules.hpp"
#include "tree/source_text.hpp"
#include "tree/wing_rules.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

using namespace moldloft::tree;
namespace fs = std::filesystem;

namespace {

const fs::path top = MOLDLOFT_SOURCE_DIR;

// Everything but what git and the build keep for themselves.
std::vector<std::string> files_of_the_tree() {
  std::vector<std::string> paths;
  for (fs::recursive_directory_iterator it{top}, end; it != end; ++it) {
    const fs::path relative = it->path().lexically_relative(top);
    const bool not_ours = relative == ".git" || relative == "build" || relative == "out";
    if (it->is_directory() && not_ours) it.disable_recursion_pending();
    if (!it->is_directory() && !not_ours) paths.push_back(relative.generic_string());
  }
  std::ranges::sort(paths);
  return paths;
}

std::string text_of(const std::string& path) {
  std::ifstream file{top / path, std::ios::binary};
  REQUIRE_MESSAGE(file, path);
  return {std::istreambuf_iterator<char>{file}, {}};
}

void report(const Findings& findings) {
  for (const auto& finding : findings) FAIL_CHECK(finding);
}

}  // namespace

TEST_CASE("folders at the top are those of the design, each with its page") {
  report(tree_findings(files_of_the_tree()));
}

TEST_CASE("every file keeps the arrows, the measures, the names and its place for time, threads and sleep") {
  for (const auto& path : files_of_the_tree()) report(file_findings(path, text_of(path)));
}

TEST_CASE(
    "wings keep their arrows, stand in no circle and on few floors, and no folder grows beyond a screen") {
  const auto paths = files_of_the_tree();
  std::vector<Wing> wings;
  for (const char* room : {"geometry", "hal", "tasks", "firmware_like", "host_sim"}) {
    const auto of_the_room = wings_in(text_of(std::string{room} + "/CMakeLists.txt"));
    CHECK_MESSAGE(of_the_room.size() >= 5, room);  // the lines are really read
    wings.insert(wings.end(), of_the_room.begin(), of_the_room.end());
  }
  report(wing_order_findings(wings));
  report(wing_content_findings(paths, wings));
  for (const auto& path : paths) report(wing_include_findings(path, text_of(path), wings));
}

TEST_CASE("the search really reads the tree: all rooms, their sources, and includes along every arrow") {
  const auto paths = files_of_the_tree();
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"host_sim/", "firmware_like/"},
                                                        {"firmware_like/", "tasks/"},
                                                        {"tasks/", "hal/"},
                                                        {"tasks/", "geometry/"}}) {
    int found = 0;
    for (const auto& path : paths) {
      if (!path.starts_with(from) || !is_source(path)) continue;
      for (const auto& include : includes_of(text_of(path))) found += include.name.starts_with(to) ? 1 : 0;
    }
    CHECK_MESSAGE(found > 0, from, " -> ", to);
  }
}
