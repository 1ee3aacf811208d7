// Inspection: a measured plate against its design. Where it lies on it, where it differs and by how much, how sure that
// is, and whether it keeps the limits that somebody gave.
//
// Sign         positive: material stands too high, seen from the side that was measured
// Deviation    the distance along the normal to the true foot on the design's B-spline (of points and templates: on the
//              measured one), no tessellation. It is read from the fitted surface, which has the noise of thousands of
//              points averaged out; the single points are in deviations.csv and deviations.ply
// Border       what lies nearer to the border than `border_width_mm` is a class of its own: the rim is ground, bent and
//              burnt, and has limits of its own
// Alignment    stated, and chosen by a person; the outline takes part, so that a sheet does not slide in its plane
// Frames       points are in the plate's world; places of the result in the design's frame. mm
// Thread       any; pure
// Failure      one line for a person: what does not fit together, by which figures, and what to do
#pragma once

#include "firmware_like/inspection/design.hpp"
#include "firmware_like/inspection/frame_lines.hpp"
#include "firmware_like/process/failure.hpp"
#include "firmware_like/results/measured_points.hpp"
#include "firmware_like/results/run_result.hpp"
#include "geometry/inspection/plate_alignment.hpp"

#include <expected>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

enum class AlignmentMethod : std::uint8_t {
  best,             // least squares of surface and outline
  robust,           // the same, and a dent does not tilt it
  one_sided_above,  // the best fit, then lifted and tilted until the plate is nowhere below the design
  one_sided_below,
  corners,  // the four corners on those of the design
  datum,    // places that a person names on both
  none,     // the design lies in the cell's world already
};
std::string_view to_string(AlignmentMethod);
std::optional<AlignmentMethod> alignment_named(std::string_view);
std::string alignment_names();  // for help and messages

// What may differ: from low to high, mm. In its own words for a region, a rectangle in the design's x and y.
struct Limit {
  double low_mm = 0, high_mm = 0;
};
struct RegionLimit {
  std::string name;
  Eigen::Vector2d min, max;
  Limit limit;
};

struct DatumPair {
  Eigen::Vector3d measured, designed;
};

struct InspectionSettings {
  AlignmentMethod method = AlignmentMethod::best;
  std::optional<Limit> limit, border_limit;  // border_limit: as limit where it is not given
  std::vector<RegionLimit> regions;          // the first that holds a place counts
  double border_width_mm = 10;
  bool with_outline = true;  // false: a raw plate with margin, whose outline is not the design's
  std::vector<DatumPair> datum;
  bool insists = false;  // compares also what looks like another plate
  int frames = 7;        // frame lines, where the design names none
};

// A place of the plate and what it differs by.
struct InspectedPlace {
  Eigen::Vector3d at;  // design frame, on the measured plate
  double mm = 0, sigma_mm = 0;
  float u = 0, v = 0;  // of the measured surface
  bool border = false;
  bool beyond = false;  // no part of the design faces it
  int region = -1;      // of the settings' regions
};

struct Spread {
  std::size_t count = 0;
  double mean_mm = 0, rms_mm = 0, least_mm = 0, most_mm = 0;
  double p05_mm = 0, median_mm = 0, p95_mm = 0;
};

struct HistogramBin {
  double from_mm = 0, to_mm = 0;
  std::size_t count = 0;
};

enum class Judgement : std::uint8_t { not_judged, passes, fails };

struct JudgedRegion {
  std::string name;
  Limit limit;
  Spread spread;
  double share_within = 1;
  bool passes = true;
  bool is_close =
      false;  // the worst place is nearer to a limit than two sigma: the verdict could be the other
};

struct EdgeLength {
  std::string name;  // side 1..4, diagonal 1-3, 2-4
  double measured_mm = 0, designed_mm = 0;
};

struct PointDeviation {
  Eigen::Vector3f at;  // design frame
  float mm = 0;
  bool border = false;
};

struct Inspection {
  std::string plate, run, design, design_file;
  DesignKind kind = DesignKind::surface;
  AlignmentMethod method = AlignmentMethod::best;
  geometry::RigidMotion design_from_world = geometry::RigidMotion::Identity();
  geometry::PlateAlignment alignment;
  std::vector<std::string> undetermined, remarks;
  std::vector<InspectedPlace> places;  // of the map: rows along u; of points and templates: one each
  int map_u = 0, map_v = 0;            // 0 where there is no map
  Spread inside, border;
  std::vector<HistogramBin> histogram;
  std::vector<InspectedPlace> worst;  // apart from each other, the worst first
  std::vector<JudgedRegion> regions;
  Judgement verdict = Judgement::not_judged;
  bool is_close = false;
  std::vector<FrameLine> frame_lines;
  FrameAxes axes;
  double twist_mm = 0;  // sight marks of the last frame against the first, over the plate's half width
  std::vector<EdgeLength> edges;
  std::vector<PointDeviation> points;  // single measured points
};

std::expected<Inspection, Failure> inspect(const RunResult&, std::span<const MeasuredPoint>, const Design&,
                                           const InspectionSettings&);

}  // namespace moldloft::firmware_like
