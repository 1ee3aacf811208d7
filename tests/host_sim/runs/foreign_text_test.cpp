// Text that others bring (a device's ERROR, a file's name, a configuration, an operator's word), through a whole
// run and every command that reads it afterwards: no run ends by it, and every file is what its ending says.
#include "firmware_like/commands/export_command.hpp"
#include "firmware_like/commands/fit_command.hpp"
#include "firmware_like/commands/replay_command.hpp"
#include "firmware_like/commands/report_command.hpp"
#include "firmware_like/gateway/operator_channel.hpp"
#include "firmware_like/process/complaint.hpp"
#include "hal/record/run_store.hpp"
#include "hal/scanner/psc1.hpp"
#include "host_sim/scripted_run.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <sstream>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
using namespace std::string_literals;
namespace fs = std::filesystem;

namespace {

// What others bring. Not one of them is longer than what it is put into allows, but for the last.
const std::vector<std::string> foreign = {
    "laser too hot: 61 \xB0"s + "C",                      // Latin-1
    "\"quoted\" 'twice' \\ back\\slash",                  //
    "two\nlines\r\nand a \t tab",                         //
    "\x1b[2J\x07 bell, NUL \0 in the middle"s,            //
    "<script>alert(1)</script> & <b> ]]> <!-- -->",       //
    "100 % %s %n {} {0} {:d} $(reboot) `id`",             //
    "surrogate \xED\xA0\x80 overlong \xC0\xAF \xE0\x80",  //
    "\u202Eright to left\u2028 separator \uFEFF",         //
    std::string(100'000, '\xE9'),                         // 100 kB
};

bool is_clean_utf8(const std::string& text) {  // by the library that reads our JSON, which takes nothing else
  std::string one_line = text;
  for (char& c : one_line) {
    if (c == '\n' || c == '\r') c = ' ';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) return false;
  }
  std::string quoted = "\"";
  for (const char c : one_line) quoted += c == '"' || c == '\\' ? std::string{'\\', c} : std::string{c};
  return Json::accept(quoted + '"');
}

// Well formed as XML asks: tags that close, entities that are known, values in quotes.
std::string flaw_of_xml(std::string text) {
  std::vector<std::string> open;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '&') {
      const auto end = text.find(';', i);
      const std::string name = text.substr(i + 1, end == text.npos ? 0 : end - i - 1);
      if (name != "lt" && name != "gt" && name != "amp" && name != "quot" && name != "apos" &&
          !name.starts_with("#"))
        return "unknown entity near " + text.substr(i, 20);
    }
    if (text[i] != '<') continue;
    std::size_t end = i + 1;
    char quote = 0;
    for (; end < text.size() && (quote != 0 || text[end] != '>'); ++end) {
      if (quote != 0 ? text[end] == quote : text[end] == '"' || text[end] == '\'')
        quote = quote != 0 ? 0 : text[end];
      if (text[end] == '<') return "'<' within a tag near " + text.substr(i, 20);
    }
    if (end >= text.size()) return "a tag without end near " + text.substr(i, 20);
    const std::string tag = text.substr(i + 1, end - i - 1);
    const std::string name = tag.substr(0, tag.find_first_of(" \n/", 1));
    i = end;
    if (tag.starts_with("!") || tag.starts_with("?") || tag.ends_with("/")) continue;
    if (!tag.starts_with("/")) {
      open.push_back(name);
      if (name == "style" || name == "script") i = text.find("</" + name, i) - 1;  // no markup in there
      continue;
    }
    const bool closes = !open.empty() && tag.substr(1) == open.back();
    if (!closes) return "</" + tag.substr(1) + "> closes " + (open.empty() ? "nothing" : open.back());
    open.pop_back();
  }
  return open.empty() ? "" : "<" + open.back() + "> is not closed";
}

void check_files(const fs::path& folder) {
  int looked_at = 0;
  for (const auto& entry : fs::directory_iterator{folder}) {
    const std::string text = text_of(entry.path()), ending = entry.path().extension();
    CAPTURE(entry.path().filename().string());
    ++looked_at;
    if (ending == ".json") {
      CHECK(Json::accept(text));
    } else if (ending == ".jsonl") {
      std::istringstream lines{text};
      for (std::string line; std::getline(lines, line);) CHECK_MESSAGE(Json::accept(line), line);
    } else if (ending == ".svg") {
      CHECK(is_clean_utf8(text));
      CHECK(flaw_of_xml(text) == "");
    } else if (ending == ".html") {
      CHECK(is_clean_utf8(text));
      CHECK(text.find("<script>alert") == text.npos);
    } else if (ending == ".step" || ending == ".igs") {
      const auto printable = [](char c) { return (c >= 0x20 && c < 0x7F) || c == '\n' || c == '\r'; };
      CHECK(std::ranges::all_of(text, printable));
    } else {
      --looked_at;
    }
  }
  CHECK(looked_at >= 3);
}

