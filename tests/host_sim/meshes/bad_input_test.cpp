// Bad input to the real programs, as a user meets it: one line on standard error that names what, where and
// what to do, an exit code that is not 0, nothing on standard output, and nothing left behind that would
// block the next try.
#include "firmware_like/config/task_table.hpp"
#include "firmware_like/process/complaint.hpp"
#include "host_sim/child_process.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::host_sim;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

class Workbench {
 public:
  std::string path(const std::string& name) const { return folder_.file(name); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream{path(name)} << text;
    return path(name);
  }
  // cell.example.toml with one line replaced, told by its beginning. Tests run side by side, and one controller holds a
  // device: each has its own.
  std::string example(const std::string& begins, const std::string& line) const {
    std::ifstream file{MOLDLOFT_SOURCE_DIR "/firmware_like/cell.example.toml"};
    std::string text;
    bool found = false;
    for (std::string old; std::getline(file, old);) {
      const bool is_it = !begins.empty() && old.starts_with(begins);
      found = found || is_it;
      if (!is_it && old == "device = \"/dev/ttyS0\"") old = "device = \"" + path("arm") + "\"";
      if (!is_it && old.starts_with("port = ")) old = "port = " + std::to_string(20000 + ::getpid() % 20000);
      text += (is_it ? line : old) + "\n";
    }
    REQUIRE((found || begins.empty()));
    return write("cell.toml", text);
  }

 private:
  hal::TemporaryFolder folder_;
};

void check_refused(const Finished& program, const std::string& line,
                   int exit_code = firmware_like::exit_failed) {
  CHECK(program.exit_code == exit_code);
  CHECK(program.err == line + "\n");
  CHECK(program.out == "");
}

}  // namespace

TEST_CASE("a configuration that is wrong is refused with file and line, and no run is begun") {
  const Workbench bench;
  const std::string out = bench.path("run");
  const auto refuses = [&](const std::string& begins, const std::string& line, const std::string& what) {
    const std::string config = bench.example(begins, line);
    check_refused(run_program({MOLDLOFT, "run", config, "--out", out}), "moldloft: " + config + what);
    CHECK_FALSE(fs::exists(out));
  };
  refuses("baud", "bauds = 9600",
          ":36: [robot] bauds: unknown key; known here: arrival_deg, arrival_mm, baud, device, driver, host, "
          "link, port, "
          "repeatability_z_mm, speed_percent, workspace");
  refuses("baud", "baud = \"9600\"", ":36: [robot] baud: a whole number is wanted");
  refuses("baud", "baud = 12", ":36: [robot] baud: 12 is outside 1200 to 921600");
  refuses("x_mm", "x_mm = [800, -800]",
          ":43: [robot.workspace] x_mm: from 800 to -800 is no range: the smaller number comes first");
}

TEST_CASE("a configuration that is not there is refused by its path") {
  check_refused(
      run_program({MOLDLOFT, "run", "/nowhere/cell.toml"}),
      "moldloft: /nowhere/cell.toml: cannot be read: No such file or directory; give the path of a cell "
      "configuration");
}

TEST_CASE("no scanner server: one line after the configured time, and the folder is free for the next try") {
  const Workbench bench;
  // Port 1 is nobody's on a machine that runs tests.
  const std::string config =
      bench.write("cell.toml", "[cell]\ndevice_timeout_s = 0.5\n[scanner]\nport = 1\n[robot]\ndevice = \"" +
                                   bench.path("arm") + "\"\n");
  for (int attempt = 0; attempt < 2; ++attempt) {
    check_refused(
        run_program({MOLDLOFT, "run", config, "--out", bench.path("run")}),
        "moldloft: scanner: 127.0.0.1:1: Connection refused (is the server running?); nothing was measured");
    CHECK_FALSE(fs::exists(bench.path("run")));
  }
}

