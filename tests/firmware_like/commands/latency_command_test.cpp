// The parts of `moldloft latency` that need no clock. The command itself runs in tests/host_sim.
#include "firmware_like/commands/latency_command.hpp"

#include "firmware_like/recorded_cyclictest.hpp"
#include "tasks/scripted_clock.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;

namespace {

tasks::Histogram hundred_of(hal::Duration value, hal::Duration last) {
  tasks::Histogram h;
  for (int i = 0; i < 99; ++i) h.add(value);
  h.add(last);
  return h;
}

}  // namespace

TEST_CASE(
    "a measurement without comparison is one turn, with it each side gets half in turns of five seconds") {
  const auto check = [](double duration_s, hal::Duration tick, bool compare, int turns, std::int64_t ticks) {
    const TurnPlan plan = plan_turns(duration_s, tick, compare);
    CHECK(plan.turns == turns);
    CHECK(plan.ticks == ticks);
  };
  check(30, 1ms, false, 1, 30'000);
  check(60, 1ms, true, 6, 5000);
  check(60, 2ms, true, 6, 2500);
  check(26, 1ms, true, 3, 4333);
  check(1, 1ms, true, 1, 500);
  check(1, 100ms, true, 1, 5);
}

TEST_CASE("cyclictest is given what ours got, not what ours asked for") {
  RunConditions conditions{.realtime = {.priority = 61, .cpu = 3}, .environment = {}, .setup = {}};
  const auto got = [&](SetupItem item, bool ok) {
    conditions.setup.push_back({.item = item, .wanted = "", .got = "", .ok = ok, .hint = ""});
  };
  for (const bool ok : {false, true}) {
    CAPTURE(ok);
    conditions.setup.clear();
    for (const auto item : {SetupItem::memory_lock, SetupItem::affinity, SetupItem::scheduling})
      got(item, ok);
    const auto settings = same_as(conditions, 2ms, 2500);
    CHECK(settings.priority == (ok ? 61 : 0));
    CHECK(settings.cpu == (ok ? 3 : -1));
    CHECK(settings.lock_memory == ok);
    CHECK(settings.interval == 2ms);
    CHECK(settings.cycles == 2500);
  }
  conditions.realtime.lock_memory = false;  // had, and not asked for: the limit would have allowed it
  CHECK_FALSE(same_as(conditions, 1ms, 1).lock_memory);
}

TEST_CASE("turns of cyclictest add up") {
  CyclictestResult all{.latency = hundred_of(20us, 50us), .cycles = 100, .beyond = 1};
  all += {.latency = hundred_of(25us, 40us), .cycles = 101, .beyond = 2};
  CHECK(all.latency.count() == 200);
  CHECK(all.latency.max() == 50us);
  CHECK(all.cycles == 201);
  CHECK(all.beyond == 3);
  CHECK(comparison_json(hundred_of(30us, 30us), all)["cyclictest"]["beyond_its_histogram"] == 3);
}

TEST_CASE("ratios are ours over cyclictest's, and unknown where there is nothing to divide by") {
  CyclictestResult theirs{.latency = hundred_of(20us, 50us), .cycles = 100, .beyond = 0};
  const Json c = comparison_json(hundred_of(30us, 200us), theirs);
  CHECK(c["ratio_p50"].get<double>() == doctest::Approx(1.5).epsilon(0.035));
  CHECK(c["ratio_p99"].get<double>() == doctest::Approx(1.5).epsilon(0.035));  // the 99th of 100
  CHECK(c["ratio_p999"] == 4.0);
  CHECK(c["ratio_p9999"] == 4.0);
  CHECK(c["ratio_max"] == 4.0);
  CHECK(c["ours"]["cycles"] == 100);
  const Json none = comparison_json(hundred_of(30us, 200us), {});
  for (const char* key : {"ratio_p50", "ratio_p99", "ratio_p999", "ratio_p9999", "ratio_max"})
    CHECK(none[key].is_null());
}

TEST_CASE("the JSON of a comparison has the keys that were promised, in microseconds") {
  tasks::ScriptedClock clock;
  clock.oversleep = 30us;
  tasks::Scheduler scheduler{clock, {.warm_up_ticks = 0}};
  scheduler.start();
  scheduler.run_until(200ms);
  Json timing = timing_report({.scheduler = scheduler});
  const auto theirs = parse_cyclictest(recorded_cyclictest);
  REQUIRE(theirs.has_value());
  timing["compared"] = comparison_json(scheduler.wake_up(), *theirs);
  const Json j = latency_json(timing);
  for (const char* side : {"ours", "cyclictest"}) {
    CAPTURE(side);
    for (const char* key : {"p50_us", "p99_us", "p999_us", "p9999_us", "max_us", "min_us", "avg_us"}) {
      CAPTURE(key);
      CHECK(j[side][key].is_number());
    }
    CHECK(j[side]["cycles"] == 200);
    CHECK_FALSE(j[side].contains("buckets_ns"));
  }
  CHECK(j["ours"]["p99_us"] == 30.0);
  CHECK(j["cyclictest"]["max_us"] == 405.5);
  CHECK(j["ratio_p99"].get<double>() ==
        j["ours"]["p99_us"].get<double>() / j["cyclictest"]["p99_us"].get<double>());
  CHECK(j["missed"] == 0);
  CHECK(j["representative"] == false);
  CHECK(j["why"] == "virtual time");
  CHECK(j["ratio_max"].is_number());
}

TEST_CASE("without comparison the JSON has ours alone") {
  tasks::ScriptedClock clock;
  tasks::Scheduler scheduler{clock, {.warm_up_ticks = 0}};
  scheduler.start();
  scheduler.run_until(50ms);
  const Json j = latency_json(timing_report({.scheduler = scheduler}));
  CHECK(j["ours"]["cycles"] == 50);
  CHECK_FALSE(j.contains("cyclictest"));
  CHECK_FALSE(j.contains("ratio_p99"));
  CHECK(j.contains("missed"));
}
