#include "firmware_like/results/timing_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace moldloft::firmware_like {
namespace {

using tasks::Histogram;
using namespace std::chrono_literals;

// Written once in every report: an allowance well beyond this is slack that a table could give away.
constexpr int generous = 4;

double millis(hal::Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }
double rounded(double value) { return std::round(value * 1e6) / 1e6; }

// The wake-up latency as cyclictest writes it: whole microseconds, truncated.
Json cyclictest_thread(const Histogram& h, const RunConditions* conditions) {
  std::vector<std::pair<std::int64_t, std::uint64_t>> whole;
  for (std::size_t i = 0; i < Histogram::size(); ++i) {
    if (h.in_bucket(i) == 0) continue;
    const auto us = (Histogram::lower_limit(i) + Histogram::upper_limit(i)) / 2 / 1us;
    if (whole.empty() || whole.back().first != us) whole.emplace_back(us, 0);
    whole.back().second += h.in_bucket(i);
  }
  Json j;
  j["histogram"] = Json::object();
  for (const auto& [us, count] : whole) j["histogram"][std::to_string(us)] = count;
  j["cycles"] = h.count();
  j["min"] = h.min() / 1us;
  j["max"] = h.max() / 1us;
  j["avg"] = micros(h.mean());
  if (conditions == nullptr) return j;
  if (conditions->realtime.cpu >= 0) j["cpu"] = conditions->realtime.cpu;
  j["priority"] = conditions->realtime.priority;
  return j;
}

void put_cyclictest_names(Json& j, const TimedRun& run) {
  j["file_version"] = 1;
  j["test_name"] = "moldloft";
  j["return_code"] = 0;
  if (run.conditions != nullptr) j["sysinfo"] = environment_json(run.conditions->environment)["sysinfo"];
  j["num_threads"] = 1;
  j["resolution_in_ns"] = 0;  // the histogram's buckets are microseconds
  j["thread"]["0"] = cyclictest_thread(run.scheduler.wake_up(), run.conditions);
}

void put_misses(Json& j, const tasks::Scheduler& s) {
  j["missed_ticks"] = s.missed_ticks();
  j["missed_by_cause"] = Json::object();
  for (const auto cause :
       {tasks::MissCause::woken_late, tasks::MissCause::preempted, tasks::MissCause::computing})
    j["missed_by_cause"][std::string{tasks::to_string(cause)}] = s.missed_by(cause);
  j["first_misses"] = Json::array();
  for (const auto& m : s.first_misses())
    j["first_misses"].push_back({{"tick", m.tick},
                                 {"t_ms", millis(m.at)},
                                 {"lost", m.lost},
                                 {"cause", std::string{tasks::to_string(m.cause)}},
                                 {"task", std::string{s.name_of(m.task)}},
                                 {"late_us", micros(m.late)},
                                 {"tick_took_us", micros(m.wall)},
                                 {"of_that_on_the_processor_us", micros(m.spent)}});
}

// When the longest of what the histogram counts began.
Json millis_of_longest(const Histogram& h, hal::Instant at) {
  return h.empty() ? Json(nullptr) : Json(millis(at));
}

double total_ns(const Histogram& h) {
  return static_cast<double>(h.mean().count()) * static_cast<double>(h.count());
}

// Of the time from the first counted tick to the last.
void put_load(Json& j, const tasks::Scheduler& s) {
  const double ticks = static_cast<double>(s.execution().count());
  if (ticks == 0) {
    j["load"] = nullptr;
    return;
  }
  const double all = ticks * static_cast<double>(s.settings().tick.count());
  double background = 0;
  for (const auto& b : s.background()) background += total_ns(b.cost);
  const double table = total_ns(s.execution()) / all;
  background /= all;
  j["load"] = {{"table", rounded(table)},
               {"background", rounded(background)},
               {"idle", rounded(std::max(0.0, 1 - table - background))}};
}

std::string_view judged(hal::Duration declared, const std::optional<hal::Duration>& suggested) {
  if (!suggested) return "too few runs";
  if (declared < *suggested) return "too small";
  return declared > generous * *suggested ? "generous" : "fits";
}

Json budget_row(std::string_view name, const Histogram& cost, hal::Duration declared, bool representative) {
  const auto suggested = suggested_budget(cost, representative);
  return {{"name", std::string{name}},
          {"runs", cost.count()},
          {"p999_us", cost.empty() ? Json(nullptr) : Json(micros(cost.percentile(0.999)))},
          {"max_us", cost.empty() ? Json(nullptr) : Json(micros(cost.max()))},
          {"declared_us", micros(declared)},
          {"suggested_us", suggested ? Json(micros(*suggested)) : Json(nullptr)},
          {"judged", std::string{judged(declared, suggested)}}};
}

// The table as it would be with the budgets suggested; those that nothing is suggested for stay as declared.
void put_budgets(Json& report, const tasks::Scheduler& s, bool representative) {
  Json j = {{"rule", std::string{budget_rule}}};
  std::vector<tasks::TaskSpec> declared, suggested;
  for (const auto& t : s.tasks()) {
    j["tasks"].push_back(budget_row(t.spec.name, t.cost, t.spec.budget, representative));
    declared.push_back(t.spec);
    suggested.push_back(t.spec);
    suggested.back().budget = suggested_budget(t.cost, representative).value_or(t.spec.budget);
  }
  for (const auto& b : s.background())
    j["background"].push_back(budget_row(b.spec.name, b.cost, b.spec.quantum, representative));
  j["busiest_tick_us"] = micros(tasks::busiest_tick(declared));
  j["busiest_tick_suggested_us"] = micros(tasks::busiest_tick(suggested));
  j["guard_us"] = micros(s.settings().guard);
  j["suggested_fits_the_tick"] = !tasks::check_table(suggested, s.settings().tick, s.settings().guard);
  report["budgets"] = j;
}

// How fast the sensor's clock runs against ours, once enough frames have told.
void put_scanner_clock(Json& j, const tasks::Cell& cell) {
  const auto drift = cell.scanner_clock().estimate();
  if (!drift) return;
  j["scanner_clock"] = {{"drift_ppm", drift->ppm},
                        {"sigma_ppm", drift->sigma_ppm},
                        {"scatter_us", drift->scatter_us},
                        {"readings", drift->pairs}};
}

// All counts, the zeros too: a reader sees what is watched.
void put_losses(Json& j, const TimedRun& run) {
  if (run.losses.empty()) return;
  j["losses"] = Json::array();
  for (const auto& [of, counts] : run.losses) {
    for (const auto& [what, count] : counts)
      j["losses"].push_back({{"of", std::string{of}}, {"what", std::string{what}}, {"count", count}});
  }
  j["dumps_too_soon"] = run.dumps_too_soon;
}

void put_tasks(Json& j, const tasks::Scheduler& s) {
  j["tasks"] = Json::array();
  for (const auto& t : s.tasks()) {
    j["tasks"].push_back({{"name", std::string{t.spec.name}},
                          {"period_ticks", t.spec.period_ticks},
                          {"budget_us", micros(t.spec.budget)},
                          {"runs", t.runs},
                          {"slips", t.slips},
                          {"late_starts", t.late_starts},
                          {"lateness_us", micros(t.lateness)},
                          {"overruns", t.overruns},
                          {"longest_at_ms", millis_of_longest(t.cost, t.longest_at)},
                          {"cost", histogram_json(t.cost)}});
  }
  j["background"] = Json::array();
  for (const auto& t : s.background()) {
    j["background"].push_back({{"name", std::string{t.spec.name}},
                               {"quantum_us", micros(t.spec.quantum)},
                               {"runs", t.runs},
                               {"refused", t.refused},
                               {"forced", t.forced},
                               {"overruns", t.overruns},
                               {"longest_at_ms", millis_of_longest(t.cost, t.longest_at)},
                               {"cost", histogram_json(t.cost)}});
  }
}

}  // namespace

