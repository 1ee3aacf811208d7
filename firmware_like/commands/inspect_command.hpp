// `moldloft inspect RUN --against DESIGN`: is the plate right, where not, and by how much. Prints the answer and writes
// inspection.json, deviations.csv, deviations.ply, frames.txt and frames.html. The value returned is the program's exit
// code: 0 within the limits or none given, exit_differs outside. A failure gives one line on stderr.
#pragma once

#include <string>
#include <vector>

namespace moldloft::firmware_like {

struct InspectOptions {
  std::string run, design;
  std::string align = "best";
  std::string limit, border_limit;   // "3" for -3 to 3, or "-2,3"; empty: not judged
  std::vector<std::string> regions;  // "NAME:x0,y0,x1,y1:LIMIT"
  double border_width_mm = 10;
  std::string outline = "use";  // or "ignore"
  std::string datum;            // a file of pairs
  std::string unit;             // of points
  int frames = 7;
  std::string out;  // folder; empty: the run's own
  bool force = false;
};
int inspect_run(const InspectOptions&);

}  // namespace moldloft::firmware_like
