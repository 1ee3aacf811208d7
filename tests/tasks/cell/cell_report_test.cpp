#include "tasks/cell/cell_report.hpp"

#include <doctest/doctest.h>

using namespace moldloft::tasks;
using S = CellState;

TEST_CASE("while devices are awaited those that are missing are named") {
  for (const auto state : {S::starting, S::unholding}) {
    CHECK(awaited({.state = state}) == Awaited::nothing);
    CHECK(awaited({.state = state, .scanner_missing = true}) == Awaited::scanner);
    CHECK(awaited({.state = state, .robot_missing = true}) == Awaited::robot);
    CHECK(awaited({.state = state, .scanner_missing = true, .robot_missing = true}) == Awaited::both);
  }
  CHECK(awaited({.state = S::starting, .calibrates = true, .robot_missing = true}) == Awaited::calibration);
  CHECK(awaited({.state = S::unholding, .calibrates = true, .robot_missing = true}) == Awaited::robot);
}

TEST_CASE(
    "a cell that holds or has aborted waits for what ends that, and for nothing where it would only come "
    "again") {
  const auto held = [](HoldCause cause) { return awaited({.state = S::held, .cause = cause}); };
  CHECK(held(HoldCause::scanner) == Awaited::scanner);
  CHECK(held(HoldCause::recorder) == Awaited::disk);
  CHECK(held(HoldCause::person) == Awaited::word_unhold);
  CHECK(held(HoldCause::plan) == Awaited::nothing);
  CHECK(held(HoldCause::measurement) == Awaited::nothing);
  CHECK(awaited({.state = S::aborted, .cause = HoldCause::person}) == Awaited::word_clear);
  CHECK(awaited({.state = S::aborted, .cause = HoldCause::measurement}) == Awaited::nothing);
  for (const auto state : {S::holding, S::stopping, S::aborting})
    CHECK(awaited({.state = state, .scanner_missing = true}) == Awaited::arm_at_rest);
}

TEST_CASE("a cell at work or at rest waits for nothing, whatever device is missing") {
  for (const auto state : {S::idle, S::execute, S::completing, S::complete, S::stopped, S::resetting})
    CHECK(awaited({.state = state, .scanner_missing = true, .robot_missing = true}) == Awaited::nothing);
  CHECK(awaited({.state = S::clearing, .scanner_missing = true}) == Awaited::nothing);
  CHECK(awaited({.state = S::clearing, .robot_missing = true}) == Awaited::robot);
}
