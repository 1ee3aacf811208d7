#include "host_sim/optics/ray_cast.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace moldloft::host_sim {

namespace {

// More crossings of one ray's short way through the slab than this do not occur with outlines that
// are not fractal.
constexpr std::size_t most_crossings = 32;

struct Crossing {
  double t = 0;
  const PlanEdge* edge = nullptr;
};

struct Crossings {
  std::array<Crossing, most_crossings> list;
  std::size_t count = 0;
};

// Where the stretch [t_begin, t_end] of the ray crosses the edges in plan, in order.
Crossings crossings_of(const Ray& ray, double t_begin, double t_end,
                       std::span<const PlanEdge> edges) noexcept {
  Crossings found;
  const double ox = ray.origin.x(), oy = ray.origin.y(), dx = ray.direction.x(), dy = ray.direction.y();
  for (const auto& e : edges) {
    const double determinant = e.along.x() * dy - e.along.y() * dx;
    if (determinant == 0) continue;
    const double rx = ox - e.from.x(), ry = oy - e.from.y();
    const double t = (e.along.y() * rx - e.along.x() * ry) / determinant;
    if (!(t >= t_begin && t < t_end)) continue;
    const double s = (dy * rx - dx * ry) / determinant;
    if (!(s >= 0 && s < 1)) continue;
    if (found.count < most_crossings) found.list[found.count++] = {t, &e};
  }
  std::sort(found.list.begin(), found.list.begin() + static_cast<std::ptrdiff_t>(found.count),
            [](const Crossing& a, const Crossing& b) { return a.t < b.t; });
  return found;
}

Eigen::Vector3d outward_normal(const PlanEdge& e) noexcept {  // the outline runs counter-clockwise
  return Eigen::Vector3d{e.along.y(), -e.along.x(), 0.0}.normalized();
}

}  // namespace

PlanWindow window_of(std::span<const Eigen::Vector2d> points) noexcept {
  PlanWindow window{points.front(), points.front()};
  for (const auto& p : points) window.include(p);
  return window;
}

RayCast::RayCast() { edges_.reserve(4096); }

void RayCast::look_at(const PlateInstance& instance) noexcept {
  plate_ = instance.plate.get();
  z_max_ = plate_->bounds().z_max + 0.01;
  table_z_ = instance.table_z_mm - instance.z_mm;
  thickness_ = plate_->thickness_mm();
  edges_.clear();
  const auto add = [this](const std::vector<Eigen::Vector2d>& border) {
    for (std::size_t i = 0; i < border.size(); ++i)
      edges_.push_back({border[i], border[(i + 1) % border.size()] - border[i]});
  };
  add(plate_->outline());
  for (const auto& hole : plate_->holes()) add(hole);
}

void RayCast::edges_within(const PlanWindow& window, std::span<const PlanEdge> from,
                           std::vector<PlanEdge>& found) const noexcept {
  found.clear();
  for (const auto& e : from) {
    const Eigen::Vector2d to = e.from + e.along;
    const Eigen::Vector2d low = e.from.cwiseMin(to), high = e.from.cwiseMax(to);
    const bool apart = low.x() > window.high.x() || low.y() > window.high.y() || high.x() < window.low.x() ||
                       high.y() < window.low.y();
    if (apart) continue;
    // A long oblique edge may pass the window by although its box does not: all four corners on one
    // side of it.
    const auto side = [&](double x, double y) {
      return e.along.x() * (y - e.from.y()) - e.along.y() * (x - e.from.x()) > 0;
    };
    const bool first = side(window.low.x(), window.low.y());
    if (side(window.high.x(), window.low.y()) == first && side(window.low.x(), window.high.y()) == first &&
        side(window.high.x(), window.high.y()) == first) {
      continue;
    }
    found.push_back(e);
  }
}

std::pair<double, double> RayCast::slab(const Ray& ray) const noexcept {
  const double down = -ray.direction.z();
  return {std::max(0.0, (ray.origin.z() - z_max_) / down), (ray.origin.z() - table_z_) / down};
}

double RayCast::over_top(const Ray& ray, double t) const noexcept {
  const Eigen::Vector3d p = ray.at(t);
  return p.z() - plate_->height(p.x(), p.y());
}

// Newton on the height over the surface, kept between `low` and `high`. A surface that is linear in
// pieces may send it to and fro across a kink; eight steps bring it within the piece's curvature,
// micrometres, of the crossing.
double RayCast::top_crossing(const Ray& ray, double low, double high, double guess) const noexcept {
  constexpr double exact_mm = 1e-6;
  double t = std::clamp(guess, low, high);
  for (int step = 0; step < 8; ++step) {
    const Eigen::Vector3d p = ray.at(t);
    const auto s = plate_->sample(p.x(), p.y());
    const double over = p.z() - s.z;
    if (std::abs(over) < exact_mm) break;
    const double rate = ray.direction.z() - s.slope_x * ray.direction.x() - s.slope_y * ray.direction.y();
    t = std::clamp(t - over / rate, low, high);
  }
  return t;
}

bool RayCast::starts_inside(const Ray& ray) const noexcept {
  const Eigen::Vector3d p = ray.at(slab(ray).first);
  return plate_->inside(p.x(), p.y());
}

Hit RayCast::hit_table(const Ray& ray) const noexcept {
  return {Target::table, slab(ray).second, Eigen::Vector3d::UnitZ()};
}

Hit RayCast::hit_inside(const Ray& ray, double guess) const noexcept {
  const auto [begin, end] = slab(ray);
  const double t = top_crossing(ray, begin, end, guess);
  const Eigen::Vector3d p = ray.at(t);
  return {Target::top, t, plate_->normal(p.x(), p.y())};
}

Hit RayCast::first_hit(const Ray& ray, std::span<const PlanEdge> edges, double guess) const noexcept {
  const auto [begin, end] = slab(ray);
  const auto crossings = crossings_of(ray, begin, end, edges);
  bool in = starts_inside(ray);
  double from = begin;
  for (std::size_t k = 0; k <= crossings.count; ++k) {
    const double to = k < crossings.count ? crossings.list[k].t : end;
    if (in) {
      const double over = over_top(ray, from);
      const bool through_wall = k > 0 && over <= 0 && over >= -thickness_;
      if (through_wall) return {Target::wall, from, outward_normal(*crossings.list[k - 1].edge)};
      if (over > 0 && over_top(ray, to) <= 0) {
        const double t = top_crossing(ray, from, to, guess);
        const Eigen::Vector3d p = ray.at(t);
        return {Target::top, t, plate_->normal(p.x(), p.y())};
      }
    }
    in = !in;
    from = to;
  }
  return {Target::table, end, Eigen::Vector3d::UnitZ()};
}

bool RayCast::hidden(const Eigen::Vector3d& point, const Eigen::Vector3d& camera,
                     std::span<const PlanEdge> edges) const noexcept {
  const Ray ray{point, camera - point};
  const double end = std::min(1.0, (z_max_ - point.z()) / ray.direction.z());
  const auto crossings = crossings_of(ray, 0.0, end, edges);
  bool in = plate_->inside(point.x(), point.y());
  double from = 0;
  for (std::size_t k = 0; k <= crossings.count; ++k) {
    const double to = k < crossings.count ? crossings.list[k].t : end;
    // Inside the outline the height over the top rises from over(from) to over(to): solid if it
    // passes [-thickness, 0].
    if (in && over_top(ray, from) <= 0 && over_top(ray, to) >= -thickness_) return true;
    in = !in;
    from = to;
  }
  return false;
}

}  // namespace moldloft::host_sim
