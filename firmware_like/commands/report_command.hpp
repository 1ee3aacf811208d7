// `moldloft report`: what a stored run's summary.json and timing.json say, on the terminal, and its report.html made
// anew. The value returned is the program's exit code; what went wrong is one line on stderr.
#pragma once

#include <string>

namespace moldloft::firmware_like {

struct ReportOptions {
  std::string run;  // a run's folder, or one that `moldloft latency --out` has left
};
int report_run(const ReportOptions&);

}  // namespace moldloft::firmware_like
