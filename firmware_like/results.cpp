#include "firmware_like/results.hpp"

#include "firmware_like/build_info.hpp"
#include "firmware_like/cad_files.hpp"
#include "firmware_like/measured_points.hpp"
#include "firmware_like/ply_writer.hpp"
#include "firmware_like/timing_page.hpp"
#include "firmware_like/timing_report.hpp"
#include "hal/printable_text.hpp"

#include <fmt/format.h>

#include <cmath>

namespace moldloft::firmware_like {
namespace {

constexpr int picture_cells = 56;
constexpr std::size_t points_in_ply = 200'000;
// Points farther than this many sigma from the surface are outliers, or not the plate.
constexpr double gate_sigmas = 10;

double seconds(hal::Duration d) { return std::chrono::duration<double>(d).count(); }

// Rounded to a nanometre: what lies below is the arithmetic's, and makes files hard to read.
double rounded(double mm) { return std::round(mm * 1e6) / 1e6; }

std::string result_word(const Controller& c) {
  switch (c.cell().state()) {
    case tasks::CellState::complete:
      return "complete";
    case tasks::CellState::held:
      return "held";
    case tasks::CellState::aborted:
      return "aborted";
    default:
      return "stopped";
  }
}

}  // namespace

std::string about_run(const Json& summary) {
  std::string line;
  const auto add = [&](std::string_view what, const Json& in, const char* key) {
    const auto found = in.is_object() ? in.find(key) : in.end();
    if (found == in.end() || !found->is_string() || found->empty()) return;
    const auto text = found->get<std::string>();
    if (!text.empty()) line += fmt::format("{}{}{}", line.empty() ? "" : "; ", what, text);
  };
  add("plate ", summary, "plate");
  add("cell ", summary, "cell");
  add("begun ", summary, "begun");
  if (const auto program = summary.find("program"); program != summary.end()) {
    add("moldloft ", *program, "version");
    add("commit ", *program, "commit");
  }
  add("remark: ", summary, "remark");
  return line;
}

Json summary_of(const Controller& c, const RunLabel& label) {
  const auto& cell = c.cell();
  const auto purpose = [&](hal::ShotPurpose p) { return cell.shots_taken(p); };
  Json j;
  j["schema"] = 1;
  j["unit"] = "mm";
  j["result"] = result_word(c);
  j["message"] = std::string{cell.why().view()};
  j["plate"] = hal::printable(label.plate);
  j["cell"] = hal::printable(c.config().name);
  if (!label.remark.empty()) j["remark"] = hal::printable(label.remark);
  j["seed"] = label.seed ? Json(*label.seed) : Json(nullptr);
  if (!label.begun.empty()) j["begun"] = label.begun;
  j["program"] = {
      {"version", build_info().version}, {"commit", build_info().commit}, {"build", build_info().build}};
  j["shots"] = {{"seek", purpose(hal::ShotPurpose::seek)},
                {"boundary", purpose(hal::ShotPurpose::boundary)},
                {"surface", purpose(hal::ShotPurpose::surface)},
                {"retaken", cell.shots_retaken()}};
  const bool complete = cell.state() == tasks::CellState::complete;
  const auto& report = c.surface().fit().report();
  j["points"] = {{"total", cell.points_seen()}, {"used", complete ? report.points_used : 0}};
  if (complete) {
    Json corners = Json::array();
    for (const auto& corner : c.surface().outline().corners)
      corners.push_back({rounded(corner.x()), rounded(corner.y())});
    j["boundary"] = {{"corners_mm", corners},
                     {"rms_mm", rounded(c.surface().outline().rms_mm)},
                     {"edge_points", cell.tracker().edge_points().size()}};
    const auto& surface = c.surface().fit().surface();
    j["surface"] = {{"control_points", {surface.control_u(), surface.control_v()}},
                    {"rms_residual_mm", rounded(report.rms_residual_mm)},
                    {"sigma_mm", rounded(report.sigma_mm)},
                    {"tolerance_mm", c.config().fit_tolerance_mm},
                    {"smallest_pivot", report.smallest_pivot},
                    {"empty_cells", report.empty_cells},
                    {"shot_offset_rms_mm", rounded(report.shot_offset_rms_mm)},
                    {"shot_offset_max_mm", rounded(report.shot_offset_max_mm)},
                    {"ready_after_last_frame_ms", seconds(cell.surface_after_last_frame()) * 1000}};
  }
  const auto& cycle = cell.cycle();
  const double total = std::max(seconds(cycle.total), 1e-9);
  j["cycle"] = {{"seconds", seconds(cycle.total)},
                {"idle_fraction", rounded(seconds(cycle.idle) / total)},
                {"standing_fraction", rounded(seconds(cycle.standing) / total)}};
  const auto memory = c.memory();
  j["memory"] = {{"plan_bytes", total_plan(memory)}, {"high_water_bytes", total_high_water(memory)}};
  Json parts = Json::object();
  for (const auto& item : memory)
    parts[item.subsystem] = {{"plan_bytes", item.plan_bytes}, {"high_water_bytes", item.high_water_bytes}};
  j["memory"]["subsystems"] = parts;
  j["recorder_lost"] = c.recorder().lost();
  return j;
}

namespace {

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

std::string picture(const Controller& c, const RunLabel& label, const Json& summary,
                    std::vector<PlateField> fields) {
  OverviewInput in;
  in.title = "Moldloft run: " + label.plate;
  in.about = about_run(summary);
  in.subtitle =
      fmt::format("{}; {} boundary and {} surface shots, {} points used, {:.1f} s of cell time",
                  summary["result"].get<std::string>(), summary["shots"]["boundary"].get<int>(),
                  summary["shots"]["surface"].get<int>(), summary["points"]["used"].get<std::uint64_t>(),
                  summary["cycle"]["seconds"].get<double>());
  const bool complete = c.cell().state() == tasks::CellState::complete;
  if (const auto why = c.cell().why().view(); !complete && !why.empty())
    in.subtitle += fmt::format("; {}", why);
  if (complete) in.surface = &c.surface().fit().surface();
  if (complete)
    in.corners = c.surface().outline().corners;
  else
    in.corners = c.cell().tracker().corners();
  in.edge_points = c.cell().tracker().edge_points();
  in.boundary_places = c.cell().boundary_places();
  in.surface_places = c.cell().surface_places();
  in.field_x_mm = c.config().scanner.field_x_mm;
  in.field_y_mm = c.config().scanner.field_y_mm;
  in.fields = std::move(fields);
  return overview_svg(in);
}

}  // namespace

std::expected<void, RunError> write_results(const Controller& c, const RunFolder& folder,
                                            const RunLabel& label, const Json& summary,
                                            const std::optional<PlateField>& error_field) {
  std::expected<void, RunError> result;
  const auto write = [&](const char* name, std::string_view content) {
    auto written = write_file(folder.path / name, content);
    if (result) result = std::move(written);
  };
  std::vector<PlateField> fields;
  if (c.cell().state() == tasks::CellState::complete) {
    const auto& surface = c.surface().fit().surface();
    const double gate =
        gate_sigmas * std::max(c.surface().fit().report().sigma_mm, c.config().scanner.noise_mm);
    const auto points = measured_points(c, *folder.store, points_in_ply, gate);
    if (!points) return std::unexpected{RunError{points.error().what}};
    write("surface.json", json_text(surface_json(surface)) + "\n");
    const CadFacts facts = cad_facts(summary);
    const auto step = step_file(surface, facts, "surface.step"),
               iges = iges_file(surface, facts, "surface.igs");
    if (!step) return std::unexpected{step.error()};
    if (!iges) return std::unexpected{iges.error()};
    write("surface.step", *step);
    write("surface.igs", *iges);
    write("boundary.ply", boundary_ply(surface, 100));
    write("points.ply", points_ply(*points));
    fields = {shape_field(surface, picture_cells),
              error_field ? *error_field : residual_field(*points, picture_cells)};
  }
  const auto events = folder.store->events();
  if (!events) return std::unexpected{RunError{events.error().what}};
  write("events.jsonl", events_jsonl(*events));
  write("overview.svg", picture(c, label, summary, std::move(fields)));
  const Json timing = timing_of(c, label.conditions);
  write("timing.json", json_text(timing, 2) + "\n");
  write("report.html", timing_page(timing, "Timing of " + label.plate, about_run(summary)));
  write("summary.json", json_text(summary, 2) + "\n");
  return result;
}

}  // namespace moldloft::firmware_like
