#include "firmware_like/commands/latency_command.hpp"

#include "firmware_like/config/task_table.hpp"
#include "firmware_like/process/complaint.hpp"
#include "firmware_like/process/console.hpp"
#include "firmware_like/process/stop_signals.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/realtime/control_thread.hpp"
#include "firmware_like/realtime/thread_counts.hpp"
#include "firmware_like/report/timing_page.hpp"
#include "firmware_like/report/timing_table.hpp"
#include "firmware_like/run/flight_files.hpp"
#include "firmware_like/run/recorder_thread.hpp"
#include "firmware_like/run/run_folder.hpp"
#include "firmware_like/selftest/latency_load.hpp"
#include "hal/base/realtime_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <semaphore>
#include <stdlib.h>
#include <utility>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr double turn_s = 5;

int refuse(std::string_view what) { return complain(what, "moldloft latency"); }

// Where the run store lies: in the folder asked for, or in one that goes when the measurement is over.
class Workplace {
 public:
  static std::expected<Workplace, Failure> make(const std::string& out) {
    if (!out.empty()) return Workplace{out, false};
    std::error_code failed;
    std::string path = (fs::temp_directory_path(failed) / "moldloft-latency-XXXXXX").string();
    if (failed || ::mkdtemp(path.data()) == nullptr)
      return std::unexpected{Failure{fmt::format("{}: cannot be created; give a folder with --out", path)}};
    return Workplace{path, true};
  }
  Workplace(Workplace&& other) noexcept
      : path_{std::move(other.path_)}, goes_{std::exchange(other.goes_, false)} {}
  Workplace& operator=(Workplace&&) = delete;
  ~Workplace() {
    std::error_code ignored;
    if (goes_) fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  Workplace(fs::path path, bool goes) : path_{std::move(path)}, goes_{goes} {}
  fs::path path_;
  bool goes_;
};

// The control thread ticks only while it has the turn; between two turns it waits, and nothing of ours runs.
class Turns {
 public:
  Turns(LatencyLoad& load, const RealtimeConfig& realtime, std::int64_t ticks)
      : load_{load}, ticks_{ticks}, control_{realtime, [this] { work(); }} {
    control_.begin();
  }
  ~Turns() {
    over_ = true;
    go_.release();
    control_.join();
  }
  Turns(const Turns&) = delete;
  Turns& operator=(const Turns&) = delete;

  void take() {
    go_.release();
    done_.acquire();
  }
  const ControlThread& control() const { return control_; }
  const ThreadCounts& counts() const { return counts_; }  // of all turns so far

