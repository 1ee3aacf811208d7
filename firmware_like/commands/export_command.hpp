// `moldloft export`: the surface of a run, or a surface.json, as STEP and IGES files. The value returned is
// the program's exit code. A failure gives one line on stderr.
#pragma once

#include <string>

namespace moldloft::firmware_like {

struct ExportOptions {
  std::string run;   // a run's folder, or a surface.json; read only
  std::string step;  // where to; empty: not asked for
  std::string iges;
  bool force = false;  // even over a file that says something else
};
int export_run(const ExportOptions&);

}  // namespace moldloft::firmware_like
