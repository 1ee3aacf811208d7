#include "firmware_like/report_command.hpp"

#include "firmware_like/console.hpp"
#include "firmware_like/results.hpp"
#include "firmware_like/run_command.hpp"
#include "firmware_like/timing_page.hpp"
#include "firmware_like/timing_table.hpp"
#include "hal/printable_text.hpp"

#include <fmt/format.h>

namespace moldloft::firmware_like {
namespace {

int refuse(std::string_view what) { return complain(what, "moldloft report"); }

}  // namespace

int report_run(const ReportOptions& options) {
  const std::filesystem::path folder{options.run};
  const auto timing = read_json(folder / "timing.json");
  if (!timing) return refuse(timing.error().what);
  std::string text, page, title = page_title(folder), about;
  try {
    if (std::filesystem::exists(folder / "summary.json")) {
      const auto summary = read_json(folder / "summary.json");
      if (!summary) return refuse(summary.error().what);
      text = result_table(*summary, options.run) + "\n";
      title = "Timing of " + summary->value("plate", "the plate");
      about = about_run(*summary);
    }
    text += timing_table(*timing);
    page = timing_page(*timing, title, about);
  } catch (const Json::exception& e) {
    return refuse(fmt::format("{}: was not written by this version of moldloft ({})", options.run, e.what()));
  }
  if (const auto written = write_file(folder / "report.html", page); !written)
    return refuse(written.error().what);
  show(fmt::format("{}\nreport                      {}\n", text,
                   hal::printable((folder / "report.html").string())));
  return exit_done;
}

}  // namespace moldloft::firmware_like