 private:
  void work() {
    for (go_.acquire(); !over_; go_.acquire()) {
      auto& scheduler = load_.scheduler();
      scheduler.start();
      const auto end = scheduler.next_tick() + ticks_ * scheduler.settings().tick;
      const auto warm = scheduler.ticks() + scheduler.settings().warm_up_ticks;
      const auto goes_on = [&] {
        return scheduler.next_tick() < end && !StopSignals::asked() && scheduler.run_tick();
      };
      while (scheduler.ticks() < warm && goes_on()) {
      }
      ThreadCounter counter;
      hal::RealtimeSection::begin();
      do {
        counter.at_tick();
      } while (goes_on());
      hal::RealtimeSection::end();
      counts_ += counter.so_far();
      done_.release();
    }
  }
  LatencyLoad& load_;
  std::int64_t ticks_;
  ThreadCounts counts_;
  bool over_ = false;
  std::binary_semaphore go_{0}, done_{0};
  ControlThread control_;
};

struct Measured {
  RunConditions conditions;
  std::optional<CyclictestResult> cyclictest;
};

bool had(const SetupRows& rows, SetupItem item) {
  return std::ranges::any_of(rows, [&](const SetupRow& row) { return row.item == item && row.ok; });
}

std::expected<Measured, Failure> measure(LatencyLoad& load, RunFolder& folder, const CellConfig& config,
                                         const TurnPlan& plan, bool compare) {
  Measured m{.conditions = {config.realtime, read_environment(config.realtime.cpu), {}}, .cyclictest = {}};
  FlightFiles flight{load.flight(), folder.path};
  const ProcessSetup process{config.realtime};
  Turns turns{load, config.realtime, plan.ticks};
  for (int turn = 0; turn < plan.turns && !StopSignals::asked(); ++turn) {
    {
      const RecorderThread recorder{load.recorder(), *folder.store, flight};
      if (turn == 0) {
        m.conditions.setup = process.rows();
        std::ranges::copy(turns.control().setup(), std::back_inserter(m.conditions.setup));
        m.conditions.setup.push_back(check_ordinary_threads(turns.control().id(), config.realtime));
      }
      turns.take();
    }
    if (!compare || StopSignals::asked()) continue;
    const auto theirs = run_cyclictest(same_as(m.conditions, config.tick, plan.ticks), folder.path);
    if (!theirs) return std::unexpected{theirs.error()};
    if (!m.cyclictest) m.cyclictest.emplace();
    *m.cyclictest += *theirs;
  }
  m.conditions.control_thread = turns.counts();
  return m;
}

Json busy_json(const LatencyLoad& load) {
  return {{"surfaces_solved", load.surfaces()},      {"points_seen", load.points_seen()},
          {"frames_recorded", load.frames()},        {"frames_refused", load.frames_refused()},
          {"frames_damaged", load.frames_damaged()}, {"records_lost", load.recorder().lost()}};
}

std::string busy_line(const Json& busy) {
  return fmt::format(
      "busy with           {} surfaces solved, {} points looked at, {} frames recorded, {} refused, {} "
      "damaged\n",
      busy["surfaces_solved"].get<std::uint64_t>(), busy["points_seen"].get<std::uint64_t>(),
      busy["frames_recorded"].get<std::uint64_t>(), busy["frames_refused"].get<std::uint64_t>(),
      busy["frames_damaged"].get<std::uint64_t>());
}

std::expected<CellConfig, Failure> config_of(const LatencyOptions& options) {
  CellConfig config = default_config();
  if (!options.config.empty()) {
    const auto loaded = load_config(options.config);
    if (!loaded) return std::unexpected{Failure{loaded.error().what}};
    config = *loaded;
  }
  if (options.tick_us != 0) config.tick = options.tick_us * 1us;
  return config;
}

std::optional<std::string> refused(const LatencyOptions& options) {
  if (!options.compare.empty() && options.compare != "cyclictest")
    return fmt::format("--compare: '{}' given; it knows cyclictest", options.compare);
  return std::nullopt;
}

}  // namespace

TurnPlan plan_turns(double duration_s, hal::Duration tick, bool compare) {
  const double each_s = compare ? duration_s / 2 : duration_s;
  const int turns = compare ? std::max(1, static_cast<int>(std::lround(each_s / turn_s))) : 1;
  const double tick_s = std::chrono::duration<double>(tick).count();
  return {.turns = turns, .ticks = std::max<std::int64_t>(1, std::llround(each_s / turns / tick_s))};
}

CyclictestSettings same_as(const RunConditions& conditions, hal::Duration tick, std::int64_t ticks) {
  const auto& realtime = conditions.realtime;
  return {.priority = had(conditions.setup, SetupItem::scheduling) ? realtime.priority : 0,
          .cpu = had(conditions.setup, SetupItem::affinity) ? realtime.cpu : -1,
          .lock_memory = realtime.lock_memory && had(conditions.setup, SetupItem::memory_lock),
          .interval = tick,
          .cycles = static_cast<std::uint64_t>(ticks)};
}

