#include "firmware_like/report/log_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

using tasks::Histogram;
using namespace std::chrono_literals;

constexpr double left_px = 64, right_px = 18, bottom_px = 46;
constexpr double legend_line_px = 18;
constexpr double time_label_px = 58, digit_px = 7.2;  // at 12 px
constexpr double bars_an_octave = 8;

struct Bar {
  double from_ns = 0, to_ns = 0;
  std::vector<std::uint64_t> counts;  // of each series
};

// From a bit below the smallest value to a bit above the largest; in whole microseconds where asked for.
std::vector<Bar> bars_for(const LogPlot& plot) {
  double lowest = INFINITY, highest = 0;
  for (const auto& s : plot.series) {
    if (s.values.empty()) continue;
    lowest = std::min(lowest, static_cast<double>(s.values.min().count()));
    highest = std::max(highest, static_cast<double>(s.values.max().count()));
  }
  if (!(lowest <= highest)) return {};
  const double unit = plot.whole_us ? 1000 : 1;
  const double smallest = std::max(static_cast<double>(plot.smallest.count()), unit);
  const auto edge = [&](int i) { return std::floor(std::exp2(i / bars_an_octave) / unit + 0.5) * unit; };
  int i = static_cast<int>(std::floor(std::log2(std::max(lowest, smallest)) * bars_an_octave));
  if (lowest > smallest) --i;
  std::vector<Bar> bars;
  for (double from = edge(i); bars.empty() || from <= highest; ++i) {
    const double to = edge(i + 1);
    if (to <= from) continue;
    bars.push_back({from, to, std::vector<std::uint64_t>(plot.series.size())});
    from = to;
  }
  return bars;
}

void count_into(std::vector<Bar>& bars, std::size_t s, const Histogram& h) {
  if (bars.empty()) return;
  for (std::size_t i = 0; i < Histogram::size(); ++i) {
    if (h.in_bucket(i) == 0) continue;
    const double middle =
        0.5 * static_cast<double>((Histogram::lower_limit(i) + Histogram::upper_limit(i)).count());
    auto bar = std::ranges::upper_bound(bars, middle, {}, &Bar::to_ns);
    if (bar == bars.end()) --bar;
    bar->counts[s] += h.in_bucket(i);
  }
  bars.back().counts[s] += h.overflows();
}

struct Axes {
  double width_px, height_px, top_px;
  double from, to;  // log10 of nanoseconds
  double top;       // log10 of counts
  double decade_px() const { return (width_px - left_px - right_px) / (to - from); }
  double x(double ns) const {
    return left_px + (std::log10(std::max(ns, 1e-3)) - from) / (to - from) * (width_px - left_px - right_px);
  }
  double y(double count) const {  // one value stands well above nothing
    const double part = count < 0.5 ? 0 : (std::log10(count) + 0.35) / (top + 0.35);
    return height_px - bottom_px - part * (height_px - top_px - bottom_px);
  }
};

std::string count_text(double count) {
  return count < 1e3   ? fmt::format("{:.0f}", count)
         : count < 1e6 ? fmt::format("{:.0f} k", count / 1e3)
                       : fmt::format("{:.0f} M", count / 1e6);
}

std::string grid(const Axes& axes) {
  std::string svg;
  const double bottom = axes.height_px - bottom_px;
  const bool has_room_between = std::log10(2.0) * axes.decade_px() > time_label_px;
  const double every = std::ceil(time_label_px / axes.decade_px());  // of the decades a label
  for (double decade = std::floor(axes.from); decade <= axes.to + 1e-9; ++decade) {
    for (int digit = 1; digit < 10; ++digit) {
      const double ns = digit * std::pow(10.0, decade), x = axes.x(ns);
      if (x < left_px - 0.5 || x > axes.width_px - right_px + 0.5) continue;
      const bool labelled =
          digit == 1 ? std::fmod(decade, every) == 0 : (digit == 2 || digit == 5) && has_room_between;
      svg += fmt::format(R"(<line class="{}" x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}"/>)",
                         digit == 1 ? "grid" : "fine", x, axes.top_px, x, bottom);
      if (labelled)
        svg += fmt::format(R"(<text class="tick" x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)", x,
                           bottom + 16, time_text(hal::Duration{std::llround(ns)}));
    }
  }
  for (double decade = 0; decade <= axes.top + 1e-9; ++decade) {
    const double y = axes.y(std::pow(10.0, decade));
    svg += fmt::format(R"(<line class="grid" x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}"/>)", left_px, y,
                       axes.width_px - right_px, y);
    svg += fmt::format(R"(<text class="tick" x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>)", left_px - 8,
                       y + 4, count_text(std::pow(10.0, decade)));
  }
  return svg;
}

