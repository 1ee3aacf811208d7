#include "tasks/planning/outline_words.hpp"

#include "geometry/edges/outline_search.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace moldloft;
using geometry::OutlineDeviation;
using Kind = OutlineDeviation::Kind;

namespace {

std::string words(const OutlineDeviation& d) { return std::string(tasks::words_of(d).view()); }

}  // namespace

TEST_CASE("each way in which an edge leaves its outline has words with the place and the size") {
  OutlineDeviation d{.place = {412, 88}, .length_mm = 100, .inwards_mm = 40};
  CHECK(words(d) == "a step of 40 mm inwards over 100 mm of the side at (412, 88)");
  d.outwards_mm = 41;
  CHECK(words(d) == "a step of 41 mm outwards over 100 mm of the side at (412, 88)");
  CHECK(words({.kind = Kind::corner_cut, .place = {-7, 300}, .leg_before_mm = 24.8, .leg_after_mm = 25.4}) ==
        "the corner at (-7, 300) is cut by 25 mm");
  CHECK(words({.kind = Kind::corner_cut, .place = {-7, 300}, .leg_before_mm = 25, .leg_after_mm = 60}) ==
        "the corner at (-7, 300) is cut by 25 mm and 60 mm");
  CHECK(words({.kind = Kind::corner_rounded, .place = {-7, 300}, .radius_mm = 9.6}) ==
        "the corner at (-7, 300) is rounded, radius about 9.6 mm");
  CHECK(words({.kind = Kind::corner_missing,
               .place = {-7, 300},
               .inwards_mm = 55,
               .leg_before_mm = 60,
               .leg_after_mm = 55}) ==
        "the corner at (-7, 300) is missing: 60 mm and 55 mm of its sides, up to 55 mm deep");
  CHECK(words({.kind = Kind::corner_missing, .place = {-7, 300}, .outwards_mm = 57}) ==
        "the plate goes on beyond the corner at (-7, 300), by up to 57 mm");
  CHECK(words({.kind = Kind::ragged, .from = {10, 0}, .to = {300, 2}, .outwards_mm = 8.25}) ==
        "a ragged rim, up to 8.2 mm, from (10, 0) to (300, 2)");
  CHECK(words({.kind = Kind::corner_unseen, .place = {-7, 300}, .leg_after_mm = 8.6}) ==
        "nothing of the edge was seen within 8.6 mm of the corner at (-7, 300): it may be rounded or cut");
  CHECK(words({.kind = Kind::unseen, .place = {120, 300}, .length_mm = 40}) ==
        "40 mm of the edge at (120, 300) were not seen");
  CHECK(words({.kind = Kind::apart, .place = {200, 40}, .inwards_mm = 50}) ==
        "an edge 50 mm inside the outline at (200, 40), beside the one that was seen there");
}

TEST_CASE("a plate with a side that is too short is said to be too small, not to have another shape") {
  const std::vector<Eigen::Vector2d> corners{{400, 0}, {580, 4}, {578, 44}, {401, 29}};
  std::vector<Eigen::Vector2d> edge;
  for (std::size_t i = 0; i < 4; ++i) {
    for (double t = 0; t < 1; t += 0.02) edge.push_back((1 - t) * corners[i] + t * corners[(i + 1) % 4]);
  }
  geometry::OutlineSearch search{edge.size(), {}, {}, {}};
  search.begin(edge, corners);
  CHECK(tasks::words_of(search).view() ==
        "the plate is too small: its side at (401, 29) is 29 mm long, sides from 40 mm on are measured");
  const std::vector<Eigen::Vector2d> long_enough{{400, 0}, {580, 4}, {578, 44}, {401, 41}};
  search.begin(edge, long_enough);
  CHECK(tasks::words_of(search).view().find("too small") == std::string_view::npos);
}
