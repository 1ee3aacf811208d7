#include "firmware_like/commands/machines.hpp"

#include "hal/robot/line_table.hpp"
#include "hal/scanner/psc_table.hpp"
#include "tasks/machines/boundary_tracker.hpp"
#include "tasks/machines/cell_state.hpp"
#include "tasks/machines/phases.hpp"
#include "tasks/machines/shot_sequence.hpp"
#include "tasks/machines/start_sequence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

namespace moldloft::firmware_like {
namespace {

// An event that leads from more states than this to one state becomes a note beside it. So many arrows would
// hide everything else.
constexpr std::size_t most_arrows_of_an_event = 5;

// A table with its types taken off: names only.
struct Row {
  std::string from, event, guard, action, to;
  bool leads_alike(const Row& other) const {
    return guard == other.guard && action == other.action && to == other.to;
  }
};

struct Machine {
  std::vector<std::string> states;  // in the order of the enumeration; the first is where it begins
  std::vector<Row> rows;            // in the order of the table
};

// A state without a name is the one before and after everything: Mermaid's point of start and end.
constexpr std::string_view nowhere = "[*]";

template <typename State>
std::string name_of(State state) {
  const std::string_view name = to_string(state);
  return std::string{name.empty() ? nowhere : name};
}

template <typename State, typename Table>
Machine machine_of(Table table, int state_count) {
  Machine machine;
  for (int s = 0; s < state_count; ++s) machine.states.push_back(name_of(static_cast<State>(s)));
  for (const auto& row : table) {
    Row r{.from = name_of(row.from),
          .event = std::string{to_string(row.on)},
          .guard = std::string{row.guard.name},
          .action = std::string{to_string(row.action)},
          .to = name_of(row.to)};
    const bool has_rival = std::ranges::any_of(
        machine.rows, [&](const Row& before) { return before.from == r.from && before.event == r.event; });
    if (r.guard.empty() && has_rival) r.guard = "else";
    machine.rows.push_back(std::move(r));
  }
  return machine;
}

// Mermaid wants one word for a state; "driving, computing" becomes driving_computing.
std::string word(const std::string& name) {
  std::string id;
  for (const char c : name) {
    if (c == ' ')
      id += '_';
    else if (c != ',')
      id += c;
  }
  return id;
}

std::string consequence(const Row& row) {
  std::string text;
  if (!row.guard.empty()) text += fmt::format(" [{}]", row.guard);
  if (row.action != "none") text += fmt::format(" / {}", row.action);
  return text;
}

// Events of one arrow that ask and do the same stand together: "side, corner / advance".
std::string arrow_label(const std::vector<Row>& rows) {
  std::vector<std::pair<std::string, std::string>> lines;  // events, consequence
  for (const auto& row : rows) {
    const std::string then = consequence(row);
    const auto same = std::ranges::find(lines, then, &std::pair<std::string, std::string>::second);
    if (same == lines.end())
      lines.emplace_back(row.event, then);
    else
      same->first += ", " + row.event;
  }
  std::string label;
  for (const auto& [events, then] : lines) label += (label.empty() ? "" : "<br/>") + events + then;
  return label;
}

// The events that become a note: from many states, and everywhere with the same consequence.
std::set<std::string> folded_events(const Machine& machine) {
  std::set<std::string> folded;
  for (const auto& first : machine.rows) {
    std::size_t count = 0;
    bool alike = true;
    for (const auto& row : machine.rows) {
      if (row.event != first.event) continue;
      ++count;
      alike = alike && row.leads_alike(first);
    }
    if (alike && count > most_arrows_of_an_event) folded.insert(first.event);
  }
  return folded;
}

std::string note_of(const Machine& machine, const std::string& event) {
  const auto row = *std::ranges::find(machine.rows, event, &Row::event);
  std::string without;
  for (const auto& state : machine.states) {
    const bool takes_it =
        std::ranges::any_of(machine.rows, [&](const Row& r) { return r.from == state && r.event == event; });
    if (!takes_it) without += (without.empty() ? "" : ", ") + state;
  }
  return fmt::format("  note right of {}\n    {}{}\n    from every state{}\n  end note\n", word(row.to),
                     event, consequence(row), without.empty() ? "" : " but " + without);
}

std::string diagram(const Machine& machine) {
  std::string text = "```mermaid\nstateDiagram-v2\n";
  for (const auto& state : machine.states) {
    if (word(state) != state) text += fmt::format("  state \"{}\" as {}\n", state, word(state));
  }
  if (machine.states.front() != nowhere) text += fmt::format("  [*] --> {}\n", word(machine.states.front()));
  const auto folded = folded_events(machine);
  for (const auto& from : machine.states) {
    bool leaves = false;
    for (const auto& to : machine.states) {
      std::vector<Row> rows;
      for (const auto& row : machine.rows) {
        if (row.from == from && row.to == to && !folded.contains(row.event)) rows.push_back(row);
        leaves = leaves || row.from == from;
      }
      if (!rows.empty()) text += fmt::format("  {} --> {} : {}\n", word(from), word(to), arrow_label(rows));
    }
    if (!leaves) text += fmt::format("  {} --> [*]\n", word(from));
  }
  for (const auto& event : folded) text += note_of(machine, event);
  return text + "```\n";
}

}  // namespace

std::string driver_diagrams() {
  const auto scanner = machine_of<hal::PscPhase>(hal::psc_transitions(), hal::psc_phase_count);
  const auto robot = machine_of<hal::LinePhase>(hal::line_transitions(), hal::line_phase_count);
  return fmt::format("### PSC1 scanner (`scanner/psc_table.cpp`)\n\n{}\n", diagram(scanner)) +
         fmt::format("### Line robot (`robot/line_table.cpp`)\n\n{}", diagram(robot));
}

std::string cell_diagrams() {
  const auto cell = machine_of<tasks::CellState>(tasks::cell_transitions(), tasks::cell_state_count);
  const auto start = machine_of<tasks::StartState>(tasks::start_transitions(), tasks::start_state_count);
  const auto phases = machine_of<tasks::Phase>(tasks::phase_transitions(), tasks::phase_count);
  const auto shots = machine_of<tasks::ShotState>(tasks::shot_transitions(), tasks::shot_state_count);
  const auto tracker = machine_of<tasks::TrackState>(tasks::track_transitions(), tasks::track_state_count);
  return fmt::format("### Supervisor (`machines/cell_state.cpp`)\n\n{}\n", diagram(cell)) +
         fmt::format("### Start of the devices (`machines/start_sequence.cpp`)\n\n{}\n", diagram(start)) +
         fmt::format("### Phases of Execute (`machines/phases.cpp`)\n\n{}\n", diagram(phases)) +
         fmt::format("### Shot sequence (`machines/shot_sequence.cpp`)\n\n{}\n", diagram(shots)) +
         fmt::format("### Boundary tracker (`machines/track_table.cpp`)\n\n{}", diagram(tracker));
}

}  // namespace moldloft::firmware_like
