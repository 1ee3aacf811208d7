// What the audit has found: one thing about a result that a person has to know before he trusts it.
//
// Frame        world, mm, plan view
#pragma once

#include "firmware_like/process/json_text.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

enum class FindingKind : std::uint8_t {
  outline,         // edge points and outline do not lie on each other
  ragged_rim,      // the edge points scatter about the outline
  shot_missing,    // a planned shot is not in the result
  unseen,          // a part of the plate without points
  shot_heights,    // shots contradict each other in height
  shot_edges,      // shots see the edge beside where the others do
  plate_moved,     // from a shot on the plate lies elsewhere
  mount,           // the scanner sits otherwise on the tip than [scanner.mount] says
  noise,           // points scatter more, or less, about the surface than the scanner promises
  between_points,  // the surface swings where nothing was measured
  memory_plan,     // the plan left something out
  net,             // the net is coarser than asked for
};

enum class Gravity : std::uint8_t {
  warning,    // the result holds but for what is named
  untrusted,  // it does not: the run is held
};

struct Finding {
  FindingKind kind{};
  Gravity gravity = Gravity::warning;
  std::optional<Eigen::Vector2d> place;  // where; nothing when it is about the whole plate
  double size_mm = 0;                    // how much; the text says of what
  std::string text;                      // what was seen, where, what to do: one line
};

std::string_view to_string(FindingKind);
std::string_view to_string(Gravity);

// [{"kind":"unseen","gravity":"warning","place_mm":[x,y],"size_mm":s,"text":".."},..]; without a place that is null.
Json findings_json(const std::vector<Finding>&);
// What findings_json() wrote; throws Json::exception where it is something else.
std::vector<Finding> findings_in(const Json&);

}  // namespace moldloft::firmware_like
