// What people read of a timing report: the table on a terminal and the page.
#include "firmware_like/report/timing_page.hpp"

#include "firmware_like/commands/latency_command.hpp"
#include "firmware_like/recorded_cyclictest.hpp"
#include "firmware_like/report/log_plot.hpp"
#include "firmware_like/report/timing_table.hpp"
#include "tasks/scripted_clock.hpp"

#include <doctest/doctest.h>

#include <regex>
#include <sstream>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;

namespace {

// A run of 2000 ticks with one miss, compared with the recorded cyclictest, on a machine that is not fit for it.
Json report() {
  tasks::ScriptedClock clock;
  std::vector<hal::Duration> costs(3000, 120us);
  costs[700] = 3300us;
  tasks::ScriptedTask first{clock, costs}, second{clock, {}};
  tasks::ScriptedBackground fit{clock, 500, 80us};
  tasks::Scheduler scheduler{clock, {.tick = 1ms}};
  scheduler.add({.name = "scanner <in> & \"out\"", .budget = 200us}, first);
  scheduler.add({.name = "health", .period_ticks = 100, .budget = 20us}, second);
  scheduler.add_background({.name = "surface", .quantum = 100us}, fit);
  clock.oversleep = 21us;
  scheduler.start();
  scheduler.run_until(2s);
  RunConditions conditions;
  conditions.environment.release = "6.1.0-rt";
  conditions.environment.virtual_machine = true;
  conditions.environment.virtual_found_by = "the processor's flags";
  conditions.setup.push_back({SetupItem::memory_lock, "all pages", "<none>", false, false, "raise memlock"});
  conditions.control_thread = {.ticks = 1990,
                               .minor_faults = 4,
                               .major_faults = 1,
                               .voluntary_switches = 1990,
                               .involuntary_switches = 3,
                               .migrations = 1,
                               .suspensions = 0};
  Json t = timing_report({.scheduler = scheduler, .conditions = &conditions});
  t["compared"] = comparison_json(scheduler.wake_up(), *parse_cyclictest(recorded_cyclictest));
  return t;
}

// Every element is closed in its order, attributes are in double quotes; gives what is wrong, or nothing.
std::string flaw_of(const std::string& html) {
  static const std::regex inside{R"re((/?)([a-zA-Z][a-zA-Z0-9]*)((?:\s+[a-zA-Z0-9-]+="")*)\s*(/?))re"};
  std::vector<std::string> open;
  for (std::size_t at = html.find('<', 1); at != html.npos;
       at = html.find('<', at + 1)) {  // after the doctype
    std::string tag;                   // what stands between < and >, the values left out
    bool quoted = false;
    std::size_t end = at + 1;
    for (; end < html.size() && html[end] != '<' && (quoted || html[end] != '>'); ++end) {
      if (html[end] == '"') quoted = !quoted;
      if (!quoted || html[end] == '"') tag += html[end];
    }
    std::smatch m;
    if (end == html.size() || html[end] != '>' || !std::regex_match(tag, m, inside))
      return "no tag: " + html.substr(at, 40);
    if (m[4] == "/") continue;
    if (m[1] == "") {
      open.push_back(m[2]);
    } else if (open.empty() || open.back() != m[2]) {
      return "closes " + m[2].str() + " inside " + (open.empty() ? "nothing" : open.back());
    } else {
      open.pop_back();
    }
  }
  return open.empty() ? "" : open.back() + " stays open";
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (auto at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++n;
  return n;
}

// The rows of the tables below a heading, "a | b | c" each; what is marked as bad has a "!" before it.
std::string rows_below(const std::string& page, const std::string& heading) {
  const auto begin = page.find("<h2>" + heading + "</h2>"), end = page.find("</section>", begin);
  static const std::regex cell{R"re(<t[dh]( class="[^"]*")?>(.*?)</t[dh]>|</tr>)re"};
  const std::string section = page.substr(begin, end - begin);
  std::string rows, line;
  for (std::sregex_iterator it{section.begin(), section.end(), cell}, last; it != last; ++it) {
    if (it->str() == "</tr>") {
      rows += std::exchange(line, "") + "\n";
      continue;
    }
    const bool is_bad = (*it)[1].str().find("bad") != std::string::npos;
    line += (line.empty() ? "" : " | ") + std::string{is_bad ? "!" : ""} + (*it)[2].str();
  }
  return rows;
}

std::string numbered(const std::string& text, const std::string& begin) {
  std::istringstream lines{text};
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(begin)) return line;
  return "";
}

}  // namespace

