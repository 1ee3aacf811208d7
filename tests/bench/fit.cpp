// moldloft-bench fit: the surface fit beside its floors and its peers, on fit job P.
#include "bench/benchmark.hpp"
#include "bench/fit_job.hpp"
#include "bench/fitpack.hpp"
#include "bench/native/fit_native.hpp"
#include "bench/stopwatch.hpp"
#include "geometry/fit/fit_surface.hpp"

#include <fmt/core.h>

#include <cmath>
#include <optional>
#include <sys/resource.h>
#include <thread>

namespace moldloft::bench {

namespace {

using geometry::FitSettings, geometry::FittedSurface, geometry::PointColumns;

constexpr geometry::FitDomain plate{0, plate_mm, 0, plate_mm};

PointColumns columns(const FitJob& job) { return {.u = job.x, .v = job.y, .z = job.z}; }

FittedSurface fit(const FitJob& job, FitSettings settings) {
  settings.domain = plate;
  auto fitted = geometry::fit_surface(columns(job), settings);
  if (!fitted) {
    throw std::runtime_error(
        fmt::format("the fit failed: {} ({})", to_string(fitted.error().error), fitted.error().where));
  }
  return *std::move(fitted);
}

// The slope of log(seconds) over log(size): the exponent with which the cost grows.
double exponent(const std::vector<std::pair<double, double>>& size_seconds) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const auto& [size, seconds] : size_seconds) {
    const double x = std::log(size), y = std::log(seconds);
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

double peak_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

struct Table {
  bool quiet;
  template <typename... Args>
  void line(fmt::format_string<Args...> format, Args&&... args) const {
    if (!quiet) fmt::print("{}\n", fmt::format(format, std::forward<Args>(args)...));
  }
};

Json floors(const FitJob& job, const Options& options, const Table& table) {
  const int runs = options.quick ? 3 : 21;
  std::vector<double> u = job.x, v = job.y;
  for (double& t : u) t = std::min(t / plate_mm, 0x1.fffffffffffffp-1);
  for (double& t : v) t = std::min(t / plate_mm, 0x1.fffffffffffffp-1);
  const double points = static_cast<double>(job.size());
  const auto ns = [&](auto&& work) { return time_of(runs, work).least / points * 1e9; };
  Json out;
  out["points"] = job.size();
  const double read =
      ns([&] { keep(native::moldloft_read_floor(u.data(), v.data(), job.z.data(), job.size())); });
  const double basis = ns([&] { keep(native::moldloft_basis_floor(u.data(), v.data(), job.size(), 20)); });
  out["read_ns"] = read, out["basis_ns"] = basis;
  table.line("per point, 450,000 points, 20 x 20 cells (least of {} runs)", runs);
  table.line("  read three columns                        {:7.2f} ns   0.27..1.0 elsewhere", read);
  table.line("  span, 4 + 4 basis values, 16 products     {:7.2f} ns   2.4 elsewhere", basis);
  Json kernels = Json::array();
  for (const auto simd : {geometry::Simd::portable, geometry::Simd::avx2, geometry::Simd::avx512}) {
    if (!geometry::machine_has(simd)) continue;
    geometry::MomentAccumulator moments(20, 20, plate, 0, simd);
    const double taken = ns([&] { (void)moments.add(columns(job)); });
    kernels.push_back({{"simd", to_string(simd)}, {"accumulate_ns", taken}});
    if (simd == geometry::widest_simd()) out["accumulate_ns"] = taken;
    table.line("  accumulate, {:8}                      {:7.2f} ns   {:.2f} x the basis floor (asked: <= 5)",
               to_string(simd), taken, taken / basis);
  }
  out["kernels"] = kernels;
  return out;
}

Json nets(const FitJob& job, const Options& options, const Table& table) {
  std::vector<double> u = job.x, v = job.y;
  for (double& t : u) t /= plate_mm;
  for (double& t : v) t /= plate_mm;
  const Fitpack fitpack(job);
  Json out = Json::array();
  table.line("\none net, free boundary (seconds: median; sigma sqrt(N/M) beside the rms)");
  table.line("  {:>7} {:>9} {:>9} {:>9} {:>7} {:>10} {:>10} {:>10} {:>9} {:>10}", "net", "ours s", "Eigen s",
             "FITPACK s", "x Eigen", "rms mm", "theory", "max mm", "bytes", "to Eigen");
  for (const int n : {8, 23, 64}) {
    FittedSurface ours;
    const FitSettings settings{.control_u = n, .control_v = n, .fairing = {.where_sparse = 0}};
    const Seconds our = time_of(options.quick ? 3 : 15, [&] { ours = fit(job, settings); });
    std::vector<double> plain(static_cast<std::size_t>(n) * n);
    const Seconds eigen = time_of(options.quick ? 1 : 5, [&] {
      keep(native::moldloft_plain_eigen_fit(u.data(), v.data(), job.z.data(), job.size(), n, plain.data()));
    });
    // FITPACK takes more than a minute for the largest net.
    std::optional<double> fitpack_s;
    if (!options.quick || n <= 23) fitpack_s = fitpack.seconds(n);
    const FitError error = error_of(ours.surface);
    double apart = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) apart = std::max(apart, std::abs(ours.surface.z(i, j) - plain[i * n + j]));
    }
    const double theory = noise_mm * n / std::sqrt(static_cast<double>(job.size()));
    Json row;
    row["n"] = n, row["ours_s"] = our.median, row["eigen_s"] = eigen.median;
    row["fitpack_s"] = fitpack_s ? Json(*fitpack_s) : Json();
    row["rms_mm"] = error.rms, row["max_mm"] = error.max, row["bytes"] = ours.report.bytes;
    row["theory_rms_mm"] = theory, row["eigen_apart_mm"] = apart;
    out.push_back(row);
    const std::string fitpack_words = fitpack_s ? fmt::format("{:.3f}", *fitpack_s) : "absent";
    table.line(
        "  {:>3} x {:<3}{:>8.5f} {:>9.4f} {:>9} {:>7.1f} {:>10.3e} {:>10.3e} {:>10.3e} {:>9} {:>10.1e}", n, n,
        our.median, eigen.median, fitpack_words, eigen.median / our.median, error.rms, theory, error.max,
        ours.report.bytes, apart);
  }
  table.line("  elsewhere, same job: moments 0.0029 / 0.0033 / 0.0153 s, Eigen 0.26 / 0.27 / 0.32,");
  table.line("  FITPACK 0.53 / 2.15 / 74.7, GoTools 0.40 / 0.40 / 0.52, PCL on_nurbs 10 / 12 / 14");
  return out;
}

