#include "firmware_like/report/measurement_page.hpp"

#include "firmware_like/process/json_file.hpp"
#include "firmware_like/process/markup.hpp"
#include "firmware_like/process/whole_file.hpp"
#include "firmware_like/report/findings_text.hpp"
#include "firmware_like/report/picture.hpp"
#include "firmware_like/report/timing_page.hpp"
#include "firmware_like/results/plate_field.hpp"
#include "firmware_like/results/stored_result.hpp"
#include "firmware_like/results/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

namespace moldloft::firmware_like {
namespace {

constexpr double good_bend_mm = 0.5;  // whole millimetres are read: below half of one nothing is to be done

std::string base64(std::string_view bytes) {
  constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : letters[three >> (18 - 6 * k) & 63];
  }
  return out;
}

// As a picture of its own: its style must not reach the page's, nor the page's it.
std::string pictured(std::string_view svg, std::string_view words) {
  if (svg.empty()) return {};
  return fmt::format("<figure><img alt=\"{0}\" src=\"data:image/svg+xml;base64,{1}\"/></figure>\n",
                     escaped(words), base64(svg));
}

std::string tile(std::string_view name, const std::string& value) {
  return fmt::format("<div class=\"tile\"><span>{}</span><b>{}</b></div>\n", name, value);
}

std::string tiles(const RunResult& r) {
  std::string html = "<div class=\"tiles\">\n";
  if (r.measured) {
    const auto& corners = r.measured->outline.corners;
    const auto side = [&](std::size_t i) { return (corners[(i + 1) % 4] - corners[i]).norm(); };
    const auto shape = shape_field(r.measured->surface, 24);
    const auto [low, high] = std::ranges::minmax(shape.values);
    html +=
        tile("size, mm", fmt::format("{:.0f} x {:.0f}", (side(0) + side(2)) / 2, (side(1) + side(3)) / 2)) +
        tile("depth, mm", fmt::format("{:.1f}", high - low)) +
        tile("noise of a point, mm", fmt::format("{:.3f}", r.measured->fit.sigma_mm)) +
        tile("points", fmt::format("{}", r.measured->fit.points_used));
  }
  html += tile("shots", fmt::format("{}", r.shots.seek + r.shots.boundary + r.shots.surface)) +
          tile("cell time", fmt::format("{:.0f} s", r.cycle.seconds));
  return html + "</div>\n";
}

// The map as a picture in the plate's own colours.
std::string deviation_map(const RunResult& r, const Json& map) {
  const int rows = map.at("rows"), columns = map.at("columns");
  const auto& values = map.at("mm");
  if (!r.measured || rows < 2 || columns < 2 || values.size() != static_cast<std::size_t>(rows * columns))
    return {};
  PlateField field;
  // Cells between the map's places: the mean of their four.
  field.count_u = rows - 1, field.count_v = columns - 1;
  field.title = "Deviation from the design: red is too high, blue too low";
  field.unit = "mm";
  const auto value = [&](int i, int k) {
    const auto& v = values[static_cast<std::size_t>(i * columns + k)];
    return v.is_number() ? v.get<double>() : NAN;
  };
  for (int i = 0; i + 1 < rows; ++i) {
    for (int k = 0; k + 1 < columns; ++k)
      field.values.push_back((value(i, k) + value(i + 1, k) + value(i, k + 1) + value(i + 1, k + 1)) / 4);
  }
  OverviewInput in;
  in.title = "Where the plate differs from its design";
  in.surface = &r.measured->surface;
  in.corners = r.measured->outline.corners;
  in.field_x_mm = r.track.field_x_mm, in.field_y_mm = r.track.field_y_mm;
  in.fields.push_back(std::move(field));
  return overview_svg(in);
}

std::string bars(const Json& histogram) {
  constexpr double width = 720, height = 150, ground = 126;
  std::size_t most = 1;
  for (const auto& bin : histogram) most = std::max(most, bin.at(2).get<std::size_t>());
  const double step = width / static_cast<double>(std::max<std::size_t>(histogram.size(), 1));
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"histogram of the deviations\">\n", width, height);
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    const double tall =
        (ground - 6) * static_cast<double>(histogram[i].at(2).get<std::size_t>()) / static_cast<double>(most);
    svg += fmt::format("<rect class=\"s0\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
                       static_cast<double>(i) * step, ground - tall, step - 1, tall);
  }
  if (!histogram.empty()) {
    const double low = histogram.front().at(0), high = histogram.back().at(1);
    for (const double part : {0.0, 0.25, 0.5, 0.75, 1.0})
      svg += fmt::format("<text class=\"tick\" x=\"{:.0f}\" y=\"144\" text-anchor=\"{}\">{:+.2f} mm</text>\n",
                         part * width,
                         part == 0   ? "start"
                         : part == 1 ? "end"
                                     : "middle",
                         low + part * (high - low));
  }
  return svg + "</svg>\n";
}

