// The diagrams against the tables, read row by row, and the page that shows them against the program.
#include "firmware_like/commands/machines.hpp"

#include "hal/robot/line_table.hpp"
#include "hal/scanner/psc_table.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/machines/cell_state.hpp"
#include "tasks/machines/phases.hpp"
#include "tasks/machines/shot_sequence.hpp"
#include "tasks/machines/start_sequence.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

using namespace moldloft;

namespace {

std::string file_text(const std::string& path) {
  std::ifstream file{path, std::ios::binary};
  REQUIRE_MESSAGE(file, path);
  return {std::istreambuf_iterator<char>{file}, {}};
}

std::string section(std::string_view text, std::string_view file) {
  const auto begin = text.find(file);
  REQUIRE(begin != text.npos);
  const auto end = text.find("###", begin);
  return std::string{text.substr(begin, end == text.npos ? text.npos : end - begin)};
}

std::string word(std::string name) {
  if (name.empty()) return "[*]";  // before and after everything
  std::erase(name, ',');
  for (char& c : name) c = c == ' ' ? '_' : c;
  return name;
}

// The text of the arrow from one state to another; empty when there is none.
std::string arrow(const std::string& diagram, std::string_view from, std::string_view to) {
  const std::string head = "  " + word(std::string{from}) + " --> " + word(std::string{to}) + " : ";
  const auto begin = diagram.find(head);
  if (begin == diagram.npos) return {};
  return diagram.substr(begin + head.size(), diagram.find('\n', begin) - begin - head.size());
}

template <typename Table>
void check_every_row_has_its_arrow(const std::string& diagram, Table table) {
  for (const auto& row : table) {
    const std::string label = arrow(diagram, to_string(row.from), to_string(row.to));
    CAPTURE(label);
    CHECK(label.find(to_string(row.on)) != label.npos);
    if (to_string(row.action) != "none")
      CHECK(label.find("/ " + std::string{to_string(row.action)}) != label.npos);
  }
}

}  // namespace

TEST_CASE(
    "every row of the tracker, the start, the phases and the shot sequence is an arrow with its event and "
    "action") {
  const std::string text = firmware_like::cell_diagrams();
  check_every_row_has_its_arrow(section(text, "track_table.cpp"), tasks::track_transitions());
  check_every_row_has_its_arrow(section(text, "start_sequence.cpp"), tasks::start_transitions());
  check_every_row_has_its_arrow(section(text, "phases.cpp"), tasks::phase_transitions());
  check_every_row_has_its_arrow(section(text, "shot_sequence.cpp"), tasks::shot_transitions());
}

TEST_CASE("every row of the drivers' tables is an arrow with its cue and action, or in the note of its cue") {
  const std::string text = firmware_like::driver_diagrams();
  check_every_row_has_its_arrow(section(text, "psc_table.cpp"), hal::psc_transitions());
  const std::string robot = section(text, "line_table.cpp");
  std::vector<hal::LineTransition> arrows;
  for (const auto& row : hal::line_transitions()) {
    if (row.on != hal::LineCue::link_lost) arrows.push_back(row);
  }
  check_every_row_has_its_arrow(robot, arrows);
  CHECK(robot.find("note right of offline\n    link lost / report loss\n    from every state\n") !=
        robot.npos);
}

TEST_CASE("the supervisor's stop and abort are notes, all its other rows arrows") {
  const std::string diagram = section(firmware_like::cell_diagrams(), "cell_state.cpp");
  for (const auto& row : tasks::cell_transitions()) {
    const bool folded = row.on == tasks::CellEvent::stop || row.on == tasks::CellEvent::abort;
    const std::string label = arrow(diagram, to_string(row.from), to_string(row.to));
    CHECK(label.empty() == folded);
    if (!folded) CHECK(label.find(to_string(row.on)) != label.npos);
  }
  CHECK(diagram.find("note right of Aborting\n    abort / drop everything\n    from every state but "
                     "Aborting, Aborted\n") != diagram.npos);
  CHECK(diagram.find("note right of Stopping\n    stop / stop motion\n"
                     "    from every state but Stopping, Stopped, Aborting, Aborted, Clearing\n") !=
        diagram.npos);
}

TEST_CASE("guards stand on the arrows as what they ask for, their complement as else") {
  const std::string diagram = section(firmware_like::cell_diagrams(), "track_table.cpp");
  CHECK(arrow(diagram, "seek edge", "seek edge") ==
        "no plate [heights left] / change height<br/>plate fills field [steps left] / step along x"
        "<br/>hidden [turns left] / turn<br/>hidden [half steps left] / step half along x");
  CHECK(arrow(section(firmware_like::driver_diagrams(), "line_table.cpp"), "commanded", "syncing") ==
        "stands still [stop answered] / report stopped and sync"
        "<br/>reset / start sync<br/>silent / report silence");
  CHECK(arrow(diagram, "seek edge", "failed") ==
        "no plate [else] / report off plate<br/>plate fills field [else] / report no edge"
        "<br/>hidden [else] / report hidden");
}

TEST_CASE("tasks/README.md holds exactly what the program prints") {
  const std::string page = file_text(MOLDLOFT_SOURCE_DIR "/tasks/README.md");
  CHECK_MESSAGE(page.find(firmware_like::cell_diagrams()) != page.npos,
                "paste the output of `moldloft machines` into tasks/README.md");
}

TEST_CASE("hal/README.md holds exactly what the program prints of the drivers") {
  const std::string page = file_text(MOLDLOFT_SOURCE_DIR "/hal/README.md");
  CHECK_MESSAGE(page.find(firmware_like::driver_diagrams()) != page.npos,
                "paste the drivers' part of the output of `moldloft machines` into hal/README.md");
}
