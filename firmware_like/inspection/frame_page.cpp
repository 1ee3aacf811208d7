#include "firmware_like/inspection/frame_page.hpp"

#include "firmware_like/process/markup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

constexpr double row_px = 62, left_px = 84, hair_px = 24;  // of the hair diagram; hair: the largest gap
constexpr std::array<int, 13> magnifications{1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000};
constexpr double good_mm = 0.5;  // whole millimetres are read; below half of one there is nothing to do

constexpr std::string_view style = R"(
:root{color-scheme:light;--more:#1f5fae;--less:#b3471b;--good:#1d7a46;--line:#c9d0d8;--soft:#4c5664}
*{box-sizing:border-box}
body{margin:0;background:#fff;color:#10151c;font:16px/1.35 system-ui,"Segoe UI",sans-serif}
main{max-width:760px;margin:0 auto;padding:18px}
header{display:flex;justify-content:space-between;align-items:baseline;gap:12px;border-bottom:3px solid #10151c}
h1{font-size:34px;margin:0}.verdict{font-size:30px;font-weight:700;text-align:right}
.yes{color:var(--good)}.no{color:var(--less)}
p{margin:6px 0;color:var(--soft)}
table{width:100%;border-collapse:collapse;font-variant-numeric:tabular-nums}
th{font-size:15px;color:var(--soft);text-align:left;font-weight:600;padding:4px 6px}
td{border-top:1px solid var(--line);padding:2px 6px;white-space:nowrap}
td.name{font-size:34px;font-weight:700}td.figure{font-size:46px;font-weight:800;text-align:right;width:3.2em}
td.words{font-size:32px;font-weight:700}td.small{font-size:20px;text-align:right}
.more{color:var(--more)}.less{color:var(--less)}.good{color:var(--good)}.none{color:var(--soft)}
.worst td{border-top:1px solid var(--line);font-size:18px;padding:2px 6px}
svg{display:block;width:100%;height:auto;margin-top:10px}
svg text{font:13px system-ui,"Segoe UI",sans-serif;fill:#10151c}.soft{fill:var(--soft)!important}
@media (max-width:520px){h1{font-size:24px}.verdict{font-size:20px}td.name{font-size:22px}td.figure{font-size:28px}
td.words{font-size:19px}td.small{font-size:14px}.slim{display:none}}
@page{size:A4;margin:12mm}
@media print{main{max-width:none;padding:0}svg{max-height:80mm}
td.name{font-size:28px}td.figure{font-size:38px}td.words{font-size:27px}
*{print-color-adjust:exact;-webkit-print-color-adjust:exact}
tr,svg{break-inside:avoid}}
)";

std::string header(const Inspection& i) {
  std::string verdict;
  if (i.verdict == Judgement::passes) verdict = "<div class=\"verdict yes\">within limits</div>";
  if (i.verdict == Judgement::fails) verdict = "<div class=\"verdict no\">outside limits</div>";
  std::string limits;
  for (const auto& r : i.regions)
    limits += fmt::format("{}{} {:+g} to {:+g} mm", limits.empty() ? "Limit: " : ", ", escaped(r.name),
                          r.limit.low_mm, r.limit.high_mm);
  if (i.is_close) limits += ". The worst place is within the uncertainty of its limit";
  return fmt::format(
      "<header><h1>{}</h1>{}</header>\n<p>Against {} ({}), alignment {}. Deviations {:+.1f} to {:+.1f} mm, "
      "rms {:.2f}. "
      "Twist {:+.1f} mm. {}</p>\n",
      escaped(i.plate), verdict, escaped(i.design_file), to_string(i.kind), to_string(i.method),
      std::min(i.inside.least_mm, i.border.count > 0 ? i.border.least_mm : 0.0),
      std::max(i.inside.most_mm, i.border.count > 0 ? i.border.most_mm : 0.0), i.inside.rms_mm, i.twist_mm,
      limits);
}

std::string rows(const Inspection& i) {
  std::string html =
      "<table><tr><th>frame</th><th colspan=\"2\">bend, mm</th><th>open</th><th>pressed</th><th "
      "class=\"slim\">sight mark</th></tr>\n";
  for (const auto& f : i.frame_lines) {
    const auto w = words_for(f);
    const char* kind = w.kind == 2 ? "none" : w.kind > 0 ? "more" : w.kind < 0 ? "less" : "good";
    html += fmt::format(
        "<tr><td class=\"name\">{}</td><td class=\"figure {}\">{}</td><td class=\"words {}\">{}</td><td "
        "class=\"small\">{:.1f}</td>"
        "<td class=\"small\">{:.1f}</td><td class=\"small slim\">{:+.1f}</td></tr>\n",
        escaped(f.name), kind, w.figure, kind, w.words, f.open_mm, f.pressed_mm, f.sight_mm);
  }
  return html + "</table>\n";
}

std::string worst(const Inspection& i) {
  if (i.worst.empty()) return {};
  std::string html =
      "<table class=\"worst\"><tr><th>worst places</th><th>x</th><th>y</th><th>deviation, mm</th></tr>\n";
  for (const auto& w : i.worst)
    html +=
        fmt::format("<tr><td>{}</td><td>{:.0f}</td><td>{:.0f}</td><td>{:+.2f} &plusmn; {:.2f}</td></tr>\n",
                    w.mm > 0 ? "too high" : "too low", w.at.x(), w.at.y(), w.mm, 2 * w.sigma_mm);
  return html + "</table>\n";
}

}  // namespace

FrameWords words_for(const FrameLine& f) {
  if (f.measured < 3) return {"-", "not measured", 2};
  if (std::abs(f.bend_mm) < good_mm) return {"0", "good", 0};
  return {fmt::format("{:+.0f}", f.bend_mm), f.bend_mm > 0 ? "bend more" : "too much",
          f.bend_mm > 0 ? 1 : -1};
}

std::string hair_diagram(const std::vector<FrameLine>& lines, double width_px) {
  double most = 0, reach = 0;
  for (const auto& f : lines) {
    for (const auto& p : f.pins) {
      if (const auto gap = p.gap_mm()) most = std::max(most, std::abs(*gap));
      reach = std::max(reach, std::abs(p.way_mm));
    }
  }
  if (!(reach > 0)) return {};
  const double px_per_mm = (width_px - left_px - 20) / (2 * reach);
  // One number that a person can say, and the largest hair still fits between two frames.
  int magnification = 1;
  for (const int m : magnifications) {
    if (most * m * px_per_mm <= hair_px) magnification = m;
  }
  const double hair = magnification * px_per_mm;
  const double height = row_px * static_cast<double>(lines.size()) + 26,
               middle = left_px + (width_px - left_px - 20) / 2;
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"gaps at all pins\">\n", width_px, height);
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const auto& f = lines[n];
    const double base = row_px * (static_cast<double>(n) + 0.5) + 4;
    svg += fmt::format("<text x=\"4\" y=\"{:.1f}\" font-weight=\"700\">{}</text>", base + 4, escaped(f.name));
    std::string curve, hairs, ground;
    for (const auto& p : f.pins) {
      const double x = middle + p.way_mm * px_per_mm;
      ground += fmt::format("{}{:.1f},{:.1f}", ground.empty() ? "" : " ", x, base);
      const auto gap = p.gap_mm();
      if (!gap) continue;
      const double tip = base - std::clamp(*gap * hair, -row_px / 2, row_px / 2);
      curve += fmt::format("{}{:.1f},{:.1f}", curve.empty() ? "" : " ", x, tip);
      hairs += fmt::format("M{:.1f} {:.1f}V{:.1f}", x, base, tip);
      svg += fmt::format(
          "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"soft\" "
          "font-size=\"10\">{}</text>",
          x, *gap >= 0 ? base + 13 : base - 5, std::abs(*gap) < 0.05 ? "0" : fmt::format("{:+.1f}", *gap));
    }
    svg += fmt::format(
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#10151c\" stroke-width=\"1.2\"/><path d=\"{}\" "
        "stroke=\"#1f5fae\" "
        "stroke-width=\"1.6\"/><polyline points=\"{}\" fill=\"none\" stroke=\"#b3471b\" "
        "stroke-width=\"1.6\"/>\n",
        ground, hairs, curve);
  }
  svg += fmt::format(
      "<text x=\"4\" y=\"{:.1f}\" class=\"soft\">black: design; red: plate, its gaps drawn {} times as large "
      "as the plate; "
      "above the line: too high</text></svg>\n",
      height - 6, magnification);
  return svg;
}

std::string frame_page(const Inspection& i) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>Frames of "
      "{}</title><style>{}</style></head><body><main>\n{}{}{}{}"
      "</main></body></html>\n",
      escaped(i.plate), style, header(i), rows(i), hair_diagram(i.frame_lines, 720), worst(i));
}

}  // namespace moldloft::firmware_like
