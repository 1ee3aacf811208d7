#include "firmware_like/commands/inspect_command.hpp"

#include "firmware_like/inspection/design_reader.hpp"
#include "firmware_like/inspection/frame_page.hpp"
#include "firmware_like/inspection/inspection.hpp"
#include "firmware_like/inspection/inspection_files.hpp"
#include "firmware_like/inspection/point_list.hpp"
#include "firmware_like/inspection/text_fields.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/report/measurement_page.hpp"
#include "firmware_like/results/stored_result.hpp"
#include "firmware_like/run/run_folder.hpp"
#include "hal/base/printable_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;

constexpr double largest_limit_mm = 1000;
constexpr std::size_t single_points = 450'000;
constexpr double gate_mm = 5;  // single points farther from the fitted surface are not of the plate

std::unexpected<Failure> refuse(std::string what) { return std::unexpected(Failure{std::move(what)}); }

std::expected<Limit, Failure> limit_of(const std::string& text, std::string_view option) {
  const auto fields = fields_of(text, ',');
  const auto first = number_of(fields[0].text);
  if (fields.size() == 1 && first && *first > 0 && *first <= largest_limit_mm) return Limit{-*first, *first};
  if (fields.size() == 2 && first) {
    const auto second = number_of(fields[1].text);
    if (second && *first < *second && std::abs(*first) <= largest_limit_mm &&
        std::abs(*second) <= largest_limit_mm)
      return Limit{*first, *second};
  }
  return refuse(fmt::format("{}: '{}' given; 3 (from -3 to 3 mm) or -2,3 is wanted, up to {:g} mm", option,
                            text, largest_limit_mm));
}

std::expected<RegionLimit, Failure> region_of(const std::string& text) {
  const auto wanted = [&] {
    return refuse(
        fmt::format("--region: '{}' given; NAME:x0,y0,x1,y1:LIMIT is wanted, in the design's x and y", text));
  };
  const auto last = text.rfind(':');
  const auto first = text.find(':');
  if (first == std::string::npos || last == first || first == 0) return wanted();
  RegionLimit region{.name = text.substr(0, first), .min = {}, .max = {}, .limit = {}};
  const std::string box = text.substr(first + 1, last - first - 1);
  const auto fields = fields_of(box, ',');
  if (fields.size() != 4) return wanted();
  double at[4];
  for (std::size_t i = 0; i < 4; ++i) {
    const auto number = number_of(fields[i].text);
    if (!number) return wanted();
    at[i] = *number;
  }
  region.min = {std::min(at[0], at[2]), std::min(at[1], at[3])};
  region.max = {std::max(at[0], at[2]), std::max(at[1], at[3])};
  const auto limit = limit_of(text.substr(last + 1), "--region");
  if (!limit) return std::unexpected(limit.error());
  region.limit = *limit;
  return region;
}

// Lines "x y z X Y Z": a place on the measured plate (world), and where the design has it.
std::expected<std::vector<DatumPair>, Failure> read_datum(const fs::path& path) {
  std::ifstream in{path, std::ios::binary};
  if (!in) return refuse(fmt::format("--datum: {} cannot be read", path.string()));
  const std::string text{std::istreambuf_iterator<char>{in}, {}};
  std::vector<DatumPair> pairs;
  std::size_t n = 0;
  for (auto line : lines_of(text)) {
    ++n;
    std::ranges::replace(line, ',', ' ');
    const auto fields = fields_of(line);
    if (fields.empty() || fields[0].text.starts_with('#')) continue;
    double at[6];
    for (std::size_t i = 0; i < 6; ++i) {
      const auto number = i < fields.size() ? number_of(fields[i].text) : std::nullopt;
      if (!number || fields.size() != 6)
        return refuse(fmt::format("{} line {}: six numbers are wanted, x y z measured and x y z designed",
                                  path.string(), n));
      at[i] = *number;
    }
    pairs.push_back({{at[0], at[1], at[2]}, {at[3], at[4], at[5]}});
  }
  return pairs;
}

