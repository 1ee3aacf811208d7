#include "firmware_like/report/result_table.hpp"

#include "firmware_like/report/findings_text.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

namespace moldloft::firmware_like {

std::string result_table(const RunResult& r, const std::string& folder) {
  std::string t = fmt::format("\n{:<28}{}\n", "result", to_string(r.outcome));
  const auto row = [&](std::string_view name, const std::string& value) {
    t += fmt::format("{:<28}{}\n", name, hal::printable(value));
  };
  const auto named_row = [&](std::string_view name, const std::string& value) {
    if (!value.empty()) row(name, value);
  };
  named_row("plate", r.label.plate);
  named_row("cell", r.cell);
  named_row("remark", r.label.remark);
  row("shots", fmt::format("{} seeking, {} boundary, {} surface, {} retaken", r.shots.seek, r.shots.boundary,
                           r.shots.surface, r.shots.retaken));
  if (r.measured) {
    const auto& [outline, surface, fit, tolerance_mm, ready] = *r.measured;
    row("points used", fmt::format("{} of {}", fit.points_used, r.points_seen));
    std::string corners;
    for (const auto& c : outline.corners) corners += fmt::format("({:.2f}, {:.2f}) ", c.x(), c.y());
    row("corners, mm", corners);
    row("surface", fmt::format("{} x {} control points", surface.control_u(), surface.control_v()));
    row("noise of a point, mm", fmt::format("{:.4f}", fit.sigma_mm));
    row("shot heights, rms, mm", fmt::format("{:.4f}", fit.shot_offset_rms_mm));
  }
  row("cell time, s", fmt::format("{:.1f} (arm standing {:.0f} %, idle {:.1f} %)", r.cycle.seconds,
                                  100 * r.cycle.standing_fraction, 100 * r.cycle.idle_fraction));
  if (!r.truth.is_null()) {
    row("against the truth, mm",
        fmt::format("normal rms {:.4f}, max {:.4f}; outline max {:.3f}; corner max {:.3f}",
                    r.truth["normal_rms_mm"].get<double>(), r.truth["normal_max_mm"].get<double>(),
                    r.truth["outline_max_mm"].get<double>(), r.truth["corner_max_mm"].get<double>()));
  }
  t += findings_lines(r);
  row("run folder", folder);
  return t;
}

}  // namespace moldloft::firmware_like
