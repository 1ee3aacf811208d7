// `moldloft run`: the cell on real devices. The value returned is the program's exit code (complaint.hpp).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace moldloft::firmware_like {

struct RunOptions {
  std::string config_path;
  std::string out;  // empty: a new folder under out/
  bool resume = false;
  // For a restart by a service manager. It resumes the run in `out` or begins it there. Either way it comes
  // up held and connects to no device until an operator says unhold over `control`.
  bool resume_held = false;
  bool quiet = false;   // no progress: only what went wrong, and the run's last line
  std::string control;  // path of the operator's socket; empty: none
  std::string go_on;    // the command that goes on with this run, where it is not this program's own
  std::optional<std::string> plate, remark;  // as typed; without a name the plate has the folder's
};
int run_cell(const RunOptions&);

}  // namespace moldloft::firmware_like