std::expected<InspectionSettings, Failure> settings_of(const InspectOptions& options) {
  InspectionSettings settings;
  const auto method = alignment_named(options.align);
  if (!method)
    return refuse(fmt::format("--align: '{}' given; {} is wanted", options.align, alignment_names()));
  settings.method = *method;
  if (options.outline != "use" && options.outline != "ignore")
    return refuse(fmt::format("--outline: '{}' given; use or ignore is wanted", options.outline));
  settings.with_outline = options.outline == "use";
  settings.border_width_mm = options.border_width_mm;
  settings.frames = options.frames;
  settings.insists = options.force;
  for (const auto& [text, option, to] : {std::tuple{&options.limit, "--limit", &settings.limit},
                                         {&options.border_limit, "--border-limit", &settings.border_limit}}) {
    if (text->empty()) continue;
    const auto limit = limit_of(*text, option);
    if (!limit) return std::unexpected(limit.error());
    *to = *limit;
  }
  if (!settings.limit && (settings.border_limit || !options.regions.empty()))
    return refuse("--limit is wanted too: it holds where no other limit does");
  for (const auto& text : options.regions) {
    auto region = region_of(text);
    if (!region) return std::unexpected(region.error());
    settings.regions.push_back(std::move(*region));
  }
  if ((settings.method == AlignmentMethod::datum) != !options.datum.empty())
    return refuse("--align datum and --datum FILE belong together");
  if (!options.datum.empty()) {
    auto pairs = read_datum(options.datum);
    if (!pairs) return std::unexpected(pairs.error());
    settings.datum = std::move(*pairs);
  }
  return settings;
}

// The single points of the run's store, and what its configuration promises. A run whose shots are gone still has its
// surface, and the map needs no more: what could not be read is said, and nothing is refused.
std::vector<MeasuredPoint> points_of(const fs::path& folder, RunResult& result,
                                     std::vector<std::string>& remarks) {
  const auto without = [&](std::string_view why) {
    remarks.push_back(fmt::format("single points are left out: {}", why));
    return std::vector<MeasuredPoint>{};
  };
  const auto run = open_run(folder);
  if (!run) return without(run.error().what);
  const auto text = run->store->meta("config");
  if (!text) return without(text.error().what);
  const auto config = parse_config(*text, folder.string() + "/run.db");
  if (!config) return without(config.error().what);
  result.tip_from_scanner = config->scanner.tip_from_scanner;
  result.promised = promise_of(*config);
  auto points = measured_points(result, *run->store, single_points, gate_mm);
  return points ? std::move(*points) : without(points.error().what);
}

std::expected<void, Failure> write_all(const fs::path& folder, const Inspection& found,
                                       const Design& design) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  const std::pair<const char*, std::string> files[] = {
      {"inspection.json", json_text(inspection_json(found), 1) + "\n"},
      {"deviations.csv", deviations_csv(found)},
      {"deviations.ply", deviations_ply(found)},
      {"frames.txt", frames_text(found, design)},
      {"frames.html", frame_page(found)}};
  for (const auto& [name, text] : files) {
    if (auto written = write_file(folder / name, text); !written) return written;
  }
  return {};
}

std::expected<int, Failure> inspected(const InspectOptions& options) {
  const auto settings = settings_of(options);
  if (!settings) return std::unexpected(settings.error());
  const fs::path run{options.run};
  auto result = read_result(run);
  if (!result) return std::unexpected(result.error());
  if (!result->measured)
    return refuse(fmt::format("{}: that run is {} and has no surface: measure the plate to its end",
                              options.run, to_string(result->outcome)));
  if (!is_measured(result->outcome) && !options.force)
    return refuse(fmt::format("{}: that run is {}: {}; --force inspects it all the same", options.run,
                              to_string(result->outcome), result->message));
  const auto design = read_design(options.design, options.unit);
  if (!design) return std::unexpected(design.error());
  std::vector<std::string> remarks;
  const auto points = points_of(run, *result, remarks);
  auto found = inspect(*result, points, *design, *settings);
  if (!found) return std::unexpected(found.error());
  found->run = options.run;
  if (!design->faces.empty()) std::ranges::move(remarks, std::back_inserter(found->remarks));
  if (result->outcome == Outcome::warned)
    found->remarks.push_back("the measurement has warnings: moldloft report shows them");
  const fs::path out = options.out.empty() ? run : fs::path{options.out};
  if (auto written = write_all(out, *found, *design); !written) return std::unexpected(written.error());
  if (options.out.empty()) {
    if (auto written = write_report(run); !written) return std::unexpected(written.error());
  }
  show(fmt::format("{}\nfiles                       {}\n", inspection_table(*found),
                   hal::printable((out / "inspection.json").string() +
                                  ", deviations.csv, deviations.ply, frames.txt, frames.html")));
  return found->verdict == Judgement::fails ? exit_differs : exit_done;
}

}  // namespace

int inspect_run(const InspectOptions& options) {
  const auto done = inspected(options);
  if (done) return *done;
  return complain(done.error().what, "moldloft inspect");
}

}  // namespace moldloft::firmware_like
