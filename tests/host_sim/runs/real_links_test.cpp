// The programs as they are deployed, in real time: the controller on a TCP socket and a serial port,
// the simulated devices behind them. Nothing here depends on how fast the machine answers; all waits
// have a limit.
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/run/flight_files.hpp"
#include "hal/record/run_store.hpp"
#include "host_sim/child_process.hpp"
#include "host_sim/real_devices.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <csignal>
#include <filesystem>
#include <fstream>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
using nlohmann::json;

namespace {

json summary_in(const std::string& folder) { return json::parse(text_of(folder + "/summary.json")); }

void check_files(const std::string& folder) {
  const auto summary = summary_in(folder);
  CHECK(summary["result"] == "complete");
  CHECK(summary["recorder_lost"] == 0);
  CHECK(summary["shots"]["surface"] == 16);
  CHECK(json::parse(text_of(folder + "/surface.json"))["unit"] == "mm");
  const auto timing = json::parse(text_of(folder + "/timing.json"));
  CHECK(timing["ticks"].get<int>() > 1000);
  CHECK(timing["environment"]["sysinfo"]["sysname"] == "Linux");
  CHECK(timing["setup"].size() == 9);
  CHECK(timing["representative"].get<bool>() == timing["why"].get<std::string>().empty());
  CHECK(timing["why"] != "virtual time");
  std::istringstream events{text_of(folder + "/events.jsonl")};
  int count = 0;
  for (std::string line; std::getline(events, line); ++count) REQUIRE(json::accept(line));
  CHECK(count > 100);
  CHECK(text_of(folder + "/overview.svg").starts_with("<svg"));
  CHECK(text_of(folder + "/overview.svg").find("</svg>") != std::string::npos);
  for (const char* ply : {"/points.ply", "/boundary.ply"})
    CHECK(text_of(folder + ply).starts_with("ply\nformat binary_little_endian 1.0\n"));
  const auto store = hal::RunStore::open(folder + "/run.db", hal::RunStore::Mode::read);
  REQUIRE_MESSAGE(store.has_value(), store.error().what);
  CHECK(store->shots()->size() ==
        summary["shots"]["seek"].get<std::size_t>() + summary["shots"]["boundary"].get<std::size_t>() + 16);
}

void check_truth(const std::string& folder) {
  const auto judged = run_program({MOLDLOFT_SIM, "judge", folder, "--seed", "1"});
  CHECK(judged.exit_code == 0);
  const auto truth = summary_in(folder)["truth"];
  CHECK(truth["normal_rms_mm"].get<double>() <= 0.02);
  CHECK(truth["normal_max_mm"].get<double>() <= 0.08);
  CHECK(truth["outline_max_mm"].get<double>() <= 0.3);
  CHECK(truth["corner_max_mm"].get<double>() <= 0.3);
}

std::size_t stored_shots(const std::string& folder) {
  const auto store = hal::RunStore::open(folder + "/run.db", hal::RunStore::Mode::read);
  return store ? store->shots()->size() : 0;
}

std::uint64_t robot_bytes_sent(const std::string& folder) {
  const auto store = hal::RunStore::open(folder + "/run.db", hal::RunStore::Mode::read);
  REQUIRE(store.has_value());
  std::uint64_t count = 0;
  while (store->bytes(hal::LinkId::robot, hal::Direction::sent, count, 1)) ++count;
  return count;
}

// The control points are the same to the last bit: both come from the same bytes in the same order.
void check_fit_repeats(const std::string& run, const std::string& out) {
  const auto fitted = run_program({MOLDLOFT, "fit", run, "--out", out});
  CHECK_MESSAGE(fitted.exit_code == 0, fitted.err);
  CHECK(text_of(out + "/surface.json") == text_of(run + "/surface.json"));
  CHECK(summary_in(out)["result"] == "complete");
}

// What the run left can be shown again, and the page comes out the same.
void check_report(const std::string& run) {
  const auto timing = json::parse(text_of(run + "/timing.json"));
  CHECK(timing["frame_to_command"]["count"].get<int>() > 10);
  CHECK(timing["frame_to_command"]["p999_us"].is_number());
  CHECK(timing["data_age"]["p999_us"].get<double>() > timing["frame_to_command"]["p50_us"].get<double>());
  REQUIRE(timing.contains("scanner_clock"));
  CHECK(timing["scanner_clock"]["readings"].get<int>() > 10);
  CHECK(timing["budgets"]["tasks"].size() == 6);
  CHECK(timing["thread"]["0"]["cycles"] == timing["wake_up"]["count"]);
  const std::string page = text_of(run + "/report.html");
  CHECK(page.find("From frame to command") != std::string::npos);
  std::filesystem::remove(run + "/report.html");
  const auto shown = run_program({MOLDLOFT, "report", run});
  CHECK_MESSAGE(shown.exit_code == 0, shown.err);
  CHECK(shown.out.find("frame to command ") != std::string::npos);
  CHECK(shown.out.find("complete") != std::string::npos);
  CHECK(text_of(run + "/report.html") == page);
}

}  // namespace

