#include "firmware_like/picture.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace moldloft::firmware_like {
namespace {

using Eigen::Vector2d;

constexpr double panel_px = 520, gap_px = 90, margin_px = 30, head_px = 70, foot_px = 60;
constexpr int colours = 33;  // odd, so that zero has a colour of its own

struct View {  // from world millimetres to pixels of one panel; y up becomes y down
  Vector2d min, max;
  double scale = 1, left = 0, top = 0;
  Vector2d px(const Vector2d& p) const { return {left + (p.x() - min.x()) * scale, top + (max.y() - p.y()) * scale}; }
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

View view_of(const OverviewInput& in) {
  View view{.min = {INFINITY, INFINITY}, .max = {-INFINITY, -INFINITY}};
  for (const auto& places : {in.boundary_places, in.surface_places}) {
    for (const auto& place : places) {
      for (const auto& corner : field_corners(place, in.field_x_mm, in.field_y_mm)) extend(view, corner);
    }
  }
  for (const auto& p : in.edge_points) extend(view, p);
  if (!std::isfinite(view.min.x())) view = {.min = {0, 0}, .max = {1, 1}};
  const Vector2d size = view.max - view.min;
  view.scale = panel_px / std::max(size.x(), 1e-9);
  view.top = head_px;
  return view;
}

// Blue below zero, white at zero, red above: readable for the colour-blind as well.
std::string colour(double part) {
  const double t = std::clamp(part, -1.0, 1.0);
  const std::array<double, 3> low{33, 102, 172}, mid{247, 247, 247}, high{178, 24, 43};
  const auto& end = t < 0 ? low : high;
  const double a = std::pow(std::abs(t), 0.85);
  const auto mix = [&](std::size_t i) { return static_cast<int>(std::lround(mid[i] + a * (end[i] - mid[i]))); };
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
std::string cells(const geometry::BSplineSurface& surface, const PlateField& field, const View& view, double limit) {
  std::vector<Vector2d> nodes(static_cast<std::size_t>((field.count_u + 1) * (field.count_v + 1)));
  const auto node = [&](int i, int j) -> Vector2d& { return nodes[static_cast<std::size_t>(i * (field.count_v + 1) + j)]; };
  for (int i = 0; i <= field.count_u; ++i) {
    for (int j = 0; j <= field.count_v; ++j) {
      const auto p = surface.at(static_cast<double>(i) / field.count_u, static_cast<double>(j) / field.count_v);
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
      path += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f} {:.1f} {:.1f} {:.1f} {:.1f}z", a.x(), a.y(), b.x(), b.y(), c.x(), c.y(), d.x(), d.y());
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
    svg += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='14' height='{:.1f}' fill='{}'/>\n", left, top + i * step, step + 0.5,
                       colour(1 - 2.0 * i / (colours - 1)));
  }
  for (const double part : {1.0, 0.5, 0.0, -0.5, -1.0}) {
    svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='small'>{:+g}</text>\n", left + 19, top + (1 - part) / 2 * height + 4, part * limit);
  }
  svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='small'>{}</text>\n", left, top - 9, field.unit);
  return svg;
}

std::string polyline(std::span<const Vector2d> points, const View& view, std::string_view style, bool closed) {
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
    svg += polyline(field_corners(place, in.field_x_mm, in.field_y_mm), view, "stroke='#222' stroke-width='.7' stroke-opacity='.45'", true);
    const Vector2d c = view.px(place.centre.head<2>());
    if (numbers) svg += fmt::format("<text x='{:.1f}' y='{:.1f}' class='shot'>{}</text>\n", c.x(), c.y() + 4, ++number);
  }
  std::vector<Vector2d> path;
  for (const auto& place : in.boundary_places) path.emplace_back(place.centre.head<2>());
  if (!path.empty()) svg += polyline(path, view, "stroke='#e08214' stroke-width='1.4' stroke-dasharray='5 3'", false);
  for (const auto& p : path) {
    const Vector2d q = view.px(p);
    svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2.6' fill='#e08214'/>\n", q.x(), q.y());
  }
  return svg;
}

std::string outline(const OverviewInput& in, const View& view) {
  std::string svg;
  if (in.surface != nullptr) {
    std::vector<Vector2d> border;
    constexpr int steps = 60;
    const auto side = [&](auto uv) {
      for (int i = 0; i < steps; ++i) {
        const auto [u, v] = uv(static_cast<double>(i) / steps);
        const Eigen::Vector3d p = in.surface->at(u, v).value;
        border.emplace_back(p.x(), p.y());
      }
    };
    side([](double t) { return std::pair{t, 0.0}; });
    side([](double t) { return std::pair{1.0, t}; });
    side([](double t) { return std::pair{1 - t, 1.0}; });
    side([](double t) { return std::pair{0.0, 1 - t}; });
    svg += polyline(border, view, "stroke='#111' stroke-width='1.6'", true);
  } else {
    for (const auto& p : in.edge_points) {
      const Vector2d q = view.px(p);
      svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='.8' fill='#111'/>\n", q.x(), q.y());
    }
  }
  for (const auto& corner : in.corners) {
    const Vector2d q = view.px(corner);
    svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='none' stroke='#111' stroke-width='1.4'/>\n", q.x(), q.y());
  }
  return svg;
}

// A bar of a round length, so that the eye has a measure.
std::string scale_bar(const View& view, double bottom) {
  const double wanted = (view.max.x() - view.min.x()) / 4;
  const double decade = std::pow(10, std::floor(std::log10(wanted)));
  const double length = wanted >= 5 * decade ? 5 * decade : wanted >= 2 * decade ? 2 * decade : decade;
  return fmt::format(
      "<path d='M{0:.1f} {1:.1f}v6h{2:.1f}v-6' fill='none' stroke='#111'/><text x='{3:.1f}' y='{4:.1f}' class='small'>{5:g} mm</text>\n",
      view.left, bottom + 12, length * view.scale, view.left + length * view.scale + 6, bottom + 20, length);
}

}  // namespace

