// What may be wrong with a simulated cell on purpose: a list of {what, how much, when}, as one writes it.
//
//     robot-lies 5 at 7, plate-pushed 3, noise 5
//
// A fault begins with a shot, counted from 1: `at 7` is that shot alone, `from 7` that one and all after it.
// `at surface` and `from surface` count from the first shot of the surface. Without either a fault is there from
// the first shot on. A plate is moved once, and then before a shot that the seed draws. Directions are drawn too.
//
// Thread       any
// Failure      one line that names the word and what is known
#pragma once

#include "host_sim/base/sim_error.hpp"

#include <cstdint>
#include <expected>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::host_sim {

enum class FaultKind : std::uint8_t {
  robot_lies,       // mm: it says another place than its encoders do
  robot_tilts,      // degrees: it says another attitude
  robot_slips,      // mm: the arm stands elsewhere, and nobody says so
  robot_leans,      // degrees: the arm stands tilted, and nobody says so
  robot_drifts,     // mm a shot: as slips, more with each shot
  robot_stays,      // it confirms motions and stays where it is
  scanner_blind,    // share of the field that shows nothing
  scanner_freezes,  // the same frame again and again
  scanner_scales,   // per cent: lengths come out so much too large
  scanner_mirrors,  // left and right are exchanged
  noise,            // times what is configured
  plate_pushed,     // mm
  plate_turned,     // degrees
  plate_lifted,     // mm
  mount_yawed,      // degrees: the scanner is not mounted as the configuration says
  mount_shifted,    // mm
};

// Its name on the command line, the unit of its size (empty: none is given), and what it does.
struct FaultWord {
  FaultKind kind;
  std::string_view name, unit, about;
  double least, most;  // of its size
};
std::span<const FaultWord> fault_words();
const FaultWord& word_of(FaultKind);

struct Fault {
  enum class When : std::uint8_t { drawn, at, from };
  FaultKind kind{};
  double size = 0;
  When when = When::drawn;
  std::uint64_t shot = 1;   // for at and from, counted from 1
  bool of_surface = false;  // counted among the shots of the surface
};

std::expected<std::vector<Fault>, SimError> faults_from(std::string_view text);
std::string text_of(const Fault&);  // as faults_from() reads it
std::string text_of(const std::vector<Fault>&);

}  // namespace moldloft::host_sim
