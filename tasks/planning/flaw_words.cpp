#include "tasks/planning/flaw_words.hpp"

#include "tasks/planning/outline_words.hpp"

namespace moldloft::tasks {
namespace {

using geometry::Error;

hal::Message few_edges(std::span<const Eigen::Vector2d> edge_points) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const auto& p : edge_points) middle += p / static_cast<double>(edge_points.size());
  return hal::Message::format(
      "{} edge points about ({:.0f}, {:.0f}) make no four sides: clear the plate's edge, clean it and run "
      "again",
      edge_points.size(), middle.x(), middle.y());
}

}  // namespace

hal::Message flaw_words(Error error, const geometry::OutlineSearch& search,
                        std::span<const Eigen::Vector2d> edge_points) {
  switch (error) {
    case Error::not_four_sided:
      return words_of(search);
    case Error::too_few_points:
    case Error::repeated_points:
    case Error::collinear:
    case Error::no_extent:
      return few_edges(edge_points);
    case Error::folded_map:
    case Error::self_crossing:
      return "the plate's sides bend back or cross, so no four-sided surface lies between them: look at its "
             "edge";
    case Error::outside_domain:
    case Error::singular:
    case Error::empty_cells:
    case Error::span_without_points:
      return "parts of the plate show too few points for a surface: clean or matt them, or raise [fit] "
             "finest_span_mm";
    case Error::capacity:
      return "the plate needs more memory than was planned at the start: raise [plate] largest_mm";
    case Error::not_finite:
    case Error::too_large:
      return "a position came that is no number or far out of the cell: check scanner and robot with "
             "'moldloft check'";
    case Error::tolerance_not_met:
    case Error::not_converged:
      return "the surface comes no nearer to the points: check [scanner] noise_mm and [fit] tolerance_mm";
    default:
      return hal::Message::format(
          "flaw {} in the calculation, which no plate should cause: keep the run's folder and report it",
          static_cast<int>(error));
  }
}

}  // namespace moldloft::tasks
