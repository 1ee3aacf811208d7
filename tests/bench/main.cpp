// moldloft-bench NAME: speeds side by side with peers and limits, in one run. Not a test: nothing here passes
// or fails, and nothing in continuous integration depends on it.
#include "bench/benchmark.hpp"
#include "firmware_like/process/build_info.hpp"

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <span>
#include <system_error>
#include <vector>

namespace moldloft::bench {

// Each in a file of its own, bench/NAME.cpp.
Json run_curvature(const Options&);
Json run_edges(const Options&);
Json run_fit(const Options&);
Json run_inspect(const Options&);
Json run_localize(const Options&);
Json run_project(const Options&);
Json run_scheduler(const Options&);
Json run_thesis(const Options&);

std::span<const Benchmark> all_benchmarks() {
  static const std::vector<Benchmark> all{
      {"fit", "surface fit: floors, nets, choice of the net, bad data, growth", run_fit},
      {"project", "foot points with a guess and from nowhere", run_project},
      {"localize", "poses of measured points, and their deviations", run_localize},
      {"inspect", "a run against its design, from all sides, with map and frames", run_inspect},
      {"curvature", "curvature maps, contours, and the fit whose parameters are not known", run_curvature},
      {"edges", "the plate's edge in one shot", run_edges},
      {"scheduler", "what a tick costs beside its tasks", run_scheduler},
      {"thesis", "chapter 6 of the thesis again: wave, hood, fuselage, plate, tables 6.1 to 6.3", run_thesis},
  };
  return all;
}

}  // namespace moldloft::bench

namespace {

using namespace moldloft::bench;

int run_command_line(int argc, char** argv) {
  CLI::App app{"Speeds side by side with peers and limits, one run"};
  app.set_version_flag("--version", "moldloft-bench " + moldloft::firmware_like::version_text(),
                       "version, commit and compiler");
  app.require_subcommand(1);
  Options options;
  bool json = false;
  for (const Benchmark& benchmark : all_benchmarks()) {
    CLI::App* command = app.add_subcommand(std::string{benchmark.name}, std::string{benchmark.what});
    command->add_flag("--json", json, "print one JSON object and nothing else");
    command->add_flag("--quick", options.quick, "fewer repeats and smaller sizes");
    command->callback([&] {
      options.quiet = json;
      const Json result = benchmark.run(options);
      if (json) fmt::print("{}\n", result.dump(2));
    });
  }
  CLI11_PARSE(app, argc, argv);
  return 0;
}

int cannot_be_written(const char* why) {
  std::fprintf(stderr, "moldloft-bench: standard output cannot be written: %s\n", why);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader that has gone is an error like a full disk
  try {
    const int code = run_command_line(argc, argv);
    const bool written = std::fflush(stdout) == 0 && std::cout.flush().good();
    return written ? code : cannot_be_written(std::strerror(errno));
  } catch (const std::system_error& e) {
    return cannot_be_written(e.code().message().c_str());
  }
}
