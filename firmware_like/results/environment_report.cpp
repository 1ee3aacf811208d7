#include "firmware_like/results/environment_report.hpp"

#include <fmt/format.h>

namespace moldloft::firmware_like {
namespace {

Json or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

std::string or_word(const std::string& text, std::string_view word) {
  return text.empty() ? std::string{word} : text;
}

std::string throttling(const Environment& e) {
  if (!e.rt_runtime_us || !e.rt_period_us) return "unknown";
  if (*e.rt_runtime_us < 0) return "off";
  return fmt::format("{} of {} us", *e.rt_runtime_us, *e.rt_period_us);
}

std::string lockable(const std::string& limit) {
  const bool is_number = !limit.empty() && limit.front() >= '0' && limit.front() <= '9';
  return is_number ? limit + " bytes" : or_word(limit, "unknown");
}

}  // namespace

Json environment_json(const Environment& e) {
  Json j;
  j["sysinfo"] = {{"sysname", e.sysname}, {"nodename", e.nodename}, {"release", e.release},
                  {"version", e.version}, {"machine", e.machine},   {"realtime", e.realtime ? 1 : 0}};
  j["realtime_found_by"] = or_null(e.realtime_found_by);
  j["virtual_machine"] = e.virtual_machine;
  j["virtual_found_by"] = or_null(e.virtual_found_by);
  j["cpu_model"] = or_null(e.cpu_model);
  j["cpus"] = e.cpus;
  j["cpus_online"] = or_null(e.cpus_online);
  j["smt_active"] = or_null(e.smt_active);
  j["governor"] = or_null(e.governor);
  j["isolated"] = e.isolated;
  j["nohz_full"] = e.nohz_full;
  j["irq_affinity"] = or_null(e.irq_affinity);
  j["rt_runtime_us"] = or_null(e.rt_runtime_us);
  j["rt_period_us"] = or_null(e.rt_period_us);
  j["clock_source"] = or_null(e.clock_source);
  j["memlock_limit_bytes"] = or_null(e.memlock_limit);
  j["rtprio_limit"] = or_null(e.rtprio_limit);
  return j;
}

Json setup_json(const SetupRows& rows) {
  Json all = Json::array();
  for (const auto& row : rows) {
    all.push_back({{"what", std::string{to_string(row.item)}},
                   {"wanted", row.wanted},
                   {"got", row.got},
                   {"ok", row.ok},
                   {"real_time", row.real_time},
                   {"hint", row.hint}});
  }
  return all;
}

Json counts_json(const ThreadCounts& c) {
  return {{"ticks", c.ticks},
          {"minor_faults", c.minor_faults},
          {"major_faults", c.major_faults},
          {"voluntary_switches", c.voluntary_switches},
          {"involuntary_switches", c.involuntary_switches},
          {"migrations", c.migrations},
          {"suspensions", c.suspensions}};
}

void put_conditions(Json& report, const RunConditions* conditions) {
  if (conditions == nullptr) {
    report["representative"] = false;
    report["why"] = "virtual time";
    return;
  }
  const Verdict verdict = verdict_on(conditions->environment, conditions->setup, conditions->realtime);
  report["environment"] = environment_json(conditions->environment);
  report["setup"] = setup_json(conditions->setup);
  report["control_thread"] = counts_json(conditions->control_thread);
  report["unsaid_lines"] = conditions->unsaid_lines;
  report["representative"] = verdict.representative;
  report["why"] = verdict.why();
}

std::string conditions_text(const RunConditions& c) {
  const Environment& e = c.environment;
  std::string t;
  const auto row = [&](std::string_view name, const std::string& value) {
    t += fmt::format("{:<20}{}\n", name, value);
  };
  row("kernel", fmt::format("{} {}, {}", e.release, e.version,
                            e.realtime ? "PREEMPT_RT by " + e.realtime_found_by : "not PREEMPT_RT"));
  row("processors", fmt::format("{} x {}{}", e.cpus, or_word(e.cpu_model, "unknown"),
                                e.virtual_machine ? ", virtual machine by " + e.virtual_found_by : ""));
  row("", fmt::format("isolated {}, nohz_full {}, SMT {}, governor {}", or_word(e.isolated, "none"),
                      or_word(e.nohz_full, "none"),
                      !e.smt_active   ? "unknown"
                      : *e.smt_active ? "on"
                                      : "off",
                      or_word(e.governor, "none")));
  row("clock", fmt::format("{}; real-time throttling {}", or_word(e.clock_source, "unknown"), throttling(e)));
  row("limits",
      fmt::format("memlock {}, rtprio {}", lockable(e.memlock_limit), or_word(e.rtprio_limit, "unknown")));
  for (const auto& s : c.setup)
    row(to_string(s.item), s.ok ? s.got : fmt::format("{}, wanted {}: {}", s.got, s.wanted, s.hint));
  return t;
}

}  // namespace moldloft::firmware_like
