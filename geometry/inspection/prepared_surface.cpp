#include "geometry/inspection/prepared_surface.hpp"

#include "geometry/inspection/foot_point.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace moldloft::geometry {

namespace {

using Eigen::Vector3d;

constexpr double eps = std::numeric_limits<double>::epsilon();

// The four basis functions of one span as polynomials in t - middle: power[i][k] belongs to (t - middle)^k.
struct SpanBasis {
  int first_control;
  double middle;
  double power[4][4];
};

std::vector<SpanBasis> span_bases(std::span<const double> knots) {
  std::vector<SpanBasis> all;
  for (int k = cubic; k + cubic + 1 < static_cast<int>(knots.size()); ++k) {
    const double a = knots[k], b = knots[k + 1];
    if (!(a < b)) continue;
    SpanBasis span{k - cubic, 0.5 * (a + b), {}};
    const BasisValues middle = cubic_basis(knots, k, span.middle), begin = cubic_basis(knots, k, a),
                      end = cubic_basis(knots, k, b);
    for (int i = 0; i < 4; ++i) {
      const double third = (end.second[i] - begin.second[i]) / (b - a);
      span.power[i][0] = middle.value[i], span.power[i][1] = middle.first[i];
      span.power[i][2] = middle.second[i] / 2, span.power[i][3] = third / 6;
    }
    all.push_back(span);
  }
  return all;
}

std::expected<void, Error> check(const std::vector<double>& knots, Eigen::Index controls) {
  if (controls < 4 || knots.size() != static_cast<std::size_t>(controls) + cubic + 1)
    return std::unexpected(Error::too_few_points);
  for (const double knot : knots) {
    if (!std::isfinite(knot)) return std::unexpected(Error::not_finite);
  }
  if (!std::ranges::is_sorted(knots) || !(knots[cubic] < knots[knots.size() - cubic - 1]))
    return std::unexpected(Error::knots_not_increasing);
  return {};
}

// Clamped; what is not a number goes to the lower end, for it becomes the number of a cell.
double held(double t, double low, double high) { return t > low ? std::min(t, high) : low; }

Box joined(const Box& a, const Box& b) { return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)}; }

}  // namespace

double Box::squared_distance(const Vector3d& p) const {
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double out = std::max({low[axis] - p[axis], 0.0, p[axis] - high[axis]});
    sum += out * out;
  }
  return sum;
}

Box box_of(const BezierNet& net) {
  Box box{net[0][0], net[0][0]};
  for (const auto& row : net) {
    for (const Vector3d& p : row) box = joined(box, {p, p});
  }
  // The net carries a few roundings; the box must contain the span all the same.
  const Vector3d slack = 16 * eps * (box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs()));
  return {box.low - slack, box.high + slack};
}

SpanBounds bounds_of(const BezierNet& net, double width_u, double width_v) {
  std::array<Vector3d, 12> du, dv;
  SpanBounds bounds;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j) {
      du[static_cast<std::size_t>(4 * i + j)] = 3 / width_u * (net[i + 1][j] - net[i][j]);
      dv[static_cast<std::size_t>(4 * i + j)] = 3 / width_v * (net[j][i + 1] - net[j][i]);
    }
  }
  // A derivative is a mean of its control vectors: no shorter than the least of their shares
  // along any direction.
  const auto least_square = [](const std::array<Vector3d, 12>& all) {
    Vector3d sum = Vector3d::Zero();
    for (const Vector3d& d : all) sum += d;
    const double length = sum.norm();
    if (!(length > 0)) return 0.0;
    double least = std::numeric_limits<double>::infinity();
    for (const Vector3d& d : all) least = std::min(least, d.dot(sum) / length);
    return least > 0 ? least * least : 0.0;
  };
  bounds.least_du2 = least_square(du);
  bounds.least_dv2 = least_square(dv);
  for (const Vector3d& a : du) {
    for (const Vector3d& b : dv) bounds.most_du_dv = std::max(bounds.most_du_dv, std::abs(a.dot(b)));
  }
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 4; ++j) {
      const Vector3d uu = net[i][j] - 2 * net[i + 1][j] + net[i + 2][j];
      const Vector3d vv = net[j][i] - 2 * net[j][i + 1] + net[j][i + 2];
      bounds.most_duu = std::max(bounds.most_duu, 6 / (width_u * width_u) * uu.norm());
      bounds.most_dvv = std::max(bounds.most_dvv, 6 / (width_v * width_v) * vv.norm());
    }
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vector3d uv = net[i + 1][j + 1] - net[i + 1][j] - net[i][j + 1] + net[i][j];
      bounds.most_duv = std::max(bounds.most_duv, 9 / (width_u * width_v) * uv.norm());
    }
  }
  return bounds;
}