std::string overview_svg(const OverviewInput& in) {
  View view = view_of(in);
  const std::size_t panels = std::max<std::size_t>(in.fields.size(), 1);
  const double plot_height = (view.max.y() - view.min.y()) * view.scale;
  const double width = 2 * margin_px + static_cast<double>(panels) * (panel_px + gap_px) - 20;
  const double height = head_px + plot_height + foot_px;
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:.0f} {1:.0f}' width='{0:.0f}' height='{1:.0f}'>\n"
      "<style>text{{font-family:sans-serif;fill:#111}}.small{{font-size:11px}}.shot{{font-size:10px;text-anchor:middle;fill:#444}}</style>\n"
      "<rect width='100%' height='100%' fill='#fff'/>\n"
      "<text x='{2:.0f}' y='22' font-size='16' font-weight='bold'>{3}</text><text x='{2:.0f}' y='40' font-size='12'>{4}</text>\n",
      width, height, margin_px, in.title, in.subtitle);
  for (std::size_t i = 0; i < panels; ++i) {
    view.left = margin_px + static_cast<double>(i) * (panel_px + gap_px);
    if (i < in.fields.size() && in.surface != nullptr) {
      const auto& field = in.fields[i];
      const double limit = nice_limit(field);
      svg += fmt::format("<text x='{:.1f}' y='{:.1f}' font-size='12'>{}</text>\n", view.left, head_px - 9, field.title);
      svg += cells(*in.surface, field, view, limit);
      const double bar = std::min(plot_height - 20, 260.0);
      svg += legend(field, limit, view.left + panel_px + 12, head_px + (plot_height - bar) / 2, bar);
    }
    svg += overlay(in, view, i == 0) + outline(in, view) + scale_bar(view, head_px + plot_height);
  }
  svg += fmt::format(
      "<text x='{:.1f}' y='{:.1f}' class='small'>black: outline and corners; orange: the tracker's path; squares: the shots of "
      "the zig-zag, numbered; world coordinates</text>\n</svg>\n",
      margin_px + 200, head_px + plot_height + 20);
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
