#include "firmware_like/commands/report_command.hpp"

#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/json_file.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/report/measurement_page.hpp"
#include "firmware_like/report/result_table.hpp"
#include "firmware_like/report/timing_page.hpp"
#include "firmware_like/report/timing_table.hpp"
#include "firmware_like/results/stored_result.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

namespace moldloft::firmware_like {
namespace {

int refuse(std::string_view what) { return complain(what, "moldloft report"); }

}  // namespace

int report_run(const ReportOptions& options) {
  const std::filesystem::path folder{options.run};
  std::string text, page;
  try {
    if (std::filesystem::exists(folder / "summary.json")) {
      const auto result = read_result(folder);
      if (!result) return refuse(result.error().what);
      text = result_table(*result, options.run) + "\n" + timing_table(result->timing);
    } else {  // of the self-test, which measures no plate
      const auto timing = read_json(folder / "timing.json");
      if (!timing) return refuse(timing.error().what);
      text = timing_table(*timing);
      page = timing_page(*timing, page_title(folder));
    }
  } catch (const Json::exception& e) {
    return refuse(fmt::format("{}: was not written by this version of moldloft ({})", options.run, e.what()));
  }
  const auto written = page.empty() ? write_report(folder) : write_file(folder / "report.html", page);
  if (!written) return refuse(written.error().what);
  show(fmt::format("{}\nreport                      {}\n", text,
                   hal::printable((folder / "report.html").string())));
  return exit_done;
}

}  // namespace moldloft::firmware_like