std::expected<PreparedSurface, Error> PreparedSurface::from(const BSplineSurface& surface) {
  const auto& [knots_u, knots_v, x, y, z, degree_u, degree_v] = surface;
  if (y.rows() != x.rows() || z.rows() != x.rows() || y.cols() != x.cols() || z.cols() != x.cols())
    return std::unexpected(Error::too_few_points);
  if (const auto ok = check(knots_u, x.rows()); !ok) return std::unexpected(ok.error());
  if (const auto ok = check(knots_v, x.cols()); !ok) return std::unexpected(ok.error());
  if (!x.allFinite() || !y.allFinite() || !z.allFinite()) return std::unexpected(Error::not_finite);

  PreparedSurface prepared;
  prepared.build_spans(surface);
  prepared.build_boxes();
  prepared.build_plan(surface);
  return prepared;
}

void PreparedSurface::build_spans(const BSplineSurface& surface) {
  along_u_ = KnotCells(surface.knots_u);
  along_v_ = KnotCells(surface.knots_v);
  const std::vector<SpanBasis> all_u = span_bases(surface.knots_u), all_v = span_bases(surface.knots_v);
  spans_.reserve(all_u.size() * all_v.size());
  const auto control = [&](int i, int j) {
    return Vector3d(surface.x(i, j), surface.y(i, j), surface.z(i, j));
  };
  for (const SpanBasis& in_u : all_u) {
    for (const SpanBasis& in_v : all_v) {
      SpanPolynomial span{};
      const Vector3d origin = control(in_u.first_control + 1, in_v.first_control + 1);
      span.origin = Lanes::of(origin);
      span.middle_u = in_u.middle, span.middle_v = in_v.middle;
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
          const Lanes p = Lanes::of(control(in_u.first_control + a, in_v.first_control + b) - origin);
          for (int j = 0; j < 4; ++j) {
            for (int i = 0; i < 4; ++i)
              span.c[j][i] = span.c[j][i] + (in_u.power[a][i] * in_v.power[b][j]) * p;
          }
        }
      }
      spans_.push_back(span);
    }
  }
}

void PreparedSurface::bezier_net(int i, int j, BezierNet& net) const {
  // The blossom of s^k at three arguments -w or w is their elementary symmetric mean.
  const auto blossoms = [](const KnotCells& table, int span, double middle, double(&rows)[4][4]) {
    const double w = std::max(table.end_of(span) - middle, middle - table.begin_of(span));
    const double values[4][4] = {{1, -w, w * w, -w * w * w},
                                 {1, -w / 3, -w * w / 3, w * w * w},
                                 {1, w / 3, -w * w / 3, -w * w * w},
                                 {1, w, w * w, w * w * w}};
    std::copy(&values[0][0], &values[0][0] + 16, &rows[0][0]);
  };
  const SpanPolynomial& polynomial = span(i, j);
  double in_u[4][4], in_v[4][4];
  blossoms(along_u_, i, polynomial.middle_u, in_u);
  blossoms(along_v_, j, polynomial.middle_v, in_v);
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      Lanes sum{};
      for (int q = 0; q < 4; ++q) {
        for (int p = 0; p < 4; ++p) sum = sum + (in_u[a][p] * in_v[b][q]) * polynomial.c[q][p];
      }
      net[a][b] = (polynomial.origin + sum).vector();
    }
  }
}

