#include "geometry/inspection/isolines.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <numbers>

namespace moldloft::geometry {

namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
constexpr double longest_list =
    1e6;  // chords on one span: a tolerance below rounding must not ask for all memory

// Edges of the grid by number: first those along u, then those along v.
class Edges {
 public:
  explicit Edges(const ScalarGrid& grid) : grid_(grid), nu_(grid.us.size()), nv_(grid.vs.size()) {}
  std::size_t count() const { return (nu_ - 1) * nv_ + nu_ * (nv_ - 1); }
  std::uint32_t along_u(std::size_t i, std::size_t j) const {
    return static_cast<std::uint32_t>(i * nv_ + j);
  }
  std::uint32_t along_v(std::size_t i, std::size_t j) const {
    return static_cast<std::uint32_t>((nu_ - 1) * nv_ + i * (nv_ - 1) + j);
  }
  Isolines::Vertex crossing(std::uint32_t edge, double level) const {
    const std::size_t horizontal = (nu_ - 1) * nv_;
    const bool is_u = edge < horizontal;
    const std::size_t at = is_u ? edge : edge - horizontal;
    const std::size_t i = is_u ? at / nv_ : at / (nv_ - 1), j = is_u ? at % nv_ : at % (nv_ - 1);
    const std::size_t i1 = is_u ? i + 1 : i, j1 = is_u ? j : j + 1;
    const double f0 = grid_.values[i * nv_ + j], f1 = grid_.values[i1 * nv_ + j1];
    const double t = std::clamp((level - f0) / (f1 - f0), 0.0, 1.0);
    const Eigen::Vector2d from(grid_.us[i], grid_.vs[j]), to(grid_.us[i1], grid_.vs[j1]);
    return {between(from, to, t), from, to};
  }

 private:
  const ScalarGrid& grid_;
  std::size_t nu_, nv_;
};

std::expected<void, Error> check(const ScalarGrid& grid, double level) {
  if (grid.us.size() < 2 || grid.vs.size() < 2 || grid.values.size() != grid.us.size() * grid.vs.size())
    return std::unexpected(Error::too_few_points);
  if (grid.values.size() >= none / 2) return std::unexpected(Error::capacity);
  if (!std::isfinite(level)) return std::unexpected(Error::not_finite);
  for (const auto* steps : {&grid.us, &grid.vs}) {
    for (const double t : *steps) {
      if (!std::isfinite(t)) return std::unexpected(Error::not_finite);
    }
    if (std::ranges::adjacent_find(*steps, std::greater_equal{}) != steps->end())
      return std::unexpected(Error::knots_not_increasing);
  }
  if (std::ranges::any_of(grid.values, [](double f) { return std::isinf(f); }))
    return std::unexpected(Error::not_finite);
  return {};
}

// For every edge that a line leaves behind on its way: the edge it goes to. With the larger values on the
// left a line enters a cell where it left the neighbour, so the pieces of all cells join by themselves.
struct Links {
  std::vector<std::uint32_t> next;
  std::vector<bool> has_previous;
};

// One cell: corners counter-clockwise, edge k between corners k and k + 1.
void link_cell(const std::array<double, 4>& corner, const std::array<std::uint32_t, 4>& edge, double level,
               Links& links) {
  unsigned above = 0;
  for (unsigned k = 0; k < 4; ++k) {
    if (std::isnan(corner[k])) return;
    above |= static_cast<unsigned>(corner[k] >= level) << k;
  }
  if (above == 0 || above == 15) return;
  // Walking counter-clockwise the cell is on the left. A line that comes in through an edge has the edge's
  // first corner on its left, so it comes in where the walk falls below the level and leaves where the walk
  // rises above it.
  std::array<unsigned, 2> in{}, out{};
  unsigned ins = 0, outs = 0;
  for (unsigned k = 0; k < 4; ++k) {
    const bool here = above >> k & 1, there = above >> ((k + 1) % 4) & 1;
    if (here && !there) in[ins++] = k;
    if (!here && there) out[outs++] = k;
  }
  const auto link = [&](unsigned from, unsigned to) {
    links.next[edge[from]] = edge[to];
    links.has_previous[edge[to]] = true;
  };
  if (ins == 1) return link(in[0], out[0]);
  // Two opposite corners above. If the saddle of the bilinear interpolant is above too, they are joined and
  // the lines cut off the corners below, each from its fall to the rise after it. Otherwise they cut off
  // the corners above.
  const double saddle =
      (corner[0] * corner[2] - corner[1] * corner[3]) / (corner[0] + corner[2] - corner[1] - corner[3]);
  const bool joined = saddle >= level;
  for (const unsigned from : in) link(from, joined ? (from + 1) % 4 : (from + 3) % 4);
}

// Follows one line from its first edge. Vertices that fall together on a node become one; a line that is
// nothing but one node is none.
void follow(const Edges& edges, double level, std::uint32_t start, bool closed, Links& links, Isolines& out) {
  Isoline line{static_cast<std::uint32_t>(out.vertices.size()), 0, closed};
  for (std::uint32_t edge = start; edge != none;) {
    const Isolines::Vertex vertex = edges.crossing(edge, level);
    if (line.count == 0 || vertex.uv != out.vertices.back().uv) {
      out.vertices.push_back(vertex);
      ++line.count;
    }
    const std::uint32_t next = links.next[edge];
    links.next[edge] = none;
    edge = next == start ? none : next;
  }
  if (closed && line.count > 1 && out.vertices.back().uv == out.vertices[line.first].uv) {
    out.vertices.pop_back();
    --line.count;
  }
  if (line.count < 2) {
    out.vertices.erase(out.vertices.begin() + line.first, out.vertices.end());
    return;
  }
  out.lines.push_back(line);
}

}  // namespace

