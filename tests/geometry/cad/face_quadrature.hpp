// Area and outline of a face by Gauss quadrature, without a word from the code that writes it. Every figure
// comes with the difference to twice as many pieces, which bounds its error: five nodes a piece converge with
// the tenth power.
#pragma once

#include "geometry/splines/trimmed_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace moldloft::test {

struct Measured {
  double value = 0, error = 0;
};

namespace quadrature {

constexpr std::array<double, 5> node = {0.046910077030668, 0.2307653449471584, 0.5, 0.7692346550528415,
                                        0.953089922969332};
constexpr std::array<double, 5> weight = {0.1184634425280945, 0.2393143352496832, 0.2844444444444444,
                                          0.2393143352496832, 0.1184634425280945};

template <typename F>
double integral(double a, double b, int pieces, F&& f) {
  double sum = 0;
  const double h = (b - a) / pieces;
  for (int p = 0; p < pieces; ++p) {
    for (std::size_t k = 0; k < node.size(); ++k) sum += h * weight[k] * f(a + h * (p + node[k]));
  }
  return sum;
}

template <typename F>
double over_spans(const std::vector<double>& knots, double end, int pieces, F&& f) {
  double sum = 0;
  for (std::size_t k = 0; k + 1 < knots.size() && knots[k] < end; ++k) {
    if (knots[k] < knots[k + 1]) sum += integral(knots[k], std::min(knots[k + 1], end), pieces, f);
  }
  return sum;
}

// Where the path crosses a knot line, what is integrated along it is not smooth: spans are cut there.
inline std::vector<double> smooth_pieces(const geometry::BSplineSurface& s, const geometry::PlanCurve& path) {
  std::vector<double> cuts = path.knots;
  constexpr int looks = 400;
  const double a = path.knots.front(), b = path.knots.back();
  for (int axis = 0; axis < 2; ++axis) {
    for (const double knot : axis == 0 ? s.knots_u : s.knots_v) {
      const auto off = [&](double t) { return path.at(t).value[axis] - knot; };
      for (int i = 0; i < looks; ++i) {
        double low = a + (b - a) * i / looks, high = a + (b - a) * (i + 1) / looks;
        if (off(low) * off(high) >= 0) continue;
        const double sign = off(high) > 0 ? 1 : -1;
        for (int k = 0; k < 60; ++k) (sign * off((low + high) / 2) > 0 ? high : low) = (low + high) / 2;
        cuts.push_back(low);
      }
    }
  }
  std::ranges::sort(cuts);
  return cuts;
}

inline double loop_length(const geometry::BSplineSurface& s, const geometry::TrimLoop& loop, int pieces) {
  double sum = 0;
  for (const auto& curve : loop) {
    const auto cuts = smooth_pieces(s, curve.path);
    sum += over_spans(cuts, cuts.back(), pieces, [&](double t) {
      const auto c = curve.path.at(t);
      const auto p = s.at(c.value.x(), c.value.y());
      return (p.du * c.first.x() + p.dv * c.first.y()).norm();
    });
  }
  return sum;
}

// Green: the area left of a loop is the integral of F dv along it, F(u, v) the area element summed from
// the first u.
inline double loop_area(const geometry::BSplineSurface& s, const geometry::TrimLoop& loop, int pieces) {
  double sum = 0;
  for (const auto& curve : loop) {
    const auto cuts = smooth_pieces(s, curve.path);
    const double whole = over_spans(cuts, cuts.back(), pieces, [&](double t) {
      const auto c = curve.path.at(t);
      const double inner = over_spans(s.knots_u, c.value.x(), pieces, [&](double u) {
        const auto p = s.at(u, c.value.y());
        return p.du.cross(p.dv).norm();
      });
      return inner * c.first.y();
    });
    sum += curve.reversed ? -whole : whole;
  }
  return sum;
}

template <typename F>
Measured with_error(F&& f) {
  const double fine = f(2);
  return {fine, std::abs(fine - f(1))};
}

}  // namespace quadrature

inline geometry::TrimLoop outer_loop(const geometry::TrimmedSurface& face) {
  return face.outer.empty() ? geometry::natural_border(face.surface) : face.outer;
}

inline Measured area_of(const geometry::TrimmedSurface& face) {
  return quadrature::with_error([&](int pieces) {
    double sum = quadrature::loop_area(face.surface, outer_loop(face), pieces);
    for (const auto& hole : face.holes) sum += quadrature::loop_area(face.surface, hole, pieces);
    return sum;
  });
}

inline Measured outline_length_of(const geometry::TrimmedSurface& face) {
  return quadrature::with_error([&](int pieces) {
    double sum = quadrature::loop_length(face.surface, outer_loop(face), pieces);
    for (const auto& hole : face.holes) sum += quadrature::loop_length(face.surface, hole, pieces);
    return sum;
  });
}

}  // namespace moldloft::test
