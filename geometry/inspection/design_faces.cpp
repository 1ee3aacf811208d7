#include "geometry/inspection/design_faces.hpp"

#include "geometry/splines/closed_polygon.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace moldloft::geometry {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double samples_a_loop = 960, samples_a_span = 6;  // of the border
constexpr int most_samples = 4000;                          // a chord
constexpr int area_grid = 24;                               // per side, for area, mean normal and centroid
constexpr double same_place = 1e-7;                         // of the domain's length
constexpr std::size_t most_checked = 20'000;  // corners of a trim: every edge is held against every other one
constexpr double largest_mm = 1e7;  // of a coordinate: no ship is longer, and a float still tells millimetres
constexpr double domain_slack = 1e-9;  // of the domain's length: what a writer's rounding may leave

// Even-odd rule over all loops: holes count once more.
bool is_inside(std::span<const TrimPolygon> loops, const Vector2d& p) {
  bool inside = false;
  for (const auto& loop : loops) {
    for (std::size_t i = 0, before = loop.size() - 1; i < loop.size(); before = i++) {
      const Vector2d &a = loop[before], &b = loop[i];
      if ((a.y() > p.y()) == (b.y() > p.y())) continue;
      if (p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y())) inside = !inside;
    }
  }
  return inside;
}

double signed_area(const TrimPolygon& loop) {
  double twice = 0;
  for (std::size_t i = 0, before = loop.size() - 1; i < loop.size(); before = i++)
    twice += loop[before].x() * loop[i].y() - loop[i].x() * loop[before].y();
  return twice / 2;
}

TrimPolygon natural_polygon(const PreparedSurface& s) {
  const double u0 = s.along_u().first(), u1 = s.along_u().last();
  const double v0 = s.along_v().first(), v1 = s.along_v().last();
  return {{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
}

// Outer loops counter-clockwise, holes clockwise: the face lies to the left.
void orient(std::vector<TrimPolygon>& loops) {
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if ((signed_area(loops[i]) > 0) != (i == 0)) std::ranges::reverse(loops[i]);
  }
}

// Corners in one place, as a writer leaves them where two of its curves meet, are taken as one.
bool crosses(const TrimPolygon& loop, double apart) {
  TrimPolygon corners;
  for (const auto& p : loop) {
    if (corners.empty() || (p - corners.back()).norm() > apart) corners.push_back(p);
  }
  while (corners.size() > 1 && (corners.front() - corners.back()).norm() <= apart) corners.pop_back();
  return corners.size() <= most_checked && crosses_itself(corners);
}

std::expected<void, Error> check_trims(const PreparedSurface& surface, std::span<const TrimPolygon> trims) {
  const double u0 = surface.along_u().first(), u1 = surface.along_u().last();
  const double v0 = surface.along_v().first(), v1 = surface.along_v().last();
  const double slack_u = domain_slack * (u1 - u0), slack_v = domain_slack * (v1 - v0);
  for (const auto& loop : trims) {
    if (loop.size() < 3) return std::unexpected(Error::too_few_points);
    for (const auto& p : loop) {
      if (!p.allFinite()) return std::unexpected(Error::not_finite);
      if (p.x() < u0 - slack_u || p.x() > u1 + slack_u || p.y() < v0 - slack_v || p.y() > v1 + slack_v)
        return std::unexpected(Error::outside_domain);
    }
    if (crosses(loop, same_place * std::max(u1 - u0, v1 - v0))) return std::unexpected(Error::self_crossing);
  }
  return {};
}

bool is_too_large(const BSplineSurface& s) {
  return std::ranges::any_of(std::array{&s.x, &s.y, &s.z}, [](const Eigen::MatrixXd* net) {
    return net->size() > 0 && net->cwiseAbs().maxCoeff() > largest_mm;
  });
}

// The border's tangent plane at a place of a chord; no length where there is none.
BorderSample border_at(const PreparedSurface& surface, const Vector2d& uv, const Vector2d& step) {
  const auto r = surface.at(uv.x(), uv.y());
  const Vector3d along = r.du * step.x() + r.dv * step.y(), normal = r.du.cross(r.dv);
  BorderSample sample{.at = r.value, .outward = Vector3d::Zero(), .length_mm = 0, .uv = uv, .step = step};
  if (!(along.norm() > 0) || !(normal.norm() > 0)) return sample;
  // The face lies to the left of its loop, seen against du x dv.
  sample.outward = along.normalized().cross(normal.normalized()).normalized();
  sample.length_mm = along.norm();
  return sample;
}

void add_samples(const PreparedSurface& surface, const Vector2d& a, const Vector2d& b, int count,
                 std::vector<BorderSample>& out) {
  const Vector2d step = (b - a) / count;
  for (int k = 0; k < count; ++k) {
    const auto sample = border_at(surface, a + (k + 0.5) * step, step);
    if (sample.length_mm > 0) out.push_back(sample);
  }
}

// Chords of a loop get samples by their share of it, and some in each knot span that they cross: a trim may have four
// corners or a thousand, and a torn rim bends within a few spans.
std::vector<BorderSample> border_of(const PreparedSurface& surface, std::span<const TrimPolygon> loops) {
  const auto &u = surface.along_u(), &v = surface.along_v();
  std::vector<BorderSample> border;
  for (const auto& loop : loops) {
    std::vector<double> lengths;
    double all = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vector2d &a = loop[i], &b = loop[(i + 1) % loop.size()];
      lengths.push_back((surface.at(b.x(), b.y()).value - surface.at(a.x(), a.y()).value).norm());
      all += lengths.back();
    }
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vector2d &a = loop[i], &b = loop[(i + 1) % loop.size()];
      const double spans = std::abs(b.x() - a.x()) / (u.last() - u.first()) * u.count() +
                           std::abs(b.y() - a.y()) / (v.last() - v.first()) * v.count();
      const double wanted =
          std::max(samples_a_loop * lengths[i] / std::max(all, 1e-300), samples_a_span * spans);
      add_samples(surface, a, b, std::clamp(static_cast<int>(std::lround(wanted)), 2, most_samples), border);
    }
  }
  return border;
}

}  // namespace

