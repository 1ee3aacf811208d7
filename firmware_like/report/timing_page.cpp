#include "firmware_like/report/timing_page.hpp"

#include "firmware_like/process/markup.hpp"
#include "firmware_like/report/log_plot.hpp"
#include "firmware_like/results/timing_report.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace moldloft::firmware_like {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view style = R"(
:root{color-scheme:light dark;--paper:#fff;--ink:#1c2430;--soft:#5b6675;--line:#d8dde4;--fine:#eef1f4;
--ours:#1f6fb2;--theirs:#c2571a;--good:#1d7a46;--bad:#b3261e;--panel:#f6f8fa}
@media (prefers-color-scheme:dark){:root{--paper:#14181d;--ink:#e4e9ef;--soft:#9aa6b4;--line:#39424d;--fine:#222931;
--ours:#5aa9e6;--theirs:#f0955a;--good:#5cc48a;--bad:#ff8a80;--panel:#1b2128}}
body{margin:0;background:var(--paper);color:var(--ink);font:15px/1.45 system-ui,"Segoe UI",sans-serif}
main{max-width:960px;margin:0 auto;padding:24px 20px 48px}
h1{font-size:24px;margin:0 0 4px}h2{font-size:17px;margin:34px 0 6px}p{margin:4px 0 10px}
.soft{color:var(--soft)}.verdict{border-left:5px solid;padding:8px 14px;margin:14px 0;background:var(--panel)}
.yes{border-color:var(--good)}.no{border-color:var(--bad)}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(130px,1fr));gap:10px;margin:16px 0}
.tile{display:flex;flex-direction:column;justify-content:space-between;
background:var(--panel);border:1px solid var(--line);border-radius:6px;padding:8px 12px}
.tile b{display:block;font-size:21px;font-variant-numeric:tabular-nums;white-space:nowrap}
.wide{overflow-x:auto}.wide+.wide{margin-top:14px}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums;font-size:14px}
th,td{padding:3px 8px;border-bottom:1px solid var(--line);text-align:right;white-space:nowrap}
th{color:var(--soft);font-weight:600}th:first-child,td:first-child,.words td,.words th,th.word,td.word{text-align:left}
.words td{white-space:normal;vertical-align:top}.words td:first-child{white-space:nowrap}
.bad{color:var(--bad);font-weight:600}.good{color:var(--good)}
svg,img{width:100%;height:auto;display:block}figure{margin:14px 0}
figure img{border-radius:6px;max-width:620px;margin:auto}.grid{stroke:var(--line)}.fine{stroke:var(--fine)}
.tick{fill:var(--soft);font:12px system-ui,"Segoe UI",sans-serif}
.s0{fill:var(--ours);fill-opacity:.35;stroke:var(--ours);stroke-width:1.4}
.s1{fill:none;stroke:var(--theirs);stroke-width:1.8}
.slim{display:none}
@media screen and (max-width:640px){.slim{display:block}.broad{display:none}main{padding:16px 12px 32px}
table{font-size:12px}th,td{padding:3px 4px}th,td:first-child,td.word,.words td:first-child{white-space:normal}
.words td:not(:first-child){overflow-wrap:anywhere}.budgets :is(th,td):nth-child(2){display:none}
.tasks :is(th,td):is(:nth-child(2),:nth-child(6)){display:none}
.stats :is(th,td):is(:nth-child(3),:nth-child(7),:nth-child(9),:nth-child(10)){display:none}}
@page{size:A4;margin:14mm}
@media print{:root{--paper:#fff;--ink:#000;--soft:#444;--line:#bbb;--fine:#e6e6e6;--ours:#1f6fb2;--theirs:#c2571a;
--good:#1d7a46;--bad:#b3261e;--panel:#fff}body{font-size:10pt}main{max-width:none;padding:0}
.tiles{grid-template-columns:repeat(3,1fr)}section{break-inside:avoid}
h2{margin-top:22px;break-after:avoid}tr{break-inside:avoid}.wide{overflow:visible}table{font-size:8.5pt}
th,td{padding:2px 4px}th,.words td,.words td:first-child{white-space:normal}.words td{overflow-wrap:anywhere}
.s0,.tile,.verdict{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
)";

std::string figure(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_string()) return value.get<std::string>().empty() ? "none" : escaped(value.get<std::string>());
  if (value.is_number_integer()) return fmt::format("{}", value.get<std::int64_t>());
  return readable(value.get<double>());
}

std::string figure(const Json& j, const char* key) {
  return j.is_object() && j.contains(key) ? figure(j.at(key)) : "-";
}

bool measured(const Json& t, const char* key) {
  return t.contains(key) && t.at(key).is_object() && t.at(key).value("count", std::uint64_t{0}) > 0;
}

struct Cell {
  std::string text, mark = {};
};

std::string row(const std::vector<Cell>& cells, const char* tag = "td") {
  std::string html = "<tr>";
  for (const auto& cell : cells)
    html += cell.mark.empty() ? fmt::format("<{0}>{1}</{0}>", tag, cell.text)
                              : fmt::format("<{0} class=\"{2}\">{1}</{0}>", tag, cell.text, cell.mark);
  return html + "</tr>\n";
}

std::string table(const std::vector<Cell>& head, const std::string& rows, std::string_view kind = "") {
  return fmt::format(
      "<div class=\"wide\"><table class=\"{}\">\n<thead>{}</thead>\n<tbody>\n{}</tbody></table></div>\n",
      kind, row(head, "th"), rows);
}

std::string section(std::string_view title, std::string_view lead, const std::string& body) {
  return fmt::format("<section>\n<h2>{}</h2>\n<p class=\"soft\">{}</p>\n{}</section>\n", title, lead, body);
}

// Twice: for a page and for a telephone, where the same drawing would be too small to read.
std::string plot_in_both_widths(LogPlot plot) {
  const std::string broad = log_plot(plot);
  plot.width_px = 376;
  plot.height_px = 240;
  return fmt::format("<div class=\"broad\">{}</div>\n<div class=\"slim\">{}</div>\n", broad, log_plot(plot));
}

// The table of statistics keeps its most telling columns on a telephone.
std::string statistics(const std::vector<Cell>& head, const std::string& rows) {
  return table(head, rows, "stats") +
         "<p class=\"slim soft\">In part: a wider window shows min, p99.99, mean and deviation as "
         "well.</p>\n";
}

std::string tile(std::string_view name, const std::string& value, std::string_view mark = "") {
  return fmt::format("<div class=\"tile\"><span class=\"soft\">{}</span><b class=\"{}\">{}</b></div>\n", name,
                     mark, value);
}

std::string in_us(const Json& h, const char* key) {
  return h.is_object() && h.contains(key) && h.at(key).is_number() ? figure(h.at(key)) + " us" : "-";
}

std::string head(const Json& t, std::string_view title, std::string_view about, std::string_view first) {
  const bool yes = t.value("representative", false);
  std::string html = fmt::format("<h1>{}</h1>\n", escaped(title));
  if (!about.empty()) html += fmt::format("<p class=\"soft\">{}</p>\n", escaped(about));
  html += first;
  if (!first.empty()) html += "<h2 id=\"timing\">Timing</h2>\n";
  html += fmt::format("<p class=\"soft\">{} ticks of {} us</p>\n", figure(t, "ticks"), figure(t, "tick_us"));
  html += yes ? std::string{"<div class=\"verdict yes\"><b>Representative.</b> The machine was set up as it is meant "
                            "to be; the figures say what this cell does.</div>\n"}
              : fmt::format("<div class=\"verdict no\"><b>Not representative:</b> {}.</div>\n",
                            escaped(t.value("why", "no reason is given")));
  const auto missed = t.value("missed_ticks", std::uint64_t{0});
  html += "<div class=\"tiles\">\n" +
          tile("missed ticks", fmt::format("{}", missed), missed > 0 ? "bad" : "good");
  if (measured(t, "wake_up"))
    html += tile("wake-up p99", in_us(t.at("wake_up"), "p99_us")) +
            tile("wake-up p99.9", in_us(t.at("wake_up"), "p999_us")) +
            tile("wake-up max", in_us(t.at("wake_up"), "max_us"));
  if (measured(t, "frame_to_command"))
    html += tile("frame to command p99.9", in_us(t.at("frame_to_command"), "p999_us"));
  if (t.contains("load") && t.at("load").is_object())
    html += tile("processor idle", fmt::format("{:.0f} %", 100 * t.at("load").at("idle").get<double>()));
  return html + "</div>\n";
}

std::vector<Cell> histogram_head(std::string_view first) {
  std::vector<Cell> cells = {{std::string{first}}, {"count"}, {"min"}};
  for (const auto& p : percentiles) cells.push_back({p.name});
  for (const char* name : {"max", "mean", "std. dev."}) cells.push_back({name});
  return cells;
}

std::string histogram_row(std::string_view name, const Json& h) {
  std::vector<Cell> cells = {{escaped(name)}, {figure(h, "count")}, {figure(h, "min_us")}};
  for (const auto& p : percentiles) cells.push_back({figure(h, p.key)});
  for (const char* key : {"max_us", "avg_us", "stddev_us"}) cells.push_back({figure(h, key)});
  return row(cells);
}

std::string wake_up(const Json& t) {
  if (t.contains("compared")) {
    const Json& c = t.at("compared");
    std::string body =
        plot_in_both_widths({.series = {{"ours, with fit and recorder busy", histogram_from(c.at("ours"))},
                                        {"cyclictest, alone", histogram_from(c.at("cyclictest"))}},
                             .label = "wake-up latency",
                             .whole_us = true});
    std::vector<Cell> ratio = {{"ratio"}, {""}, {""}};
    for (const auto& p : percentiles) {
      const std::string key = p.key;
      ratio.push_back({figure(c, ratio_key(p).c_str())});
    }
    for (const auto& text : {figure(c, ratio_of_maxima), std::string{}, std::string{}})
      ratio.push_back({text});
    body +=
        statistics(histogram_head("us"), histogram_row("ours", c.at("ours")) +
                                             histogram_row("cyclictest", c.at("cyclictest")) + row(ratio));
    return section(
        "How late a tick begins",
        "From the time at which a tick is due to the moment at which the control thread runs. Both were "
        "measured in turns on the same machine: " +
            escaped(c.value("how", "")) + ".",
        body);
  }
  if (!measured(t, "wake_up")) return "";
  return section(
      "How late a tick begins",
      fmt::format("From the time at which a tick is due to the moment at which the control thread runs. The "
                  "latest came at {} s.",
                  moment_s(t, "latest_wake_up_at_ms")),
      plot_in_both_widths(
          {.series = {{"ours", histogram_from(t.at("wake_up"))}}, .label = "wake-up latency"}));
}

std::string plot_of(const Json& t, const char* key, std::string_view title, std::string_view lead,
                    std::string_view label, hal::Duration smallest) {
  if (!measured(t, key)) return "";
  return section(
      title, lead,
      plot_in_both_widths(
          {.series = {{"", histogram_from(t.at(key))}}, .label = std::string{label}, .smallest = smallest}));
}

std::string distributions(const Json& t) {
  std::string rows;
  const auto add = [&](std::string_view name, const char* key) {
    if (measured(t, key)) rows += histogram_row(name, t.at(key));
  };
  add("wake-up latency", "wake_up");
  add("the whole table", "execution");
  for (const auto& task : t.at("tasks"))
    rows += histogram_row("- " + task.at("name").get<std::string>(), task.at("cost"));
  add("slack", "slack");
  for (const auto& task : t.at("background"))
    rows += histogram_row("- " + task.at("name").get<std::string>(), task.at("cost"));
  add("pushed by background", "pushed_by_background");
  add("frame to command", "frame_to_command");
  add("data age", "data_age");
  std::string lead =
      "Microseconds. The table runs at the beginning of a tick, background work in the slack that it leaves.";
  if (!measured(t, "frame_to_command")) {
    const bool has_devices = t.contains("frame_to_command") && t.at("frame_to_command").is_object();
    lead += has_devices ? " No frame has led to a command in this run."
                        : " From frame to command is measured in runs with devices only.";
  }
  return section("Everything that was timed", lead, statistics(histogram_head(""), rows));
}

Cell count_cell(const Json& j, const char* key) {
  return {figure(j, key), j.value(key, std::uint64_t{0}) > 0 ? "bad" : ""};
}

std::string tasks_section(const Json& t) {
  std::string rows, background;
  for (const auto& task : t.at("tasks"))
    rows += row({{escaped(task.at("name").get<std::string>())},
                 {figure(task, "period_ticks")},
                 {figure(task, "runs")},
                 count_cell(task, "slips"),
                 count_cell(task, "late_starts"),
                 {figure(task, "lateness_us")},
                 count_cell(task, "overruns"),
                 {moment_s(task, "longest_at_ms")}});
  for (const auto& task : t.at("background"))
    background += row({{escaped(task.at("name").get<std::string>())},
                       {figure(task, "runs")},
                       {figure(task, "refused")},
                       {figure(task, "forced")},
                       {figure(task, "overruns")},
                       {moment_s(task, "longest_at_ms")}});
  return section(
      "Tasks",
      "A slip is a run that fell into a missed tick; a late start began after the budgets of the tasks "
      "before it, lateness counts all of them together; an overrun took longer than its budget. Refused: a "
      "tick whose slack was too short. Longest "
      "at: when the longest run began, on the clock of the events and of the flight recorder.",
      table({{"task"},
             {"every n ticks"},
             {"runs"},
             {"slips"},
             {"late starts"},
             {"lateness, us"},
             {"overruns"},
             {"longest at, s"}},
            rows, "tasks") +
          "<p class=\"slim soft\">In part: a wider window shows period and lateness as well.</p>\n" +
          table(
              {{"background"}, {"steps"}, {"refused"}, {"forced"}, {"beyond the quantum"}, {"longest at, s"}},
              background));
}

std::string misses(const Json& t) {
  if (t.value("missed_ticks", std::uint64_t{0}) == 0) return section("Missed ticks", "None.", "");
  std::string lead = fmt::format("{} in all", t.at("missed_ticks").get<std::uint64_t>());
  if (t.contains("missed_by_cause"))
    for (const auto& [cause, count] : t.at("missed_by_cause").items())
      lead += fmt::format(", {}: {}", escaped(cause), count.get<std::uint64_t>());
  std::string rows;
  for (const auto& m : t.at("first_misses"))
    rows += row({{moment_s(m, "t_ms")},
                 {figure(m, "lost")},
                 {figure(m, "cause"), "word"},
                 {figure(m, "late_us")},
                 {figure(m, "tick_took_us")},
                 {figure(m, "of_that_on_the_processor_us")},
                 {figure(m, "task"), "word"}});
  return section(
      "Missed ticks",
      lead +
          ". Woken late: the machine woke the thread late. Preempted: the thread was ready and had no "
          "processor. "
          "Computing: a task took too long. The first ones, of which the others may be the consequence:",
      table({{"at, s"},
             {"lost"},
             {"cause", "word"},
             {"late, us"},
             {"tick took, us"},
             {"on the processor, us"},
             {"longest task", "word"}},
            rows));
}

std::string budgets(const Json& t) {
  if (!t.contains("budgets")) return "";
  const Json& b = t.at("budgets");
  std::string rows;
  for (const char* kind : {"tasks", "background"}) {
    if (!b.contains(kind)) continue;
    for (const auto& r : b[kind]) {
      const auto judged = r.at("judged").get<std::string>();
      rows += row({{escaped(r.at("name").get<std::string>())},
                   {figure(r, "runs")},
                   {figure(r, "p999_us")},
                   {figure(r, "max_us")},
                   {figure(r, "declared_us")},
                   {figure(r, "suggested_us")},
                   {judged, judged == "too small" ? "word bad" : "word"}});
    }
  }
  return section(
      "Budgets",
      fmt::format("Suggested: {}. The busiest tick needs {} us as declared and {} us as suggested, of {} us "
                  "with {} us kept free{}.",
                  escaped(b.at("rule").get<std::string>()), figure(b, "busiest_tick_us"),
                  figure(b, "busiest_tick_suggested_us"), figure(t, "tick_us"), figure(b, "guard_us"),
                  b.value("suggested_fits_the_tick", true) ? "" : ": the suggested budgets do not fit"),
      table({{"us"}, {"runs"}, {"p99.9"}, {"max"}, {"declared"}, {"suggested"}, {"judged", "word"}}, rows,
            "budgets"));
}

std::string losses(const Json& t) {
  if (!t.contains("losses")) return "";
  std::string rows;
  for (const auto& loss : t.at("losses")) {
    const bool any = loss.at("count").get<std::uint64_t>() > 0;
    rows += row({{figure(loss, "of"), "word"},
                 {figure(loss, "what"), "word"},
                 {figure(loss, "count"), any ? "bad" : ""}});
  }
  std::string lead =
      "Counted since the program's start. All of it was asked for again: the result lacks nothing. "
      "Garbled lines and broken streams point to a cable or its earthing.";
  if (const auto left_out = t.value("dumps_too_soon", std::uint64_t{0}); left_out > 0)
    lead += fmt::format(" Dumps of the flight recorder left out, too soon after another: {}.", left_out);
  return section("Lost on the way", lead, table({{"whose", "word"}, {"what", "word"}, {"count"}}, rows));
}

// What the operating system did to the control thread after its first ticks.
std::string control_thread(const Json& t) {
  if (!t.contains("control_thread")) return "";
  const Json& c = t.at("control_thread");
  return section(
      "The control thread",
      "Counted by the kernel after the first ticks. A thread that only sleeps to its ticks gives the "
      "processor away once a tick. Moved: to another processor.",
      table({{"ticks"}, {"page faults"}, {"gave way"}, {"preempted"}, {"moved"}},
            row({{figure(c, "ticks")},
                 {fmt::format("{}", c.at("minor_faults").get<std::uint64_t>() +
                                        c.at("major_faults").get<std::uint64_t>())},
                 {figure(c, "voluntary_switches")},
                 {figure(c, "involuntary_switches")},
                 {figure(c, "migrations")}})));
}

std::string machine(const Json& t) {
  if (!t.contains("environment")) return "";
  std::string rows;
  for (const auto& [key, value] : t.at("environment").items()) {
    if (!value.is_object()) {
      rows += row({{escaped(key)}, {figure(value)}});
      continue;
    }
    for (const auto& [inner, text] : value.items()) rows += row({{escaped(inner)}, {figure(text)}});
  }
  const auto has_hint = [](const Json& s) { return !s.at("hint").get<std::string>().empty(); };
  const bool all_got = std::ranges::none_of(t.at("setup"), has_hint);
  std::string setup;
  for (const auto& s : t.at("setup")) {
    std::vector<Cell> cells = {{figure(s, "what")},
                               {figure(s, "wanted")},
                               {figure(s, "got"), s.at("ok").get<bool>() ? "good" : "bad"}};
    if (!all_got) cells.push_back({has_hint(s) ? figure(s, "hint") : ""});
    setup += row(cells);
  }
  std::vector<Cell> heads = {{"what"}, {"wanted"}, {"got"}};
  if (!all_got) heads.push_back({"how to get it"});
  return section("Process set-up", "Asked of the operating system, and what it gave when read back.",
                 table(heads, setup, "words")) +
         section("The machine", "As the kernel describes it.", table({{""}, {""}}, rows, "words"));
}

}  // namespace

std::string page_title(const std::filesystem::path& folder) {
  const auto path = folder.has_filename() ? folder : folder.parent_path();
  return "Timing of " + path.filename().string();
}

std::string timing_page(const Json& t, std::string_view title, std::string_view about,
                        std::string_view first) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n"
      "<style>{}</style>\n</head>\n<body>\n<main>\n",
      escaped(title), style);
  html += head(t, title, about, first) + wake_up(t);
  html += plot_of(t, "execution", "What the table takes", "All tasks of a tick together.",
                  "execution of the table", 100ns);
  html += plot_of(t, "slack", "What is left of a tick",
                  "Background work runs in it, up to the guard time. The first bar holds everything below.",
                  "slack", 10us);
  html +=
      plot_of(t, "frame_to_command", "From frame to command",
              "From the last byte of a frame read to the command that it decided handed to the robot's link.",
              "frame to command", 100ns);
  html += distributions(t) + misses(t) + tasks_section(t) + budgets(t) + losses(t) + control_thread(t) +
          machine(t);
  return html + "</main>\n</body>\n</html>\n";
}

}  // namespace moldloft::firmware_like