Json automatic(const FitJob& job, const Options& options, double fixed_s, const Table& table) {
  FittedSurface chosen;
  const Seconds taken = time_of(options.quick ? 3 : 11, [&] { chosen = fit(job, {}); });
  const FitError error = error_of(chosen.surface);
  Json out;
  out["n"] = chosen.surface.control_u(), out["seconds"] = taken.median, out["rms_mm"] = error.rms;
  out["times_fixed"] = taken.median / fixed_s;
  table.line("\nnet chosen by cross-validation among nets of one pass");
  for (const auto& net : chosen.report.nets) {
    table.line("  {:>2} x {:<2} spans  gcv {:.6e}  bic {:.1f}  sigma {:.6f}{}", net.spans_u, net.spans_v,
               net.gcv, net.bic, net.sigma,
               net.spans_u == chosen.report.nets[chosen.report.chosen].spans_u ? "  <- chosen" : "");
  }
  table.line(
      "  {} x {} in {:.4f} s = {:.1f} x the fixed 23 x 23 (asked: <= 10), rms {:.3e} mm (asked: <= 7e-4)",
      chosen.surface.control_u(), chosen.surface.control_v(), taken.median, taken.median / fixed_s,
      error.rms);
  table.line("  elsewhere: FITPACK with s = M 16.9 s, 1.04e-3; GoTools LR 2.7 s, 1.37e-3");
  return out;
}

void bad_data(const FitJob& job, Json& out, const Table& table) {
  const FitError whole = error_of(fit(job, {.control_u = 23, .control_v = 23}).surface);
  const FittedSurface hole = fit(with_hole(job), {.control_u = 23, .control_v = 23});
  const FitError holed = error_of(hole.surface);
  out["hole_rms_mm"] = holed.rms_inside, out["hole_outside_rms_mm"] = holed.rms_outside;
  const FitJob bad = with_outliers(job);
  const FitError plain = error_of(fit(bad, {.control_u = 23, .control_v = 23}).surface);
  FittedSurface robust;
  const Seconds taken =
      time_of(3, [&] { robust = fit(bad, {.control_u = 23, .control_v = 23, .robust_passes = 10}); });
  const FitError cleaned = error_of(robust.surface);
  out["outlier_rms_mm"] = cleaned.rms, out["outlier_seconds"] = taken.median;
  table.line(
      "\n80 mm hole: {} empty cells, rms inside {:.4f} mm (asked: <= 0.05; FITPACK 44), outside {:.3e} "
      "(whole {:.3e})",
      hole.report.empty_cells, holed.rms_inside, holed.rms_outside, whole.rms_outside);
  table.line("1 % outliers of 3 mm: rms {:.3e} -> {:.3e} mm in {} Tukey passes, {:.3f} s (asked: <= 1e-3)",
             plain.rms, cleaned.rms, robust.report.robust_passes, taken.median);
}

