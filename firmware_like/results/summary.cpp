#include "firmware_like/results/summary.hpp"

#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

using Milliseconds = std::chrono::duration<double, std::milli>;

// Rounded to a nanometre: what lies below is the arithmetic's, and makes files hard to read.
double rounded(double mm) { return std::round(mm * 1e6) / 1e6; }

void put_measured(Json& j, const RunResult& r) {
  const MeasuredPlate& plate = *r.measured;
  Json corners = Json::array();
  for (const auto& corner : plate.outline.corners)
    corners.push_back({rounded(corner.x()), rounded(corner.y())});
  j["boundary"] = {
      {"corners_mm", corners}, {"rms_mm", rounded(plate.outline.rms_mm)}, {"edge_points", r.edge_points}};
  const auto& fit = plate.fit;
  j["surface"] = {{"control_points", {plate.surface.control_u(), plate.surface.control_v()}},
                  {"finest_spans", {fit.finest_spans_u, fit.finest_spans_v}},
                  {"rms_residual_mm", rounded(fit.rms_residual_mm)},
                  {"sigma_mm", rounded(fit.sigma_mm)},
                  {"tolerance_mm", plate.tolerance_mm},
                  {"smallest_pivot", fit.smallest_pivot},
                  {"empty_cells", fit.empty_cells},
                  {"corner_sigma_mm", fit.corner_sigma_mm},
                  {"shot_offset_rms_mm", rounded(fit.shot_offset_rms_mm)},
                  {"shot_offset_max_mm", rounded(fit.shot_offset_max_mm)},
                  {"ready_after_last_frame_ms",
                   std::chrono::duration<double>(plate.ready_after_last_frame).count() * 1000}};
}

MeasuredPlate read_measured(const Json& j) {
  MeasuredPlate plate;
  const auto& boundary = j.at("boundary");
  for (std::size_t i = 0; i < plate.outline.corners.size(); ++i)
    plate.outline.corners[i] = {boundary.at("corners_mm").at(i).at(0).get<double>(),
                                boundary.at("corners_mm").at(i).at(1).get<double>()};
  plate.outline.rms_mm = boundary.at("rms_mm");
  const auto& surface = j.at("surface");
  auto& fit = plate.fit;
  fit.points_used = j.at("points").at("used");
  // Until surface.json is read its net is known by its size.
  const Eigen::Index rows = surface.at("control_points").at(0), columns = surface.at("control_points").at(1);
  for (auto* net : {&plate.surface.x, &plate.surface.y, &plate.surface.z}) net->setZero(rows, columns);
  const Json finest = surface.value("finest_spans", Json{0, 0});  // unknown of runs from before it was kept
  fit.finest_spans_u = finest.at(0), fit.finest_spans_v = finest.at(1);
  fit.rms_residual_mm = surface.at("rms_residual_mm");
  fit.sigma_mm = surface.at("sigma_mm");
  plate.tolerance_mm = surface.at("tolerance_mm");
  fit.smallest_pivot = surface.at("smallest_pivot");
  fit.empty_cells = surface.at("empty_cells");
  fit.corner_sigma_mm = surface.value("corner_sigma_mm", fit.corner_sigma_mm);
  fit.shot_offset_rms_mm = surface.at("shot_offset_rms_mm");
  fit.shot_offset_max_mm = surface.at("shot_offset_max_mm");
  plate.ready_after_last_frame =
      std::chrono::round<hal::Duration>(Milliseconds{surface.at("ready_after_last_frame_ms").get<double>()});
  return plate;
}

}  // namespace

