#include "firmware_like/picture.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "hal/printable_text.hpp"

namespace moldloft::firmware_like {
namespace {

using Eigen::Vector2d;

constexpr double margin_px = 30, head_px = 86;
constexpr double panel_px = 520, stacked_panel_px = 860, tallest_px = 640;  // a panel's plot fits into these
constexpr double scale_px = 90;  // beside a plot: the colours and their values
constexpr double under_px = 44,
                 legend_px = 24;      // under a plot: the bar of round length; under all: what the lines mean
constexpr double narrowest_px = 720;  // the legend's line needs this
// Plates longer than this lie one panel under the other, or they would shrink to ribbons side by side.
constexpr double stacked_from = 1.8;
constexpr int colours = 33;  // odd, so that zero has a colour of its own

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

// Where the panels stand: side by side, or one under the other.
struct Layout {
  std::size_t panels = 1;
  bool stacked = false;
  double plot_width = 0, plot_height = 0;

  double left(std::size_t i) const {
    return margin_px + (stacked ? 0.0 : static_cast<double>(i) * (plot_width + scale_px));
  }
  double top(std::size_t i) const {
    return head_px + (stacked ? static_cast<double>(i) * (plot_height + under_px + 20) : 0.0);
  }
  double width() const {
    const double columns = stacked ? 1.0 : static_cast<double>(panels);
    return std::max(2 * margin_px + columns * (plot_width + scale_px) - 20, narrowest_px);
  }
  double bottom() const { return top(panels - 1) + plot_height + under_px; }
};

Layout lay_out(std::size_t panels, View& view) {
  const Vector2d size = (view.max - view.min).cwiseMax(1e-9);
  Layout layout{.panels = panels, .stacked = panels > 1 && size.x() > stacked_from * size.y()};
  view.scale = std::min((layout.stacked ? stacked_panel_px : panel_px) / size.x(), tallest_px / size.y());
  layout.plot_width = size.x() * view.scale;
  layout.plot_height = size.y() * view.scale;
  return layout;
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

// What stands in a title may come from a file's name.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : hal::printable(text)) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

// As much of a line as the picture is wide.
std::string fitting(std::string_view line, double width_px) {
  constexpr double letter_px = 6.6;  // of the small type, a wide one
  const auto room = static_cast<std::size_t>(std::max((width_px - 2 * margin_px) / letter_px, 8.0));
  if (line.size() <= room) return std::string{line};
  std::size_t end = room - 3;
  while (end > 0 && (static_cast<unsigned char>(line[end]) & 0xC0u) == 0x80u) --end;  // inside a character
  return std::string{line.substr(0, end)} + "...";
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
    svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='small'>{}</text>\n", left + 19,
                       top + (1 - part) / 2 * height + 4, value);
  }
  svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='small'>{}</text>\n", left, top - 9, field.unit);
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

// A bar of a round length, so that the eye has a measure.
std::string scale_bar(const View& view, double bottom) {
  const double wanted = (view.max.x() - view.min.x()) / 4;
  const double decade = std::pow(10, std::floor(std::log10(wanted)));
  const double length = wanted >= 5 * decade ? 5 * decade : wanted >= 2 * decade ? 2 * decade : decade;
  return fmt::format(
      "<path d='M{0:.1f} {1:.1f}v6h{2:.1f}v-6' fill='none' stroke='#111'/><text x='{3:.1f}' y='{4:.1f}' "
      "class='small'>{5:g} mm</text>\n",
      view.left, bottom + 12, length * view.scale, view.left + length * view.scale + 6, bottom + 20, length);
}

std::string coloured_plate(const OverviewInput& in, const PlateField& field, const View& view,
                           const Layout& layout) {
  const double limit = nice_limit(field), bar = std::min(layout.plot_height - 20, 260.0);
  return fmt::format("<text x='{:.1f}' y='{:.1f}' font-size='12'>{}</text>\n", view.left, view.top - 9,
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
  return line + "; world coordinates";
}

}  // namespace

std::string overview_svg(const OverviewInput& in) {
  View view = view_of(in);
  const Layout layout = lay_out(std::max<std::size_t>(in.fields.size(), 1), view);
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:.0f} {1:.0f}' width='{0:.0f}' "
      "height='{1:.0f}'>\n"
      "<style>text{{font-family:sans-serif;fill:#111}}.small{{font-size:11px}}"
      ".shot{{font-size:10px;text-anchor:middle;fill:#444}}</style>\n"
      "<rect width='100%' height='100%' fill='#fff'/>\n"
      "<text x='{2:.0f}' y='22' font-size='16' font-weight='bold'>{3}</text>"
      "<text x='{2:.0f}' y='40' font-size='12'>{4}</text>\n"
      "<text x='{2:.0f}' y='57' class='small'>{5}</text>\n",
      layout.width(), layout.bottom() + legend_px, margin_px, escaped(in.title), escaped(in.subtitle),
      escaped(fitting(in.about, layout.width())));
  for (std::size_t i = 0; i < layout.panels; ++i) {
    view.left = layout.left(i);
    view.top = layout.top(i);
    if (i < in.fields.size() && in.surface != nullptr) svg += coloured_plate(in, in.fields[i], view, layout);
    svg += overlay(in, view, i == 0) + outline(in, view) + scale_bar(view, view.top + layout.plot_height);
  }
  svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='small'>{}</text>\n</svg>\n", margin_px,
                     layout.bottom(), legend_line(in));
  return svg;
}

PlateField shape_field(const geometry::BSplineSurface& surface, int count) {
  PlateField field;
  field.count_u = field.count_v = count;
  field.title = "Shape: height over the best-fit plane";
  field.unit = "mm";
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) points.push_back(surface.at((i + 0.5) / count, (j + 0.5) / count).value);
  }
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto& p : points) centre += p / static_cast<double>(points.size());
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const auto& p : points) moments += (p - centre) * (p - centre).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes{moments};
  Eigen::Vector3d normal = axes.eigenvectors().col(0);
  if (normal.z() < 0) normal = -normal;
  for (const auto& p : points) field.values.push_back(normal.dot(p - centre));
  return field;
}

}  // namespace moldloft::firmware_like
