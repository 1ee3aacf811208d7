#include "host_sim/runs/hard_campaign.hpp"

#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "host_sim/runs/campaign_rows.hpp"
#include "host_sim/runs/simulated_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <unistd.h>

namespace moldloft::host_sim {

using firmware_like::Json;
using firmware_like::show;

namespace {

std::string_view outcome_of(const HardRow& row) {
  if (row.measured()) return "measured";
  if (row.warned()) return "warned";
  return row.exit_code == firmware_like::exit_failed ? "failed" : "held";
}

const Cause& cause_of(const HardRow& row) {
  return *std::ranges::find(hard_causes(), row.cause, &Cause::name);
}

HardRow run_case(const CampaignOptions& options, std::uint64_t seed, const std::filesystem::path& root) {
  const HardCase drawn = hard_case(seed);
  SimulatedRunOptions run;
  run.cell = drawn.cell;
  run.out = root / fmt::format("hard-{}", seed);
  run.name = fmt::format("hard {}: {}", seed, drawn.what);
  run.write_everything = !options.out.empty();
  HardRow row{.seed = seed, .cause = std::string{drawn.cause->name}, .what = drawn.what};
  if (const auto done = simulate(run)) {
    row.exit_code = done->exit_code;
    row.words = words_of_summary(done->summary);
    if (done->summary.contains("truth")) row.truth = done->summary["truth"];
  } else {
    row.words = {done.error().what};
  }
  row.said = fmt::format("{}", fmt::join(row.words, " | "));
  std::error_code ignored;
  if (options.out.empty()) std::filesystem::remove_all(run.out, ignored);
  return row;
}

std::string figures(const HardRow& row) {
  if (row.truth.empty()) return {};
  return fmt::format("rms {:.3f} max {:.3f} outline {:.2f} corner {:.2f} mm",
                     truth_figure(row.truth, "normal_rms_mm"), truth_figure(row.truth, "normal_max_mm"),
                     truth_figure(row.truth, "outline_max_mm"), truth_figure(row.truth, "corner_max_mm"));
}

void print_row(const HardRow& row) {
  show(fmt::format("{:>5}  {:<13}{:<10}{}; {}{}{}{}\n", row.seed, row.cause, outcome_of(row), row.what,
                   figures(row), row.said.empty() ? "" : "; ", row.said,
                   is_untrue(row)     ? "  UNTRUE"
                   : !says_cause(row) ? "  another cause"
                                      : ""));
}

// The same words with other numbers are the same words.
std::string without_numbers(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    const bool of_number =
        std::isdigit(static_cast<unsigned char>(c)) != 0 || (c == '.' && plain.ends_with('#'));
    if (!of_number) {
      plain += c;
    } else if (!plain.ends_with('#')) {
      plain += '#';
    }
  }
  return plain;
}

void print_causes(const std::vector<HardRow>& rows) {
  show(fmt::format("\n{:<14}{:>6}{:>10}{:>8}{:>6}{:>8}{:>8}\n", "cause", "runs", "measured", "warned", "held",
                   "failed", "untrue"));
  for (const Cause& cause : hard_causes()) {
    std::map<std::string_view, int> count;
    int runs = 0, untrue = 0;
    for (const HardRow& row : rows) {
      if (row.cause != cause.name) continue;
      ++runs, ++count[outcome_of(row)];
      untrue += is_untrue(row);
    }
    if (runs == 0) continue;
    show(fmt::format("{:<14}{:>6}{:>10}{:>8}{:>6}{:>8}{:>8}\n", cause.name, runs, count["measured"],
                     count["warned"], count["held"], count["failed"], untrue));
  }
}

// Cause -> what was said, how often, and whether that names the cause.
void print_words(const std::vector<HardRow>& rows) {
  show("\nwhat was said, by cause\n");
  for (const Cause& cause : hard_causes()) {
    std::map<std::string, int> said;
    for (const HardRow& row : rows) {
      if (row.cause != cause.name) continue;
      for (const auto& word : row.words) ++said[without_numbers(word)];
    }
    for (const auto& [words, times] : said)
      show(fmt::format("{:<14}{:>4} x {:<6}{}\n", cause.name, times, names(cause, words) ? "true" : "-",
                       words));
  }
}

void print_untrue(const std::vector<HardRow>& rows) {
  show("\ncomplete and beyond the limits\n");
  for (const HardRow& row : rows) {
    if (is_untrue(row))
      show(fmt::format("{:>5}  {:<13}{}; {}\n", row.seed, row.cause, row.what, figures(row)));
  }
  if (std::ranges::none_of(rows, is_untrue)) show("none\n");
}

void print_summary(const std::vector<HardRow>& rows) {
  print_causes(rows);
  print_words(rows);
  print_untrue(rows);
  const auto share = [&](auto what) {
    const auto count = std::ranges::count_if(rows, [&](const HardRow& r) { return outcome_of(r) == what; });
    return 100.0 * static_cast<double>(count) / static_cast<double>(rows.size());
  };
  show(fmt::format(
      "\n{} runs: {:.0f} % measured, {:.0f} % warned, {:.0f} % held; {} complete and beyond the limits, "
      "{} with another cause than the known one\n",
      rows.size(), share("measured"), share("warned"), share("held"), std::ranges::count_if(rows, is_untrue),
      std::ranges::count_if(rows, [](const HardRow& r) { return !says_cause(r); })));
}

void print_json(const std::vector<HardRow>& rows) {
  Json all = Json::array();
  for (const HardRow& row : rows) {
    all.push_back({{"seed", row.seed},
                   {"cause", row.cause},
                   {"what", row.what},
                   {"exit_code", row.exit_code},
                   {"outcome", outcome_of(row)},
                   {"words", row.words},
                   {"names_cause", says_cause(row)},
                   {"untrue", is_untrue(row)},
                   {"truth", row.truth}});
  }
  show(fmt::format("{}\n", firmware_like::json_text(all, 1)));
}

}  // namespace

bool HardRow::warned() const { return exit_code == firmware_like::exit_warned; }

bool is_untrue(const HardRow& row) { return row.measured() && !within_limits(row.truth); }

bool says_cause(const HardRow& row) { return row.words.empty() || names(cause_of(row), row.said); }

std::vector<std::string> words_of_summary(const Json& summary) {
  std::vector<std::string> words;
  if (const auto message = summary.value("message", std::string{}); !message.empty())
    words.push_back(message);
  if (!summary.contains("findings")) return words;
  for (const Json& finding : summary["findings"]) {
    if (finding.contains("text")) words.push_back(finding["text"].get<std::string>());
  }
  return words;
}

int run_hard_campaign(const CampaignOptions& options) {
  const bool keep = !options.out.empty();
  const std::filesystem::path root =
      keep ? std::filesystem::path{options.out}
           : std::filesystem::temp_directory_path() / fmt::format("moldloft-campaign-{}", ::getpid());
  const SeedRange seeds = options.seeds.value_or(hard_seeds);
  const auto rows = rows_of<HardRow>(
      seeds.last - seeds.first + 1, [&](std::size_t i) { return run_case(options, seeds.first + i, root); },
      [&](const HardRow& row) {
        if (!options.json) print_row(row);
      });
  std::error_code ignored;
  if (!keep) std::filesystem::remove_all(root, ignored);
  options.json ? print_json(rows) : print_summary(rows);
  const bool failed = std::ranges::any_of(rows, [](const HardRow& r) { return outcome_of(r) == "failed"; });
  return failed || std::ranges::any_of(rows, is_untrue) ? 1 : 0;
}

}  // namespace moldloft::host_sim
