#include "firmware_like/cad_files.hpp"

#include "geometry/cad/iges_writer.hpp"
#include "geometry/cad/step_writer.hpp"

#include <fmt/format.h>

#include <cstdio>

namespace moldloft::firmware_like {
namespace {

geometry::CadStamp stamp_of(const std::string& begun) {
  geometry::CadStamp s;
  char end = 0;
  const int fields = std::sscanf(begun.c_str(), "%4d-%2d-%2dT%2d:%2d:%2d%c", &s.year, &s.month, &s.day,
                                 &s.hour, &s.minute, &s.second, &end);
  return fields == 7 && end == 'Z' ? s : geometry::CadStamp{};
}

geometry::CadLabel label_of(const CadFacts& facts, const std::string& file_name) {
  std::string what = "measured plate surface, mm, world coordinates";
  if (facts.noise_mm) what += fmt::format("; noise of a point {:.4f} mm", *facts.noise_mm);
  if (facts.tolerance_mm) what += fmt::format("; tolerance of the fit {} mm", *facts.tolerance_mm);
  std::vector<std::string> notes;
  if (!facts.cell.empty()) notes.push_back("cell: " + facts.cell);
  if (!facts.remark.empty()) notes.push_back("remark: " + facts.remark);
  return {.name = facts.plate,
          .description = what,
          .notes = notes,
          .file_name = file_name,
          .system = facts.program.empty() ? "Moldloft" : "Moldloft " + facts.program,
          .stamp = stamp_of(facts.begun)};
}

using Writer = std::expected<std::string, geometry::Error> (*)(const geometry::TrimmedSurface&,
                                                               const geometry::CadLabel&);

std::expected<std::string, RunError> written(Writer writer, const geometry::BSplineSurface& surface,
                                             const CadFacts& facts, const std::string& file_name) {
  auto text = writer({.surface = surface}, label_of(facts, file_name));
  if (!text)
    return std::unexpected(RunError{fmt::format("{}: {}", file_name, geometry::to_string(text.error()))});
  return std::move(*text);
}

}  // namespace

CadFacts cad_facts(const Json& summary) {
  CadFacts facts;
  const auto number = [](const Json& in, const char* key) -> std::optional<double> {
    const auto found = in.find(key);
    if (found == in.end() || !found->is_number()) return {};
    return found->get<double>();
  };
  const auto text = [](const Json& in, const char* key, std::string& to) {
    const auto found = in.find(key);
    if (found != in.end() && found->is_string()) to = found->get<std::string>();
  };
  if (!summary.is_object()) return facts;
  text(summary, "plate", facts.plate);
  text(summary, "cell", facts.cell);
  text(summary, "remark", facts.remark);
  text(summary, "begun", facts.begun);
  if (const auto program = summary.find("program"); program != summary.end() && program->is_object()) {
    std::string version = "?", commit = "?", build = "?";
    text(*program, "version", version);
    text(*program, "commit", commit);
    text(*program, "build", build);
    facts.program = fmt::format("{} (commit {}; {})", version, commit, build);
  }
  if (const auto surface = summary.find("surface"); surface != summary.end() && surface->is_object()) {
    facts.noise_mm = number(*surface, "sigma_mm");
    facts.tolerance_mm = number(*surface, "tolerance_mm");
  }
  return facts;
}

std::expected<std::string, RunError> step_file(const geometry::BSplineSurface& surface, const CadFacts& facts,
                                               const std::string& file_name) {
  return written(geometry::step_text, surface, facts, file_name);
}

std::expected<std::string, RunError> iges_file(const geometry::BSplineSurface& surface, const CadFacts& facts,
                                               const std::string& file_name) {
  return written(geometry::iges_text, surface, facts, file_name);
}

}  // namespace moldloft::firmware_like