TEST_CASE(
    "the deployed program measures a plate over a socket and a serial port, and its run can be fitted "
    "again") {
  const Devices devices;
  const hal::TemporaryFolder folder;
  const std::string out = folder.file("run");
  ChildProcess run{run_words(devices, out), PTY_MODEM};
  const auto code = run.wait(run_limit);
  REQUIRE_MESSAGE(code == firmware_like::exit_done, run.err());
  CHECK(run.out().find("complete") != std::string::npos);
  check_files(out);
  check_truth(out);
  check_fit_repeats(out, folder.file("fit"));
  check_report(out);
}

TEST_CASE("the robot's lines go over a socket as well, and a plate is measured without any serial port") {
  const hal::TemporaryFolder folder;
  const std::string config = folder.file("cell.toml"), out = folder.file("run");
  ChildProcess devices{
      {MOLDLOFT_SIM, "devices", "--scanner-port", "0", "--robot-port", "0", "--cell", config}};
  REQUIRE_MESSAGE(devices.prints("ready: scanner 127.0.0.1:", 20s), devices.err());
  ChildProcess run{{MOLDLOFT, "run", config, "--out", out}};
  const auto code = run.wait(run_limit);
  REQUIRE_MESSAGE(code == firmware_like::exit_done, run.err());
  check_truth(out);
}

TEST_CASE("a run that ctrl-C stops, then a power cut, goes on where it was with --resume") {
  const Devices devices;
  const hal::TemporaryFolder folder;
  const std::string out = folder.file("run");
  {
    ChildProcess run{run_words(devices, out), PTY_MODEM};
    REQUIRE_MESSAGE(run.prints("boundary shots   5", run_limit), run.err());
    run.send(SIGINT);
    CHECK(run.wait(20s) == firmware_like::exit_stopped);
    CHECK(run.err().find(
              "moldloft: stopped: the arm stands. Everything so far is saved; to go on: moldloft run " +
              devices.config() + " --out " + out + " --resume\n") != std::string::npos);
    CHECK(run.out().empty());  // no table of a run that has no result
  }
  const auto shots_at_stop = stored_shots(out);
  CHECK(shots_at_stop >= 5);
  CHECK(summary_in(out)["result"] == "stopped");
  {
    ChildProcess run{run_words(devices, out, true), PTY_MODEM};
    REQUIRE_MESSAGE(run.prints("surface   4/16", run_limit), run.err());
    run.send(SIGKILL);
    CHECK_FALSE(run.wait(20s).has_value());
  }
  const auto shots_at_cut = stored_shots(out);
  CHECK(shots_at_cut > shots_at_stop);
  {
    ChildProcess run{run_words(devices, out, true), PTY_MODEM};
    const auto code = run.wait(run_limit);
    REQUIRE_MESSAGE(code == firmware_like::exit_done, run.err());
  }
  check_files(out);
  check_truth(out);
  check_fit_repeats(out, folder.file("fit"));
}

