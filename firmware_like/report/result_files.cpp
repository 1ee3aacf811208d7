#include "firmware_like/report/result_files.hpp"

#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/report/measurement_page.hpp"
#include "firmware_like/report/picture.hpp"
#include "firmware_like/results/cad_files.hpp"
#include "firmware_like/results/measured_points.hpp"
#include "firmware_like/results/ply_writer.hpp"
#include "firmware_like/results/stored_result.hpp"
#include "firmware_like/results/summary.hpp"
#include "firmware_like/run/surface_file.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace moldloft::firmware_like {
namespace {

constexpr int picture_cells = 56;
constexpr std::size_t points_in_ply = 200'000;
// Points farther than this many sigma from the surface are outliers, or not the plate.
constexpr double gate_sigmas = 10;

std::string events_jsonl(const std::vector<hal::EventRecord>& events) {
  std::string lines;
  for (const auto& e : events) {
    Json j = {{"t_ms", std::chrono::duration<double, std::milli>(e.at).count()},
              {"source", std::string{e.source.view()}}};
    const auto put = [&](const char* key, std::string_view text) {
      if (!text.empty()) j[key] = std::string{text};
    };
    put("event", e.event);
    put("from", e.from);
    put("to", e.to);
    put("text", e.text);
    lines += json_text(j) + "\n";
  }
  return lines;
}

std::string picture(const RunResult& r, std::vector<PlateField> fields) {
  OverviewInput in;
  in.title = "Moldloft run: " + r.label.plate;
  in.about = about_run(r);
  in.subtitle = fmt::format("{}; {} boundary and {} surface shots, {} points used, {:.1f} s of cell time",
                            to_string(r.outcome), r.shots.boundary, r.shots.surface,
                            r.measured ? r.measured->fit.points_used : 0, r.cycle.seconds);
  if (!r.measured && !r.message.empty()) in.subtitle += fmt::format("; {}", r.message);
  if (r.measured) in.surface = &r.measured->surface;
  if (r.measured)
    in.corners = r.measured->outline.corners;
  else
    in.corners = r.track.corners;
  in.edge_points = r.track.edge_points;
  in.boundary_places = r.track.boundary_places;
  in.surface_places = r.track.surface_places;
  in.field_x_mm = r.track.field_x_mm;
  in.field_y_mm = r.track.field_y_mm;
  in.fields = std::move(fields);
  in.findings = r.findings;
  return overview_svg(in);
}

// Files that only a run with a surface has, and the picture's fields of it.
template <typename Write>
std::expected<std::vector<PlateField>, Failure> write_surface(const RunResult& r, const RunFolder& folder,
                                                              const std::optional<PlateField>& error_field,
                                                              const Write& write) {
  const auto& surface = r.measured->surface;
  const double gate = gate_sigmas * std::max(r.measured->fit.sigma_mm, r.promised.noise_mm);
  const auto points = measured_points(r, *folder.store, points_in_ply, gate);
  if (!points) return std::unexpected{Failure{points.error().what}};
  write("surface.json", json_text(surface_json(surface)) + "\n");
  write("boundary.ply", boundary_ply(surface, 100));
  write("points.ply", points_ply(*points));
  std::vector fields{shape_field(surface, picture_cells),
                     error_field ? *error_field : residual_field(*points, picture_cells)};
  // Nobody shall bend a plate after a file that the audit does not trust.
  if (r.outcome == Outcome::held) return fields;
  const CadFacts facts = cad_facts(r);
  const auto step = step_file(surface, facts, "surface.step"),
             iges = iges_file(surface, facts, "surface.igs");
  if (!step) return std::unexpected{step.error()};
  if (!iges) return std::unexpected{iges.error()};
  write("surface.step", *step);
  write("surface.igs", *iges);
  return fields;
}

}  // namespace

std::expected<void, Failure> write_results(const RunResult& r, const RunFolder& folder,
                                           const std::optional<PlateField>& error_field) {
  std::expected<void, Failure> result;
  const auto write = [&](const char* name, std::string_view content) {
    auto written = write_file(folder.path / name, content);
    if (result) result = std::move(written);
  };
  // What was compared with a design was the surface before this one.
  std::error_code ignored;
  for (const char* file :
       {"inspection.json", "frames.txt", "frames.html", "deviations.csv", "deviations.ply"})
    std::filesystem::remove(folder.path / file, ignored);
  std::vector<PlateField> fields;
  if (r.measured) {
    auto of_surface = write_surface(r, folder, error_field, write);
    if (!of_surface) return std::unexpected{of_surface.error()};
    fields = std::move(*of_surface);
  }
  const auto events = folder.store->events();
  if (!events) return std::unexpected{Failure{events.error().what}};
  write("events.jsonl", events_jsonl(*events));
  write("track.json", json_text(track_json(r)) + "\n");
  const std::string overview = picture(r, std::move(fields));
  write("overview.svg", overview);
  write("timing.json", json_text(r.timing, 2) + "\n");
  write("report.html", measurement_page(r, overview, {}));
  write("summary.json", json_text(summary_json(r), 2) + "\n");
  return result;
}

}  // namespace moldloft::firmware_like
