#include "firmware_like/results/cad_files.hpp"

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

std::expected<std::string, Failure> written(Writer writer, const geometry::BSplineSurface& surface,
                                            const CadFacts& facts, const std::string& file_name) {
  auto text = writer({.surface = surface}, label_of(facts, file_name));
  if (!text)
    return std::unexpected(Failure{fmt::format("{}: {}", file_name, geometry::to_string(text.error()))});
  return std::move(*text);
}

}  // namespace

CadFacts cad_facts(const RunResult& r) {
  CadFacts facts{.plate = r.label.plate, .cell = r.cell, .remark = r.label.remark, .begun = r.label.begun};
  const auto or_unknown = [](const std::string& text) { return text.empty() ? "?" : text; };
  const auto& program = r.program;
  if (!(program.version + program.commit + program.build).empty())
    facts.program = fmt::format("{} (commit {}; {})", or_unknown(program.version), or_unknown(program.commit),
                                or_unknown(program.build));
  if (r.measured) {
    if (r.measured->fit.sigma_mm > 0) facts.noise_mm = r.measured->fit.sigma_mm;
    if (r.measured->tolerance_mm > 0) facts.tolerance_mm = r.measured->tolerance_mm;
  }
  return facts;
}

std::expected<std::string, Failure> step_file(const geometry::BSplineSurface& surface, const CadFacts& facts,
                                              const std::string& file_name) {
  return written(geometry::step_text, surface, facts, file_name);
}

std::expected<std::string, Failure> iges_file(const geometry::BSplineSurface& surface, const CadFacts& facts,
                                              const std::string& file_name) {
  return written(geometry::iges_text, surface, facts, file_name);
}

}  // namespace moldloft::firmware_like