void PreparedSurface::build_boxes() {
  levels_.push_back({0, along_u_.count(), along_v_.count()});
  const auto ratio = [](double most, double least_square) {
    return least_square > 0 ? most / least_square : std::numeric_limits<double>::infinity();
  };
  bounds_.reserve(spans_.size());
  for (int i = 0; i < along_u_.count(); ++i) {
    for (int j = 0; j < along_v_.count(); ++j) {
      BezierNet net;
      bezier_net(i, j, net);
      boxes_.push_back(box_of(net));
      bounds_.push_back(bounds_of(net, along_u_.end_of(i) - along_u_.begin_of(i),
                                  along_v_.end_of(j) - along_v_.begin_of(j)));
      const SpanBounds& b = bounds_.back();
      spans_[index(i, j)].newton_rate =
          1.5 * (ratio(b.most_duu, b.least_du2) + ratio(b.most_dvv, b.least_dv2)) +
          3 * ratio(b.most_duv, std::sqrt(b.least_du2 * b.least_dv2));
    }
  }
  while (levels_.back().count_u > 1 || levels_.back().count_v > 1) {
    const int below = levels() - 1;
    const Level level{boxes_.size(), (boxes_u(below) + 1) / 2, (boxes_v(below) + 1) / 2};
    for (int i = 0; i < level.count_u; ++i) {
      for (int j = 0; j < level.count_v; ++j) {
        const int i1 = std::min(2 * i + 1, boxes_u(below) - 1), j1 = std::min(2 * j + 1, boxes_v(below) - 1);
        boxes_.push_back(joined(joined(box(below, 2 * i, 2 * j), box(below, i1, 2 * j)),
                                joined(box(below, 2 * i, j1), box(below, i1, j1))));
      }
    }
    levels_.push_back(level);
  }
}

void PreparedSurface::build_plan(const BSplineSurface& surface) {
  bool up = false, down = false;
  for (int i = 0; i < along_u_.count(); ++i) {
    for (int j = 0; j < along_v_.count(); ++j) {
      const SpanPolynomial& polynomial = span(i, j);
      for (int k = 0; k < 9; ++k) {
        const double a = 0.5 * (k / 3), b = 0.5 * (k % 3);
        const SurfaceJet jet = polynomial.at(std::lerp(along_u_.begin_of(i), along_u_.end_of(i), a),
                                             std::lerp(along_v_.begin_of(j), along_v_.end_of(j), b));
        const double area = jet.du.xy[0] * jet.dv.xy[1] - jet.du.xy[1] * jet.dv.xy[0];
        up |= area > 0;
        down |= !(area > 0);
      }
    }
  }
  const Box& all = boxes_.back();
  const double extent_x = all.high.x() - all.low.x(), extent_y = all.high.y() - all.low.y();
  if (up == down || !(extent_x > 0) || !(extent_y > 0)) return;

  PreparedSurface flat;  // the plan view itself, in which a foot is an inverse
  BSplineSurface plan = surface;
  plan.z.setZero();
  flat.build_spans(plan);

  const int cells = std::clamp(2 * std::max(along_u_.count(), along_v_.count()), 16, 64);
  plan_u_ = plan_v_ = cells + 1;
  plan_x_ = all.low.x(), plan_y_ = all.low.y();
  per_x_ = cells / extent_x, per_y_ = cells / extent_y;
  plan_.resize(static_cast<std::size_t>(plan_u_) * static_cast<std::size_t>(plan_v_));
  Parameters row{0.5 * (along_u_.first() + along_u_.last()), 0.5 * (along_v_.first() + along_v_.last())};
  for (int i = 0; i < plan_u_; ++i) {
    Parameters from = row;
    for (int j = 0; j < plan_v_; ++j) {
      const Vector3d p(plan_x_ + i / per_x_, plan_y_ + j / per_y_, 0);
      const FootPoint foot = foot_near(flat, p, from.u, from.v);
      from = {foot.u, foot.v};
      if (j == 0) row = from;
      // Beyond the border the map goes on straight, so that the cells which the border crosses hold
      // a smooth map.
      const SurfaceJet jet = flat.span_at(foot.u, foot.v).at(foot.u, foot.v);
      const double xu = jet.du.xy[0], yu = jet.du.xy[1], xv = jet.dv.xy[0], yv = jet.dv.xy[1];
      const double dx = p.x() - foot.point.x(), dy = p.y() - foot.point.y(), area = xu * yv - xv * yu;
      plan_[static_cast<std::size_t>(i * plan_v_ + j)] = {foot.u + (yv * dx - xv * dy) / area,
                                                          foot.v + (xu * dy - yu * dx) / area};
    }
  }
}