std::vector<double> even_steps(int count) {
  assert(count >= 2);
  std::vector<double> steps(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) steps[static_cast<std::size_t>(i)] = static_cast<double>(i) / (count - 1);
  return steps;
}

std::expected<Isolines, Error> trace_isolines(const ScalarGrid& grid, double level) {
  if (const auto checked = check(grid, level); !checked) return std::unexpected(checked.error());
  const Edges edges(grid);
  Links links{std::vector<std::uint32_t>(edges.count(), none), std::vector<bool>(edges.count(), false)};
  const std::size_t nv = grid.vs.size();
  for (std::size_t i = 0; i + 1 < grid.us.size(); ++i) {
    const double *low = &grid.values[i * nv], *high = low + nv;
    for (std::size_t j = 0; j + 1 < nv; ++j) {
      link_cell({low[j], high[j], high[j + 1], low[j + 1]},
                {edges.along_u(i, j), edges.along_v(i + 1, j), edges.along_u(i, j + 1), edges.along_v(i, j)},
                level, links);
    }
  }
  Isolines out;
  const auto all = static_cast<std::uint32_t>(edges.count());
  for (std::uint32_t edge = 0; edge < all; ++edge) {
    if (links.next[edge] != none && !links.has_previous[edge]) follow(edges, level, edge, false, links, out);
  }
  for (std::uint32_t edge = 0; edge < all; ++edge) {
    if (links.next[edge] != none) follow(edges, level, edge, true, links, out);
  }
  return out;
}

double LightOn::operator()(double u, double v) const {
  const SurfacePoint point = surface.at(u, v);
  const Eigen::Vector3d cross = point.du.cross(point.dv);
  const double area = cross.norm();
  if (!(area > 0)) return std::numeric_limits<double>::quiet_NaN();
  return towards_light.dot(cross) / area;
}

