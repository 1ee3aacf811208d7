#include "firmware_like/report/picture.hpp"

#include "firmware_like/process/markup.hpp"
#include "hal/base/printable_text.hpp"

#include <Eigen/Dense>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace moldloft::firmware_like {
namespace {

using Eigen::Vector2d;

// The picture is as wide as a sheet's column, panels one under the other: on a telephone of 400 px its letters are 9 px
// high, on A4 upright it fills the width.
constexpr double margin_px = 24;
constexpr double panel_px = 480, tallest_px = 460;  // a panel's plot fits into these
constexpr double scale_px = 92;                     // beside a plot: the colours and their values
constexpr double above_px = 34, under_px = 40;  // over a plot: its title; under it: the bar of round length
constexpr double width_px = 2 * margin_px + panel_px + scale_px;
constexpr double letters_px = 15, title_px = 20, line_px = 20;
constexpr double letter_width = 0.56;  // of a line of sans-serif, in letters' heights
constexpr int colours = 33;            // odd, so that zero has a colour of its own

struct View {  // from world millimetres to pixels of one panel; y up becomes y down
  Vector2d min, max;
  double scale = 1, left = 0, top = 0;
  Vector2d px(const Vector2d& p) const {
    return {left + (p.x() - min.x()) * scale, top + (max.y() - p.y()) * scale};
  }
};

void extend(View& view, const Vector2d& p) {
  view.min = view.min.cwiseMin(p);
  view.max = view.max.cwiseMax(p);
}

std::array<Vector2d, 4> field_corners(const tasks::ShotPlace& place, double width, double height) {
  const double c = std::cos(place.head_yaw), s = std::sin(place.head_yaw);
  std::array<Vector2d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const double x = (i == 0 || i == 3 ? -0.5 : 0.5) * width, y = (i < 2 ? -0.5 : 0.5) * height;
    corners[i] = place.centre.head<2>() + Vector2d{c * x - s * y, s * x + c * y};
  }
  return corners;
}

std::vector<Vector2d> border_of(const geometry::BSplineSurface& surface) {
  constexpr int steps = 60;
  std::vector<Vector2d> border;
  const auto side = [&](auto uv) {
    for (int i = 0; i < steps; ++i) {
      const auto [u, v] = uv(static_cast<double>(i) / steps);
      const Eigen::Vector3d p = surface.at(u, v).value;
      border.emplace_back(p.x(), p.y());
    }
  };
  side([](double t) { return std::pair{t, 0.0}; });
  side([](double t) { return std::pair{1.0, t}; });
  side([](double t) { return std::pair{1 - t, 1.0}; });
  side([](double t) { return std::pair{0.0, 1 - t}; });
  return border;
}

void extend_by_fields(View& view, std::span<const tasks::ShotPlace> places, const OverviewInput& in) {
  for (const auto& place : places) {
    for (const auto& corner : field_corners(place, in.field_x_mm, in.field_y_mm)) extend(view, corner);
  }
}

// What is drawn is inside: outline, tracker's path, shots of the surface. The fields of the boundary shots, half of
// which lie off the plate, count only while there is little else.
View view_of(const OverviewInput& in) {
  View view{.min = {INFINITY, INFINITY}, .max = {-INFINITY, -INFINITY}};
  extend_by_fields(view, in.surface_places, in);
  if (in.surface_places.empty()) extend_by_fields(view, in.boundary_places, in);
  for (const auto& place : in.boundary_places) extend(view, place.centre.head<2>());
  for (const auto& p : in.edge_points) extend(view, p);
  for (const auto& p : in.corners) extend(view, p);
  if (in.surface != nullptr) {
    for (const auto& p : border_of(*in.surface)) extend(view, p);
  }
  if (!std::isfinite(view.min.x())) view = {.min = {0, 0}, .max = {1, 1}};
  const Vector2d border = Vector2d::Constant(0.02 * (view.max - view.min).maxCoeff());
  view.min -= border;
  view.max += border;
  return view;
}

// Where the panels stand: one under the other, below the head's lines.
struct Layout {
  std::size_t panels = 1;
  double head = 0, plot_width = 0, plot_height = 0;