std::expected<DesignFaces, Flaw> DesignFaces::from(std::span<const DesignFace> designed) {
  DesignFaces all;
  if (designed.empty()) return std::unexpected(Flaw{Error::too_few_points});
  std::size_t largest = 0;
  for (std::size_t n = 0; n < designed.size(); ++n) {
    if (!designed[n].surface.bicubic()) return std::unexpected(Flaw{Error::too_few_points, n});
    auto surface = PreparedSurface::from(designed[n].surface);
    if (!surface) return std::unexpected(Flaw{surface.error(), n});
    if (is_too_large(designed[n].surface)) return std::unexpected(Flaw{Error::too_large, n});
    Face face{.surface = std::move(*surface),
              .trims = designed[n].trims,
              .border = {},
              .mean_normal = {},
              .centroid = {}};
    if (const auto trims = check_trims(face.surface, face.trims); !trims)
      return std::unexpected(Flaw{trims.error(), n});
    orient(face.trims);
    if (!face.weigh()) return std::unexpected(Flaw{Error::singular_parametrization, n});
    all.faces_.push_back(std::move(face));
    if (all.faces_[n].area > all.faces_[largest].area) largest = n;
  }
  all.join(largest);
  if (all.border_.empty()) return std::unexpected(Flaw{Error::no_border, largest});
  return all;
}

// Area, its centroid and its mean normal, by the midpoint rule.
bool DesignFaces::Face::weigh() {
  const double u0 = surface.along_u().first(), v0 = surface.along_v().first();
  const double step_u = (surface.along_u().last() - u0) / area_grid;
  const double step_v = (surface.along_v().last() - v0) / area_grid;
  Vector3d normals = Vector3d::Zero(), moments = Vector3d::Zero();
  for (int i = 0; i < area_grid; ++i) {
    for (int k = 0; k < area_grid; ++k) {
      const Vector2d uv{u0 + step_u * (i + 0.5), v0 + step_v * (k + 0.5)};
      if (!trims.empty() && !is_inside(trims, uv)) continue;
      const auto r = surface.at(uv.x(), uv.y());
      const Vector3d normal = r.du.cross(r.dv) * step_u * step_v;
      normals += normal;
      area += normal.norm();
      moments += normal.norm() * r.value;
    }
  }
  if (!(area > 0) || !(normals.norm() > 0)) return false;
  centroid = moments / area;
  mean_normal = normals.normalized();
  return true;
}

void DesignFaces::join(std::size_t largest) {
  Vector3d normals = Vector3d::Zero(), moments = Vector3d::Zero();
  const Vector3d up = faces_[largest].mean_normal;
  for (auto& face : faces_) {
    face.sign = face.mean_normal.dot(up) < 0 ? -1 : 1;
    area_ += face.area;
    normals += face.sign * face.area * face.mean_normal;
    moments += face.area * face.centroid;
    if (face.trims.empty()) {
      const std::vector<TrimPolygon> natural{natural_polygon(face.surface)};
      face.border = border_of(face.surface, natural);
    } else {
      face.border = border_of(face.surface, face.trims);
    }
  }
  up_ = normals.normalized();
  centroid_ = moments / area_;
  for (int n = 0; n < count(); ++n) {
    for (const auto& sample : faces_[static_cast<std::size_t>(n)].border) {
      const auto meets = [&](int other) {
        if (other == n) return false;
        const auto foot = foot_on(other, sample.at);
        return std::abs(foot.signed_mm) < seam_mm && foot.overhang_mm < seam_mm;
      };
      bool seam = false;
      for (int other = 0; other < count() && !seam; ++other) seam = meets(other);
      if (seam) continue;
      border_.push_back(sample);
      border_.back().face = n;
    }
  }
}