// What a service manager does after a kill: the same words again.
TEST_CASE("a program that is killed and started again with --resume-held moves nothing until it is told to") {
  const Devices devices;
  const hal::TemporaryFolder folder;
  const std::string out = folder.file("run"), control = folder.file("control");
  const std::vector<std::string> words = {MOLDLOFT, "run",           devices.config(), "--out",
                                          out,      "--resume-held", "--control",      control};
  const auto tell = [&](const char* word) {
    return run_program({MOLDLOFT, "tell", word, "--control", control});
  };
  {
    ChildProcess run{words, PTY_MODEM};
    REQUIRE_MESSAGE(run.prints("Held", 20s), run.err());
    CHECK(tell("unhold").out == "done: Held -> Starting\n");
    REQUIRE_MESSAGE(run.prints("boundary shots   3", run_limit), run.err());
    run.send(SIGKILL);
    CHECK_FALSE(run.wait(20s).has_value());
  }
  const auto sent_before = robot_bytes_sent(out);
  CHECK(sent_before > 0);
  ChildProcess run{words, PTY_MODEM};
  REQUIRE_MESSAGE(run.prints("Held", 20s), run.err());
  CHECK(json::parse(tell("status").out)["why"] ==
        "started held: nothing moves before an operator sends unhold");
  CHECK(tell("hold").err == "moldloft: refused: hold means nothing in Held\n");
  CHECK(tell("stop").out == "done: Held -> Stopped\n");
  CHECK(run.wait(20s) == firmware_like::exit_stopped);
  CHECK(robot_bytes_sent(out) == sent_before);  // to the last byte: the robot has heard nothing
  CHECK_FALSE(std::filesystem::exists(control));
}

TEST_CASE(
    "a start pose off the plate and a plate that leaves the workspace end in one line that says what to do") {
  const Devices devices;
  const hal::TemporaryFolder folder;
  const auto last_line = [](const std::string& text) {
    const auto before = text.rfind('\n', text.size() - 2);
    return before == std::string::npos ? text : text.substr(before + 1);
  };
  const auto saved = [&](const char* name) {
    return ". What was measured is saved in " + folder.file(name) +
           " (overview.svg shows it); then begin a new run\n";
  };
  ChildProcess beyond{
      {MOLDLOFT, "run", devices.config_with("y_mm", "y_mm = [-800, 50]"), "--out", folder.file("beyond")},
      PTY_MODEM};
  CHECK_MESSAGE(beyond.wait(run_limit) == firmware_like::exit_aborted, beyond.err());
  CHECK(last_line(beyond.err()).starts_with("moldloft: aborted: target outside the workspace: y "));
  CHECK(last_line(beyond.err())
            .ends_with(" mm, limit -800.0 to 50.0 mm: move the plate, or widen [robot.workspace] if the arm "
                       "may go there" +
                       saved("beyond")));
  CHECK(beyond.out().empty());
  CHECK(stored_shots(folder.file("beyond")) > 1);

  ChildProcess off{{MOLDLOFT, "run", devices.config_with("centre_mm", "centre_mm = [510, 400, 15]"), "--out",
                    folder.file("off")},
                   PTY_MODEM};
  CHECK(off.wait(run_limit) == firmware_like::exit_held);
  CHECK(last_line(off.err()) ==
        "moldloft: held: no plate under the scanner at x 510 y 400 mm, looked for at 2 heights: move [start] "
        "onto the "
        "plate" +
            saved("off"));
  CHECK(off.out().empty());
  CHECK(stored_shots(folder.file("off")) == 2);

  // Nothing was measured here: no folder, and not a line before the one that says why.
  const std::string never = folder.file("never");
  ChildProcess refused{{MOLDLOFT, "run", devices.config_with("x_mm", "x_mm = [-800, 50]"), "--out", never},
                       PTY_MODEM};
  CHECK(refused.wait(run_limit) == firmware_like::exit_failed);
  CHECK(lines_in(refused.err()) == 1);
  CHECK(refused.err().find(": [start] centre_mm: target outside the workspace: x ") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(never));
}