  double top(std::size_t i) const {
    return head + above_px + static_cast<double>(i) * (plot_height + above_px + under_px);
  }
  double bottom() const { return top(panels - 1) + plot_height + under_px; }
};

Layout lay_out(std::size_t panels, double head, View& view) {
  const Vector2d size = (view.max - view.min).cwiseMax(1e-9);
  view.scale = std::min(panel_px / size.x(), tallest_px / size.y());
  return {.panels = panels,
          .head = head,
          .plot_width = size.x() * view.scale,
          .plot_height = size.y() * view.scale};
}

// A text in lines that fit into the picture, cut between words. If a part of the sentence ends in a line's
// last third, the cut is there, so that a number does not lose its unit. A word that is longer than a line is
// cut in itself.
std::vector<std::string> lines_of(std::string_view text, double height_px) {
  const auto columns = static_cast<std::size_t>((width_px - 2 * margin_px) / (letter_width * height_px));
  const auto continues = [&](std::size_t at) {
    return (static_cast<unsigned char>(text[at]) & 0xC0u) == 0x80u;
  };
  std::vector<std::string> lines;
  while (text.size() > columns) {
    std::size_t end = text.rfind(' ', columns);
    for (std::size_t at = end; at != std::string_view::npos && at > columns * 2 / 3;
         at = text.rfind(' ', at - 1)) {
      if (text[at - 1] != ',' && text[at - 1] != ';') continue;
      end = at;
      break;
    }
    if (end == std::string_view::npos || end == 0) {
      for (end = columns; end > 1 && continues(end);) --end;
    }
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(end);
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  }
  if (!text.empty()) lines.emplace_back(text);
  return lines;
}

// Blue below zero, white at zero, red above: readable for the colour-blind as well.
std::string colour(double part) {
  const double t = std::clamp(part, -1.0, 1.0);
  const std::array<double, 3> low{33, 102, 172}, mid{247, 247, 247}, high{178, 24, 43};
  const auto& end = t < 0 ? low : high;
  const double a = std::pow(std::abs(t), 0.85);
  const auto mix = [&](std::size_t i) {
    return static_cast<int>(std::lround(mid[i] + a * (end[i] - mid[i])));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(0), mix(1), mix(2));
}

double nice_limit(const PlateField& field) {
  std::vector<double> sizes;
  for (const double v : field.values) {
    if (std::isfinite(v)) sizes.push_back(std::abs(v) * field.scale);
  }
  if (sizes.empty()) return 1;
  // Nearly all: a single wild cell must not take the colour out of the rest.
  const auto nth = sizes.begin() + static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), nth, sizes.end());
  const double decade = std::pow(10, std::floor(std::log10(std::max(*nth, 1e-12))));
  for (const double step : {1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0}) {
    if (step * decade >= *nth) return step * decade;
  }
  return 10 * decade;
}

// One path for each colour: cells of a colour together, so that the file stays small.
std::string cells(const geometry::BSplineSurface& surface, const PlateField& field, const View& view,
                  double limit) {
  std::vector<Vector2d> nodes(static_cast<std::size_t>((field.count_u + 1) * (field.count_v + 1)));
  const auto node = [&](int i, int j) -> Vector2d& {
    return nodes[static_cast<std::size_t>(i * (field.count_v + 1) + j)];
  };
  for (int i = 0; i <= field.count_u; ++i) {
    for (int j = 0; j <= field.count_v; ++j) {
      const auto p =
          surface.at(static_cast<double>(i) / field.count_u, static_cast<double>(j) / field.count_v);
      node(i, j) = view.px(p.value.head<2>());
    }
  }
  std::map<int, std::string> paths;
  for (int i = 0; i < field.count_u; ++i) {
    for (int j = 0; j < field.count_v; ++j) {
      const double value = field.values[static_cast<std::size_t>(i * field.count_v + j)] * field.scale;
      if (!std::isfinite(value)) continue;
      const int level = static_cast<int>(std::lround(std::clamp(value / limit, -1.0, 1.0) * (colours / 2)));
      auto& path = paths[level];
      const Vector2d a = node(i, j), b = node(i + 1, j), c = node(i + 1, j + 1), d = node(i, j + 1);
      path += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f} {:.1f} {:.1f} {:.1f} {:.1f}z", a.x(), a.y(), b.x(),
                          b.y(), c.x(), c.y(), d.x(), d.y());
    }
  }
  std::string svg;
  for (const auto& [level, path] : paths) {
    const std::string fill = colour(static_cast<double>(level) / (colours / 2));
    // A hairline in the same colour closes the seams that anti-aliasing leaves between cells.
    svg += fmt::format("<path d='{}' fill='{}' stroke='{}' stroke-width='.6'/>\n", path, fill, fill);
  }
  return svg;
}

