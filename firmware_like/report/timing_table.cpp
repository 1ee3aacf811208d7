#include "firmware_like/report/timing_table.hpp"

#include "firmware_like/results/timing_report.hpp"

#include <fmt/format.h>

namespace moldloft::firmware_like {
namespace {

constexpr int name_width = 20;
constexpr int result_width = 28;  // as the table of a run's result has it

std::string figure(const Json& value) { return value.is_number() ? readable(value.get<double>()) : "-"; }

std::string text(const Json& j, const char* key) {
  return j.contains(key) && j.at(key).is_string() ? j.at(key).get<std::string>() : std::string{};
}

std::uint64_t number(const Json& j, const char* key) {
  return j.contains(key) && j.at(key).is_number() ? j.at(key).get<std::uint64_t>() : 0;
}

std::string histogram_head(std::string_view first) {
  std::string line = fmt::format("{:<{}}{:>9}{:>8}", first, name_width, "count", "min");
  for (const auto& p : percentiles) line += fmt::format("{:>9}", p.name);
  return line + fmt::format("{:>9}{:>8}{:>8}\n", "max", "mean", "stddev");
}

std::string histogram_row(std::string_view name, const Json& h) {
  if (!h.is_object() || number(h, "count") == 0) return fmt::format("{:<{}}not measured\n", name, name_width);
  std::string line =
      fmt::format("{:<{}}{:>9}{:>8}", name, name_width, number(h, "count"), figure(h.at("min_us")));
  for (const auto& p : percentiles) line += fmt::format("{:>9}", figure(h.at(p.key)));
  line += fmt::format("{:>9}{:>8}{:>8}\n", figure(h.at("max_us")), figure(h.at("avg_us")),
                      figure(h.at("stddev_us")));
  if (const auto beyond = number(h, "overflows"); beyond > 0)
    line += fmt::format("{:<{}}{} beyond 68 s\n", "", name_width, beyond);
  return line;
}

std::string histograms(const Json& t) {
  std::string s = histogram_head("us");
  s += histogram_row("wake-up latency", t.at("wake_up"));
  s += histogram_row("table", t.at("execution"));
  for (const auto& task : t.at("tasks")) s += histogram_row("  " + text(task, "name"), task.at("cost"));
  s += histogram_row("slack", t.at("slack"));
  for (const auto& task : t.at("background")) s += histogram_row("  " + text(task, "name"), task.at("cost"));
  s += histogram_row("pushed by background", t.at("pushed_by_background"));
  s += histogram_row("frame to command", t.at("frame_to_command"));
  s += histogram_row("data age", t.at("data_age"));
  if (!t.at("frame_to_command").is_object()) s += "(end to end is measured in runs with devices only)\n";
  return s;
}

std::string missed(const Json& t) {
  std::string s = fmt::format("{} of {}", number(t, "missed_ticks"), number(t, "ticks"));
  if (!t.contains("missed_by_cause") || number(t, "missed_ticks") == 0) return s;
  std::string_view before = ":";
  for (const auto& [cause, count] : t.at("missed_by_cause").items()) {
    s += fmt::format("{} {} {}", before, cause, count.get<std::uint64_t>());
    before = ",";
  }
  return s;
}

std::string first_misses(const Json& t) {
  if (t.at("first_misses").empty()) return "";
  constexpr auto columns = "{:>11}{:>6}  {:<11}{:>11}{:>12}{:>14}{}\n";
  std::string s = fmt::format(columns, "at, s", "lost", "cause", "late, us", "took, us", "computed, us",
                              "  longest task");
  for (const auto& m : t.at("first_misses"))
    s += fmt::format(columns, moment_s(m, "t_ms"), number(m, "lost"), text(m, "cause"),
                     figure(m.at("late_us")), figure(m.at("tick_took_us")),
                     figure(m.at("of_that_on_the_processor_us")),
                     text(m, "task") == "none" ? "" : "  " + text(m, "task"));
  return s;
}

// Parts that are separated by "; " begin lines of their own below the first, so that the terminal breaks none.
std::string in_lines(std::string value, int indent) {
  const std::string separator = ";\n" + std::string(static_cast<std::size_t>(indent), ' ');
  for (auto at = value.find("; "); at != value.npos; at = value.find("; ", at + separator.size()))
    value.replace(at, 2, separator);
  return value;
}

std::string load(const Json& t) {
  if (!t.contains("load") || !t.at("load").is_object()) return "not measured";
  const auto percent = [&](const char* key) { return 100 * t.at("load").at(key).get<double>(); };
  return fmt::format("table {:.1f} %, background {:.1f} %, idle {:.1f} %", percent("table"),
                     percent("background"), percent("idle"));
}

std::string latest_wake_up(const Json& t) {
  if (number(t.at("wake_up"), "count") == 0) return "not measured";
  return fmt::format("{} us late, at {} s", figure(t.at("wake_up").at("max_us")),
                     moment_s(t, "latest_wake_up_at_ms"));
}

std::string task_counts(const Json& t) {
  constexpr auto columns = "{:<{}}{:>9}{:>8}{:>13}{:>14}{:>10}{:>15}\n";
  std::string s = fmt::format(columns, "tasks", name_width, "runs", "slips", "late starts", "lateness, us",
                              "overruns", "longest at, s");
  for (const auto& task : t.at("tasks"))
    s += fmt::format(columns, "  " + text(task, "name"), name_width, number(task, "runs"),
                     number(task, "slips"), number(task, "late_starts"), figure(task.at("lateness_us")),
                     number(task, "overruns"), moment_s(task, "longest_at_ms"));
  s += fmt::format(columns, "background", name_width, "runs", "forced", "refused", "", "overruns",
                   "longest at, s");
  for (const auto& task : t.at("background"))
    s += fmt::format(columns, "  " + text(task, "name"), name_width, number(task, "runs"),
                     number(task, "forced"), number(task, "refused"), "", number(task, "overruns"),
                     moment_s(task, "longest_at_ms"));
  return s;
}

std::string budgets(const Json& t) {
  if (!t.contains("budgets")) return "";
  const Json& b = t.at("budgets");
  std::string s = fmt::format("{:<{}}{:>9}{:>10}{:>10}{:>10}   {}\n", "budgets, us", name_width, "p99.9",
                              "max", "declared", "suggested", "judged");
  const auto rows = [&](const char* key) {
    if (!b.contains(key)) return;
    for (const auto& row : b.at(key))
      s += fmt::format("{:<{}}{:>9}{:>10}{:>10}{:>10}   {}\n", "  " + text(row, "name"), name_width,
                       figure(row.at("p999_us")), figure(row.at("max_us")), figure(row.at("declared_us")),
                       figure(row.at("suggested_us")), text(row, "judged"));
  };
  rows("tasks");
  rows("background");
  s += fmt::format("  busiest tick {} us declared, {} us suggested, of {} us with {} us guard{}\n",
                   figure(b.at("busiest_tick_us")), figure(b.at("busiest_tick_suggested_us")),
                   figure(t.at("tick_us")), figure(b.at("guard_us")),
                   b.at("suggested_fits_the_tick").get<bool>() ? "" : ": the suggested DO NOT FIT");
  return s + "  suggested: " + in_lines(text(b, "rule"), 13) + "\n";
}

std::string line(std::string_view name, int width, const std::string& value) {
  return fmt::format("{:<{}}{}\n", name, width, value);
}

// A tick costs one voluntary switch: the sleep to the next.
std::string system_counts(const Json& t) {
  if (!t.contains("control_thread")) return "";
  const Json& c = t.at("control_thread");
  return line("control thread", name_width,
              fmt::format("{} page faults, {} times preempted, {} moves to another processor, in {} ticks",
                          number(c, "minor_faults") + number(c, "major_faults"),
                          number(c, "involuntary_switches"), number(c, "migrations"), number(c, "ticks")));
}

std::string losses(const Json& t) {
  if (!t.contains("losses")) return "";
  const std::string lost = losses_line(t);
  std::string s = line("lost on the way", name_width, lost.empty() ? "nothing" : lost);
  if (const auto left_out = number(t, "dumps_too_soon"); left_out > 0)
    s += line("flight recorder", name_width,
              fmt::format("dumps left out, too soon after another: {}", left_out));
  return s;
}

std::string verdict(const Json& t) {
  const bool yes = t.contains("representative") && t.at("representative").get<bool>();
  return yes ? std::string{"yes"} : "NO: " + text(t, "why");
}

std::string comparison(const Json& t) {
  if (!t.contains("compared")) return "";
  const Json& c = t.at("compared");
  std::string s = histogram_head("wake-up latency, us");
  s += histogram_row("ours", c.at("ours")) + histogram_row("cyclictest", c.at("cyclictest"));
  std::string line = fmt::format("{:<{}}{:>9}{:>8}", "ratio", name_width, "", "");
  for (const auto& p : percentiles) line += fmt::format("{:>9}", figure(c.at(ratio_key(p))));
  return s + line + fmt::format("{:>9}\n", figure(c.at(ratio_of_maxima))) + "(" + text(c, "how") + ")\n\n";
}

}  // namespace

std::string timing_table(const Json& t) {
  return comparison(t) + histograms(t) + "\n" + line("missed ticks", name_width, missed(t)) +
         first_misses(t) + line("latest wake-up", name_width, latest_wake_up(t)) +
         line("load", name_width, load(t)) + system_counts(t) + losses(t) + "\n" + task_counts(t) + "\n" +
         budgets(t) + "\n" + line("representative", name_width, in_lines(verdict(t), name_width));
}

std::string timing_lines(const Json& t) {
  const Json& w = t.at("wake_up");
  std::string s;
  if (number(w, "count") > 0)
    s += line("wake-up latency, us", result_width,
              fmt::format("p50 {}, p99 {}, p99.9 {}, max {}", figure(w.at("p50_us")), figure(w.at("p99_us")),
                          figure(w.at("p999_us")), figure(w.at("max_us"))));
  const std::string lost = losses_line(t);
  return s + line("missed ticks", result_width, missed(t)) + line("load", result_width, load(t)) +
         (lost.empty() ? "" : line("lost on the way", result_width, lost)) +
         line("timing representative", result_width, verdict(t));
}

std::string missed_ticks_line(const Json& t) {
  if (number(t, "missed_ticks") == 0) return "";
  std::string causes;
  for (const auto& [cause, count] : t.at("missed_by_cause").items())
    if (const auto n = count.get<std::uint64_t>(); n > 0)
      causes += fmt::format("{}{} {}", causes.empty() ? "" : ", ", cause, n);
  std::string s =
      fmt::format("{} of {} ticks were missed: {}", number(t, "missed_ticks"), number(t, "ticks"), causes);
  if (t.at("first_misses").empty()) return s;
  const Json& first = t.at("first_misses").front();
  s += fmt::format("; the first at {} s, {} us late", moment_s(first, "t_ms"), figure(first.at("late_us")));
  if (const std::string task = text(first, "task"); task != "none") s += fmt::format(", after '{}'", task);
  return s;
}

std::string losses_line(const Json& t) {
  if (!t.contains("losses")) return "";
  std::string s, of;
  for (const auto& loss : t.at("losses")) {
    if (number(loss, "count") == 0) continue;
    const std::string whose = text(loss, "of");
    s += whose == of ? ", " : fmt::format("{}{}: ", s.empty() ? "" : "; ", whose);
    s += fmt::format("{} {}", text(loss, "what"), number(loss, "count"));
    of = whose;
  }
  return s;
}

}  // namespace moldloft::firmware_like
