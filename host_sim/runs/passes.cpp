#include "host_sim/runs/passes.hpp"

#include "firmware_like/inspection/frame_page.hpp"
#include "firmware_like/inspection/inspection_files.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "host_sim/runs/simulated_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace moldloft::host_sim {
namespace {

namespace fs = std::filesystem;
using firmware_like::Inspection;

constexpr double unformed_springback = 0.5;  // of a plate of which nobody said what it was before
constexpr double nearer = 0.95;              // than the pass before: noise is no progress

// What is left of the mistakes after some passes.
Mistakes left_of(const Mistakes& before, double part) {
  Mistakes left = before;
  left.springback = 1 - part * (1 - before.springback);
  left.twist_mm *= part;
  left.bow_mm *= part;
  left.shift_x_mm *= part, left.shift_y_mm *= part;
  for (auto& dent : left.dents) dent.depth_mm *= part;
  return left;
}

double worst_of(const Inspection& i) { return i.worst.empty() ? 0 : std::abs(i.worst.front().mm); }

std::expected<Pass, SimError> run_pass(const PassesOptions& options, int number, const Mistakes& mistakes) {
  SimulatedRunOptions run;
  run.cell = options.cell;
  run.cell.formed = mistakes;
  run.cell.has_design = true;
  run.out = options.out / fmt::format("pass-{}", number);
  run.name = fmt::format("{}, pass {}", options.cell.plate, number);
  const auto done = simulate(run);
  if (!done) return std::unexpected(done.error());
  if (!firmware_like::is_measured(done->result.outcome))
    return std::unexpected(SimError{
        fmt::format("pass {} is {}: {}", number, to_string(done->result.outcome), done->result.message)});
  const auto designed = designed_plate(options.cell);
  const auto placed = placed_plate(run.cell);
  if (!designed || !placed) return std::unexpected(designed ? placed.error() : designed.error());
  firmware_like::Design design;
  design.file = "design.json";
  design.name = options.cell.plate;
  design.faces.push_back({spline_of(**designed), {}});
  firmware_like::InspectionSettings settings;
  settings.limit = {-options.limit_mm, options.limit_mm};
  settings.insists = true;  // before the first pass it may look like another plate
  auto exact = done->result;
  exact.measured->surface = spline_of(*placed->plate, placed->world_from_plate());
  auto measured = firmware_like::inspect(done->result, {}, design, settings);
  const auto truth = firmware_like::inspect(exact, {}, design, settings);
  if (!measured || !truth)
    return std::unexpected(SimError{measured ? truth.error().what : measured.error().what});
  measured->run = done->folder.string();
  for (const auto& [name, text] :
       {std::pair<const char*, std::string>{"inspection.json",
                                            firmware_like::json_text(inspection_json(*measured), 1) + "\n"},
        {"frames.html", frame_page(*measured)}}) {
    if (const auto written = firmware_like::write_file(done->folder / name, text); !written)
      return std::unexpected(SimError{written.error().what});
  }
  return Pass{.number = number,
              .measured = measured->inside,
              .truth = truth->inside,
              .worst_mm = worst_of(*measured),
              .true_worst_mm = worst_of(*truth),
              .within = measured->verdict == firmware_like::Judgement::passes};
}

}  // namespace

std::expected<std::vector<Pass>, SimError> run_passes(const PassesOptions& options,
                                                      const std::function<void(const Pass&)>& on_pass) {
  Mistakes before;
  before.springback = unformed_springback;
  if (options.cell.formed) before = *options.cell.formed;
  if (before.shape)
    return std::unexpected(
        SimError{"--formed: passes form the plate to its design; say how far it is, not another shape"});
  std::vector<Pass> passes;
  for (int number = 1; number <= options.passes; ++number) {
    const auto pass = run_pass(options, number, left_of(before, std::pow(options.left_after_pass, number)));
    if (!pass) return std::unexpected(pass.error());
    passes.push_back(*pass);
    if (on_pass) on_pass(*pass);
  }
  return passes;
}

int show_passes(const PassesOptions& options) {
  using firmware_like::show;
  show(fmt::format("{:>4}{:>14}{:>14}{:>16}{:>14}   within {:g} mm\n", "pass", "rms, mm", "true rms",
                   "worst, mm", "true worst", options.limit_mm));
  const auto passes = run_passes(options, [](const Pass& p) {
    show(fmt::format("{:>4}{:>14.3f}{:>14.3f}{:>16.2f}{:>14.2f}   {}\n", p.number, p.measured.rms_mm,
                     p.truth.rms_mm, p.worst_mm, p.true_worst_mm, p.within ? "yes" : "no"));
    firmware_like::flush_shown();
  });
  if (!passes) return firmware_like::complain(passes.error().what, "moldloft-sim passes");
  firmware_like::Json rows = firmware_like::Json::array();
  for (const auto& p : *passes)
    rows.push_back({{"pass", p.number},
                    {"rms_mm", p.measured.rms_mm},
                    {"true_rms_mm", p.truth.rms_mm},
                    {"worst_mm", p.worst_mm},
                    {"true_worst_mm", p.true_worst_mm},
                    {"within", p.within}});
  const auto written =
      firmware_like::write_file(options.out / "passes.json", firmware_like::json_text(rows, 1) + "\n");
  if (!written) return firmware_like::complain(written.error().what, "moldloft-sim passes");
  show(
      fmt::format("folders {} to pass-{}, passes.json\n", (options.out / "pass-1").string(), options.passes));
  const bool converges = std::ranges::adjacent_find(*passes, [](const Pass& a, const Pass& b) {
                           return b.measured.rms_mm > nearer * a.measured.rms_mm && b.measured.rms_mm > 0.02;
                         }) == passes->end();
  return converges ? firmware_like::exit_done : firmware_like::exit_failed;
}

}  // namespace moldloft::host_sim
