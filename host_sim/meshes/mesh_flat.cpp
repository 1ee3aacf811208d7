#include "host_sim/meshes/mesh_flat.hpp"

#include "host_sim/base/plan_polygon.hpp"
#include "host_sim/meshes/mesh_edges.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace moldloft::host_sim {

namespace {

constexpr double most_facing_down =
    0.01;                          // of the area: small folds of a scan are dropped, a second sheet is not
constexpr double steepest = 0.05;  // of a face's normal upwards: below, a face at the border stands on edge
constexpr double smallest_hole = 1e-6;  // of the plate's area: below, it is a crack
constexpr int most_peels = 100;         // of faces that stand on edge, one behind the other

double plan_area(const TriangleMesh& mesh, const Triangle& t) {
  const auto &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
  return 0.5 * ((b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()));
}

// Principal axes of the surface, each triangle weighing by its area: z along the normals, x along
// the long side.
Eigen::Matrix3d flat_axes(const TriangleMesh& mesh, Eigen::Vector3d& middle) {
  Eigen::Vector3d normals = Eigen::Vector3d::Zero(), sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  const Eigen::Vector3d origin = mesh.corner(mesh.triangles.front(), 0);
  double total = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d n = 0.5 * mesh.doubled_area(t);
    const Eigen::Vector3d g = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0 - origin;
    const double area = n.norm();
    normals += n;
    sum += area * g;
    squares += area * g * g.transpose();
    total += area;
  }
  middle = sum / total;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares / total - middle * middle.transpose());
  middle += origin;
  Eigen::Vector3d z = solver.eigenvectors().col(0), x = solver.eigenvectors().col(2);
  if (z.dot(normals) < 0) z = -z;
  Eigen::Index largest = 0;
  x.cwiseAbs().maxCoeff(&largest);
  if (x[largest] < 0) x = -x;
  Eigen::Matrix3d axes;
  axes << x, z.cross(x), z;
  return axes;
}

// Faces at the border that stand on edge, peeled off from the border inwards.
int peel_steep_border(TriangleMesh& mesh) {
  int peeled = 0;
  for (int round = 0; round < most_peels; ++round) {
    const auto is_steep = [&](const Triangle& t) {
      const Eigen::Vector3d n = mesh.doubled_area(t);
      return n.z() <= steepest * n.norm();
    };
    if (std::none_of(mesh.triangles.begin(), mesh.triangles.end(), is_steep)) break;
    const auto mates = edge_mates(mesh);
    std::size_t kept = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const bool at_border = std::count(&mates[3 * t], &mates[3 * t] + 3, free_edge) > 0;
      if (!at_border || !is_steep(mesh.triangles[t])) mesh.triangles[kept++] = mesh.triangles[t];
    }
    const auto now = static_cast<int>(mesh.triangles.size() - kept);
    mesh.triangles.resize(kept);
    if (now == 0) break;
    peeled += now;
  }
  return peeled;
}

std::vector<Eigen::Vector2d> in_plan(const TriangleMesh& mesh, const std::vector<int>& loop) {
  std::vector<Eigen::Vector2d> points;
  points.reserve(loop.size());
  for (const int v : loop) points.emplace_back(mesh.vertices[static_cast<std::size_t>(v)].head<2>());
  return points;
}

void find_outline(const TriangleMesh& mesh, FlatSheet& sheet) {
  std::vector<double> areas;
  double most = 0;
  for (const auto& loop : border_loops(mesh, edge_mates(mesh))) {
    auto points = in_plan(mesh, loop);
    areas.push_back(signed_area(points));
    if (areas.back() <= most) continue;
    most = areas.back();
    sheet.outline = std::move(points);
  }
  for (const double area : areas) {
    if (area >= -smallest_hole * most) continue;
    ++sheet.holes;
    sheet.largest_hole_mm2 = std::max(sheet.largest_hole_mm2, -area);
  }
}

}  // namespace

void lay_flat(TriangleMesh& mesh) {
  Eigen::Vector3d middle;
  const Eigen::Matrix3d axes = flat_axes(mesh, middle);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (auto& v : mesh.vertices) v = axes.transpose() * (v - middle);
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      low = low.cwiseMin(mesh.corner(t, k));
      high = high.cwiseMax(mesh.corner(t, k));
    }
  }
  const Eigen::Vector3d shift{0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), 0.0};
  for (auto& v : mesh.vertices) v -= shift;
}

std::expected<FlatSheet, SimError> make_explicit(const std::string& name, TriangleMesh& mesh) {
  const auto refused = [&](std::string_view why) {
    return std::unexpected(SimError{fmt::format("{}: not explicit: {}", name, why)});
  };
  const auto mates = edge_mates(mesh);
  if (std::find(mates.begin(), mates.end(), free_edge) == mates.end())
    return refused("the surface is closed and has no outline; export the upper side of the plate alone");
  double up = 0, down = 0;
  for (const auto& t : mesh.triangles) {
    const double area = plan_area(mesh, t);
    (area > 0 ? up : down) += std::abs(area);
  }
  if (down > most_facing_down * (up + down)) {
    return refused(
        fmt::format("{:.0f} % of the surface faces down when the part lies flat; a single sheet is needed",
                    100 * down / (up + down)));
  }
  FlatSheet sheet;
  // Before a border is walked, only the faces in its way are removed, since a face without any area in plan
  // may hold the faces on both of its sides together.
  sheet.folds = static_cast<int>(
      std::erase_if(mesh.triangles, [&](const auto& t) { return plan_area(mesh, t) < -1e-9 * (up + down); }));
  sheet.folds += peel_steep_border(mesh);
  sheet.folds_share = down / (up + down);
  if (mesh.triangles.empty()) return refused("nothing of it looks up");
  if (sheet.folds > 0) lay_flat(mesh);  // what was left out must not tilt the rest
  find_outline(mesh, sheet);
  if (sheet.outline.size() < 3) return refused("no border of it encloses an area when the part lies flat");
  std::erase_if(mesh.triangles, [&](const auto& t) { return plan_area(mesh, t) <= 1e-9 * (up + down); });
  return sheet;
}

}  // namespace moldloft::host_sim