Parameters PreparedSurface::plan_guess(double x, double y) const {
  const double a = held((x - plan_x_) * per_x_, 0, plan_u_ - 1),
               b = held((y - plan_y_) * per_y_, 0, plan_v_ - 1);
  const int i = std::min(static_cast<int>(a), plan_u_ - 2), j = std::min(static_cast<int>(b), plan_v_ - 2);
  const double s = a - i, t = b - j;
  const Parameters* node = &plan_[static_cast<std::size_t>(i * plan_v_ + j)];
  const Parameters &p00 = node[0], &p01 = node[1], &p10 = node[plan_v_], &p11 = node[plan_v_ + 1];
  const auto mix = [&](double c00, double c01, double c10, double c11) {
    const double low = c00 + t * (c01 - c00), high = c10 + t * (c11 - c10);
    return low + s * (high - low);
  };
  return {std::clamp(mix(p00.u, p01.u, p10.u, p11.u), along_u_.first(), along_u_.last()),
          std::clamp(mix(p00.v, p01.v, p10.v, p11.v), along_v_.first(), along_v_.last())};
}

Parameters PreparedSurface::descended_guess(const Vector3d& p) const {
  int i = 0, j = 0;
  for (int level = levels() - 2; level >= 0; --level) {
    double least = std::numeric_limits<double>::infinity();
    int best_i = 2 * i, best_j = 2 * j;
    for (int a = 2 * i; a <= std::min(2 * i + 1, boxes_u(level) - 1); ++a) {
      for (int b = 2 * j; b <= std::min(2 * j + 1, boxes_v(level) - 1); ++b) {
        // Boxes overlap, and inside several of them the distance says nothing: the nearer middle decides.
        const Box& candidate = box(level, a, b);
        const double off =
            candidate.squared_distance(p) + 1e-3 * (p - 0.5 * (candidate.low + candidate.high)).squaredNorm();
        if (off < least) least = off, best_i = a, best_j = b;
      }
    }
    i = best_i, j = best_j;
  }
  return {span(i, j).middle_u, span(i, j).middle_v};
}

Parameters PreparedSurface::guess_of(const Vector3d& p) const {
  return is_explicit() ? plan_guess(p.x(), p.y()) : descended_guess(p);
}

SurfacePoint PreparedSurface::at(double u, double v) const {
  u = held(u, along_u_.first(), along_u_.last());
  v = held(v, along_v_.first(), along_v_.last());
  const SpanPolynomial& polynomial = span_at(u, v);
  const SurfaceJet jet = polynomial.at(u, v);
  return {(polynomial.origin + jet.value).vector(),
          jet.du.vector(),
          jet.dv.vector(),
          jet.duu.vector(),
          jet.duv.vector(),
          jet.dvv.vector()};
}

std::size_t PreparedSurface::bytes() const {
  return spans_.capacity() * sizeof(SpanPolynomial) + bounds_.capacity() * sizeof(SpanBounds) +
         boxes_.capacity() * sizeof(Box) + plan_.capacity() * sizeof(Parameters);
}

}  // namespace moldloft::geometry
