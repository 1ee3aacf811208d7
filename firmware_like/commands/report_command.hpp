// `moldloft report`: prints a stored run's summary.json and timing.json as tables, and writes its report.html
// anew. The value returned is the program's exit code. A failure gives one line on stderr.
#pragma once

#include <string>

namespace moldloft::firmware_like {

struct ReportOptions {
  std::string run;  // a run's folder, or one that `moldloft latency --out` has left
};
int report_run(const ReportOptions&);

}  // namespace moldloft::firmware_like