Json summary_json(const RunResult& r) {
  Json j;
  j["schema"] = 1;
  j["unit"] = "mm";
  j["result"] = std::string{to_string(r.outcome)};
  j["message"] = r.message;
  j["plate"] = hal::printable(r.label.plate);
  j["cell"] = hal::printable(r.cell);
  if (!r.label.remark.empty()) j["remark"] = hal::printable(r.label.remark);
  j["seed"] = r.label.seed ? Json(*r.label.seed) : Json(nullptr);
  if (!r.label.begun.empty()) j["begun"] = r.label.begun;
  j["program"] = {{"version", r.program.version}, {"commit", r.program.commit}, {"build", r.program.build}};
  if (r.is_audited) j["findings"] = findings_json(r.findings);
  j["shots"] = {{"seek", r.shots.seek},
                {"boundary", r.shots.boundary},
                {"surface", r.shots.surface},
                {"retaken", r.shots.retaken}};
  j["points"] = {{"total", r.points_seen}, {"used", r.measured ? r.measured->fit.points_used : 0}};
  if (r.measured) put_measured(j, r);
  j["cycle"] = {{"seconds", r.cycle.seconds},
                {"idle_fraction", rounded(r.cycle.idle_fraction)},
                {"standing_fraction", rounded(r.cycle.standing_fraction)}};
  j["memory"] = {{"plan_bytes", total_plan(r.memory)}, {"high_water_bytes", total_high_water(r.memory)}};
  Json parts = Json::object();
  for (const auto& item : r.memory)
    parts[item.subsystem] = {{"plan_bytes", item.plan_bytes}, {"high_water_bytes", item.high_water_bytes}};
  j["memory"]["subsystems"] = parts;
  j["recorder_lost"] = r.recorder_lost;
  if (!r.truth.is_null()) j["truth"] = r.truth;
  if (!r.fitted_from.empty()) j["fitted_from"] = r.fitted_from;
  return j;
}

RunResult named_in(const Json& j) {
  RunResult r;
  const auto text = [](const Json& in, const char* key, std::string& to) {
    const auto found = in.is_object() ? in.find(key) : in.end();
    if (found != in.end() && found->is_string()) to = found->get<std::string>();
  };
  const auto number = [](const Json& in, const char* key, double& to) {
    const auto found = in.find(key);
    if (found != in.end() && found->is_number()) to = found->get<double>();
  };
  text(j, "plate", r.label.plate);
  text(j, "cell", r.cell);
  text(j, "remark", r.label.remark);
  text(j, "begun", r.label.begun);
  if (!j.is_object()) return r;
  if (const auto seed = j.find("seed"); seed != j.end() && seed->is_number_unsigned())
    r.label.seed = seed->get<std::uint64_t>();
  if (const auto program = j.find("program"); program != j.end()) {
    text(*program, "version", r.program.version);
    text(*program, "commit", r.program.commit);
    text(*program, "build", r.program.build);
  }
  if (const auto surface = j.find("surface"); surface != j.end() && surface->is_object()) {
    r.measured.emplace();
    number(*surface, "sigma_mm", r.measured->fit.sigma_mm);
    number(*surface, "tolerance_mm", r.measured->tolerance_mm);
  }
  return r;
}

std::expected<RunResult, Failure> read_summary(const Json& j) {
  RunResult r = named_in(j);
  try {
    const auto outcome = outcome_named(j.at("result").get<std::string>());
    if (j.at("schema") != 1 || !outcome) return std::unexpected{Failure{"schema 1 is needed"}};
    r.outcome = *outcome;
    r.message = j.at("message");
    r.is_audited = j.contains("findings");
    if (r.is_audited) r.findings = findings_in(j["findings"]);
    const auto& shots = j.at("shots");
    r.shots = {shots.at("seek"), shots.at("boundary"), shots.at("surface"), shots.at("retaken")};
    r.points_seen = j.at("points").at("total");
    if (j.contains("surface")) r.measured = read_measured(j);
    if (j.contains("boundary")) r.edge_points = j["boundary"].value("edge_points", std::uint64_t{0});
    const auto& cycle = j.at("cycle");
    r.cycle = {cycle.at("seconds"), cycle.at("idle_fraction"), cycle.at("standing_fraction")};
    for (const auto& [name, bytes] : j.at("memory").at("subsystems").items())
      r.memory.push_back({name, bytes.at("plan_bytes"), bytes.at("high_water_bytes")});
    r.recorder_lost = j.at("recorder_lost");
    r.truth = j.value("truth", Json{});
    r.fitted_from = j.value("fitted_from", "");
  } catch (const Json::exception& error) {
    return std::unexpected{
        Failure{fmt::format("was not written by this version of moldloft ({})", error.what())}};
  }
  return r;
}

std::string about_run(const RunResult& r) {
  std::string line;
  const auto add = [&](std::string_view what, const std::string& text) {
    if (!text.empty()) line += fmt::format("{}{}{}", line.empty() ? "" : "; ", what, text);
  };
  add("plate ", hal::printable(r.label.plate));
  add("cell ", hal::printable(r.cell));
  add("begun ", r.label.begun);
  add("moldloft ", r.program.version);
  add("commit ", r.program.commit);
  add("remark: ", hal::printable(r.label.remark));
  return line;
}

}  // namespace moldloft::firmware_like