TEST_CASE("the check of the page finds what is not well formed") {
  CHECK(flaw_of("<!DOCTYPE html><p>a<b>c</b></p>") == "");
  CHECK(flaw_of("<!DOCTYPE html><p>a<b>c</p></b>") == "closes p inside b");
  CHECK(flaw_of("<!DOCTYPE html><p>a") == "p stays open");
  CHECK(flaw_of("<!DOCTYPE html><p>1 < 2</p>") == "no tag: < 2</p>");
  CHECK(flaw_of("<!DOCTYPE html><p class=\"a\"b\">1</p>") != "");
}

TEST_CASE("the page is one well-formed file that loads nothing and runs nothing") {
  const std::string page = timing_page(report(), "Timing of <plate> & \"co\"");
  CHECK(flaw_of(page) == "");
  CHECK(page.starts_with("<!DOCTYPE html>"));
  CHECK(page.find("<script") == page.npos);
  CHECK(page.find("http") == page.npos);
  CHECK(page.find("url(") == page.npos);
  CHECK(page.find("@import") == page.npos);
  CHECK(page.find("src=") == page.npos);
  CHECK(page.find("href=") == page.npos);
  CHECK(page.find("<title>Timing of &lt;plate&gt; &amp; &quot;co&quot;</title>") != page.npos);
  CHECK(page.find("scanner &lt;in&gt; &amp; &quot;out&quot;") != page.npos);
  CHECK(page.find("&lt;none&gt;") != page.npos);
  CHECK(page.find("prefers-color-scheme:dark") != page.npos);
  CHECK(page.find("@media print") != page.npos);
}

TEST_CASE("the page says first whether the run is representative, and why not") {
  const Json t = report();
  const std::string page = timing_page(t, "run");
  const auto verdict = page.find("Not representative:</b> ");
  REQUIRE(verdict != page.npos);
  CHECK(verdict < page.find("<h2>"));
  CHECK(page.find("virtual") != page.npos);
  Json good = t;
  good["representative"] = true;
  CHECK(timing_page(good, "run").find("<b>Representative.</b>") != std::string::npos);
}

TEST_CASE("the page shows ours and cyclictest in one drawing, every task, miss and budget") {
  const std::string page = timing_page(report(), "run");
  CHECK(count_of(page, "<path class=\"s0\"") == 2 * 3);  // wake-up, execution, slack, each in two widths
  CHECK(count_of(page, "<path class=\"s1\"") == 2);
  CHECK(page.find("ours, with fit and recorder busy") != page.npos);
  CHECK(page.find("cyclictest, alone") != page.npos);
  for (const char* heading : {"How late a tick begins", "Everything that was timed", "Missed ticks", "Tasks",
                              "Budgets", "The control thread", "Process set-up", "The machine"}) {
    CAPTURE(heading);
    CHECK(count_of(page, "<h2>" + std::string{heading} + "</h2>") == 1);
  }
  CHECK(page.find("3 in all, woken late: 0, preempted: 0, computing: 3. ") != page.npos);  // ticks 701 to 703
  CHECK(page.find(std::string{budget_rule}) != page.npos);
}