std::string frames(const Json& lines) {
  if (lines.empty()) return {};
  std::string html =
      "<div class=\"wide\"><table>\n<thead><tr><th>frame</th><th class=\"word\">bend, mm</th><th>open, "
      "mm</th><th>pressed, mm</th>"
      "<th>sight mark, mm</th></tr></thead>\n<tbody>\n";
  for (const auto& f : lines) {
    const double bend = f.at("bend_mm");
    const std::string words = std::abs(bend) < good_bend_mm
                                  ? "good"
                                  : fmt::format("{:+.1f} {}", bend, bend > 0 ? "bend more" : "too much");
    html += fmt::format(
        "<tr><td>{}</td><td class=\"word{}\">{}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:+.1f}</td></tr>\n",
        escaped(f.at("name").get<std::string>()), std::abs(bend) < good_bend_mm ? " good" : "", words,
        f.at("open_mm").get<double>(), f.at("pressed_mm").get<double>(), f.at("sight_mm").get<double>());
  }
  return html + "</tbody></table></div>\n";
}

std::string inspection_section(const RunResult& r, const Json& i) {
  if (!i.is_object()) return {};
  const std::string verdict = i.at("verdict");
  const bool judged = verdict != "not judged", passes = verdict == "passes";
  const auto& inside = i.at("inside");
  const auto mm = [](const Json& from, const char* key) { return from.at(key).get<double>(); };
  std::string html = "<section>\n<h2>Is the plate right?</h2>\n";
  html += fmt::format(
      "<div class=\"verdict {}\"><b>{}</b> Against {}: {:+.2f} to {:+.2f} mm, rms {:.2f} mm, alignment "
      "{}.{}</div>\n",
      judged && !passes ? "no" : "yes",
      !judged  ? "Compared, not judged."
      : passes ? "Within its limits."
               : "Outside its limits.",
      escaped(i.at("design").at("file").get<std::string>()), mm(inside, "min_mm"), mm(inside, "max_mm"),
      mm(inside, "rms_mm"), escaped(i.at("alignment").at("method").get<std::string>()),
      i.value("close_to_limit", false) ? " The worst place is within the uncertainty of its limit." : "");
  if (i.contains("map")) html += pictured(deviation_map(r, i.at("map")), "deviation from the design");
  html += bars(i.at("histogram")) + frames(i.at("frames"));
  html +=
      "<div class=\"wide\"><table>\n<thead><tr><th>worst places</th><th>x, mm</th><th>y, "
      "mm</th><th>deviation, mm</th></tr></thead>\n<tbody>\n";
  for (const auto& w : i.at("worst"))
    html +=
        fmt::format("<tr><td>{}</td><td>{:.0f}</td><td>{:.0f}</td><td>{:+.2f} &plusmn; {:.2f}</td></tr>\n",
                    mm(w, "mm") > 0 ? "too high" : "too low", w.at("at").at(0).get<double>(),
                    w.at("at").at(1).get<double>(), mm(w, "mm"), 2 * mm(w, "sigma_mm"));
  html += "</tbody></table></div>\n";
  for (const auto& remark : i.at("remarks"))
    html += fmt::format("<p class=\"soft\">{}.</p>\n", escaped(remark.get<std::string>()));
  return html + "</section>\n";
}

std::string provenance(const RunResult& r) {
  std::string rows;
  const auto row = [&](std::string_view name, const std::string& value) {
    if (!value.empty()) rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", name, escaped(value));
  };
  row("plate", r.label.plate);
  row("remark", r.label.remark);
  row("cell", r.cell);
  row("begun", r.label.begun);
  row("program",
      fmt::format("moldloft {}, commit {}, {}", r.program.version, r.program.commit, r.program.build));
  if (r.measured) {
    const auto& s = r.measured->surface;
    row("surface", fmt::format("bicubic B-spline, {} x {} control points; tolerance {:g} mm", s.control_u(),
                               s.control_v(), r.measured->tolerance_mm));
    row("outline",
        fmt::format("{} edge points, {:.3f} mm rms about it", r.edge_points, r.measured->outline.rms_mm));
    row("heights of shots",
        fmt::format("{:.4f} mm rms, at most {:.4f} mm", r.measured->fit.shot_offset_rms_mm,
                    r.measured->fit.shot_offset_max_mm));
  }
  row("shots", fmt::format("{} seeking, {} boundary, {} surface, {} retaken", r.shots.seek, r.shots.boundary,
                           r.shots.surface, r.shots.retaken));
  row("fitted from", r.fitted_from);
  return "<section>\n<h2>Settings and origin</h2>\n<div class=\"wide\"><table class=\"words\"><tbody>\n" +
         rows + "</tbody></table></div>\n</section>\n";
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in{path, std::ios::binary};
  return in ? std::string{std::istreambuf_iterator<char>{in}, {}} : std::string{};
}

}  // namespace

std::string measurement_page(const RunResult& r, std::string_view overview, const Json& inspection) {
  const std::string first = findings_section(r) + tiles(r) + pictured(overview, "the plate in plan view") +
                            inspection_section(r, inspection) + provenance(r);
  return timing_page(r.timing, r.label.plate, about_run(r), first);
}

std::expected<void, Failure> write_report(const std::filesystem::path& folder) {
  const auto result = read_result(folder);
  if (!result) return std::unexpected(result.error());
  std::error_code failed;
  Json inspection;
  if (std::filesystem::exists(folder / "inspection.json", failed)) {
    auto read = read_json(folder / "inspection.json");
    if (!read) return std::unexpected(read.error());
    inspection = std::move(*read);
  }
  try {
    return write_file(folder / "report.html",
                      measurement_page(*result, text_of(folder / "overview.svg"), inspection));
  } catch (const Json::exception& e) {
    return std::unexpected(Failure{
        fmt::format("{}: was not written by this version of moldloft ({})", folder.string(), e.what())});
  }
}

}  // namespace moldloft::firmware_like
