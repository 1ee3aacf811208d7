#include "tasks/planning/outline_words.hpp"

#include "geometry/edges/outline_search.hpp"

#include <algorithm>
#include <optional>

namespace moldloft::tasks {
namespace {

using Kind = geometry::OutlineDeviation::Kind;

// Distances below a centimetre are told apart by their tenths.
hal::FixedText<16> mm(double value) {
  return value < 9.95 ? hal::FixedText<16>::format("{:.1f} mm", value)
                      : hal::FixedText<16>::format("{:.0f} mm", value);
}

hal::Message corner_cut(const geometry::OutlineDeviation& d) {
  const double more = std::max(d.leg_before_mm, d.leg_after_mm),
               less = std::min(d.leg_before_mm, d.leg_after_mm);
  if (less > 0.8 * more)
    return hal::Message::format("the corner at ({:.0f}, {:.0f}) is cut by {}", d.place.x(), d.place.y(),
                                mm((more + less) / 2).view());
  return hal::Message::format("the corner at ({:.0f}, {:.0f}) is cut by {} and {}", d.place.x(), d.place.y(),
                              mm(d.leg_before_mm).view(), mm(d.leg_after_mm).view());
}

hal::Message corner_missing(const geometry::OutlineDeviation& d) {
  if (d.outwards_mm > d.inwards_mm)
    return hal::Message::format("the plate goes on beyond the corner at ({:.0f}, {:.0f}), by up to {}",
                                d.place.x(), d.place.y(), mm(d.outwards_mm).view());
  return hal::Message::format(
      "the corner at ({:.0f}, {:.0f}) is missing: {} and {} of its sides, up to {} deep", d.place.x(),
      d.place.y(), mm(d.leg_before_mm).view(), mm(d.leg_after_mm).view(), mm(d.inwards_mm).view());
}

}  // namespace

hal::Message words_of(const geometry::OutlineDeviation& d) {
  const double x = d.place.x(), y = d.place.y();
  const bool inwards = d.inwards_mm >= d.outwards_mm;
  switch (d.kind) {
    case Kind::step:
      return hal::Message::format("a step of {} {} over {} of the side at ({:.0f}, {:.0f})",
                                  mm(d.distance_mm()).view(), inwards ? "inwards" : "outwards",
                                  mm(d.length_mm).view(), x, y);
    case Kind::corner_cut:
      return corner_cut(d);
    case Kind::corner_rounded:
      return hal::Message::format("the corner at ({:.0f}, {:.0f}) is rounded, radius about {}", x, y,
                                  mm(d.radius_mm).view());
    case Kind::corner_missing:
      return corner_missing(d);
    case Kind::ragged:
      return hal::Message::format("a ragged rim, up to {}, from ({:.0f}, {:.0f}) to ({:.0f}, {:.0f})",
                                  mm(d.distance_mm()).view(), d.from.x(), d.from.y(), d.to.x(), d.to.y());
    case Kind::corner_unseen:
      return hal::Message::format(
          "nothing of the edge was seen within {} of the corner at ({:.0f}, {:.0f}): it may be rounded or "
          "cut",
          mm(d.leg_after_mm).view(), x, y);
    case Kind::unseen:
      return hal::Message::format("{} of the edge at ({:.0f}, {:.0f}) were not seen", mm(d.length_mm).view(),
                                  x, y);
    case Kind::apart:
      return hal::Message::format(
          "an edge {} {} the outline at ({:.0f}, {:.0f}), beside the one that was seen there",
          mm(d.distance_mm()).view(), inwards ? "inside" : "outside", x, y);
  }
  return {};
}

namespace {

// The edge lies along the sides between these corners: they are the plate's.
constexpr double whole_share = 0.97;

hal::FixedText<80> places(std::span<const Eigen::Vector2d> corners) {
  hal::FixedText<80> list;
  for (const auto& c : corners) {
    const auto longer = hal::FixedText<80>::format("{}{}({:.0f}, {:.0f})", list.view(),
                                                   list.empty() ? "" : ", ", c.x(), c.y());
    if (longer.view().size() == list.view().size() || longer.view().back() != ')') break;
    list = longer;
  }
  return list;
}

// Sides as long as this are measured.
constexpr double shortest_side_mm = 40;

// Of four corners in a row round the plate.
std::optional<hal::Message> short_side(std::span<const Eigen::Vector2d> corners) {
  if (corners.size() != 4) return std::nullopt;
  std::size_t at = 0;
  const auto length = [&](std::size_t i) { return (corners[(i + 1) % 4] - corners[i]).norm(); };
  for (std::size_t i = 1; i < 4; ++i) {
    if (length(i) < length(at)) at = i;
  }
  if (length(at) >= shortest_side_mm) return std::nullopt;
  return hal::Message::format(
      "the plate is too small: its side at ({:.0f}, {:.0f}) is {:.0f} mm long, sides from {:g} mm on are "
      "measured",
      corners[at].x(), corners[at].y(), length(at), shortest_side_mm);
}

}  // namespace

hal::Message words_of(const geometry::OutlineSearch& search) {
  constexpr std::string_view what_to_do = "only plates with four sides are measured";
  const auto corners = search.corners();
  if (const auto small = short_side(search.candidates())) return *small;
  if (search.share_along() >= whole_share && corners.size() != 4)
    return hal::Message::format("the plate has {} corners, {}: {}", corners.size(), places(corners).view(),
                                what_to_do);
  if (const auto* worst = search.worst())
    return hal::Message::format("{}: {}", words_of(*worst).view(), what_to_do);
  if (corners.empty())
    return hal::Message::format("the plate's edge is round, it has no corners: {}", what_to_do);
  return hal::Message::format(
      "{} corners were found, {}, but only {:.0f} % of the edge lie on lines between them: {}",
      corners.size(), places(corners.first(std::min<std::size_t>(corners.size(), 2))).view(),
      100 * search.share_along(), what_to_do);
}

}  // namespace moldloft::tasks
