// What came out of a run, as one value: taken once from the controller when its cell has come to rest
// (controller/result_of.hpp), or read from the run's folder (stored_result.hpp). Summary, tables, pages, pictures, CAD
// files and points are made from it and from nothing else.
//
// Units        mm in world coordinates, as the cell measured; times as they say
// Thread       any: it owns all that it holds
#pragma once

#include "firmware_like/config/config.hpp"
#include "firmware_like/config/memory_plan.hpp"
#include "firmware_like/process/json_text.hpp"
#include "firmware_like/results/finding.hpp"
#include "geometry/edges/outline.hpp"
#include "geometry/fit/surface_fit.hpp"
#include "geometry/rigid_motion.hpp"
#include "geometry/splines/bspline.hpp"
#include "hal/base/clock.hpp"
#include "tasks/cell/shot_evidence.hpp"
#include "tasks/machines/boundary_tracker.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

enum class Outcome : std::uint8_t {
  complete,
  warned,  // complete, and the audit has found something that a person must know
  held,
  aborted,
  stopped,
};
std::string_view to_string(Outcome);
std::optional<Outcome> outcome_named(std::string_view);
int exit_code(Outcome);     // as complaint.hpp has them
bool is_measured(Outcome);  // complete, be it with warnings

// What the run is called, and when and by what it was made.
struct RunLabel {
  std::string plate = "measured";
  std::optional<std::uint64_t> seed;  // of a simulated run
  std::string begun = {};             // when, UTC; empty in a simulated run
  std::string remark = {};            // the operator's
};

struct ProgramVersion {
  std::string version, commit, build;
};

struct ShotCounts {
  int seek = 0, boundary = 0, surface = 0, retaken = 0;
};

// A plate that was measured from its edge to its middle.
struct MeasuredPlate {
  geometry::Outline outline;
  geometry::BSplineSurface surface;
  geometry::SurfaceFitReport fit;
  double tolerance_mm = 0;  // what the fit was allowed to miss, rms
  hal::Duration ready_after_last_frame{0};
};

// Where the cell looked: what a picture of the run shows besides the surface.
struct RunTrack {
  std::vector<Eigen::Vector2d> edge_points;
  std::vector<Eigen::Vector2d> corners;  // as the tracker came by them
  std::vector<tasks::ShotPlace> boundary_places, surface_places;
  double field_x_mm = 102, field_y_mm = 102;  // of the scanner
};

// What the configuration says of devices and result, and the audit asks for.
struct Promise {
  double noise_mm = 0.051;            // of a point's height
  double repeatability_z_mm = 0.013;  // of the arm's height from stop to stop
  double finest_span_mm = 10;
  double largest_unseen = 0.02;  // share of the plate's area without points beyond which it is not measured
};

Promise promise_of(const CellConfig&);

struct CycleShares {
  double seconds = 0, idle_fraction = 0, standing_fraction = 0;
};

struct RunResult {
  RunLabel label;
  std::string cell;  // its name
  ProgramVersion program;
  Outcome outcome = Outcome::stopped;
  std::string message;  // why a cell that is not complete stands

  ShotCounts shots;
  std::uint64_t points_seen = 0, edge_points = 0;
  std::optional<MeasuredPlate> measured;  // where the fit came to its end
  RunTrack track;
  Promise promised;
  tasks::RunEvidence evidence;  // not on disk: what follows from it are the findings
  bool is_audited = false;      // not where the fit did not come to its end, nor of runs of earlier versions
  std::vector<Finding> findings;  // the audit's, the gravest first
  geometry::RigidMotion tip_from_scanner = geometry::RigidMotion::Identity();
  CycleShares cycle;
  MemoryPlan memory;
  std::uint64_t recorder_lost = 0;
  // As timing.json holds it (timing_report.hpp). Its readers only show it, and runs of other versions lack keys, so a
  // value of its own type would hold nothing that they need.
  Json timing;
  Json truth;                 // of a simulated run: the judge's figures; null where there are none
  std::string fitted_from{};  // the run whose shots were fitted once more
};

}  // namespace moldloft::firmware_like
