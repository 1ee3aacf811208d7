// Edges on measured reality: two height maps that SICK ships with its samples (The Unlicense). Every row is
// one laser profile, so rows are stripes and columns are points. The expected positions were read by eye
// from enlarged pictures of the height maps, before anything was computed; the tolerances say how well they
// can be read.
#include "geometry/edges/boundary_view.hpp"
#include "geometry/edges/plate_runs.hpp"
#include "geometry/edges/range_image.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

using namespace moldloft::geometry;
using moldloft::test::RangeImage, moldloft::test::Stripes, moldloft::test::stripes_of;

namespace {

RangeImage load(const std::string& name) {
  RangeImage image = moldloft::test::load_range_image(name);
  if (image.width == 0) MESSAGE("not there, nothing to check: " << name);
  REQUIRE(image.value.size() == static_cast<std::size_t>(image.width) * image.height);
  return image;
}

struct Agreement {
  int rows = 0, within = 0;
  double mean_px = 0;
};

// The lowest (or highest) edge of every row against a column that may depend on the row.
template <typename Column>
Agreement agreement(std::span<const PlateRun> runs, const RangeImage& image, int first_row, int from, int to,
                    bool upper, Column&& column, double tolerance_px) {
  Agreement result;
  for (int row = from; row < to; ++row) {
    const PlateRun* outermost = nullptr;
    for (const PlateRun& run : runs) {
      if (run.stripe == row - first_row && (outermost == nullptr || upper)) outermost = &run;
    }
    ++result.rows;
    if (outermost == nullptr || !is_edge(upper ? outermost->at_last : outermost->at_first)) continue;
    const double px = (upper ? outermost->edge_last : outermost->edge_first).y() / image.point_mm;
    const double off = px - column(row);
    if (std::abs(off) <= tolerance_px) ++result.within, result.mean_px += off;
  }
  result.mean_px /= std::max(1, result.within);
  return result;
}

// The field ends far beyond the picture: every end inside the picture is then an edge or hidden.
PlateRunSettings whole_picture() {
  PlateRunSettings settings;
  settings.field_half_y_mm = 1000;
  return settings;
}

}  // namespace

TEST_CASE("range image: the free edges and the groove between two plates lie where the picture shows them") {
  const RangeImage image = load("StripGroove_image_9.json");
  if (image.width == 0) return;
  constexpr int first = 40, end = 520;  // between the ragged ends of both plates
  const Stripes stripes = stripes_of(image, first, end, 16500);
  PlateRunFinder finder(end - first, static_cast<std::size_t>(end - first) * image.width);

  // The left plate: columns 148 to 421 at row 100, to 425 at row 450; its right edge is rounded over ten
  // columns, so it can be read to four (0.4 mm).
  const auto left =
      finder.find(stripes.views, {280 * image.stripe_mm, 300 * image.point_mm, 0}, whole_picture());
  REQUIRE(left.has_value());
  const auto free_edge = agreement(
      *left, image, first, first, end, false, [](int) { return 148.0; }, 2);
  const auto groove = agreement(
      *left, image, first, first, end, true, [](int row) { return 420.3 + 0.0115 * row; }, 4);
  MESSAGE("left plate: free edge " << free_edge.within << " of " << free_edge.rows << " rows, "
                                   << free_edge.mean_px << " px; groove " << groove.within << ", "
                                   << groove.mean_px << " px");
  CHECK(free_edge.within >= 0.95 * free_edge.rows);
  CHECK(groove.within >= 0.95 * groove.rows);

  // The right plate: columns 504 at row 100 and 507 at row 450, to 597. A step up from the groove's ground.
  const auto right =
      finder.find(stripes.views, {280 * image.stripe_mm, 560 * image.point_mm, 0}, whole_picture());
  REQUIRE(right.has_value());
  const auto step = agreement(
      *right, image, first, first, end, false, [](int row) { return 502.8 + 0.0082 * row; }, 4);
  const auto end_edge = agreement(
      *right, image, first, first, end, true, [](int) { return 597.0; }, 2);
  MESSAGE("right plate: step " << step.within << " of " << step.rows << " rows, " << step.mean_px
                               << " px; free edge " << end_edge.within << ", " << end_edge.mean_px << " px");
  CHECK(step.within >= 0.95 * step.rows);
  CHECK(end_edge.within >= 0.95 * end_edge.rows);
  for (const PlateRun& run : *right) CHECK(run.at_last == RunEnd::free_end);

  // The groove's ground lies 12.4 mm lower, columns 433 to 503: the right plate hides what comes.
  const auto ground =
      finder.find(stripes.views, {280 * image.stripe_mm, 470 * image.point_mm, -12.3}, whole_picture());
  REQUIRE(ground.has_value());
  int hidden = 0;
  for (const PlateRun& run : *ground) hidden += run.at_last == RunEnd::hidden;
  CHECK(hidden >= 0.95 * (end - first));
}

TEST_CASE(
    "range image: a cut corner, its neighbours and a side of a plate among blocks are where the picture "
    "shows them") {
  const RangeImage image = load("BlobFeatureTypes3D_image.json");
  if (image.width == 0) return;
  constexpr int first = 60, end = 420;
  const Stripes stripes = stripes_of(image, first, end, 10033);
  PlateRunFinder finder(end - first, static_cast<std::size_t>(end - first) * image.width);
  const auto runs =
      finder.find(stripes.views, {390 * image.stripe_mm, 280 * image.point_mm, 0}, whole_picture());
  REQUIRE(runs.has_value());

  // The cut: column 114.5 at row 110, 104.5 at 120, 65 at 160, 46.5 at 180. Then the left side
  // at column 30.7.
  const auto cut = agreement(
      *runs, image, first, 70, 185, false, [](int row) { return 104.5 - 0.968 * (row - 120); }, 2.5);
  const auto side = agreement(
      *runs, image, first, 210, 400, false, [](int) { return 30.7; }, 2);
  const auto right = agreement(
      *runs, image, first, 230, 400, true, [](int) { return 724.0; }, 2.5);
  MESSAGE("cut " << cut.within << " of " << cut.rows << " rows, " << cut.mean_px << " px; left side "
                 << side.within << " of " << side.rows << ", " << side.mean_px << " px; right side "
                 << right.within << " of " << right.rows << ", " << right.mean_px << " px");
  CHECK(cut.within >= 0.95 * cut.rows);
  CHECK(side.within >= 0.95 * side.rows);
  CHECK(right.within >= 0.95 * right.rows);

  // Both meet at column 31, row 197 (+- 2 px) and turn by 45 degrees.
  BoundaryViewer viewer(8000);
  BoundaryViewSettings view_settings;
  view_settings.stripe_pitch_mm = image.stripe_mm;
  view_settings.field_half_x_mm = view_settings.field_half_y_mm = 1000;
  const auto view = viewer.look(*runs, stripes.views.size(), view_settings);
  double nearest = 1e9, turn = 0;
  for (const BoundaryPiece& piece : view.pieces) {
    if (piece.kind != BoundaryPiece::Kind::corner) continue;
    const double off =
        std::hypot(piece.corner.x() / image.stripe_mm - 197, piece.corner.y() / image.point_mm - 31);
    if (off < nearest) nearest = off, turn = piece.turn;
  }
  MESSAGE("corner " << nearest << " px from where it was read, turn " << turn * 57.29578 << " degrees");
  CHECK(nearest < 3);
  CHECK(std::abs(turn) == doctest::Approx(0.785).epsilon(0.04));
}