BorderSample DesignFaces::border_near(const Vector3d& p) const {
  constexpr int steps = 4;
  constexpr double farthest = 0.75;  // of a step: beyond it another sample is nearer
  const BorderSample* best = &border_.front();
  double least = std::numeric_limits<double>::infinity();
  for (const auto& sample : border_) {
    const double d = (p - sample.at).squaredNorm();
    if (d < least) least = d, best = &sample;
  }
  const auto& surface = faces_[static_cast<std::size_t>(best->face)].surface;
  double way = 0;
  for (int k = 0; k < steps; ++k) {
    const Vector2d uv = best->uv + way * best->step;
    const auto r = surface.at(uv.x(), uv.y());
    const Vector3d along = r.du * best->step.x() + r.dv * best->step.y();
    way = std::clamp(way + along.dot(p - r.value) / along.squaredNorm(), -farthest, farthest);
  }
  BorderSample near = border_at(surface, best->uv + way * best->step, best->step);
  near.face = best->face;
  return near.length_mm > 0 ? near : *best;
}

bool DesignFaces::is_on(int face, double u, double v) const {
  const auto& trims = faces_[static_cast<std::size_t>(face)].trims;
  return trims.empty() || is_inside(trims, {u, v});
}

DesignFoot DesignFaces::foot_on(int n, const Vector3d& p) const {
  const Face& face = faces_[static_cast<std::size_t>(n)];
  const auto guess = face.surface.guess_of(p);
  const auto foot = foot_near(face.surface, p, guess.u, guess.v, FootAccuracy::by_distance);
  DesignFoot found{.point = foot.point,
                   .normal = face.sign * foot.normal,
                   .signed_mm = face.sign * foot.signed_mm,
                   .overhang_mm = foot.overhang_mm,
                   .u = foot.u,
                   .v = foot.v,
                   .face = n,
                   .converged = foot.converged};
  if (foot.place == FootPlace::interior) found.overhang_mm = 0;
  if (face.trims.empty() || is_inside(face.trims, {foot.u, foot.v})) return found;
  // Cut away there: the nearest place is on the trim.
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& sample : face.border) {
    const double d = (p - sample.at).squaredNorm();
    if (d >= nearest) continue;
    nearest = d;
    found.overhang_mm = std::max(0.0, (p - sample.at).dot(sample.outward));
  }
  return found;
}

DesignFoot DesignFaces::foot(const Vector3d& p) const {
  DesignFoot best = foot_on(0, p);
  for (int n = 1; n < count(); ++n) {
    const auto other = foot_on(n, p);
    const auto off = [](const DesignFoot& f) {
      return f.converged ? std::hypot(f.signed_mm, f.overhang_mm) : std::numeric_limits<double>::infinity();
    };
    if (off(other) < off(best)) best = other;
  }
  return best;
}

std::optional<DesignFaces::Crossing> DesignFaces::crossing(const Vector3d& through, const Vector3d& up,
                                                           double reach_mm) const {
  constexpr int most_steps = 30;
  constexpr double near_mm = 1e-9;
  std::optional<Crossing> best;
  double least_over = std::numeric_limits<double>::infinity();
  for (int n = 0; n < count(); ++n) {
    Vector3d p = through;
    DesignFoot foot;
    // The line is followed to the tangent plane at the foot until it no longer moves.
    for (int step = 0; step < most_steps; ++step) {
      foot = foot_on(n, p);
      if (!foot.converged) break;
      const double slope = foot.normal.dot(up);
      if (std::abs(slope) < 0.1) break;  // steeper than 84 degrees: no height over this plane
      const double way = (foot.point - p).dot(foot.normal) / slope;
      p += way * up;
      if (std::abs(way) < near_mm) break;
    }
    const double slope = foot.normal.dot(up);
    if (!foot.converged || std::abs(slope) < 0.1 || foot.overhang_mm > reach_mm ||
        foot.overhang_mm >= least_over)
      continue;
    least_over = foot.overhang_mm;
    const double into = (foot.point - p).dot(foot.normal) / slope;
    best = Crossing{.point = p + into * up, .normal = foot.normal, .u = foot.u, .v = foot.v, .face = n};
  }
  return best;
}

}  // namespace moldloft::geometry
