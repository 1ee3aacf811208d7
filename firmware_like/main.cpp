// The controller program: walks the table of commands.
#include "firmware_like/commands/command_line.hpp"
#include "firmware_like/commands/command_table.hpp"
#include "firmware_like/process/build_info.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"

#include <fmt/format.h>

#include <system_error>
#include <utility>
#include <vector>

using namespace moldloft::firmware_like;

namespace {

int run_command_line(int argc, char** argv) {
  CLI::App app{"Moldloft: measures formed ship plates with a laser-stripe scanner on a robot", "moldloft"};
  app.set_version_flag("--version", "moldloft " + version_text(), "version, commit and compiler");
  app.require_subcommand(1);
  std::vector<std::pair<CLI::App*, RunCommand>> known;
  for (const Command& command : commands()) {
    CLI::App* words = app.add_subcommand(command.name, command.help);
    known.emplace_back(words, command.add_options(*words));
  }
  if (const auto ended = parse_command_line(app, argc, argv)) return *ended;
  for (const auto& [words, run] : known) {
    if (*words) return run();
  }
  return exit_failed;
}

}  // namespace

int main(int argc, char** argv) {
  open_console();
  try {
    return end_of_output(run_command_line(argc, argv), "moldloft");
  } catch (const std::system_error& e) {
    return complain(fmt::format("the system refuses: {}; is a limit of this user too low (ulimit -a)?",
                                e.code().message()));
  } catch (const std::exception& e) {
    return complain(fmt::format("a defect, please report it: {}", e.what()));
  }
}