std::expected<Isolines, Error> isophotes(const BSplineSurface& surface, const Eigen::Vector3d& towards_light,
                                         double angle, int nu, int nv) {
  if (!towards_light.allFinite() || !std::isfinite(angle)) return std::unexpected(Error::not_finite);
  if (!(towards_light.norm() > 0)) return std::unexpected(Error::collinear);
  if (nu < 2 || nv < 2) return std::unexpected(Error::too_few_points);
  const auto steps = [](const std::vector<double>& knots, int count) {
    std::vector<double> all = even_steps(count);
    const double from = knots[cubic], to = knots[knots.size() - cubic - 1];
    for (double& t : all) t = from + (to - from) * t;
    return all;
  };
  const LightOn field{surface, towards_light.normalized()};
  const double level = std::cos(angle);
  auto lines =
      trace_isolines(sample_field(field, steps(surface.knots_u, nu), steps(surface.knots_v, nv)), level);
  if (lines) refine_isolines(*lines, field, level);
  return lines;
}

std::vector<Eigen::Vector3d> on_surface(const BSplineSurface& surface, const Isolines& lines,
                                        const Isoline& line) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(line.count + 1u);
  for (const Isolines::Vertex& vertex : lines.of(line))
    points.push_back(surface.at(vertex.uv.x(), vertex.uv.y()).value);
  if (line.closed) points.push_back(points.front());
  return points;
}

double length_of(std::span<const Eigen::Vector3d> polyline) {
  double sum = 0;
  for (std::size_t i = 1; i < polyline.size(); ++i) sum += (polyline[i] - polyline[i - 1]).norm();
  return sum;
}

std::expected<std::vector<Eigen::Vector3d>, Error> isoparametric_line(const BSplineSurface& surface,
                                                                      Parameter fixed, double value,
                                                                      double tolerance_mm) {
  const bool along_u = fixed == Parameter::v;
  const std::vector<double>& knots = along_u ? surface.knots_u : surface.knots_v;
  const std::vector<double>& other = along_u ? surface.knots_v : surface.knots_u;
  if (!std::isfinite(value) || !std::isfinite(tolerance_mm) || !(tolerance_mm > 0) ||
      !surface.x.allFinite() || !surface.y.allFinite() || !surface.z.allFinite())
    return std::unexpected(Error::not_finite);
  if (value < other[cubic] || value > other[other.size() - cubic - 1])
    return std::unexpected(Error::outside_domain);

  const auto at = [&](double t) { return along_u ? surface.at(t, value) : surface.at(value, t); };
  std::vector<Eigen::Vector3d> points{at(knots[cubic]).value};
  for (std::size_t k = cubic; k + cubic + 1 < knots.size(); ++k) {
    const double from = knots[k], step = knots[k + 1] - from;
    if (!(step > 0)) continue;
    // The second derivative is linear on a span, so its largest size is at an end; taken from inside the
    // span, since a knot may break it.
    const BasisValues ends[2] = {cubic_basis(knots, static_cast<int>(k), from),
                                 cubic_basis(knots, static_cast<int>(k), knots[k + 1])};
    double bend = 0;
    const int kv = find_span(other, value);
    const BasisValues across = cubic_basis(other, kv, value);
    for (const BasisValues& end : ends) {
      Eigen::Vector3d second = Eigen::Vector3d::Zero();
      for (int a = 0; a <= cubic; ++a) {
        for (int b = 0; b <= cubic; ++b) {
          const int here = static_cast<int>(k) - cubic + a, there = kv - cubic + b;
          const int i = along_u ? here : there, j = along_u ? there : here;
          second += end.second[a] * across.value[b] *
                    Eigen::Vector3d(surface.x(i, j), surface.y(i, j), surface.z(i, j));
        }
      }
      bend = std::max(bend, second.norm());
    }
    const double chords = std::min(longest_list, std::ceil(step * std::sqrt(bend / (8 * tolerance_mm))));
    const int count = std::max(1, static_cast<int>(chords));
    for (int c = 1; c <= count; ++c)
      points.push_back(at(c == count ? knots[k + 1] : from + step * c / count).value);
  }
  return points;
}

}  // namespace moldloft::geometry