TEST_CASE("no serial device: one line that names the device") {
  const Workbench bench;
  ChildProcess devices{{MOLDLOFT_SIM, "devices", "--scanner-port", "0", "--robot-pty", bench.path("robot"),
                        "--cell", bench.path("fits.toml")}};
  REQUIRE_MESSAGE(devices.prints("ready:", 20s), devices.err());
  const std::string fits = text_of(bench.path("fits.toml"));
  const std::string port =
      fits.substr(fits.find("port = "), fits.find('\n', fits.find("port = ")) - fits.find("port = "));
  const auto with_device = [&](const std::string& device) {
    return bench.write("cell.toml", "[cell]\ndevice_timeout_s = 0.5\n[scanner]\n" + port +
                                        "\n[robot]\ndevice = \"" + device + "\"\n");
  };
  check_refused(run_program({MOLDLOFT, "run", with_device("/dev/ttyNONE"), "--out", bench.path("run")}),
                "moldloft: robot: /dev/ttyNONE does not exist: is the robot's cable plugged in, is the name "
                "right?; nothing was measured");
  check_refused(run_program({MOLDLOFT, "run", with_device("/dev/null"), "--out", bench.path("run")}),
                "moldloft: robot: /dev/null is not a serial port; nothing was measured");
  CHECK_FALSE(fs::exists(bench.path("run")));
}

TEST_CASE("ctrl-C before the arm has moved ends at once and leaves nothing behind") {
  const Workbench bench;
  const std::string config =
      bench.write("cell.toml", "[scanner]\nport = 2\n[robot]\ndevice = \"" + bench.path("arm") + "\"\n");
  ChildProcess run{{MOLDLOFT, "run", config, "--out", bench.path("run")}};
  hal::SteadyClock clock;
  while (!fs::exists(bench.path("run/run.db")) && clock.now() < 20s) clock.sleep_until(clock.now() + 5ms);
  run.send(SIGINT);
  CHECK(run.wait(20s) == firmware_like::exit_stopped);
  CHECK(run.err() == "moldloft: stopped before anything was measured; nothing is kept\n");
  CHECK_FALSE(fs::exists(bench.path("run")));
}

TEST_CASE("an output folder that cannot be written is refused before the devices are asked") {
  const Workbench bench;
  const std::string config = bench.example("", ""), file = bench.write("file", "");
  for (const std::string program : {"run", "cell"}) {
    CAPTURE(program);
    const bool real = program == "run";
    const auto refused = real ? run_program({MOLDLOFT, "run", config, "--out", file + "/run"})
                              : run_program({MOLDLOFT_SIM, "cell", "--out", file + "/run"});
    check_refused(refused, (real ? "moldloft: " : "moldloft-sim cell: ") + file +
                               "/run: cannot be created (Not a directory); give another --out");
  }
}

TEST_CASE("a folder that holds a run is never overwritten, and resumed only with what it was begun with") {
  const Workbench bench;
  const std::string run = bench.path("run"), config = bench.example("", "");
  REQUIRE(run_program({MOLDLOFT_SIM, "cell", "--out", run}).exit_code == 0);
  const auto size = fs::file_size(run + "/run.db");
  const Finished complete = run_program({MOLDLOFT, "run", config, "--out", run, "--resume"});
  CHECK(complete.exit_code == firmware_like::exit_done);
  CHECK(complete.err.starts_with("moldloft: " + run + ": this run is complete, nothing is left to measure"));
  fs::remove(run + "/summary.json");  // as a run is left that was broken off
  check_refused(
      run_program({MOLDLOFT, "run", config, "--out", run}),
      "moldloft: " + run + ": holds a run already; give another --out, or --resume to go on with it");
  check_refused(run_program({MOLDLOFT, "run", config, "--out", run, "--resume"}),
                "moldloft: " + run +
                    ": was begun with another configuration ('robot.workspace.max_step_mm' differs); resume "
                    "it with the same, or "
                    "begin a new run with another --out");
  check_refused(run_program({MOLDLOFT, "fit", run, "--out", run}),
                "moldloft: " + run + ": is the run itself; give another folder with --out");
  CHECK(fs::file_size(run + "/run.db") == size);
}

TEST_CASE("a folder that holds no run is neither resumed nor fitted") {
  const Workbench bench;
  const std::string config = bench.example("", ""), nothing = bench.path("nothing");
  const std::string why = "moldloft: " + nothing + ": no run.db there; give the folder of a run";
  check_refused(run_program({MOLDLOFT, "run", config, "--out", nothing, "--resume"}), why);
  check_refused(run_program({MOLDLOFT, "fit", nothing, "--out", bench.path("fit")}), why);
  check_refused(run_program({MOLDLOFT, "run", config, "--resume"}),
                "moldloft: --resume: give the run's folder with --out");
  fs::create_directories(nothing);
  bench.write("nothing/run.db", "these are no tables");
  check_refused(run_program({MOLDLOFT, "fit", nothing, "--out", bench.path("fit")}),
                "moldloft: " + nothing + "/run.db: is not a run store");
}