Json comparison_json(const tasks::Histogram& ours, const CyclictestResult& cyclictest) {
  const auto side = [](const tasks::Histogram& h, std::uint64_t cycles) {
    Json j = histogram_json(h);
    j["cycles"] = cycles;
    return j;
  };
  Json j = {{"ours", side(ours, ours.count())}, {"cyclictest", side(cyclictest.latency, cyclictest.cycles)}};
  j["cyclictest"]["beyond_its_histogram"] = cyclictest.beyond;
  const auto ratio = [&](const char* key, const std::string& name) {
    const Json &a = j["ours"][key], &b = j["cyclictest"][key];
    const bool known = a.is_number() && b.is_number();  // cyclictest's least is half a microsecond
    j[name] = known ? Json(a.get<double>() / b.get<double>()) : Json(nullptr);
  };
  for (const auto& p : percentiles) ratio(p.key, ratio_key(p));
  ratio("max_us", ratio_of_maxima);
  j["how"] = "in turns; cyclictest's truncated microseconds n counted as n + 0.5, both in the same buckets";
  return j;
}

Json latency_json(const Json& timing) {
  Json j;
  const auto side = [](const Json& h, const Json& cycles) {
    Json s = {{"cycles", cycles}, {"min_us", h["min_us"]}, {"avg_us", h["avg_us"]}};
    for (const auto& p : percentiles) s[p.key] = h[p.key];
    s["max_us"] = h["max_us"];
    return s;
  };
  if (timing.contains("compared")) {
    const Json& c = timing["compared"];
    j["ours"] = side(c["ours"], c["ours"]["cycles"]);
    j["cyclictest"] = side(c["cyclictest"], c["cyclictest"]["cycles"]);
    for (const auto& p : percentiles) j[ratio_key(p)] = c[ratio_key(p)];
    j[ratio_of_maxima] = c[ratio_of_maxima];
    j["how"] = c["how"];
  } else {
    j["ours"] = side(timing["wake_up"], timing["wake_up"]["count"]);
  }
  j["missed"] = timing["missed_ticks"];
  for (const char* key : {"representative", "why", "ticks", "tick_us", "missed_by_cause", "load", "busy"})
    if (timing.contains(key)) j[key] = timing[key];
  return j;
}

int measure_latency(const LatencyOptions& options) {
  if (const auto why = refused(options)) return refuse(*why);
  // Ctrl-C ends the measurement; what was measured so far is reported.
  const StopSignals signals;
  const auto config = config_of(options);
  if (!config) return complain_all(config.error().what, "moldloft latency");
  auto place = Workplace::make(options.out);
  if (!place) return refuse(place.error().what);
  auto folder = create_run(place->path(), config->text, load_frames, RunKind::measured);
  if (!folder) return refuse(folder.error().what);
  const bool compare = !options.compare.empty();
  if (!options.json)
    say(fmt::format("measuring for {:.0f} s; ctrl-C ends it with what there is\n", options.duration_s));
  hal::SteadyClock clock;
  const auto load = std::make_unique<LatencyLoad>(*config, clock);
  const auto measured =
      measure(*load, *folder, *config, plan_turns(options.duration_s, config->tick, compare), compare);
  if (!measured) return refuse(measured.error().what);
  if (load->failed())
    return refuse("the fit gave up on a plate that is known to be good: a defect; please report");
  if (load->recorder().store_failed()) return refuse(load->recorder().store_error().view());

  Json timing = timing_report({.scheduler = load->scheduler(), .conditions = &measured->conditions});
  timing["busy"] = busy_json(*load);
  if (measured->cyclictest)
    timing["compared"] = comparison_json(load->scheduler().wake_up(), *measured->cyclictest);
  if (!options.out.empty()) {
    for (const auto& [name, content] :
         {std::pair{"timing.json", json_text(timing, 2) + "\n"},
          std::pair{"report.html", timing_page(timing, page_title(place->path()))}}) {
      const auto written = write_file(place->path() / name, content);
      if (!written) return refuse(written.error().what);
    }
  }
  if (options.json)
    show(fmt::format("{}\n", json_text(latency_json(timing), 2)));
  else
    show(fmt::format("{}\n{}{}", conditions_text(measured->conditions), busy_line(timing["busy"]),
                     timing_table(timing)));
  return exit_done;
}

}  // namespace moldloft::firmware_like
