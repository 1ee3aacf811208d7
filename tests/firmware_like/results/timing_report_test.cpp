// The timing report on scripted time: every cost is known, so is every figure.
#include "firmware_like/results/timing_report.hpp"

#include "tasks/scripted_clock.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;
using tasks::Histogram;

namespace {

// Ticks of 1 ms: 200 us of the first task, 100 us of the second in every fourth tick; background steps of 50 us.
struct Bench {
  tasks::ScriptedClock clock;
  tasks::ScriptedTask first, second;
  tasks::ScriptedBackground background;
  tasks::Scheduler scheduler;

  explicit Bench(std::vector<hal::Duration> first_costs, int steps = 0)
      : first{clock, std::move(first_costs)},
        second{clock, std::vector<hal::Duration>(100'000, 100us)},
        background{clock, steps, 50us},
        scheduler{clock, {.tick = 1ms, .warm_up_ticks = 0}} {
    scheduler.add({.name = "first", .budget = 250us}, first);
    scheduler.add({.name = "second", .period_ticks = 4, .offset_ticks = 1, .budget = 50us}, second);
    scheduler.add_background({.name = "fit", .quantum = 60us}, background);
    scheduler.start();
  }
  Json run(hal::Duration until) {
    scheduler.run_until(until);
    return timing_report({.scheduler = scheduler});
  }
};

std::vector<hal::Duration> always(hal::Duration cost) { return std::vector<hal::Duration>(100'000, cost); }

Histogram of(std::size_t count, hal::Duration value) {
  Histogram h;
  for (std::size_t i = 0; i < count; ++i) h.add(value);
  return h;
}

std::set<std::string> keys_of(const Json& j) {
  std::set<std::string> keys;
  for (const auto& [key, value] : j.items()) keys.insert(key);
  return keys;
}

}  // namespace

TEST_CASE("percentiles in the report are those of the sorted values, at most a bucket above") {
  std::mt19937 random{7};
  std::lognormal_distribution<double> latency{std::log(20'000.0), 0.7};
  Histogram h;
  std::vector<std::int64_t> sorted;
  for (int i = 0; i < 50'000; ++i) {
    sorted.push_back(std::llround(latency(random)));
    h.add(hal::Duration{sorted.back()});
  }
  std::ranges::sort(sorted);
  const Json j = histogram_json(h);
  const auto nearest_rank = [&](double fraction) {
    return static_cast<double>(sorted[static_cast<std::size_t>(std::ceil(fraction * 50'000)) - 1]) / 1000;
  };
  const std::pair<const char*, double> asked[] = {
      {"p50_us", 0.5}, {"p99_us", 0.99}, {"p999_us", 0.999}, {"p9999_us", 0.9999}};
  for (const auto& [key, fraction] : asked) {
    CAPTURE(key);
    CHECK(j[key].get<double>() >= nearest_rank(fraction));
    CHECK(j[key].get<double>() <= nearest_rank(fraction) * (1 + 1 / 32.0) + 0.001);
  }
  double sum = 0, squares = 0;
  for (const auto ns : sorted) sum += static_cast<double>(ns) / 1000;
  for (const auto ns : sorted) squares += std::pow(static_cast<double>(ns) / 1000 - sum / 50'000, 2);
  CHECK(j["count"] == 50'000);
  CHECK(j["min_us"].get<double>() == static_cast<double>(sorted.front()) / 1000);
  CHECK(j["max_us"].get<double>() == static_cast<double>(sorted.back()) / 1000);
  CHECK(std::abs(j["avg_us"].get<double>() - sum / 50'000) <= 0.001);  // whole nanoseconds
  CHECK(j["stddev_us"].get<double>() == doctest::Approx(std::sqrt(squares / 49'999)).epsilon(0.01));
}

TEST_CASE("what was not measured is null, never zero") {
  const Json none = histogram_json({});
  CHECK(none["count"] == 0);
  for (const char* key :
       {"min_us", "avg_us", "stddev_us", "p50_us", "p99_us", "p999_us", "p9999_us", "max_us"}) {
    CAPTURE(key);
    CHECK(none[key].is_null());
  }
  CHECK(histogram_json(of(1, 5us))["stddev_us"].is_null());
  Bench bench{always(200us)};
  const Json t = bench.run(10ms);
  CHECK(t["frame_to_command"].is_null());  // no cell, no devices
  CHECK(t["data_age"].is_null());
  CHECK(timing_report({.scheduler = tasks::Scheduler{bench.clock, {}}})["load"].is_null());
}

TEST_CASE("values beyond the histogram are counted, and the maximum is still exact") {
  Histogram h = of(9, 1ms);
  h.add(100s);
  const Json j = histogram_json(h);
  CHECK(j["overflows"] == 1);
  CHECK(j["max_us"] == 100e6);
  CHECK(j["p99_us"] == 100e6);
}

TEST_CASE("a report read back gives the same buckets") {
  Histogram h = of(3, 17ns);
  h.merge(of(500, 23'456ns));
  h.merge(of(1, 1'985us));
  const Histogram back = histogram_from(histogram_json(h));
  CHECK(back.count() == 504);
  for (std::size_t i = 0; i < Histogram::size(); ++i) CHECK(back.in_bucket(i) == h.in_bucket(i));
  CHECK(histogram_from(Json(nullptr)).empty());
}

TEST_CASE("load is the part of the ticks that table and background took") {
  Bench bench{always(200us), 400};  // 400 steps of 50 us in 100 ms
  const Json t = bench.run(100ms);
  CHECK(t["load"]["table"].get<double>() == 0.225);  // 200 us, and 100 us in every fourth tick
  CHECK(t["load"]["background"].get<double>() == 0.2);
  CHECK(t["load"]["idle"].get<double>() == 0.575);
  CHECK(t["execution"]["min_us"] == 200.0);
  CHECK(t["execution"]["max_us"] == 300.0);
  CHECK(t["slack"]["min_us"] == 700.0);
  CHECK(t["slack"]["max_us"] == 800.0);
}

TEST_CASE("every task has its runs, slips, late starts and overruns") {
  auto costs = always(200us);
  costs[4] = 2300us;  // runs into ticks 5 and 6
  Bench bench{costs};
  const Json t = bench.run(20ms);
  const Json &first = t["tasks"][0], &second = t["tasks"][1];
  CHECK(first["name"] == "first");
  CHECK(first["runs"] == 18);
  CHECK(first["slips"] == 2);
  CHECK(first["overruns"] == 1);
  CHECK(first["longest_at_ms"] == 4.0);
  CHECK(first["budget_us"] == 250.0);
  CHECK(second["runs"] == 4);  // ticks 1, 9, 13 and 17
  CHECK(second["slips"] == 1);
  CHECK(second["overruns"] == 4);
  CHECK(t["ticks"] == 18);
  CHECK(t["missed_ticks"] == 2);
  CHECK(t["missed_by_cause"] == Json({{"woken late", 0}, {"preempted", 0}, {"computing", 2}}));
  REQUIRE(t["first_misses"].size() == 1);
  const Json& miss = t["first_misses"][0];
  CHECK(miss["tick"] == 5);
  CHECK(miss["lost"] == 2);
  CHECK(miss["cause"] == "computing");
  CHECK(miss["task"] == "first");
  CHECK(miss["t_ms"] == 6.3);
  CHECK(miss["late_us"] == 1300.0);
  CHECK(miss["tick_took_us"] == 2300.0);
  CHECK(miss["of_that_on_the_processor_us"] == 2300.0);
}

TEST_CASE("a budget is suggested by the rule that the report states") {
  CHECK(suggested_budget(of(999, 40us), false) == std::nullopt);
  CHECK(suggested_budget(of(1000, 40us), false) == 60us);
  CHECK(suggested_budget(of(1000, 1us), false) == 10us);
  CHECK(suggested_budget(of(1000, 0us), false) == 10us);
  Histogram preempted = of(2000, 40us);  // one run of 2001 lies beyond the 99.9th percentile
  preempted.add(700us);
  const auto usual = preempted.percentile(0.999);  // the bucket of 40 us
  CHECK(usual >= 40us);
  CHECK(usual < 41'300ns);
  CHECK(suggested_budget(preempted, false) == 70us);  // 1.5 times that, up to the next 10 us
  CHECK(suggested_budget(preempted, true) == 700us);  // where nobody preempts it was the task itself
  preempted.add(701us);
  CHECK(suggested_budget(preempted, true) == 710us);
  CHECK(budget_rule.find("1.5 x p99.9") != budget_rule.npos);
}

TEST_CASE("declared budgets are judged by those suggested, and the suggested must fit into the tick") {
  Bench bench{always(200us), 2000};
  const Json t = bench.run(4s);  // "second" runs 1000 times
  const Json& b = t["budgets"];
  CHECK(b["rule"] == std::string{budget_rule});
  CHECK(b["tasks"][0]["name"] == "first");
  CHECK(b["tasks"][0]["suggested_us"] == 300.0);
  CHECK(b["tasks"][0]["declared_us"] == 250.0);
  CHECK(b["tasks"][0]["judged"] == "too small");
  CHECK(b["tasks"][1]["suggested_us"] == 150.0);
  CHECK(b["tasks"][1]["judged"] == "too small");
  CHECK(b["background"][0]["suggested_us"] == 80.0);  // 75 up to the next 10
  CHECK(b["background"][0]["judged"] == "too small");
  CHECK(b["busiest_tick_us"] == 300.0);
  CHECK(b["busiest_tick_suggested_us"] == 450.0);
  CHECK(b["suggested_fits_the_tick"] == true);

  Bench light{always(20us)};
  const Json budgets = light.run(2s)["budgets"];
  CHECK(budgets["tasks"][0]["judged"] == "generous");  // 30 us suggested of 250
  CHECK(budgets["tasks"][1]["judged"] == "too few runs");
  CHECK(Bench{always(165us)}.run(2s)["budgets"]["tasks"][0]["judged"] == "fits");  // 250 us suggested of 250
  CHECK(budgets["tasks"][1]["suggested_us"].is_null());
  CHECK(budgets["background"][0]["p999_us"].is_null());

  Bench heavy{always(650us)};
  CHECK(heavy.run(4s)["budgets"]["suggested_fits_the_tick"] == false);  // 980 us and the guard
}

TEST_CASE("tools that read cyclictest's JSON find its names with its meaning") {
  Bench bench{always(200us)};
  bench.clock.oversleep = 7'900ns;
  const Json t = bench.run(100ms);
  CHECK(t["file_version"] == 1);
  CHECK(t["return_code"] == 0);
  CHECK(t["num_threads"] == 1);
  CHECK(t["resolution_in_ns"] == 0);
  const Json& thread = t["thread"]["0"];
  CHECK(thread["cycles"] == 100);
  CHECK(thread["min"] == 7);  // truncated, as cyclictest does
  CHECK(thread["max"] == 7);
  CHECK(thread["avg"].get<double>() == 7.9);
  CHECK(thread["histogram"] == Json({{"7", 100}}));
}

TEST_CASE("a microsecond of cyclictest's histogram holds all that lies in it") {
  Bench bench{always(200us)};
  for (const auto late : {7'100ns, 7'500ns, 7'900ns, 9'200ns}) {
    bench.clock.oversleep = late;
    bench.scheduler.run_tick();
  }
  const Json t = timing_report({.scheduler = bench.scheduler});
  CHECK(t["thread"]["0"]["histogram"] == Json({{"7", 3}, {"9", 1}}));
}

TEST_CASE("background work that starves says how often it was refused and how often forced") {
  Bench bench{always(850us), 1000};  // a step of 60 us and the guard of 100 us never fit
  const Json t = bench.run(1s);
  const Json& fit = t["background"][0];
  CHECK(fit["forced"] == 10);  // every hundredth tick
  CHECK(fit["refused"] == 990);
  CHECK(fit["runs"] == 10);
}

TEST_CASE("the lateness of a task is what the budgets before it do not explain") {
  Bench bench{always(400us)};  // 150 us beyond the first budget, 100 us guard
  const Json t = bench.run(8ms);
  CHECK(t["tasks"][1]["late_starts"] == 2);
  CHECK(t["tasks"][1]["lateness_us"] == 100.0);
  CHECK(t["tasks"][0]["lateness_us"] == 0.0);
}

TEST_CASE("what drivers count as lost stands in the report, the zeros too") {
  Bench bench{always(200us)};
  const Json t = timing_report({.scheduler = bench.scheduler,
                                .losses = {{"scanner", {{"stale frames", 0}}},
                                           {"robot", {{"garbled lines", 7}, {"repeated lines", 2}}}}});
  REQUIRE(t["losses"].size() == 3);
  CHECK(t["losses"][0] == Json{{"of", "scanner"}, {"what", "stale frames"}, {"count", 0}});
  CHECK(t["losses"][1] == Json{{"of", "robot"}, {"what", "garbled lines"}, {"count", 7}});
  CHECK(t["losses"][2] == Json{{"of", "robot"}, {"what", "repeated lines"}, {"count", 2}});
  CHECK_FALSE(timing_report({.scheduler = bench.scheduler}).contains("losses"));
}

TEST_CASE("the report of a run has every part") {
  Bench bench{always(200us), 10};
  const Json t = bench.run(50ms);
  for (const char* key : {"schema",
                          "file_version",
                          "test_name",
                          "return_code",
                          "num_threads",
                          "resolution_in_ns",
                          "thread",
                          "representative",
                          "why",
                          "tick_us",
                          "ticks",
                          "missed_ticks",
                          "missed_by_cause",
                          "first_misses",
                          "wake_up",
                          "execution",
                          "slack",
                          "pushed_by_background",
                          "frame_to_command",
                          "data_age",
                          "load",
                          "tasks",
                          "background",
                          "budgets"}) {
    CAPTURE(key);
    CHECK(t.contains(key));
  }
  CHECK(keys_of(t["tasks"][0]) == std::set<std::string>{"name", "period_ticks", "budget_us", "runs", "slips",
                                                        "late_starts", "lateness_us", "overruns",
                                                        "longest_at_ms", "cost"});
  CHECK(keys_of(t["background"][0]) == std::set<std::string>{"name", "quantum_us", "runs", "refused",
                                                             "forced", "overruns", "longest_at_ms", "cost"});
  CHECK(keys_of(t["budgets"]["tasks"][0]) ==
        std::set<std::string>{"name", "runs", "p999_us", "max_us", "declared_us", "suggested_us", "judged"});
}

TEST_CASE("the conditions of a run head its report, with cyclictest's sysinfo and priority") {
  Bench bench{always(200us)};
  RunConditions conditions;
  conditions.environment.sysname = "Linux";
  conditions.environment.realtime = true;
  conditions.realtime.priority = 61;
  conditions.realtime.cpu = 2;
  bench.scheduler.run_until(20ms);
  const Json t = timing_report({.scheduler = bench.scheduler, .conditions = &conditions});
  CHECK(t["sysinfo"]["sysname"] == "Linux");
  CHECK(t["sysinfo"]["realtime"] == 1);
  CHECK(t["thread"]["0"]["priority"] == 61);
  CHECK(t["thread"]["0"]["cpu"] == 2);
  conditions.realtime.cpu = 0;
  CHECK(timing_report({.scheduler = bench.scheduler, .conditions = &conditions})["thread"]["0"]["cpu"] == 0);
  conditions.realtime.cpu = -1;  // any
  CHECK_FALSE(
      timing_report({.scheduler = bench.scheduler, .conditions = &conditions})["thread"]["0"].contains(
          "cpu"));
  CHECK(t["environment"].is_object());
}