TEST_CASE("a plate that is none is refused by what is wrong with it") {
  const Workbench bench;
  const std::string no_ply = bench.write("panel.ply", "these are no triangles\n"), out = bench.path("run");
  const std::string not_a_mesh =
      ": is neither a PLY nor an STL file (if it is binary STL, its length does not fit its count of facets)";
  check_refused(run_program({MOLDLOFT_SIM, "cell", "--plate", no_ply, "--out", out}),
                "moldloft-sim cell: " + no_ply + not_a_mesh);
  check_refused(run_program({MOLDLOFT_SIM, "cell", "--plate", bench.path("none.ply"), "--out", out}),
                "moldloft-sim cell: " + bench.path("none.ply") +
                    ": does not exist: give the path of a PLY or STL file");
  check_refused(run_program({MOLDLOFT_SIM, "devices", "--plate", no_ply}),
                "moldloft-sim devices: " + no_ply + not_a_mesh);
  check_refused(run_program({MOLDLOFT_SIM, "cell", "--plate", "cube", "--out", out}),
                "moldloft-sim cell: no plate is called 'cube': choose flat, cylinder, saddle, twist, dome, "
                "wave, or give the path of a PLY or STL file");
  check_refused(run_program({MOLDLOFT_SIM, "cell", "--width", "900", "--out", out}),
                "moldloft-sim cell: plate 'saddle' (900 x 900 mm) does not fit under the scara arm: choose a "
                "smaller plate, another place or "
                "another arm");
  CHECK_FALSE(fs::exists(out));
}

TEST_CASE("an option that the plate cannot follow is refused instead of passed over") {
  const auto refuses = [](std::vector<std::string> words, const std::string& line) {
    words.insert(words.begin(), {MOLDLOFT_SIM, "cell"});
    const auto refused = run_program(words);
    CHECK(refused.exit_code == firmware_like::exit_failed);
    CHECK_MESSAGE(refused.err.starts_with("moldloft-sim cell: " + line), refused.err);
    CHECK(refused.out == "");
  };
  refuses({"--unit", "m"}, "--unit: is for mesh files; the plate 'saddle' is a formula in mm; ");
  refuses({"--plate", "dome", "--unit", "mm"},
          "--unit: is for mesh files; the plate 'dome' is a formula in mm; ");
  refuses({"--plate", "a.ply", "--unit", "furlong"},
          "--unit: no unit is called 'furlong': choose mm, cm, m or inch; ");
  refuses({"--plate", "a.stl", "--width", "300"},
          "--width: is for plates by formula; the mesh a.stl has its own shape; ");
}

TEST_CASE("a latency self-test that cannot be is refused in one line before anything is measured") {
  const Workbench bench;
  const std::string out = bench.path("self-test");
  const auto refuses = [&](std::vector<std::string> words, const std::string& line) {
    words.insert(words.begin(), {MOLDLOFT, "latency", "--out", out});
    check_refused(run_program(words), "moldloft latency: " + line);
    CHECK_FALSE(fs::exists(out));
  };
  const auto tick = [](const std::string& given) {
    return "--tick: '" + given + "' given; a whole number from " +
           std::to_string(firmware_like::shortest_tick / 1us) +
           " to 100000 us is wanted; moldloft latency --help explains";
  };
  refuses({"--duration", "0"},
          "--duration: '0' given; a number from 1 to 2592000 s is wanted; moldloft latency --help explains");
  refuses(
      {"--duration", "nan"},
      "--duration: 'nan' given; a number from 1 to 2592000 s is wanted; moldloft latency --help explains");
  refuses({"--compare", "latencytest"}, "--compare: 'latencytest' given; it knows cyclictest");
  refuses({"--tick", "500"}, tick("500"));
  refuses({"--tick", "100001"}, tick("100001"));
  refuses({"--tick", "-1"}, tick("-1"));
  refuses({"--tick", "0"}, tick("0"));
  refuses({"--tick", "1e4"}, tick("1e4"));
  refuses({"--config", bench.path("none.toml")},
          bench.path("none.toml") +
              ": cannot be read: No such file or directory; give the path of a cell configuration");
  const std::string held = bench.write("held", "a file");
  const auto in_the_way = run_program({MOLDLOFT, "latency", "--duration", "1", "--out", held + "/x"});
  CHECK(in_the_way.exit_code == firmware_like::exit_failed);
  CHECK(in_the_way.err.starts_with("moldloft latency: " + held + "/x: cannot be created"));
  CHECK(in_the_way.out == "");
}