// Everything that reads a run, on the one in `folder`.
void read_again(const std::string& folder) {
  const hal::TemporaryFolder results;
  CHECK(firmware_like::fit_run({.run = folder, .out = results.file("fit")}) == firmware_like::exit_done);
  check_files(results.file("fit"));
  CHECK(firmware_like::report_run({.run = folder}) == firmware_like::exit_done);
  CHECK(firmware_like::replay_run({.run = folder}) == firmware_like::exit_done);
  CHECK(firmware_like::export_run(
            {.run = folder, .step = results.file("a.step"), .iges = results.file("a.igs")}) ==
        firmware_like::exit_done);
  check_files(folder);
}

// What the scanner would send: ERROR, with a text that PROTOCOLS.md does not allow.
std::vector<std::byte> error_message(const std::string& text) {
  std::vector<std::byte> wire(512);
  wire.resize(hal::psc1::encode(
      9, hal::psc1::ErrorReply{hal::psc1::Status::bad_state, 0, std::string_view{text}}, wire));
  return wire;
}

bool computes(const SimulatedCell& cell, hal::Instant now) {
  return now > cell.world.scanner().busy_from() + 50ms && now < cell.world.scanner().busy_until() - 20ms;
}

}  // namespace

TEST_CASE(
    "a scanner's ERROR holds the cell for a moment, whatever it is written in, and the run is as good as "
    "any") {
  ScriptedRun cell;
  std::size_t sent = 0;
  hal::Instant last{0};
  cell.run([&](const SimulatedCell& c, hal::Instant now) {
    const bool may = c.controller.cell().shots_taken(hal::ShotPurpose::boundary) > 0 && now > last + 1s;
    if (sent == foreign.size() || !may || !computes(c, now)) return;
    last = now;
    const auto wire = error_message(foreign[sent++]);
    CHECK(c.scanner_cable.device().write(wire) == wire.size());
  });
  CHECK(sent == foreign.size());
  const std::string events = cell.file("events.jsonl");
  CHECK(events.find("laser too hot: 61 °C") != events.npos);
  CHECK(events.find("two lines") != events.npos);
  check_files(cell.folder());
  read_again(cell.folder());
  check_truth(Json::parse(cell.file("summary.json")));
}

TEST_CASE("the last word of a run that ends by it is in its summary, and its status can be asked for") {
  for (const auto& text : foreign) {
    CAPTURE(text.substr(0, 30));
    ScriptedRun cell;
    bool sent = false;
    const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
      auto& controlled = c.controller.cell();
      if (!sent && controlled.shots_taken(hal::ShotPurpose::boundary) > 0 && computes(c, now))
        sent = c.scanner_cable.device().write(error_message(text)) > 0;
      if (controlled.cause() != tasks::HoldCause::scanner) return;
      const Json status = Json::parse(firmware_like::status_json(controlled.progress()));
      CHECK(is_clean_utf8(status["why"]));
      CHECK(is_clean_utf8(firmware_like::answer_to("status", controlled, [] {})));
      controlled.command(tasks::CellEvent::stop);
    });
    CHECK(sent);
    CHECK(run.exit_code == firmware_like::exit_stopped);
    CHECK(Json::parse(cell.file("summary.json"))["message"].get<std::string>().starts_with("scanner: "));
    check_files(cell.folder());
  }
}

TEST_CASE("lines on the robot's wire that are none are counted, and the run completes") {
  ScriptedRun cell;
  std::size_t sent = 0;
  const auto run = cell.run([&](const SimulatedCell& c, hal::Instant now) {
    if (now % 200ms != 0ms) return;
    const std::string& text = foreign[sent++ % (foreign.size() - 1)];
    const std::string line = "<0000 " + text + " *1\n";
    c.robot_cable.device().write(std::as_bytes(std::span{line}));
  });
  CHECK(sent > 20);
  CHECK(run.exit_code == firmware_like::exit_done);
  check_files(cell.folder());
}

TEST_CASE(
    "a store of an earlier version, which kept a device's bytes as they came, is fitted, reported and "
    "shown") {
  ScriptedRun cell;
  REQUIRE(cell.run().exit_code == firmware_like::exit_done);
  {
    auto store = *hal::RunStore::open(fs::path{cell.folder()} / "run.db", hal::RunStore::Mode::append);
    for (const auto& text : foreign) {
      hal::EventRecord event{.at = 1s};
      for (auto* field : {&event.event, &event.from, &event.to}) field->assign(text);
      event.source.assign(text);
      event.text.assign(text);
      REQUIRE(store.write(event).has_value());
    }
  }
  read_again(cell.folder());
  const auto store = *hal::RunStore::open(fs::path{cell.folder()} / "run.db", hal::RunStore::Mode::read);
  const auto events = store.events();
  for (const auto& e : *events) CHECK(is_clean_utf8(std::string{e.text.view()}));
}

