#include "firmware_like/results/surface_swing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>

namespace moldloft::firmware_like {
namespace {

constexpr double step_mm = 3;     // along the outline
constexpr double inset_mm = 0.5;  // of the places looked at, from the outline
constexpr double apart_mm = 50;   // swings nearer to each other are one
constexpr double bucket_mm = 10;  // of the points
constexpr std::size_t few_points = 5;
constexpr int farthest_bucket = 12;   // beyond that nothing is near
constexpr double usual_share = 0.95;  // of the bends where the plate was seen: what is usual

// The points that were seen, by place.
class PointsByPlace {
 public:
  explicit PointsByPlace(const tasks::RunEvidence& evidence) {
    for (const auto& run : evidence.runs) add(run.first), add(run.last);
    for (const auto& p : evidence.samples) add(p);
  }

  // The nearest few, the nearest first; fewer where no more are near.
  std::vector<Eigen::Vector3d> nearest(const Eigen::Vector2d& to) const {
    std::vector<Eigen::Vector3d> found;
    const auto distance = [&](const Eigen::Vector3d& p) { return (p.head<2>() - to).norm(); };
    const int column = index(to.x()), row = index(to.y());
    for (int ring = 0; ring <= farthest_bucket; ++ring) {
      // What lies in this ring and beyond is no nearer than what is there already.
      if (found.size() >= few_points && distance(found[few_points - 1]) <= (ring - 1) * bucket_mm) break;
      for (int dy = -ring; dy <= ring; ++dy) {
        for (int dx = -ring; dx <= ring; ++dx) {
          if (std::max(std::abs(dx), std::abs(dy)) != ring) continue;
          const auto at = buckets_.find(key(column + dx, row + dy));
          if (at != buckets_.end()) found.insert(found.end(), at->second.begin(), at->second.end());
        }
      }
      std::ranges::sort(found, {}, distance);
    }
    if (found.size() > few_points) found.resize(few_points);
    return found;
  }

 private:
  static int index(double mm) { return static_cast<int>(std::floor(mm / bucket_mm)); }
  static long long key(int column, int row) {
    return (static_cast<long long>(column) << 32) ^ static_cast<unsigned>(row);
  }
  void add(const Eigen::Vector3d& p) { buckets_[key(index(p.x()), index(p.y()))].push_back(p); }
  std::unordered_map<long long, std::vector<Eigen::Vector3d>> buckets_;
};

class Swings {
 public:
  Swings(const tasks::RunEvidence& evidence, const geometry::PlanMap& map,
         const geometry::BSplineSurface& surface)
      : points_{evidence}, map_{map}, surface_{surface}, bend_{usual_bend(evidence)} {}

  std::optional<SurfaceSwing> at(const Eigen::Vector2d& place, double limit_mm) const {
    const auto here = on_surface(place);
    const auto near = points_.nearest(place);
    if (!here || near.empty()) return std::nullopt;
    // The median of a few: any one of them may be an outlier.
    std::vector<double> above;
    for (const auto& p : near) {
      const auto there = on_surface(p.head<2>());
      if (!there) continue;
      above.push_back(here->value.z() - p.z() - slope(*there).dot(place - p.head<2>()));
    }
    if (above.empty()) return std::nullopt;
    const auto middle = above.begin() + static_cast<std::ptrdiff_t>(above.size() / 2);
    std::ranges::nth_element(above, middle);
    const double away = (near.back().head<2>() - place).norm();
    if (std::abs(*middle) <= limit_mm + bend_ * away * away / 2) return std::nullopt;
    return SurfaceSwing{
        .place = place, .height_mm = *middle, .from_points_mm = (near.front().head<2>() - place).norm()};
  }

 private:
  std::optional<geometry::SurfacePoint> on_surface(const Eigen::Vector2d& place) const {
    const auto uv = map_.invert(place, {0.5, 0.5});
    return uv ? std::optional{surface_.at(uv->x(), uv->y())} : std::nullopt;
  }
  // dz/dx, dz/dy of a surface over the plan.
  static Eigen::Vector2d slope(const geometry::SurfacePoint& p) {
    const Eigen::Vector3d n = p.du.cross(p.dv);
    return -n.head<2>() / n.z();
  }
  // How much the plate bends where it was seen: the second derivative of most places, 1/mm.
  double usual_bend(const tasks::RunEvidence& evidence) const {
    std::vector<double> bends;
    constexpr double reach_mm = 5;
    for (std::size_t i = 0; i < evidence.samples.size(); i += 7) {
      const Eigen::Vector2d p = evidence.samples[i].head<2>();
      const auto here = on_surface(p);
      if (!here) continue;
      for (const Eigen::Vector2d& way : {Eigen::Vector2d{reach_mm, 0}, Eigen::Vector2d{0, reach_mm}}) {
        const auto aside = on_surface(p + way);
        if (aside) bends.push_back((slope(*aside) - slope(*here)).norm() / reach_mm);
      }
    }
    if (bends.empty()) return 0;
    const auto at =
        bends.begin() + static_cast<std::ptrdiff_t>(usual_share * static_cast<double>(bends.size() - 1));
    std::ranges::nth_element(bends, at);
    return *at;
  }

  PointsByPlace points_;
  const geometry::PlanMap& map_;
  const geometry::BSplineSurface& surface_;
  double bend_;
};

}  // namespace

std::vector<SurfaceSwing> surface_swings(const OutlineTrace& outline, const std::vector<UnseenPart>& unseen,
                                         const tasks::RunEvidence& evidence, const geometry::PlanMap& map,
                                         const geometry::BSplineSurface& surface, double limit_mm) {
  const Swings swings{evidence, map, surface};
  std::vector<SurfaceSwing> all;
  const auto look = [&](const Eigen::Vector2d& place) {
    if (const auto swing = swings.at(place, limit_mm)) all.push_back(*swing);
  };
  const auto& line = outline.points();
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Eigen::Vector2d way = line[i + 1] - line[i];
    const Eigen::Vector2d inwards = Eigen::Vector2d{-way.y(), way.x()}.normalized() * inset_mm;
    const int steps = static_cast<int>(way.norm() / step_mm) + 1;
    for (int k = 0; k < steps; ++k) look(line[i] + way * (static_cast<double>(k) / steps) + inwards);
  }
  for (const auto& part : unseen) look(part.centre);
  std::ranges::sort(all, std::ranges::greater{}, [](const SurfaceSwing& s) { return std::abs(s.height_mm); });
  std::vector<SurfaceSwing> apart;
  for (const auto& s : all) {
    if (std::ranges::none_of(
            apart, [&](const SurfaceSwing& other) { return (other.place - s.place).norm() < apart_mm; }))
      apart.push_back(s);
  }
  return apart;
}

}  // namespace moldloft::firmware_like
