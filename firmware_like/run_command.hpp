// `moldloft run` and `moldloft fit`: the cell on real devices, or once more on the shots of a stored run.
// The value returned is the program's exit code.
#pragma once

#include "firmware_like/journal.hpp"
#include "firmware_like/results.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace moldloft::firmware_like {

enum ExitCode : int {
  exit_done = 0,
  exit_failed = 1,  // nothing was begun, or a file could not be written
  exit_held = 2,    // the cell holds for a person
  exit_aborted = 3,
  exit_stopped = 4,  // by ctrl-C
};

// The one line that a failure is, on standard error; the exit code that goes with it.
int complain(std::string_view what, std::string_view program = "moldloft", Priority = Priority::error);
// The same for what has several lines, such as all errors of a configuration; each is made printable.
int complain_all(std::string_view lines, std::string_view program = "moldloft");

struct RunOptions {
  std::string config_path;
  std::string out;  // empty: a new folder under out/
  bool resume = false;
  // For a restart by a service manager: goes on with the run in `out` or begins it there, and either way comes up
  // held, not connected to any device, until an operator says unhold over `control`.
  bool resume_held = false;
  bool quiet = false;   // no progress: only what went wrong, and the run's last line
  std::string control;  // path of the operator's socket; empty: none
  std::string go_on;    // the command that goes on with this run, where it is not this program's own
  std::optional<std::string> plate, remark;  // as typed; without a name the plate has the folder's
};
int run_cell(const RunOptions&);

struct FitOptions {
  std::string run;     // a run's folder; read only
  std::string out;     // where the results go; must not be the run itself
  bool force = false;  // even over another run's results
};
int fit_run(const FitOptions&);

// The table that ends a run, for a person.
std::string result_table(const Json& summary, const std::string& folder);
int exit_code(const Controller&);

}  // namespace moldloft::firmware_like