TEST_CASE("a run's folder and a plate's name may be called anything that a file system takes") {
  for (const auto& text : foreign) {
    CAPTURE(text.substr(0, 30));
    std::string name = text.substr(0, std::min<std::size_t>(text.find('\0'), 80));
    std::erase(name, '/');
    ScriptedRun cell;
    cell.options.out /= name;
    const auto run = cell.run();
    CHECK(run.exit_code == firmware_like::exit_done);
    check_files(cell.folder());
    const hal::TemporaryFolder results;
    CHECK(firmware_like::fit_run({.run = cell.folder(), .out = results.file(name)}) ==
          firmware_like::exit_done);
    check_files(results.file(name));
    CHECK(firmware_like::report_run({.run = cell.folder()}) == firmware_like::exit_done);
    CHECK(firmware_like::export_run({.run = cell.folder(),
                                     .step = results.file(name + ".step"),
                                     .iges = results.file(name + ".igs")}) == firmware_like::exit_done);
    check_files(cell.folder());
  }
}

TEST_CASE("a configuration's texts are taken as they are, or refused in one line that can be read") {
  const auto quoted = [](const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
      const auto byte = static_cast<unsigned char>(c);
      if (c == '"' || c == '\\') out += '\\';
      out += byte < 0x20 || byte == 0x7F ? fmt::format("\\u{:04x}", byte) : std::string{c};
    }
    return out + '"';
  };
  int taken = 0, refused = 0;
  for (const auto& text : foreign) {
    for (const std::string& toml :
         {"[cell]\nname = " + quoted(text) + "\n", "[scanner]\nhost = " + quoted(text) + "\n",
          "[robot]\ndevice = " + quoted(text) + "\n", "[robot]\ndriver = " + quoted(text) + "\n",
          quoted(text) + " = 1\n", "[" + quoted(text) + "]\nx = 1\n", "[cell]\nname = 'a'\n# " + text + "\n",
          text}) {
      const auto config = firmware_like::parse_config(toml, "dir\n\xB0/cell.toml");
      if (config) {
        ++taken;
        CHECK(is_clean_utf8(config->name));
        continue;
      }
      ++refused;
      const std::string& what = config.error().what;
      CAPTURE(what.substr(0, 200));
      std::istringstream lines{what};  // one for each error of the file
      for (std::string line; std::getline(lines, line);) {
        CHECK(is_clean_utf8(line));
        CHECK(line.size() < 1000);
        CHECK(line.starts_with("dir °/cell.toml:"));
      }
    }
  }
  CHECK(taken >= 6);
  CHECK(refused >= 40);
}

TEST_CASE("an operator's word is a command or is refused in one line, whatever it is") {
  hal::VirtualClock clock;
  hal::Cable scanner{clock, {}}, robot{clock, {}};
  firmware_like::Controller controller{
      firmware_like::default_config(), clock, scanner.host(), robot.host(),
      firmware_like::ControllerOptions{.begin_held = true, .attended = true}};
  controller.start();
  controller.tick();
  for (const auto& text : foreign) {
    for (const std::string& word : {text, "status" + text, "unhold " + text, text + "stop", "stop\0x"s}) {
      const std::string answer =
          firmware_like::answer_to(word, controller.cell(), [&] { controller.tick(); });
      CHECK(answer.starts_with("refused: "));
      CHECK(is_clean_utf8(answer));
    }
  }
  CHECK(controller.cell().state() == tasks::CellState::held);
}

TEST_CASE("words, paths and options that nobody expects end the programs in one line, with 1") {
  const hal::TemporaryFolder folder;
  for (const auto& text : foreign) {
    const std::string word = text.substr(0, std::min<std::size_t>(text.find('\0'), 200));
    CAPTURE(word);
    for (const auto& words : std::vector<std::vector<std::string>>{
             {MOLDLOFT, "tell", word, "--control", folder.file("none")},
             {MOLDLOFT, "tell", "status", "--control", folder.file(word)},
             {MOLDLOFT, "run", folder.file(word)},
             {MOLDLOFT, "fit", folder.file(word), "--out", folder.file("x")},
             {MOLDLOFT, "report", folder.file(word)},
             {MOLDLOFT, "replay", folder.file(word)},
             {MOLDLOFT, "export", folder.file(word), "--step", folder.file("x.step")},
             {MOLDLOFT_SIM, "cell", "--plate", word + ".ply", "--out", folder.file("y")},
             {MOLDLOFT_SIM, "judge", folder.file(word)}}) {
      const Finished program = run_program(words);
      CAPTURE(words[1]);
      CAPTURE(program.err);
      CHECK(program.exit_code == firmware_like::exit_failed);
      CHECK(is_clean_utf8(program.err));
      CHECK(lines_in(program.err) == 1);
    }
  }
}
