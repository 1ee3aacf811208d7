#include "host_sim/runs/campaign.hpp"

#include "firmware_like/commands/option_values.hpp"
#include "firmware_like/process/console.hpp"
#include "host_sim/runs/campaign_rows.hpp"
#include "host_sim/runs/hard_campaign.hpp"
#include "host_sim/runs/simulated_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <unistd.h>
#include <vector>

namespace moldloft::host_sim {

using firmware_like::say;
using firmware_like::show;
namespace {

using firmware_like::Json;

// Some hours of all plates; more is a slip of the finger.
constexpr std::uint64_t most_seeds = 10'000;

struct Job {
  std::string plate;
  OutlineKind outline{};
  std::string outline_name;
  std::uint64_t seed = 0;
};

struct Row {
  Job job;
  std::string result;
  Json truth;
  std::string message;
  bool good = false;
};

std::vector<Job> jobs_for(const CampaignOptions& options) {
  std::vector<Job> jobs;
  const SeedRange seeds = options.seeds.value_or(SeedRange{});
  for (const auto& plate : shape_names()) {
    if (options.plates != "all" && options.plates != plate) continue;
    for (const auto& outline : outline_names()) {
      if (options.outlines != "all" && options.outlines != outline) continue;
      for (auto left = seeds.last - seeds.first + 1, seed = seeds.first; left > 0; --left, ++seed) {
        jobs.push_back({std::string{plate}, *outline_named(outline), std::string{outline}, seed});
      }
    }
  }
  return jobs;
}

Row run_job(const CampaignOptions& options, const Job& job, const std::filesystem::path& root) {
  SimulatedRunOptions run;
  run.cell = options.cell;
  run.cell.plate = job.plate;
  run.cell.outline = job.outline;
  run.cell.seed = job.seed;
  run.out = root / fmt::format("{}-{}-{}", job.plate, job.outline_name, job.seed);
  run.write_everything = !options.out.empty();
  Row row{.job = job, .result = "error", .truth = Json::object(), .message = {}};
  if (const auto done = simulate(run)) {
    row.result = done->summary["result"].get<std::string>();
    row.message = done->summary["message"].get<std::string>();
    if (done->summary.contains("truth")) row.truth = done->summary["truth"];
    row.good = is_measured(done->result.outcome) && within_limits(row.truth);
  } else {
    row.message = done.error().what;
  }
  if (options.out.empty()) std::filesystem::remove_all(run.out);
  return row;
}

void print_row(const Row& r) {
  show(fmt::format("{:<10}{:<15}{:>5}  {:<10}", r.job.plate, r.job.outline_name, r.job.seed, r.result));
  if (r.truth.empty()) {
    show(fmt::format("  {}\n", r.message));
    return;
  }
  show(fmt::format("{:>10.4f}{:>10.4f}{:>10.4f}{:>10.4f}{}\n", truth_figure(r.truth, "normal_rms_mm"),
                   truth_figure(r.truth, "normal_max_mm"), truth_figure(r.truth, "outline_max_mm"),
                   truth_figure(r.truth, "corner_max_mm"), r.good ? "" : "  beyond the limits"));
}

void print_summary(const std::vector<Row>& rows) {
  const auto complete =
      std::count_if(rows.begin(), rows.end(), [](const Row& r) { return r.result == "complete"; });
  const auto good = std::count_if(rows.begin(), rows.end(), [](const Row& r) { return r.good; });
  show(fmt::format("{} runs, {} complete, {} within the limits\n", rows.size(), complete, good));
  for (const auto& [key, limit] : {std::pair{"normal_rms_mm", max_normal_rms_mm},
                                   {"normal_max_mm", max_normal_max_mm},
                                   {"outline_max_mm", max_outline_mm},
                                   {"corner_max_mm", max_corner_mm}}) {
    double worst = 0, sum = 0;
    for (const auto& r : rows) {
      worst = std::max(worst, truth_figure(r.truth, key));
      sum += truth_figure(r.truth, key);
    }
    show(fmt::format("{:<16} mean {:>8.4f}  worst {:>8.4f}  limit {:>6.2f}\n", key,
                     sum / static_cast<double>(std::max<std::ptrdiff_t>(complete, 1)), worst, limit));
  }
}

}  // namespace

std::expected<SeedRange, SimError> seeds_from(std::string_view text) {
  const auto dots = text.find("..");
  const std::string_view a = text.substr(0, dots), b = dots == text.npos ? a : text.substr(dots + 2);
  const firmware_like::Limits<std::uint64_t> any{0, std::numeric_limits<std::uint64_t>::max()};
  SeedRange seeds;
  const bool read =
      firmware_like::read_number(a, any, seeds.first) && firmware_like::read_number(b, any, seeds.last);
  if (!read || seeds.first > seeds.last || seeds.last - seeds.first >= most_seeds)
    return std::unexpected(SimError{
        fmt::format("'{}' given; A..B or A is wanted, whole numbers from 0 on, the smaller first, {} at most",
                    text, most_seeds)});
  return seeds;
}

int run_campaign(const CampaignOptions& options) {
  if (options.plates == hard_plates) return run_hard_campaign(options);
  const auto jobs = jobs_for(options);
  if (jobs.empty()) {
    say(fmt::format(
        "moldloft-sim campaign: nothing to run; --plates all, hard or one of {}; --outlines all or one of "
        "{}; --seeds A..B\n",
        fmt::join(shape_names(), ", "), fmt::join(outline_names(), ", ")));
    return 1;
  }
  const bool keep = !options.out.empty();
  const std::filesystem::path root =
      keep ? std::filesystem::path{options.out}
           : std::filesystem::temp_directory_path() / fmt::format("moldloft-campaign-{}", ::getpid());
  if (!options.json) {
    show(fmt::format("{:<10}{:<15}{:>5}  {:<10}{:>10}{:>10}{:>10}{:>10}\n", "plate", "outline", "seed",
                     "result", "rms mm", "max mm", "outline", "corner"));
  }
  const auto rows = rows_of<Row>(
      jobs.size(), [&](std::size_t i) { return run_job(options, jobs[i], root); },
      [&](const Row& row) {
        if (!options.json) print_row(row);
      });
  std::error_code ignored;
  if (!keep) std::filesystem::remove_all(root, ignored);

  if (options.json) {
    Json all = Json::array();
    for (const auto& r : rows) {
      all.push_back({{"plate", r.job.plate},
                     {"outline", r.job.outline_name},
                     {"seed", r.job.seed},
                     {"result", r.result},
                     {"truth", r.truth}});
    }
    show(fmt::format("{}\n", firmware_like::json_text(all, 1)));
  } else {
    print_summary(rows);
  }
  return std::all_of(rows.begin(), rows.end(), [](const Row& r) { return r.good; }) ? 0 : 1;
}

}  // namespace moldloft::host_sim
