#include "firmware_like/results/shot_agreement.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

constexpr double corner_guard_mm = 5;
constexpr std::size_t fewest_edges = 5;  // of a side, before their median counts

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

void add_heights(ShotAgreement& a, std::span<const Eigen::Vector3d> samples, const geometry::PlanMap& map,
                 const geometry::BSplineSurface& surface) {
  double sum = 0, squares = 0;
  Eigen::Vector2d guess{0.5, 0.5};
  for (const auto& p : samples) {
    const auto uv = map.invert(p.head<2>(), guess);
    if (!uv) continue;
    guess = *uv;
    const double above = p.z() - surface.at(uv->x(), uv->y()).value.z();
    sum += above, squares += above * above;
    ++a.samples;
  }
  if (a.samples == 0) return;
  a.height_mm = sum / a.samples;
  a.scatter_mm = std::sqrt(std::max(0.0, squares / a.samples - a.height_mm * a.height_mm));
}

void add_edges(ShotAgreement& a, std::span<const SeenEdge> edges) {
  for (std::size_t side = 0; side < 4; ++side) {
    std::vector<double> distances;
    Eigen::Vector2d middle{0, 0};
    for (const auto& edge : edges) {
      if (edge.place.side != side) continue;
      distances.push_back(edge.place.distance_mm);
      middle += edge.point;
    }
    if (distances.size() < fewest_edges) continue;
    const auto count = distances.size();
    const double aside = median(distances);
    if (a.edges > 0 && std::abs(aside) <= std::abs(a.aside_mm)) continue;
    a.edges = static_cast<int>(count), a.aside_mm = aside;
    a.aside_at = middle / static_cast<double>(count);
  }
}

}  // namespace

std::vector<SeenEdge> seen_edges(const tasks::RunEvidence& evidence, const OutlineTrace& outline,
                                 double reach_mm) {
  std::vector<SeenEdge> edges;
  for (std::size_t i = 0; i < evidence.shots.size(); ++i) {
    const auto look = [&](tasks::RunEdge end, const Eigen::Vector3d& p) {
      if (end != tasks::RunEdge::edge) return;
      const auto place = outline.locate(p.head<2>());
      if (std::abs(place.distance_mm) > reach_mm || place.from_corner_mm < corner_guard_mm) return;
      edges.push_back({.shot = i, .point = p.head<2>(), .place = place});
    };
    for (const auto& run : evidence.runs_of(i)) look(run.at_first, run.first), look(run.at_last, run.last);
  }
  return edges;
}

std::vector<ShotAgreement> agreement_of_shots(const tasks::RunEvidence& evidence,
                                              const std::vector<SeenEdge>& edges,
                                              const geometry::PlanMap& map,
                                              const geometry::BSplineSurface& surface) {
  std::vector<ShotAgreement> all;
  auto next = edges.begin();
  for (std::size_t i = 0; i < evidence.shots.size(); ++i) {
    const auto begin = next;
    while (next != edges.end() && next->shot == i) ++next;
    if (!evidence.shots[i].plate_found) continue;
    ShotAgreement a{.shot = i};
    add_heights(a, evidence.samples_of(i), map, surface);
    add_edges(a, std::span{begin, next});
    all.push_back(a);
  }
  return all;
}

}  // namespace moldloft::firmware_like