std::string legend(const PlateField& field, double limit, double left, double top, double height) {
  std::string svg;
  const double step = height / colours;
  for (int i = 0; i < colours; ++i) {
    svg += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='14' height='{:.1f}' fill='{}'/>\n", left,
                       top + i * step, step + 0.5, colour(1 - 2.0 * i / (colours - 1)));
  }
  for (const double part : {1.0, 0.5, 0.0, -0.5, -1.0}) {
    const std::string value = part == 0 ? "0" : fmt::format("{:+g}", part * limit);
    svg += fmt::format("<text x='{:.1f}' y='{:.1f}'>{}</text>\n", left + 20,
                       top + (1 - part) / 2 * height + 5, value);
  }
  svg += fmt::format("<text x='{:.1f}' y='{:.1f}'>{}</text>\n", left, top - 10, field.unit);
  return svg;
}

std::string polyline(std::span<const Vector2d> points, const View& view, std::string_view style,
                     bool closed) {
  std::string path;
  for (const auto& p : points) {
    const Vector2d q = view.px(p);
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", q.x(), q.y());
  }
  return fmt::format("<path d='{}{}' fill='none' {}/>\n", path, closed ? "z" : "", style);
}

std::string overlay(const OverviewInput& in, const View& view, bool numbers) {
  std::string svg;
  int number = 0;
  for (const auto& place : in.surface_places) {
    svg += polyline(field_corners(place, in.field_x_mm, in.field_y_mm), view,
                    "stroke='#222' stroke-width='.7' stroke-opacity='.45'", true);
    const Vector2d c = view.px(place.centre.head<2>());
    if (numbers)
      svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='shot'>{}</text>\n", c.x(), c.y() + 4, ++number);
  }
  std::vector<Vector2d> path;
  for (const auto& place : in.boundary_places) path.emplace_back(place.centre.head<2>());
  if (!path.empty())
    svg += polyline(path, view, "stroke='#e08214' stroke-width='1.4' stroke-dasharray='5 3'", false);
  for (const auto& p : path) {
    const Vector2d q = view.px(p);
    svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2.6' fill='#e08214'/>\n", q.x(), q.y());
  }
  return svg;
}

std::string outline(const OverviewInput& in, const View& view) {
  std::string svg;
  if (in.surface != nullptr) {
    const auto border = border_of(*in.surface);
    svg += polyline(border, view, "stroke='#111' stroke-width='1.6'", true);
  } else {
    for (const auto& p : in.edge_points) {
      const Vector2d q = view.px(p);
      svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='.8' fill='#111'/>\n", q.x(), q.y());
    }
  }
  for (const auto& corner : in.corners) {
    const Vector2d q = view.px(corner);
    svg +=
        fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='none' stroke='#111' stroke-width='1.4'/>\n",
                    q.x(), q.y());
  }
  return svg;
}

// Numbered as in the list of findings on the run's page.
std::string marks(const OverviewInput& in, const View& view) {
  std::string svg;
  for (std::size_t i = 0; i < in.findings.size(); ++i) {
    if (!in.findings[i].place) continue;
    const Vector2d q = view.px(*in.findings[i].place);
    svg += fmt::format(
        "<circle cx='{0:.1f}' cy='{1:.1f}' r='9' fill='none' stroke='#c00' stroke-width='2.4'/>"
        "<text x='{2:.1f}' y='{3:.1f}' class='mark'>{4}</text>\n",
        q.x(), q.y(), q.x() + 11, q.y() - 7, i + 1);
  }
  return svg;
}

