// The way through a PSC1 scanner's connection and shot, as a table (PROTOCOLS.md has the words).
#pragma once

#include "hal/base/transition.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace moldloft::hal {

enum class PscPhase : std::uint8_t { offline, greeting, configuring, ready, exposing, computing };
constexpr int psc_phase_count = 6;

enum class PscCue : std::uint8_t {
  link_open,
  link_lost,
  greeted,
  configured,
  triggered,
  exposed,
  exposed_anew,  // a second exposure for one shot: the arm may have moved
  frame,
  late,  // no answer in time, or an error instead of it
  forgotten,
};
constexpr int psc_cue_count = 10;

enum class PscAction : std::uint8_t {
  back_off,
  report_loss,
  greet,
  configure,
  announce,
  announce_and_trigger,
  announce_and_fail,
  send_trigger,
  report_exposed,
  report_frame,
  report_both,
  fail_shot,
  drop_shot,
};
constexpr int psc_action_count = 13;

struct PscContext {
  bool has_retries = false;   // the shot may be asked for once more
  bool outstanding = false;   // a shot is
  bool exposed = false;       // it is, and the cell has been told: the arm may have moved
  bool same_session = false;  // it was exposed in the session that the scanner is in
};

using PscTransition = Transition<PscPhase, PscCue, PscAction, PscContext>;
std::span<const PscTransition> psc_transitions() MOLDLOFT_NONBLOCKING;
std::span<const Ignored<PscPhase, PscCue>> psc_ignored();

std::string_view to_string(PscPhase);
std::string_view to_string(PscCue);
std::string_view to_string(PscAction);

}  // namespace moldloft::hal