// The figures are those of the terminal's table, whose test says how they come about.
TEST_CASE("the page's tables row by row") {
  Json t = report();
  const std::string page = timing_page(t, "run");
  CHECK(rows_below(page, "How late a tick begins") ==
        R"(us | count | min | p50 | p99 | p99.9 | p99.99 | max | mean | std. dev.
ours | 1987 | 21.0 | 21.0 | 21.0 | 21.0 | 21.0 | 21.0 | 21.0 | 0.00
cyclictest | 200 | 53.5 | 64.5 | 270 | 406 | 406 | 406 | 72.5 | 39.3
ratio |  |  | 0.33 | 0.08 | 0.05 | 0.05 | 0.05 |  | 
)");
  CHECK(rows_below(page, "Missed ticks") ==
        R"(at, s | lost | cause | late, us | tick took, us | on the processor, us | longest task
0.703 | 3 | computing | 2321 | 3300 | 3300 | scanner &lt;in&gt; &amp; &quot;out&quot;
)");
  CHECK(rows_below(page, "Tasks") ==
        R"(task | every n ticks | runs | slips | late starts | lateness, us | overruns | longest at, s
scanner &lt;in&gt; &amp; &quot;out&quot; | 1 | 1987 | !3 | 0 | 0.00 | !1 | 0.700
health | 100 | 19 | 0 | !1 | 3021 | 0 | 0.100
background | steps | refused | forced | beyond the quantum | longest at, s
surface | 410 | 0 | 0 | 0 | 0.010
)");
  CHECK(rows_below(page, "Budgets") ==
        R"(us | runs | p99.9 | max | declared | suggested | judged
scanner &lt;in&gt; &amp; &quot;out&quot; | 1987 | 121 | 3300 | 200 | 190 | fits
health | 19 | 0.00 | 0.00 | 20.0 | - | too few runs
surface | 410 | 80.0 | 80.0 | 100 | - | too few runs
)");
  CHECK(rows_below(page, "The control thread") ==
        R"(ticks | page faults | gave way | preempted | moved
1990 | 5 | 1990 | 3 | 1
)");
  CHECK(rows_below(page, "Process set-up") ==
        R"(what | wanted | got | how to get it
memory lock | all pages | !&lt;none&gt; | raise memlock
)");
  t["setup"][0]["hint"] = "";  // nothing is missing: no column for it
  CHECK(rows_below(timing_page(t, "run"), "Process set-up") ==
        "what | wanted | got\nmemory lock | all pages | !&lt;none&gt;\n");
  t["budgets"]["tasks"][0]["judged"] = "too small";
  CHECK(rows_below(timing_page(t, "run"), "Budgets").find("| 190 | !too small\n") != std::string::npos);
}

TEST_CASE("a run in virtual time has a page without machine and comparison") {
  Json t = report();
  for (const char* key : {"compared", "environment", "setup"}) t.erase(key);
  const std::string page = timing_page(t, "run");
  CHECK(flaw_of(page) == "");
  CHECK(page.find("The machine") == page.npos);
  CHECK(count_of(page, "<path class=\"s1\"") == 0);
}

TEST_CASE(
    "a run on devices that ended before any frame led to a command is not taken for one without devices") {
  Json t = report();
  const auto said = [&] { return timing_page(t, "run"); };
  CHECK(said().find("in runs with devices only") != std::string::npos);
  t["frame_to_command"] = {{"count", 0}};
  CHECK(said().find("in runs with devices only") == std::string::npos);
  CHECK(said().find("No frame has led to a command in this run.") != std::string::npos);
}

TEST_CASE(
    "what was lost on the way stands on the page, in the table, and at a run's end where there is any") {
  const auto with = [](std::uint64_t garbled, std::uint64_t repeated, std::uint64_t broken) {
    Json t = report();
    t["losses"] = Json::array({{{"of", "scanner"}, {"what", "broken streams"}, {"count", broken}},
                               {{"of", "robot"}, {"what", "garbled lines"}, {"count", garbled}},
                               {{"of", "robot"}, {"what", "repeated lines"}, {"count", repeated}}});
    return t;
  };
  CHECK(losses_line(with(3, 2, 1)) == "scanner: broken streams 1; robot: garbled lines 3, repeated lines 2");
  CHECK(losses_line(with(0, 2, 0)) == "robot: repeated lines 2");
  CHECK(losses_line(with(0, 0, 0)) == "");
  CHECK(losses_line(report()) == "");  // a report that does not count them
  CHECK(timing_table(with(3, 0, 0)).find("lost on the way     robot: garbled lines 3\n") !=
        std::string::npos);
  CHECK(timing_table(with(0, 0, 0)).find("lost on the way     nothing\n") != std::string::npos);
  CHECK(timing_table(report()).find("lost") == timing_table(report()).find("lost  cause"));
  CHECK(timing_lines(with(3, 0, 0)).find("lost on the way             robot: garbled lines 3\n") !=
        std::string::npos);
  CHECK(timing_lines(with(0, 0, 0)) == timing_lines(report()));
  const std::string page = timing_page(with(3, 0, 0), "t", "");
  CHECK(flaw_of(page) == "");
  CHECK(page.find("<td class=\"word\">garbled lines</td><td class=\"bad\">3</td>") != std::string::npos);
  CHECK(page.find("<td class=\"word\">broken streams</td><td>0</td>") != std::string::npos);
  Json crowded = with(0, 0, 0);
  crowded["dumps_too_soon"] = 4;
  CHECK(timing_table(crowded).find("flight recorder     dumps left out, too soon after another: 4\n") !=
        std::string::npos);
  CHECK(timing_page(crowded, "t", "").find("too soon after another: 4.") != std::string::npos);
  CHECK(timing_table(with(0, 0, 0)).find("flight recorder") == std::string::npos);
  CHECK(timing_page(report(), "t", "").find("Lost on the way") == std::string::npos);
}