// A bar of a round length, so that the eye has a measure.
std::string scale_bar(const View& view, double bottom) {
  const double wanted = (view.max.x() - view.min.x()) / 4;
  const double decade = std::pow(10, std::floor(std::log10(wanted)));
  const double length = wanted >= 5 * decade ? 5 * decade : wanted >= 2 * decade ? 2 * decade : decade;
  return fmt::format(
      "<path d='M{0:.1f} {1:.1f}v6h{2:.1f}v-6' fill='none' stroke='#111'/><text x='{3:.1f}' "
      "y='{4:.1f}'>{5:g} mm</text>\n",
      view.left, bottom + 10, length * view.scale, view.left + length * view.scale + 8, bottom + 20, length);
}

std::string coloured_plate(const OverviewInput& in, const PlateField& field, const View& view,
                           const Layout& layout) {
  const double limit = nice_limit(field), bar = std::min(layout.plot_height - 20, 260.0);
  return fmt::format("<text x='{:.1f}' y='{:.1f}'>{}</text>\n", view.left, view.top - 12,
                     escaped(field.title)) +
         cells(*in.surface, field, view, limit) +
         legend(field, limit, view.left + layout.plot_width + 12, view.top + (layout.plot_height - bar) / 2,
                bar);
}

std::string legend_line(const OverviewInput& in) {
  std::string line =
      in.surface != nullptr ? "black: outline and corners" : "black: edge points and corners seen";
  if (!in.boundary_places.empty()) line += "; orange: the tracker's path";
  if (!in.surface_places.empty()) line += "; squares: the shots of the zig-zag, numbered";
  if (std::ranges::any_of(in.findings, [](const Finding& f) { return f.place.has_value(); }))
    line += "; red: what the audit has found, numbered as in report.html";
  return line + "; world coordinates";
}

}  // namespace

std::string overview_svg(const OverviewInput& in) {
  View view = view_of(in);
  double y = margin_px;
  const auto write = [&](std::string_view words, double height, std::string_view style) {
    std::string svg;
    for (const auto& line : lines_of(words, height)) {
      svg += fmt::format("<text x='{:.0f}' y='{:.1f}'{}>{}</text>\n", margin_px, y, style, escaped(line));
      y += line_px * height / letters_px;
    }
    return svg;
  };
  // One after the other: the operands of a sum are evaluated in any order, and each moves y on.
  std::string body = write(in.title, title_px, " class='title'");
  body += write(in.subtitle, letters_px, "");
  body += write(in.about, letters_px, "");
  const Layout layout = lay_out(std::max<std::size_t>(in.fields.size(), 1), y - letters_px, view);
  for (std::size_t i = 0; i < layout.panels; ++i) {
    view.left = margin_px;
    view.top = layout.top(i);
    if (i < in.fields.size() && in.surface != nullptr) body += coloured_plate(in, in.fields[i], view, layout);
    body += overlay(in, view, i == 0) + outline(in, view) + marks(in, view) +
            scale_bar(view, view.top + layout.plot_height);
  }
  y = layout.bottom() + letters_px;
  body += write(legend_line(in), letters_px, "");
  // As wide as the window or the sheet at most; on paper it fills the sheet and is never cut.
  return fmt::format(
             "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:.0f} {1:.0f}' width='{0:.0f}' "
             "height='{1:.0f}'>\n"
             "<style>text{{font:{2}px sans-serif;fill:#111}}.title{{font-size:{3}px;font-weight:bold}}"
             ".shot{{font-size:13px;text-anchor:middle;fill:#333}}"
             ".mark{{font-size:15px;font-weight:bold;fill:#c00;stroke:#fff;stroke-width:3px;paint-order:"
             "stroke}}"
             "svg{{display:block;margin:auto;max-width:"
             "100%;height:auto}}"
             "@page{{size:A4;margin:12mm}}@media print{{svg{{width:100%;max-height:270mm}}}}</style>\n"
             "<rect width='100%' height='100%' fill='#fff'/>\n",
             width_px, y, letters_px, title_px) +
         body + "</svg>\n";
}

}  // namespace moldloft::firmware_like
