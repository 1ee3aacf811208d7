// What the deployed program says on standard error: to a terminal's user, to a file, to the system's journal.
#include "firmware_like/process/complaint.hpp"
#include "host_sim/real_devices.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <csignal>
#include <sstream>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;

namespace {

// Standard error is a file here; systemd names the journal's stream by its device and inode in the same way.
constexpr const char* as_journal = "JOURNAL_STREAM=$(stat -L -c %d:%i /proc/self/fd/2) exec \"$0\" \"$@\"";

std::vector<std::string> under_journal(std::vector<std::string> words) {
  words.insert(words.begin(), {"/bin/sh", "-c", as_journal});
  return words;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream all{text};
  for (std::string line; std::getline(all, line);) lines.push_back(line);
  return lines;
}

// A held service whose scanner nobody serves, as `words_of` starts it.
struct Service {
  hal::TemporaryFolder folder;
  // Tests run side by side, and one controller holds a device: each has its own.
  std::string port = std::to_string(40000 + ::getpid() % 20000), device = folder.file("arm");
  std::string control = folder.file("control"), out = folder.file("run"), config = folder.file("cell.toml");
  std::optional<ChildProcess> program;

  explicit Service(bool journal, const std::vector<std::string>& more = {}) {
    std::ofstream{config} << "[scanner]\nhost = \"127.0.0.1\"\nport = " << 40000 + ::getpid() % 20000
                          << "\n[robot]\ndevice = \"" << folder.file("arm") << "\"\n";
    std::vector<std::string> words = {MOLDLOFT, "run",           config,      "--out",
                                      out,      "--resume-held", "--control", control};
    words.insert(words.end(), more.begin(), more.end());
    program.emplace(journal ? under_journal(words) : words);
    for (int i = 0; i < 200 && status().find("Held") == std::string::npos; ++i) program->wait(50ms);
  }
  Finished tell(const char* word) const {
    return run_program({MOLDLOFT, "tell", word, "--control", control});
  }
  std::string status() const { return tell("status").out; }
  std::string ended() {
    program->send(SIGTERM);
    CHECK(program->wait(20s).has_value());
    return program->err();
  }
};

}  // namespace

TEST_CASE("under the journal an abort comes with its reason and as an error, anywhere else without a mark") {
  for (const bool journal : {true, false}) {
    CAPTURE(journal);
    Service service{journal};
    CHECK(service.tell("abort").out == "done: Held -> Aborted\n");
    const std::string said = service.ended();
    CAPTURE(said);
    bool told = false;
    for (const auto& line : lines_of(said)) {
      told = told || (line.starts_with("<3>moldloft: aborted at ") &&
                      line.ends_with(": aborted by command: clear when the cell is safe"));
      if (!journal) CHECK(line.find('<') == std::string::npos);
    }
    CHECK(told == journal);
    CHECK(lines_of(said).back().starts_with(journal ? "<3>moldloft: " : "moldloft: "));
  }
}

TEST_CASE("missed ticks are one warning of the journal at the end of the run, anywhere else the table's") {
  for (const bool journal : {true, false}) {
    CAPTURE(journal);
    Service service{journal};
    // A program that is suspended cannot tick: at least 100 of its ticks are lost, whatever the machine does beside.
    service.program->send(SIGSTOP);
    service.program->wait(200ms);
    service.program->send(SIGCONT);
    CHECK(service.status().find("Held") != std::string::npos);
    const std::string said = service.ended();
    CAPTURE(said);
    std::vector<std::string> told;
    for (const auto& line : lines_of(said))
      if (line.find("ticks were missed") != std::string::npos) told.push_back(line);
    REQUIRE(told.size() == (journal ? 1 : 0));
    if (!journal) continue;
    CHECK(told[0].starts_with("<4>moldloft: "));
    CHECK(std::stoi(told[0].substr(std::string_view{"<4>moldloft: "}.size())) >= 100);
    CHECK(told[0].find("; the first at ") != std::string::npos);
    CHECK(lines_of(said).back().find("ticks were missed") == std::string::npos);  // that is how to go on
  }
}

TEST_CASE("what is wrong before anything is begun is an error of the journal too") {
  const auto refused = run_program(under_journal({MOLDLOFT, "run", "/nowhere/cell.toml"}));
  CHECK(refused.exit_code == firmware_like::exit_failed);
  CHECK(refused.err.starts_with("<3>moldloft: /nowhere/cell.toml: "));
  CHECK(lines_of(refused.err).size() == 1);
}

TEST_CASE("what a cell waits for is said while it waits: an operator, then the scanner by its address") {
  Service service{false};
  CHECK(service.status().find("waiting for an operator: moldloft tell unhold, or stop") != std::string::npos);
  CHECK(service.program->prints("waiting for an operator: moldloft tell unhold, or stop", 10s));
  CHECK(service.tell("unhold").out == "done: Held -> Starting\n");
  CHECK(service.program->prints("and the scanner: 127.0.0.1:" + service.port, 10s));
  CHECK(service.program->prints("waiting for the robot: " + service.device + " does not exist", 10s));
  service.ended();
}

TEST_CASE("--quiet leaves what went wrong and the last line") {
  Service service{false, {"--quiet"}};
  const std::string said = service.ended();
  CHECK(said == "moldloft: stopped before anything was measured; nothing is kept\n");

  const hal::TemporaryFolder folder;
  const auto run = run_program({MOLDLOFT_SIM, "cell", "--quiet", "--out", folder.file("run")}, run_limit);
  CHECK(run.exit_code == firmware_like::exit_done);
  CHECK(run.err == "");
  CHECK(run.out == "complete: " + folder.file("run") + "\n");
}