TEST_CASE("a report of what is no run, or of another version's, is refused in one line") {
  const Workbench bench;
  const std::string none = bench.path("none");
  check_refused(run_program({MOLDLOFT, "report", none}),
                "moldloft report: " + none + "/timing.json: cannot be opened");
  fs::create_directories(bench.path("run"));
  const std::string file = bench.write("run/timing.json", "{");
  check_refused(run_program({MOLDLOFT, "report", bench.path("run")}),
                "moldloft report: " + file + ": not JSON");
  bench.write("run/timing.json", R"({"schema": 1, "ticks": 5})");
  const auto old = run_program({MOLDLOFT, "report", bench.path("run")});
  CHECK(old.exit_code == firmware_like::exit_failed);
  CHECK(old.out == "");
  CHECK(old.err.starts_with("moldloft report: " + bench.path("run") + ": was not written by this version"));
  CHECK(std::ranges::count(old.err, '\n') == 1);
  CHECK_FALSE(fs::exists(bench.path("run/report.html")));
}

TEST_CASE(
    "a number that is none, or beyond its limits, is refused in one line with option, value and limits") {
  const Workbench bench;
  const auto refuses = [&](std::vector<std::string> words, const std::string& limits) {
    const std::string option = words[words.size() - 2], value = words.back();
    const std::string command = words[1] == "replay" ? "moldloft replay" : "moldloft-sim " + words[1];
    CAPTURE(option);
    CAPTURE(value);
    check_refused(run_program(words), command + ": " + option + ": '" + value + "' given; " + limits + "; " +
                                          command + " --help explains");
  };
  const auto cell = [&](const std::string& option, const std::string& value, const std::string& limits) {
    for (const char* command : {"cell", "devices", "day", "judge"})
      refuses({MOLDLOFT_SIM, command, option, value}, limits + " is wanted");
  };
  cell("--seed", "-1", "a whole number from 0 to 18446744073709551615");
  cell("--seed", "18446744073709551616", "a whole number from 0 to 18446744073709551615");
  cell("--seed", "1.5", "a whole number from 0 to 18446744073709551615");
  cell("--seed", "", "a whole number from 0 to 18446744073709551615");
  cell("--width", "-5", "a number from 1 to 10000 mm");
  cell("--depth", "0", "a number from 1 to 10000 mm");
  cell("--top-width", "1e300", "a number from 1 to 10000 mm");
  cell("--shear", "inf", "a number from -10000 to 10000 mm");
  cell("--thickness", "nan", "a number from 0.5 to 200 mm");
  cell("--thickness", "0", "a number from 0.5 to 200 mm");
  cell("--thickness", "6mm", "a number from 0.5 to 200 mm");
  cell("--thickness", "6,0", "a number from 0.5 to 200 mm");
  cell("--amplitude", "nan", "a number from -500 to 500 mm");
  cell("--radius", "0", "a number from 1 to 1000000 mm");
  refuses({MOLDLOFT_SIM, "devices", "--scanner-port", "70000"}, "a whole number from 0 to 65535 is wanted");
  refuses({MOLDLOFT_SIM, "devices", "--scanner-port", "-1"}, "a whole number from 0 to 65535 is wanted");
  refuses({MOLDLOFT_SIM, "day", "--hours", "inf"}, "a number from 0.01 to 10000 h is wanted");
  refuses({MOLDLOFT_SIM, "day", "--every", "nan"}, "a number from 0 to 86400 s is wanted");
  refuses({MOLDLOFT_SIM, "day", "--rows", "0"}, "a whole number from 1 to 1000 is wanted");
  refuses({MOLDLOFT, "replay", bench.path("run"), "--ticks", "0"},
          "a whole number from 1 to 1000000 is wanted");
  const std::string seeds = "A..B or A is wanted, whole numbers from 0 on, the smaller first, 10000 at most";
  for (const char* wrong :
       {"3..1", "a..b", "1..", "..3", "1..1000000000000", "-1", "1...3", "0..18446744073709551615"})
    refuses({MOLDLOFT_SIM, "campaign", "--seeds", wrong}, seeds);
  refuses({MOLDLOFT_SIM, "campaign", "--plates", "cube"},
          "all, or one of flat, cylinder, saddle, twist, dome, wave is wanted");
  refuses({MOLDLOFT_SIM, "campaign", "--outlines", "round"},
          "all, or one of square, rectangle, trapezoid, parallelogram is wanted");
}