std::string readable(double v) { return fmt::format("{:.{}f}", v, v < 10 ? 2 : v < 100 ? 1 : 0); }

std::string moment_s(const Json& j, const char* key) {
  const bool known = j.contains(key) && j.at(key).is_number();
  return known ? fmt::format("{:.3f}", j.at(key).get<double>() / 1000) : "-";
}

std::string ratio_key(const Percentile& p) {
  const std::string_view key = p.key;
  return "ratio_" + std::string{key.substr(0, key.size() - std::string_view{"_us"}.size())};
}

double micros(hal::Duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

Json histogram_json(const Histogram& h) {
  const auto figure = [&](hal::Duration d) { return h.empty() ? Json(nullptr) : Json(micros(d)); };
  Json j = {{"count", h.count()}, {"min_us", figure(h.min())}, {"avg_us", figure(h.mean())}};
  j["stddev_us"] = h.count() < 2 ? Json(nullptr) : Json(micros(h.standard_deviation()));
  for (const auto& p : percentiles) j[p.key] = figure(h.percentile(p.fraction));
  j["max_us"] = figure(h.max());
  j["overflows"] = h.overflows();
  j["buckets_ns"] = Json::object();
  for (std::size_t i = 0; i < Histogram::size(); ++i) {
    if (h.in_bucket(i) > 0)
      j["buckets_ns"][std::to_string(Histogram::lower_limit(i).count())] = h.in_bucket(i);
  }
  return j;
}

Histogram histogram_from(const Json& j) {
  Histogram h;
  if (!j.is_object() || !j.contains("buckets_ns")) return h;
  for (const auto& [lower_ns, count] : j["buckets_ns"].items()) {
    for (auto n = count.get<std::uint64_t>(); n > 0; --n) h.add(hal::Duration{std::stoll(lower_ns)});
  }
  return h;
}

std::optional<hal::Duration> suggested_budget(const Histogram& cost, bool representative) {
  if (cost.count() < runs_for_a_budget) return std::nullopt;
  const auto usual = cost.percentile(0.999) * 3 / 2;
  const auto needed = representative ? std::max(usual, cost.max()) : usual;
  constexpr hal::Duration step = 10us;
  return std::max((needed + step - 1ns) / step * step, step);
}

Json timing_report(const TimedRun& run) {
  const auto& s = run.scheduler;
  Json j;
  j["schema"] = 1;
  put_cyclictest_names(j, run);
  put_conditions(j, run.conditions);
  j["tick_us"] = micros(s.settings().tick);
  j["ticks"] = s.ticks();
  put_misses(j, s);
  j["wake_up"] = histogram_json(s.wake_up());
  j["latest_wake_up_at_ms"] = millis_of_longest(s.wake_up(), s.latest_wake_up());
  j["execution"] = histogram_json(s.execution());
  j["slack"] = histogram_json(s.slack());
  j["pushed_by_background"] = histogram_json(s.pushed());
  j["frame_to_command"] = run.cell == nullptr ? Json(nullptr) : histogram_json(run.cell->frame_to_command());
  j["data_age"] = run.cell == nullptr ? Json(nullptr) : histogram_json(run.cell->data_age());
  if (run.cell != nullptr) put_scanner_clock(j, *run.cell);
  put_losses(j, run);
  put_load(j, s);
  put_tasks(j, s);
  put_budgets(j, s, j["representative"].get<bool>());
  return j;
}

}  // namespace moldloft::firmware_like