TEST_CASE("a run that is asked for it, then dies, leaves its last second twice, and replay shows both") {
  const Devices devices;
  const hal::TemporaryFolder folder;
  const std::string out = folder.file("run");
  {
    ChildProcess run{run_words(devices, out), PTY_MODEM};
    REQUIRE_MESSAGE(run.prints("boundary shots   3", run_limit), run.err());
    run.send(SIGUSR2);
    hal::SteadyClock clock;
    // A busy machine may have frozen the recorder for an overrun of its own before: the request counts then.
    const auto end = clock.now() + 20s;
    while (firmware_like::flight_dumps(out).empty() && clock.now() < end)
      clock.sleep_until(clock.now() + 10ms);
    run.send(SIGSEGV);
    CHECK_FALSE(run.wait(20s).has_value());
    CHECK(run.err().find("moldloft: crashed; flight-crash.bin in the run's folder") != std::string::npos);
  }
  CHECK(std::filesystem::exists(out + "/flight-01.bin"));
  REQUIRE(std::filesystem::exists(out + "/flight-crash.bin"));
  const auto shown = run_program({MOLDLOFT, "replay", out, "--timeline", "--all"});
  CHECK(shown.exit_code == 0);
  CHECK(shown.out.find("/flight-01.bin\ncause: ") != std::string::npos);
  CHECK(shown.out.find("/flight-crash.bin\ncause: signal 11, running task: ") != std::string::npos);
  CHECK(shown.out.find(
            "tasks:  1 scanner in  2 robot in  3 cell  4 robot out  5 scanner out  6 health  ~ surface\n") !=
        std::string::npos);
  CHECK(shown.out.find("ticks of 1000 us") != std::string::npos);
  CHECK(shown.out.find("[shot: ") != std::string::npos);
  CHECK(shown.out.find("scanner ") != std::string::npos);

  const auto events = run_program({MOLDLOFT, "replay", out});
  CHECK(events.exit_code == 0);
  CHECK(events.out.find("cell     start            Idle -> Starting\n") != std::string::npos);
  CHECK(events.out.find("frame    boundary at x ") != std::string::npos);

  const auto nothing = run_program({MOLDLOFT, "replay", folder.file("none"), "--timeline"});
  CHECK(nothing.exit_code == 1);
  CHECK(nothing.err == "moldloft: " + folder.file("none") + ": no such run or dump\n");
}

// No figure is judged here: a test must not depend on how busy its machine is.
TEST_CASE("the timing self-test runs on this machine and leaves its report") {
  const hal::TemporaryFolder folder;
  const std::string out = folder.file("self-test");
  const auto done = run_program({MOLDLOFT, "latency", "--duration", "1", "--json", "--out", out});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  CHECK(done.err == "");
  const auto figures = json::parse(done.out);
  CHECK(figures["ours"]["cycles"].get<int>() > 100);
  CHECK(figures["ours"]["max_us"].get<double>() >= figures["ours"]["p50_us"].get<double>());
  CHECK(figures["representative"].get<bool>() == figures["why"].get<std::string>().empty());
  CHECK(figures["busy"]["points_seen"].get<int>() > 0);
  CHECK(figures["busy"]["frames_recorded"].get<int>() > 0);
  CHECK(figures["busy"]["records_lost"] == 0);
  const auto timing = json::parse(text_of(out + "/timing.json"));
  CHECK(timing["setup"].size() == 9);
  CHECK(timing["frame_to_command"].is_null());  // there are no devices
  CHECK(text_of(out + "/report.html").starts_with("<!DOCTYPE html>"));
  const auto store = hal::RunStore::open(out + "/run.db", hal::RunStore::Mode::read);
  REQUIRE_MESSAGE(store.has_value(), store.error().what);
  CHECK(store->shots()->size() == figures["busy"]["frames_recorded"].get<std::size_t>());
}

TEST_CASE("the timing self-test without a folder prints its table and leaves nothing behind") {
  const hal::TemporaryFolder folder;
  const auto done =
      run_program({"/usr/bin/env", "TMPDIR=" + folder.file(""), MOLDLOFT, "latency", "--duration", "1"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  CHECK(done.err == "measuring for 1 s; ctrl-C ends it with what there is\n");
  CHECK(done.out.starts_with("kernel              "));
  for (const char* row :
       {"\nordinary threads    ", "\nwake-up latency ", "\nlatest wake-up      ", "\nrepresentative      "}) {
    CAPTURE(row);
    const auto at = done.out.find(row);
    CHECK(at != std::string::npos);
    CHECK(done.out.find(row, at + 1) == std::string::npos);
  }
  CHECK(std::filesystem::is_empty(folder.file("")));
}