// The outline of the bars, closed along the axis.
std::string outline(const std::vector<Bar>& bars, std::size_t s, const Axes& axes) {
  const double bottom = axes.y(0);
  std::string path = fmt::format("M{:.1f} {:.1f}", axes.x(bars.front().from_ns), bottom);
  for (const auto& bar : bars) {
    const double y = axes.y(static_cast<double>(bar.counts[s]));
    path += fmt::format("V{:.1f}H{:.1f}", y, axes.x(bar.to_ns));
  }
  return fmt::format(R"(<path class="s{}" d="{}V{:.1f}Z"/>)", s, path, bottom);
}

// Names beside their colours, in as many lines as they need; how many that are is left in `lines`.
std::string legend(const std::vector<LogSeries>& series, double width_px, int& lines) {
  std::string svg;
  double x = left_px + 4;
  lines = series.size() > 1 ? 1 : 0;
  for (std::size_t s = 0; s < series.size() && series.size() > 1; ++s) {
    const double length = 24 + digit_px * static_cast<double>(series[s].name.size());
    if (s > 0 && x + length > width_px) {
      ++lines;
      x = left_px + 4;
    }
    const double y = 6 + (lines - 1) * legend_line_px;
    svg += fmt::format(R"(<rect class="s{}" x="{:.1f}" y="{:.1f}" width="18" height="10"/>)", s, x, y);
    svg +=
        fmt::format(R"(<text class="tick" x="{:.1f}" y="{:.1f}">{}</text>)", x + 24, y + 9, series[s].name);
    x += length + 28;
  }
  return svg;
}

}  // namespace

std::string time_text(hal::Duration d) {
  const auto text = [](double v, std::string_view unit) {
    return fmt::format("{:.{}f} {}", v,
                       v < 9.995 && v != std::floor(v)   ? 2
                       : v < 99.95 && v != std::floor(v) ? 1
                                                         : 0,
                       unit);
  };
  const auto ns = static_cast<double>(d.count());
  if (ns < 1e3) return text(ns, "ns");
  if (ns < 1e6) return text(ns / 1e3, "us");
  if (ns < 1e9) return text(ns / 1e6, "ms");
  return text(ns / 1e9, "s");
}

std::string log_plot(const LogPlot& plot) {
  auto bars = bars_for(plot);
  for (std::size_t s = 0; s < plot.series.size(); ++s) count_into(bars, s, plot.series[s].values);
  double most = 1;
  for (const auto& bar : bars)
    for (const auto count : bar.counts) most = std::max(most, static_cast<double>(count));
  int legend_lines = 0;
  const std::string names = legend(plot.series, plot.width_px, legend_lines);
  Axes axes{.width_px = plot.width_px,
            .height_px = plot.height_px,
            .top_px = 8 + std::max(1, legend_lines) * legend_line_px,
            .from = 3,
            .to = 6,
            .top = std::log10(most) + 0.08};
  if (!bars.empty()) {
    axes.from = std::log10(bars.front().from_ns) - 0.02;
    axes.to = std::max(std::log10(bars.back().to_ns) + 0.02, axes.from + 1);
  }
  std::string svg = fmt::format(R"(<svg viewBox="0 0 {} {}" role="img" aria-label="{}">)", plot.width_px,
                                plot.height_px, plot.label);
  svg += grid(axes);
  for (std::size_t s = 0; s < plot.series.size() && !bars.empty(); ++s) svg += outline(bars, s, axes);
  svg += names;
  svg += fmt::format(R"(<text class="tick" x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)",
                     (left_px + plot.width_px - right_px) / 2, plot.height_px - 8, plot.label);
  svg += fmt::format(
      R"svg(<text class="tick" x="14" y="{0:.1f}" text-anchor="middle" transform="rotate(-90 14 {0:.1f})">)svg",
      plot.height_px / 2);
  return svg + "how often</text></svg>\n";
}

}  // namespace moldloft::firmware_like
