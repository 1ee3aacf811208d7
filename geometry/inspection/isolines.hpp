// Lines on which a scalar field over (u, v) has one value: contours of height, deviation or curvature,
// isophotes; and isoparametric lines. Polylines in the domain, lifted on the surface where they are
// wanted in space.
//
// Method       marching squares. A line's vertices lie on the edges of the grid; a cell with two opposite
//              corners above the level is decided by the value at the saddle of its bilinear interpolant
//              (Nielson and Hamann 1991, "The asymptotic decider"), so that neighbouring levels never cross.
//              A node on the level counts as above.
// Order        every line has the larger values on its left in (u, v); it is closed, or ends at the border or
//              at a hole (a cell with a node that holds NaN). Open lines come first, each kind in the order
//              of the grid.
// Accuracy     trace: linear along an edge of length h, |f - level| <= h^2 / 8 max |f''| along the edges.
//              refine: the field's own crossing on the edge, to 8 eps of the domain's size or to the level
//              exactly; so |f - level| <= 8 eps max |f'|, and the field's own rounding. isoparametric_line:
//              chords within the tolerance asked for, since a cubic's second derivative is linear
// Cost         trace about 5 ns a node; refine about 12 evaluations of the field a vertex
// Allocation   what is returned, and one index an edge of the grid
// Failure      Error::too_few_points (less than 2 x 2 nodes, or values that do not fill the grid), not_finite
//              (level, coordinates, infinite values, light), knots_not_increasing (coordinates), collinear (a
//              light without direction)
#pragma once

#include "geometry/error.hpp"
#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <expected>
#include <limits>
#include <span>
#include <vector>

namespace moldloft::geometry {

struct ScalarGrid {
  std::vector<double> us, vs;  // strictly increasing
  std::vector<double> values;  // values[i * vs.size() + j] at (us[i], vs[j]); NaN is a hole
};

struct Isoline {
  std::uint32_t first = 0, count = 0;  // its vertices
  bool closed = false;                 // the last vertex joins the first, which is not repeated
};

struct Isolines {
  struct Vertex {
    Eigen::Vector2d uv;
    Eigen::Vector2d from, to;  // the grid's edge that it lies on
  };
  std::vector<Vertex> vertices;
  std::vector<Isoline> lines;
  std::span<const Vertex> of(const Isoline& line) const {
    return std::span(vertices).subspan(line.first, line.count);
  }
};

// A field is a function of (u, v) that gives a number: what a lambda is.
template <typename Field>
concept ScalarField = requires(const Field& field, double u, double v) {
  { field(u, v) } -> std::convertible_to<double>;
};

// `count` >= 2 values from 0 to 1, ends included.
std::vector<double> even_steps(int count);

template <ScalarField Field>
ScalarGrid sample_field(const Field& field, std::vector<double> us, std::vector<double> vs) {
  ScalarGrid grid{std::move(us), std::move(vs), {}};
  grid.values.reserve(grid.us.size() * grid.vs.size());
  for (const double u : grid.us) {
    for (const double v : grid.vs) grid.values.push_back(field(u, v));
  }
  return grid;
}

std::expected<Isolines, Error> trace_isolines(const ScalarGrid&, double level);

// Both ends, and a coordinate that they share, come out exactly.
inline Eigen::Vector2d between(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double t) {
  if (t < 0.5) return from + t * (to - from);
  return to - (1 - t) * (to - from);
}

// Moves every vertex along its edge to where the field itself crosses the level. The ends of the edge
// keep the crossing between them: a secant that never leaves its bracket (Illinois), helped by a halving
// every fourth step.
template <ScalarField Field>
void refine_isolines(Isolines& lines, const Field& field, double level) {
  constexpr double least = 4 * std::numeric_limits<double>::epsilon();
  constexpr int most_steps = 100;
  for (Isolines::Vertex& vertex : lines.vertices) {
    const auto off = [&](double t) {
      const Eigen::Vector2d uv = between(vertex.from, vertex.to, t);
      return static_cast<double>(field(uv.x(), uv.y())) - level;
    };
    double low = 0, high = 1, f_low = off(0), f_high = off(1);
    if (f_low == 0 || f_high == 0) {
      vertex.uv = f_low == 0 ? vertex.from : vertex.to;
      continue;
    }
    if (!(f_low * f_high < 0)) continue;  // a field other than the one that was traced
    double t = 0.5;
    int side = 0;  // the end that the last step moved
    for (int step = 0; step < most_steps && high - low > least; ++step) {
      t = step % 4 == 3 ? 0.5 * (low + high) : low + (high - low) * (f_low / (f_low - f_high));
      t = std::clamp(t, low + 0.5 * least, high - 0.5 * least);
      const double f = off(t);
      if (f == 0 || !std::isfinite(f)) break;
      if ((f < 0) == (f_low < 0)) {
        if (side == -1) f_high *= 0.5;
        low = t, f_low = f, side = -1;
      } else {
        if (side == 1) f_low *= 0.5;
        high = t, f_high = f, side = 1;
      }
    }
    vertex.uv = between(vertex.from, vertex.to, t);
  }
}

// The field of isophotes (thesis figures 6-5, 6-10): the cosine of the angle between the surface's normal r_u
// x r_v and the direction towards the light, a unit vector. NaN where the surface has no tangent plane.
struct LightOn {
  const BSplineSurface& surface;
  Eigen::Vector3d towards_light;
  double operator()(double u, double v) const;
};

// The height along a unit vector: lines of constant height of a plate are its contours for `up` = z.
struct HeightOn {
  const BSplineSurface& surface;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double operator()(double u, double v) const { return up.dot(surface.at(u, v).value); }
};

// Where the normal makes `angle` (rad, [0, pi]) with the direction towards the light, on a grid of nu
// x nv nodes, refined. The light's length does not matter. At 0 and pi an isophote is a point, which
// no grid shows.
std::expected<Isolines, Error> isophotes(const BSplineSurface&, const Eigen::Vector3d& towards_light,
                                         double angle, int nu, int nv);

// Vertices of one line on the surface; a closed line comes back to its first.
std::vector<Eigen::Vector3d> on_surface(const BSplineSurface&, const Isolines&, const Isoline&);

// The sum of the chords, mm.
double length_of(std::span<const Eigen::Vector3d> polyline);

enum class Parameter : std::uint8_t { u, v };

// The line on which one parameter has `value`, from end to end of the other, as chords within `tolerance_mm`
// of it. Error::outside_domain for a value off the knots, not_finite for a net or a tolerance that is no
// number or not positive.
std::expected<std::vector<Eigen::Vector3d>, Error> isoparametric_line(const BSplineSurface&, Parameter fixed,
                                                                      double value, double tolerance_mm);

}  // namespace moldloft::geometry