void scaling(const FitJob& job, const Options& options, Json& out, const Table& table) {
  table.line("\npoints, streamed through one accumulator of 20 x 20 cells, with the solution of 23 x 23");
  std::vector<std::pair<double, double>> growth;
  out["scaling"] = Json::array();
  for (const double points : options.quick ? std::vector{1e5, 1e6} : std::vector{1e5, 1e6, 1e7, 1e8}) {
    const FitSettings settings{.control_u = 23, .control_v = 23, .domain = plate};
    const Seconds taken = time_of(points > 1e6 ? 1 : 5, [&] {
      auto moments = *geometry::accumulator_for(settings, job.z[0]);
      for (double left = points; left > 0;) {
        const auto take = static_cast<std::size_t>(std::min(left, static_cast<double>(job.size())));
        (void)moments.add({.u = {job.x.data(), take}, .v = {job.y.data(), take}, .z = {job.z.data(), take}});
        left -= static_cast<double>(take);
      }
      keep(geometry::fit_moments(moments, settings)->report.sigma);
    });
    growth.emplace_back(points, taken.least);
    out["scaling"].push_back({{"points", points}, {"seconds", taken.least}, {"peak_rss_mib", peak_mib()}});
    table.line("  {:>12.0f} points {:>9.5f} s {:>6.2f} ns a point, peak of the process {:.1f} MiB", points,
               taken.least, taken.least / points * 1e9, peak_mib());
  }
  out["scaling_exponent"] = exponent(growth);
  table.line("  exponent {:.3f}", exponent(growth));

  table.line("\ncontrol points, 450,000 points (fold and solve)");
  growth.clear();
  out["control_scaling"] = Json::array();
  for (const int n : options.quick ? std::vector{8, 23} : std::vector{8, 16, 23, 32, 64, 128}) {
    const Seconds taken =
        time_of(n > 64 ? 3 : 9, [&] { keep(fit(job, {.control_u = n, .control_v = n}).report.sigma); });
    growth.emplace_back(n * n, taken.least);
    out["control_scaling"].push_back({{"n", n}, {"seconds", taken.least}});
    table.line("  {:>3} x {:<3} {:>9.5f} s", n, n, taken.least);
  }
  out["control_scaling_exponent"] = exponent(growth);
  table.line("  exponent {:.3f} in the number of control points (the pass over the points is part of it)",
             exponent(growth));
}

Json two_threads(const FitJob& job, const Options& options, const Table& table) {
  const std::size_t half = job.size() / 2;
  const auto part = [&](std::size_t from, std::size_t count) -> PointColumns {
    return {.u = {job.x.data() + from, count},
            .v = {job.y.data() + from, count},
            .z = {job.z.data() + from, count}};
  };
  const int runs = options.quick ? 3 : 15;
  const auto add_all = [&] {
    geometry::MomentAccumulator all(20, 20, plate);
    (void)all.add(columns(job));
    keep(all.totals().squares);
  };
  const auto add_halves = [&] {
    geometry::MomentAccumulator first(20, 20, plate), second(20, 20, plate);
    std::thread other([&] { (void)second.add(part(half, job.size() - half)); });
    (void)first.add(part(0, half));
    other.join();
    first.merge(second);
    keep(first.totals().squares);
  };
  const Seconds one = time_of(runs, add_all), two = time_of(runs, add_halves);
  table.line("\naccumulation on one thread {:.2f} ms, on two with an accumulator each, merged, {:.2f} ms",
             one.least * 1e3, two.least * 1e3);
  return {{"one_thread_s", one.least}, {"two_threads_s", two.least}};
}

}  // namespace

Json run_fit(const Options& options) {
  const Table table{options.quiet};
  const FitJob job = fit_job();
  Json out = floors(job, options, table);
  scaling(job, options, out,
          table);  // first, while the process is small: its peak is what shows that memory is flat
  out["nets"] = nets(job, options, table);
  out["auto"] = automatic(job, options, out["nets"][1]["ours_s"].get<double>(), table);
  bad_data(job, out, table);
  out["threads"] = two_threads(job, options, table);
  return out;
}

}  // namespace moldloft::bench
