#include "host_sim/runs/simulated_run.hpp"

#include "firmware_like/config/device_makes.hpp"
#include "firmware_like/config/plate_name.hpp"
#include "firmware_like/controller/result_of.hpp"
#include "firmware_like/inspection/design_reader.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/report/result_files.hpp"
#include "firmware_like/results/summary.hpp"
#include "hal/links/cable.hpp"
#include "host_sim/cell/cell_config.hpp"
#include "host_sim/cell/world_clock.hpp"

#include <fmt/format.h>

#include <cmath>

namespace moldloft::host_sim {
namespace {

using firmware_like::Controller;
using firmware_like::Json;

constexpr int ticks_between_drains = 10;
constexpr int ticks_between_reports = 200;

Json truth_json(const Verdict& v) {
  return {{"normal_max_mm", v.normal_max_mm},
          {"normal_rms_mm", v.normal_rms_mm},
          {"normal_max_at_mm", {v.normal_max_at.x(), v.normal_max_at.y()}},
          {"outline_max_mm", v.outline_max_mm},
          {"corner_max_mm", v.corner_max_mm},
          {"points", v.points}};
}

// What the plate was to become, what it became, and how far that is in heights, nothing aligned.
Json design_truth_json(const CellDescription& cell, const Plate& formed, const Plate& design) {
  const auto off = height_difference(formed, design);
  return {{"shape", cell.plate},
          {"formed", cell.formed ? words_of(*cell.formed) : std::string{}},
          {"height_rms_mm", off.rms_mm},
          {"height_lowest_mm", off.lowest_mm},
          {"height_highest_mm", off.highest_mm}};
}

// The judge's grid lies on the true plate, the picture's cells on the measured surface: each cell shows the grid point
// nearest to its middle.
firmware_like::PlateField error_field(const Verdict& verdict, const geometry::BSplineSurface& surface,
                                      int count) {
  firmware_like::PlateField field;
  field.count_u = field.count_v = count;
  field.title = "Measured minus true surface, along the normal";
  field.unit = "um";
  field.scale = 1000;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k) {
      const Eigen::Vector3d p = surface.at((i + 0.5) / count, (k + 0.5) / count).value;
      double nearest = INFINITY, value = NAN;
      for (const auto& d : verdict.grid) {
        const double distance = (d.world - p.head<2>()).squaredNorm();
        if (distance >= nearest) continue;
        nearest = distance;
        value = d.normal_mm;
      }
      field.values.push_back(value);
    }
  }
  return field;
}

void run_to_rest(Controller& controller, const SimulatedCell& cell, hal::Clock& clock,
                 const SimulatedRunOptions& options) {
  controller.start();
  for (int ticks = 1; controller.tick() && clock.now() < options.time_limit; ++ticks) {
    if (options.on_tick) options.on_tick(cell, clock.now());
    if (controller.cell().phase() == tasks::Phase::scan_surface) cell.world.surface_begins();
    const bool takes = !options.disk_takes || options.disk_takes();
    if (takes && ticks % ticks_between_drains == 0) controller.recorder().drain(cell.store);
    if (options.on_progress && ticks % ticks_between_reports == 0)
      options.on_progress(controller.cell().progress());
  }
  controller.recorder().drain(cell.store);
  if (options.on_progress) options.on_progress(controller.cell().progress());
}

// "wave, seed 1"; of a mesh the file's name without the path.
std::string shape_and_seed(const CellDescription& cell) {
  const bool mesh = cell.plate.ends_with(".ply");
  return fmt::format("{}, seed {}", mesh ? firmware_like::name_of_folder(cell.plate) : cell.plate, cell.seed);
}

std::expected<firmware_like::RunFolder, firmware_like::Failure> folder_for(
    const SimulatedRunOptions& options, const firmware_like::CellConfig& config) {
  firmware_like::RunNames names{options.name, options.remark};
  if (options.resume) return firmware_like::resume_run(options.out, config.text, names);
  if (names.plate.empty()) names.plate = shape_and_seed(options.cell);
  return firmware_like::create_run(options.out, config.text, *firmware_like::make_of(config.scanner).codec,
                                   firmware_like::RunKind::simulated, names);
}

