#include "firmware_like/results/run_result.hpp"

#include "firmware_like/process/complaint.hpp"

#include <algorithm>

namespace moldloft::firmware_like {
namespace {

struct OutcomeRow {
  Outcome outcome;
  std::string_view word;
  int exit_code;
};
constexpr std::array<OutcomeRow, 5> outcomes{{{Outcome::complete, "complete", exit_done},
                                              {Outcome::warned, "warned", exit_warned},
                                              {Outcome::held, "held", exit_held},
                                              {Outcome::aborted, "aborted", exit_aborted},
                                              {Outcome::stopped, "stopped", exit_stopped}}};

const OutcomeRow& row_of(Outcome outcome) {
  return *std::ranges::find(outcomes, outcome, &OutcomeRow::outcome);
}

}  // namespace

std::string_view to_string(Outcome outcome) { return row_of(outcome).word; }
int exit_code(Outcome outcome) { return row_of(outcome).exit_code; }
bool is_measured(Outcome outcome) { return outcome == Outcome::complete || outcome == Outcome::warned; }

std::optional<Outcome> outcome_named(std::string_view word) {
  const auto* row = std::ranges::find(outcomes, word, &OutcomeRow::word);
  return row == outcomes.end() ? std::nullopt : std::optional{row->outcome};
}

Promise promise_of(const CellConfig& config) {
  return {.noise_mm = config.scanner.noise_mm,
          .repeatability_z_mm = config.robot.repeatability_z_mm,
          .finest_span_mm = config.finest_span_mm,
          .largest_unseen = config.unseen_percent / 100};
}

}  // namespace moldloft::firmware_like
