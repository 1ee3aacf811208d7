// What is wrong with arguments is one line that says what to do; and the plate's name goes into everything.
#include "firmware_like/process/build_info.hpp"
#include "firmware_like/process/complaint.hpp"
#include "hal/record/run_store.hpp"
#include "host_sim/child_process.hpp"

#include <doctest/doctest.h>

#include <filesystem>

using namespace moldloft;
using namespace moldloft::host_sim;

namespace {

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

void check_line(std::vector<std::string> words, const std::string& begins) {
  const auto done = run_program(words);
  CAPTURE(done.err);
  CHECK(done.exit_code == firmware_like::exit_failed);
  CHECK(done.out == "");
  CHECK(lines_in(done.err) == 1);
  CHECK(done.err.starts_with(begins));
  CHECK(done.err.size() < 400);
}

}  // namespace

TEST_CASE("no command, an unknown one and a misspelt one are told with those that there are") {
  check_line({MOLDLOFT}, "moldloft: say what to do: run, check, tell, ");
  check_line({MOLDLOFT, "rnu"}, "moldloft: 'rnu' is no command; did you mean run?; there are run, check, ");
  check_line({MOLDLOFT, "chek", "cell.toml"}, "moldloft: 'chek' is no command; did you mean check?");
  check_line({MOLDLOFT, "frobnicate"}, "moldloft: 'frobnicate' is no command; there are run, ");
  check_line({MOLDLOFT, std::string(100 << 10, 'x')}, "moldloft: 'xxx");
  check_line({MOLDLOFT_SIM, "cel"}, "moldloft-sim: 'cel' is no command; did you mean cell?");
}

TEST_CASE("an option that is misspelt or given twice and a word too many are told") {
  check_line({MOLDLOFT, "run", "cell.toml", "--otu", "x"},
             "moldloft run: '--otu' is no option here; did you mean --out?; moldloft run --help explains");
  check_line({MOLDLOFT, "run", "cell.toml", "--out", "a", "--out=b"},
             "moldloft run: --out is given 2 times; give it once");
  check_line({MOLDLOFT, "run", "a.toml", "b.toml"}, "moldloft run: 'b.toml' is one word too many");
  check_line({MOLDLOFT, "run"}, "moldloft run: config is required");
  check_line(
      {MOLDLOFT_SIM, "cell", "--fault", "robot-lie 5"},
      "moldloft-sim cell: --fault: 'robot-lie 5': no fault is called so; known are robot-lies, robot-tilts, "
      "robot-slips, robot-leans, robot-drifts, robot-stays, scanner-blind, scanner-freezes, "
      "scanner-scales, scanner-mirrors, noise, plate-pushed, plate-turned, plate-lifted, mount-yawed, "
      "mount-shifted");
  check_line(
      {MOLDLOFT_SIM, "devices", "--fault", "noise 5, scanner-blind 1 from surface"},
      "moldloft-sim devices: --fault scanner-blind 1 from surface: devices do not know which shots are "
      "of the surface: give a number of a shot");
  check_line({MOLDLOFT_SIM, "cell", "--seed", "1", "--seed", "7"},
             "moldloft-sim cell: --seed is given 2 times; give it once");
  check_line({MOLDLOFT, "run", "cell.toml", "--n\xE9\n"},
             "moldloft run: '--n"
             "\?\?' is no option here");
}

TEST_CASE("both programs say their version, commit and compiler") {
  const std::string text = firmware_like::version_text();
  CHECK(run_program({MOLDLOFT, "--version"}).out == "moldloft " + text + "\n");
  CHECK(run_program({MOLDLOFT_SIM, "--version"}).out == "moldloft-sim " + text + "\n");
  CHECK(holds(text, " (commit "));
}

TEST_CASE("a plate's name that cannot be is refused before anything is made") {
  const hal::TemporaryFolder folder;
  const std::string out = folder.file("run");
  for (const std::string& name : {std::string{""}, std::string{" "}, std::string{"a\nb"}, std::string{"\xB0"},
                                  std::string(100 << 10, 'p')}) {
    check_line({MOLDLOFT, "run", "/dev/null", "--out", out, "--plate", name}, "moldloft: --plate: ");
    check_line({MOLDLOFT, "run", "/dev/null", "--out", out, "--remark", name}, "moldloft: --remark: ");
    check_line({MOLDLOFT_SIM, "cell", "--out", out, "--name", name}, "moldloft-sim cell: --name: ");
  }
  CHECK_FALSE(std::filesystem::exists(out));
}

TEST_CASE(
    "the plate's name, the remark, the cell and the version stand in all results, and fit and report have "
    "them") {
  const hal::TemporaryFolder folder;
  const std::string out = folder.file("run"), again = folder.file("again");
  REQUIRE(run_program(
              {MOLDLOFT_SIM, "cell", "--out", out, "--name", "Hull 7/<12> 'port'", "--remark", "second pass"})
              .exit_code == 0);
  const std::string version{firmware_like::build_info().version};
  const auto check_results = [&](const std::string& where) {
    CAPTURE(where);
    const std::string summary = text_of(where + "/summary.json"), step = text_of(where + "/surface.step"),
                      iges = text_of(where + "/surface.igs"), picture = text_of(where + "/overview.svg"),
                      page = text_of(where + "/report.html");
    CHECK(holds(summary, "\"plate\": \"Hull 7/<12> 'port'\""));
    CHECK(holds(summary, "\"remark\": \"second pass\""));
    CHECK(holds(summary, "\"version\": \"" + version + "\""));
    CHECK(holds(step, "PRODUCT('Hull 7/<12> ''port''','Hull 7/<12> ''port''',"));
    CHECK(holds(step, "'cell: simulated SCARA cell'"));
    CHECK(holds(step, "'remark: second pass'"));
    CHECK(holds(step, "'Moldloft " + version + " (commit "));
    CHECK(holds(iges, "18HHull 7/<12> 'port',"));
    CHECK(holds(iges, "remark: second pass "));
    CHECK(holds(picture, "Moldloft run: Hull 7/&lt;12&gt; 'port'<"));
    CHECK(holds(picture, "cell simulated SCARA cell; moldloft " + version));
    CHECK(holds(page, "<title>Hull 7/&lt;12&gt; 'port'</title>"));
    CHECK(holds(page, "remark: second pass"));
  };
  check_results(out);
  REQUIRE(run_program({MOLDLOFT, "fit", out, "--out", again}).exit_code == 0);
  check_results(again);
  const auto report = run_program({MOLDLOFT, "report", out});
  CHECK(holds(report.out, "plate                       Hull 7/<12> 'port'\n"));
  CHECK(holds(report.out, "remark                      second pass\n"));
  check_results(out);
  REQUIRE(run_program({MOLDLOFT, "export", out, "--step", folder.file("p.step")}).exit_code == 0);
  CHECK(holds(text_of(folder.file("p.step")), "PRODUCT('Hull 7/<12> ''port'''"));
  const auto store = hal::RunStore::open(out + "/run.db", hal::RunStore::Mode::read);
  REQUIRE(store.has_value());
  CHECK(store->meta("plate").value_or("") == "Hull 7/<12> 'port'");
  CHECK(store->meta("version").value_or("") == version);
}