// design.json, in plate coordinates: what the plate was to become, and nothing of where it lies.
std::expected<void, SimError> write_design(const CellDescription& cell, const std::filesystem::path& folder) {
  if (!cell.has_design) return {};
  const auto plate = designed_plate(cell);
  if (!plate) return std::unexpected{plate.error()};
  const geometry::DesignFace face{spline_of(**plate), {}};
  const auto text = firmware_like::json_text(
                        firmware_like::design_json({&face, 1}, "moldloft-sim, shape " + cell.plate), 1) +
                    "\n";
  const auto written = firmware_like::write_file(folder / "design.json", text);
  if (!written) return std::unexpected{SimError{written.error().what}};
  return {};
}

// A plate that was moved meanwhile may be measured where it lay or where it lies: the better of the two counts.
std::expected<Verdict, SimError> judge_where_it_lay(const PlateInstance& put_down,
                                                    const SimulatedWorld& world,
                                                    const firmware_like::MeasuredPlate& measured) {
  const auto first = judge(put_down, measured.surface, measured.outline.corners);
  if (!world.plate_has_moved()) return first;
  const auto last = judge(world.plate(), measured.surface, measured.outline.corners);
  if (!first || !last) return first ? first : last;
  const auto worst = [](const Verdict& v) { return std::max(v.outline_max_mm, v.normal_max_mm); };
  return worst(*last) < worst(*first) ? last : first;
}

}  // namespace

std::expected<SimulatedRun, SimError> simulate(const SimulatedRunOptions& options) {
  const auto plate = placed_plate(options.cell);
  if (!plate) return std::unexpected{plate.error()};
  if (options.on_plate) options.on_plate(*plate);
  const std::string text = options.config.empty() ? cell_toml(options.cell, *plate) : options.config;
  const auto config = firmware_like::parse_config(text, "simulated cell");
  if (!config) return std::unexpected{SimError{config.error().what}};
  auto folder = folder_for(options, *config);
  if (!folder) return std::unexpected{SimError{folder.error().what}};

  WorldClock clock;
  hal::Cable scanner_cable{clock, {}}, robot_cable{clock, {.bytes_per_second = serial_bytes_per_second}};
  SimulatedWorld world{options.cell, *plate, scanner_cable.device(), robot_cable.device()};
  clock.carry(world);
  if (options.real_time) clock.pace_by_wall();
  const std::uint32_t epoch = options.resume ? folder->archive->last_epoch() + 1 : 1;
  const auto controller =
      std::make_unique<Controller>(*config, clock, scanner_cable.host(), robot_cable.host(),
                                   firmware_like::ControllerOptions{.archive = folder->archive.get(),
                                                                    .epoch = epoch,
                                                                    .nonce = epoch,
                                                                    .begin_held = options.held,
                                                                    .attended = options.held});
  run_to_rest(*controller, {world, scanner_cable, robot_cable, *controller, *folder->store}, clock, options);

  SimulatedRun run{.result = result_of(*controller, {.plate = folder->names.plate,
                                                     .seed = options.cell.seed,
                                                     .remark = folder->names.remark}),
                   .folder = folder->path};
  auto& result = run.result;
  run.exit_code = exit_code(result.outcome);
  if (controller->recorder().store_failed())
    return std::unexpected{SimError{std::string{controller->recorder().store_error().view()}}};
  if (!options.resume && !controller->cell().has_driven()) {
    run.summary = summary_json(result);
    firmware_like::discard_run(std::move(*folder));
    return run;
  }
  std::optional<firmware_like::PlateField> errors;
  if (result.measured) {
    const auto verdict = judge_where_it_lay(*plate, world, *result.measured);
    if (!verdict) return std::unexpected{verdict.error()};
    result.truth = truth_json(*verdict);
    if (options.cell.has_design) {
      const auto design = designed_plate(options.cell);
      if (!design) return std::unexpected{design.error()};
      result.truth["design"] = design_truth_json(options.cell, *plate->plate, **design);
    }
    if (options.write_everything) errors = error_field(*verdict, result.measured->surface, 56);
  }
  run.summary = summary_json(result);
  if (options.write_everything) {
    const auto written = write_results(result, *folder, errors);
    if (!written) return std::unexpected{SimError{written.error().what}};
    if (const auto design = write_design(options.cell, folder->path); !design)
      return std::unexpected{design.error()};
  }
  return run;
}

}  // namespace moldloft::host_sim
