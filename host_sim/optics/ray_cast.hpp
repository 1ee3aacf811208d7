// Rays against a plate with thickness lying on a table, in plate coordinates (mm).
//
// The plate is a solid: its top surface inside the outline, the same surface lower by the thickness, and
// vertical walls between. Rays are much steeper than the plate: the height over the surface falls, or rises,
// all along a ray. Under that condition the first hit is exact, including a wall's foot, the space under a
// raised edge, and corners.
//
// Cost         a ray away from edges 3 height samples; each edge near it 5 ns
// Allocation   none after reserve()
#pragma once

#include "host_sim/plates/plate.hpp"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace moldloft::host_sim {

struct Ray {
  Eigen::Vector3d origin, direction;
  Eigen::Vector3d at(double t) const noexcept { return origin + t * direction; }
};

enum class Target { nothing, top, wall, table };

struct Hit {
  Target target = Target::nothing;
  double t = 0;            // along the ray
  Eigen::Vector3d normal;  // of what was hit, outwards
};

struct PlanEdge {
  Eigen::Vector2d from, along;  // a side of the outline, from its first to its second corner
};

struct PlanWindow {  // an axis-parallel box in plan
  Eigen::Vector2d low, high;
  void include(const Eigen::Vector2d& p) noexcept {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
};

PlanWindow window_of(std::span<const Eigen::Vector2d> points) noexcept;

class RayCast {
 public:
  RayCast();
  void look_at(const PlateInstance&) noexcept;

  // Edges that any ray inside the window can meet, out of `from`.
  void edges_within(const PlanWindow&, std::span<const PlanEdge> from,
                    std::vector<PlanEdge>& found) const noexcept;
  std::span<const PlanEdge> all_edges() const noexcept { return edges_; }

  // Where the ray enters the slab between the plate's highest point and the table, and where it leaves it.
  std::pair<double, double> slab(const Ray&) const noexcept;

  // What a descending ray meets first; `edges` must hold all that it can cross in plan. `guess` is a t near the hit.
  Hit first_hit(const Ray&, std::span<const PlanEdge> edges, double guess) const noexcept;
  // The same where the ray is known to cross no edge.
  Hit hit_inside(const Ray&, double guess) const noexcept;
  Hit hit_table(const Ray&) const noexcept;
  bool starts_inside(const Ray&) const noexcept;

  // Whether the plate stands between a point and a camera above.
  bool hidden(const Eigen::Vector3d& point, const Eigen::Vector3d& camera,
              std::span<const PlanEdge>) const noexcept;

  double z_max() const noexcept { return z_max_; }
  double table_z() const noexcept { return table_z_; }

 private:
  double over_top(const Ray&, double t) const noexcept;
  double top_crossing(const Ray&, double low, double high, double guess) const noexcept;

  const Plate* plate_ = nullptr;
  std::vector<PlanEdge> edges_;
  double z_max_ = 0, table_z_ = 0, thickness_ = 0;
};

}  // namespace moldloft::host_sim