TEST_CASE("the page fits a telephone of 400 px and a sheet of A4, and no digit is cut off") {
  const std::string page = timing_page(report(), "run");
  // Narrow: drawings of their own, 376 px wide so that 12 px letters are 12 px; tables keep their most telling columns.
  CHECK(count_of(page, "<div class=\"slim\"><svg viewBox=\"0 0 376 240\"") == 3);
  CHECK(count_of(page, "<div class=\"broad\"><svg viewBox=\"0 0 920 330\"") == 3);
  CHECK(page.find("@media screen and (max-width:640px){.slim{display:block}.broad{display:none}") !=
        page.npos);
  CHECK(count_of(page, "<table class=\"stats\">") == 2);
  CHECK(count_of(page, "<table class=\"tasks\">") == 1);
  CHECK(count_of(page, "<table class=\"budgets\">") == 1);
  // Paper: the sheet is named, nothing scrolls, heads of columns are broken rather than cut.
  CHECK(page.find("@page{size:A4;margin:14mm}") != page.npos);
  const std::string print = page.substr(page.find("@media print"));
  CHECK(print.find(".wide{overflow:visible}") < print.find("</style>"));
  CHECK(print.find("th,.words td,.words td:first-child{white-space:normal}") < print.find("</style>"));
}

TEST_CASE(
    "labels of the axis of time never stand on each other, however wide the drawing and long the axis") {
  const std::regex label{
      R"re(<text class="tick" x="([0-9.]+)" y="([0-9.]+)" text-anchor="middle">([^<]+)</text>)re"};
  for (const double width : {376.0, 920.0}) {
    for (const auto longest : {20us, 500us, 90'000us, 9'000'000us}) {
      tasks::Histogram h;
      h.add(1us);
      h.add(longest);
      LogPlot plot{.series = {{"ours, with fit and recorder busy", h}, {"cyclictest, alone", h}},
                   .label = "latency"};
      plot.width_px = width;
      const std::string svg = log_plot(plot);
      std::vector<std::pair<double, double>> spans;  // on the axis
      for (std::sregex_iterator it{svg.begin(), svg.end(), label}, end; it != end; ++it) {
        if (std::stod((*it)[2]) != 330 - 46 + 16) continue;
        const double half = 0.5 * 7.2 * static_cast<double>((*it)[3].length());
        spans.emplace_back(std::stod((*it)[1]) - half, std::stod((*it)[1]) + half);
      }
      CHECK(spans.size() >= 2);
      for (std::size_t i = 1; i < spans.size(); ++i) CHECK(spans[i - 1].second < spans[i].first);
      CHECK(spans.back().second <= width + 8);
      // Names of the series stand inside as well: in a narrow drawing the second goes below the first.
      const auto first = svg.find("y=\"15.0\">ours"),
                 second = svg.find(width > 500 ? "y=\"15.0\">cyc" : "y=\"33.0\">cyc");
      CHECK(first != svg.npos);
      CHECK(second != svg.npos);
    }
  }
}

TEST_CASE("one value among a hundred thousand stands clear of the axis, in its place") {
  tasks::Histogram h;
  for (int i = 0; i < 100'000; ++i) h.add(10us);
  h.add(10ms);
  const std::string svg = log_plot({.series = {{"ours", h}}, .label = "latency"});
  CHECK(flaw_of("<!DOCTYPE html>" + svg) == "");
  std::smatch path;
  REQUIRE(
      std::regex_search(svg, path, std::regex{R"re(<path class="s0" d="M([0-9.]+) ([0-9.]+)([^"]*)V)re"}));
  const double bottom = std::stod(path[2]);
  // Heights in order: where the outline leaves the bottom, and how high.
  std::vector<double> heights;
  double right_of_last = 0;
  const std::string steps = path[3];
  const std::regex step{R"(V([0-9.]+)H([0-9.]+))"};
  for (std::sregex_iterator it{steps.begin(), steps.end(), step}, end; it != end; ++it) {
    const double up = bottom - std::stod((*it)[1]);
    if (up <= 0) continue;
    heights.push_back(up);
    right_of_last = std::stod((*it)[2]);
  }
  REQUIRE(heights.size() == 2);
  CHECK(heights[0] > heights[1]);
  CHECK(heights[1] > 10);  // px
  // Three decades lie between the two; both stand within the axes.
  CHECK(right_of_last <= 902);
  CHECK(right_of_last > 850);
}

TEST_CASE("what is smaller than the plot begins with stands in its first bar") {
  tasks::Histogram h;
  for (int i = 0; i < 50; ++i) h.add(0ns);
  h.add(900us);
  const auto left_edge = [&](hal::Duration smallest) {
    const std::string svg = log_plot({.series = {{"", h}}, .label = "slack", .smallest = smallest});
    CHECK(svg.find(">1 ns<") == std::string::npos);
    return svg.find(">10 us<") != std::string::npos && svg.find(">1 us<") == std::string::npos;
  };
  CHECK(left_edge(10us));
  CHECK_FALSE(left_edge(100ns));
}

TEST_CASE("durations are written as people say them") {
  CHECK(time_text(0ns) == "0 ns");
  CHECK(time_text(870ns) == "870 ns");
  CHECK(time_text(1us) == "1 us");
  CHECK(time_text(1'500ns) == "1.50 us");
  CHECK(time_text(23'400ns) == "23.4 us");
  CHECK(time_text(1985us) == "1.99 ms");
  CHECK(time_text(100ms) == "100 ms");
  CHECK(time_text(68s) == "68 s");
}

TEST_CASE("the table fits a terminal of a hundred columns and tells everything") {
  const Json t = report();
  const std::string table = timing_table(t);
  std::istringstream lines{table};
  for (std::string line; std::getline(lines, line);) {
    CAPTURE(line);
    CHECK(line.size() <= 100);
    CHECK((line.empty() || line.back() != ' '));
  }
  CHECK(numbered(table, "missed ticks") ==
        "missed ticks        3 of 1997: woken late 0, preempted 0, computing 3");
  CHECK(numbered(table, "      0.703").find("     3  computing") != std::string::npos);
  CHECK(numbered(table, "frame to command") == "frame to command    not measured");
  CHECK(numbered(table, "  health").find(" 19 ") != std::string::npos);
  CHECK(numbered(table, "control thread") ==
        "control thread      5 page faults, 3 times preempted, 1 moves to another processor, in 1990 ticks");
  CHECK(numbered(table, "representative").starts_with("representative      NO: "));
  CHECK(numbered(table, "ratio").find("0.3") != std::string::npos);  // 21 us to 64.5
}

// By hand: of 2000 ticks three fell into the run of 3300 us and ten are the start-up, so 1987 count.
// 121.6 us a tick is 12.2 % of it; ten of 500 background steps of 80 us fit a tick, 90 of them into the start-up.
TEST_CASE("the table line by line") {
  std::string table = timing_table(report());
  table.erase(0, table.find("us   "));
  table.erase(table.find("  suggested: "));
  CHECK(table == R"(us     count     min      p50      p99    p99.9   p99.99      max    mean  stddev
ours                     1987    21.0     21.0     21.0     21.0     21.0     21.0    21.0    0.00
cyclictest                200    53.5     64.5      270      406      406      406    72.5    39.3
ratio                                     0.33     0.08     0.05     0.05     0.05
(in turns; cyclictest's truncated microseconds n counted as n + 0.5, both in the same buckets)

us                      count     min      p50      p99    p99.9   p99.99      max    mean  stddev
wake-up latency          1987    21.0     21.0     21.0     21.0     21.0     21.0    21.0    0.00
table                    1987     120      121      121      121     3300     3300     122    71.2
  scanner <in> & "out"     1987     120      121      121      121     3300     3300     122    71.2
  health                   19    0.00     0.00     0.00     0.00     0.00     0.00    0.00    0.00
slack                    1987    0.00      859      859      859      859      859     859    19.2
  surface                 410    80.0     80.0     80.0     80.0     80.0     80.0    80.0    0.00
pushed by background       46    0.00     0.00     0.00     0.00     0.00     0.00    0.00    0.00
frame to command    not measured
data age            not measured
(end to end is measured in runs with devices only)

missed ticks        3 of 1997: woken late 0, preempted 0, computing 3
      at, s  lost  cause         late, us    took, us  computed, us  longest task
      0.703     3  computing         2321        3300          3300  scanner <in> & "out"
latest wake-up      21.0 us late, at 0.010 s
load                table 12.2 %, background 1.7 %, idle 86.2 %
control thread      5 page faults, 3 times preempted, 1 moves to another processor, in 1990 ticks

tasks                    runs   slips  late starts  lateness, us  overruns  longest at, s
  scanner <in> & "out"     1987       3            0          0.00         1          0.700
  health                   19       0            1          3021         0          0.100
background               runs  forced      refused                overruns  longest at, s
  surface                 410       0            0                       0          0.010

budgets, us             p99.9       max  declared suggested   judged
  scanner <in> & "out"      121      3300       200       190   fits
  health                 0.00      0.00      20.0         -   too few runs
  surface                80.0      80.0       100         -   too few runs
  busiest tick 220 us declared, 210 us suggested, of 1000 us with 100 us guard
)");
}

TEST_CASE("the table says what is unusual, and only then") {
  tasks::ScriptedClock clock;
  tasks::ScriptedTask slow{clock, std::vector<hal::Duration>(3000, 700us)};
  tasks::ScriptedBackground fit{clock, 2000, 150us};
  tasks::Scheduler scheduler{clock, {.tick = 1ms, .warm_up_ticks = 0}};
  scheduler.add({.name = "slow", .budget = 750us}, slow);
  scheduler.add_background({.name = "surface", .quantum = 210us}, fit);
  scheduler.start();
  scheduler.run_until(1500ms);
  clock.oversleep = 2500us;
  scheduler.run_tick();
  Json t = timing_report({.scheduler = scheduler});
  const std::string table = timing_table(t);
  CHECK(numbered(table, "  busiest tick").ends_with("guard: the suggested DO NOT FIT"));
  const std::string miss = numbered(table, "      1.50");
  CHECK(miss.find("woken late") != miss.npos);
  CHECK(miss.find("none") == miss.npos);
  CHECK(miss.back() == '0');  // no task is blamed: the line ends with the figures
  // Every hundredth tick one step is forced; in the others it was refused.
  CHECK(numbered(table, "  surface                  15      15         1486") != "");
  CHECK(table.find("beyond 68 s") == table.npos);
  CHECK(count_of(table, "(end to end is measured") == 1);

  t["wake_up"]["overflows"] = 2;
  t["frame_to_command"] = histogram_json(scheduler.wake_up());
  const std::string other = timing_table(t);
  CHECK(other.find("\n                    2 beyond 68 s\n") != other.npos);
  CHECK(count_of(other, "(end to end is measured") == 0);
}

TEST_CASE("the terminal's last words are the verdict, alone or with its reasons") {
  Json t = report();
  t["representative"] = true;
  CHECK(timing_table(t).ends_with("\n\nrepresentative      yes\n"));
  t["representative"] = false;
  t["why"] = "the control thread has no FIFO priority";
  CHECK(timing_table(t).ends_with("\n\nrepresentative      NO: the control thread has no FIFO priority\n"));
}

TEST_CASE("the last column of the ratios is that of the maxima") {
  Json t = report();
  t["compared"]["ratio_max"] = 77.7;
  CHECK(numbered(timing_table(t), "ratio").ends_with("     77.7"));
}

TEST_CASE("figures have as many places as people read") {
  CHECK(readable(0) == "0.00");
  CHECK(readable(7.254) == "7.25");
  CHECK(readable(72.54) == "72.5");
  CHECK(readable(725.4) == "725");
  CHECK(moment_s({{"t_ms", 1234.5678}}, "t_ms") == "1.235");
  CHECK(moment_s({{"t_ms", nullptr}}, "t_ms") == "-");
  CHECK(moment_s(Json::object(), "t_ms") == "-");  // a report of before it was kept
}

TEST_CASE("the end of a run shows wake-up, misses, load and the verdict, and no more") {
  const std::string lines = timing_lines(report());
  CHECK(count_of(lines, "\n") == 4);
  CHECK(numbered(lines, "wake-up latency").find("p99.9") != std::string::npos);
  CHECK(numbered(lines, "load").starts_with("load                        table 12"));
}

TEST_CASE(
    "missed ticks make one line with count, causes and the first of them, and none where none was missed") {
  // The tick due at 700 ms began 21 us late and took 3.3 ms: those due at 701, 702 and 703 ms were lost.
  CHECK(missed_ticks_line(report()) ==
        "3 of 1997 ticks were missed: computing 3; the first at 0.703 s, 2321 us late, after "
        "'scanner <in> & \"out\"'");
  Json none = report();
  none["missed_ticks"] = 0;
  none["first_misses"] = Json::array();
  CHECK(missed_ticks_line(none) == "");
}
