#include "host_sim/mesh_plate.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>

#include "host_sim/plan_polygon.hpp"

namespace moldloft::host_sim {

namespace {

constexpr double most_facing_down =
    0.01;  // of the area: small folds of a scan are dropped, a second sheet is not

double plan_area(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const auto& a = mesh.vertices[static_cast<std::size_t>(t[0])];
  const auto& b = mesh.vertices[static_cast<std::size_t>(t[1])];
  const auto& c = mesh.vertices[static_cast<std::size_t>(t[2])];
  return 0.5 * ((b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()));
}

// Principal axes of the surface, each triangle weighing by its area: z along the normals, x along the long
// side.
Eigen::Matrix3d flat_axes(const TriangleMesh& mesh, Eigen::Vector3d& middle) {
  Eigen::Vector3d normals = Eigen::Vector3d::Zero(), sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double total = 0;
  for (const auto& t : mesh.triangles) {
    const auto& a = mesh.vertices[static_cast<std::size_t>(t[0])];
    const auto& b = mesh.vertices[static_cast<std::size_t>(t[1])];
    const auto& c = mesh.vertices[static_cast<std::size_t>(t[2])];
    const Eigen::Vector3d n = 0.5 * (b - a).cross(c - a), g = (a + b + c) / 3.0;
    const double area = n.norm();
    normals += n;
    sum += area * g;
    squares += area * g * g.transpose();
    total += area;
  }
  middle = sum / total;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares / total - middle * middle.transpose());
  Eigen::Vector3d z = solver.eigenvectors().col(0), x = solver.eigenvectors().col(2);
  if (z.dot(normals) < 0) z = -z;
  Eigen::Index largest = 0;
  x.cwiseAbs().maxCoeff(&largest);
  if (x[largest] < 0) x = -x;
  Eigen::Matrix3d axes;
  axes << x, z.cross(x), z;
  return axes;
}

void lay_flat(TriangleMesh& mesh) {
  Eigen::Vector3d middle;
  const Eigen::Matrix3d axes = flat_axes(mesh, middle);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (auto& v : mesh.vertices) {
    v = axes.transpose() * (v - middle);
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const Eigen::Vector3d shift{0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), 0.0};
  for (auto& v : mesh.vertices) v -= shift;
}

// The boundary loop that encloses most: edges that belong to one triangle only, walked in their own
// direction.
std::vector<Eigen::Vector2d> largest_boundary(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> uses;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++uses[{t[k], t[(k + 1) % 3]}];
  }
  std::multimap<int, int> next;
  for (const auto& [edge, count] : uses) {
    if (!uses.contains({edge.second, edge.first})) next.emplace(edge.first, edge.second);
  }
  std::vector<Eigen::Vector2d> best;
  while (!next.empty()) {
    std::vector<Eigen::Vector2d> loop;
    for (auto at = next.begin(); at != next.end();) {
      loop.push_back(mesh.vertices[static_cast<std::size_t>(at->first)].head<2>());
      const int to = at->second;
      next.erase(at);
      at = next.find(to);
    }
    if (loop.size() >= 3 && (best.empty() || signed_area(loop) > signed_area(best))) best = std::move(loop);
  }
  return best;
}

struct Facet {                       // a triangle in plan and its plane
  std::array<double, 9> half_plane;  // nx x + ny y + c >= 0 inside, three times, (nx, ny) of unit length
  double slope_x, slope_y, offset;   // z = offset + slope_x x + slope_y y
};

Facet facet_of(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  Facet f{};
  std::array<Eigen::Vector3d, 3> p;
  for (std::size_t k = 0; k < 3; ++k) p[k] = mesh.vertices[static_cast<std::size_t>(t[k])];
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector2d a = p[k].head<2>(), d = (p[(k + 1) % 3].head<2>() - a).normalized();
    f.half_plane[3 * k] = -d.y();
    f.half_plane[3 * k + 1] = d.x();
    f.half_plane[3 * k + 2] = d.y() * a.x() - d.x() * a.y();
  }
  const Eigen::Vector3d n = (p[1] - p[0]).cross(p[2] - p[0]);
  f.slope_x = -n.x() / n.z();
  f.slope_y = -n.y() / n.z();
  f.offset = p[0].z() - f.slope_x * p[0].x() - f.slope_y * p[0].y();
  return f;
}

// How far the point lies inside the facet; negative outside.
double depth_in(const Facet& f, double x, double y) noexcept {
  const auto& h = f.half_plane;
  return std::min({h[0] * x + h[1] * y + h[2], h[3] * x + h[4] * y + h[5], h[6] * x + h[7] * y + h[8]});
}

class MeshPlate final : public Plate {
 public:
  MeshPlate(std::string name, const TriangleMesh& mesh, std::vector<Eigen::Vector2d> outline,
            double thickness_mm) {
    name_ = std::move(name);
    outline_ = std::move(outline);
    corners_ = largest_quadrilateral(outline_);
    thickness_mm_ = thickness_mm;
    bounds_.min = bounds_.max = outline_.front();
    for (const auto& p : outline_) {
      bounds_.min = bounds_.min.cwiseMin(p);
      bounds_.max = bounds_.max.cwiseMax(p);
    }
    bounds_.z_min = std::numeric_limits<double>::infinity();
    bounds_.z_max = -bounds_.z_min;
    for (const auto& t : mesh.triangles) {
      facets_.push_back(facet_of(mesh, t));
      for (const int v : t) {
        bounds_.z_min = std::min(bounds_.z_min, mesh.vertices[static_cast<std::size_t>(v)].z());
        bounds_.z_max = std::max(bounds_.z_max, mesh.vertices[static_cast<std::size_t>(v)].z());
      }
    }
    build_grid(mesh);
    classify_cells();
  }

  SurfaceSample sample(double x, double y) const noexcept override {
    const auto& cell = cells_[cell_at(x, y)];
    const Facet* best = &facets_[listed_[cell.first]];
    double best_depth = depth_in(*best, x, y);
    for (std::uint32_t k = 1; k < cell.count && best_depth < 0; ++k) {
      const Facet& f = facets_[listed_[cell.first + k]];
      const double depth = depth_in(f, x, y);
      if (depth > best_depth) best = &f, best_depth = depth;
    }
    return {best->offset + best->slope_x * x + best->slope_y * y, best->slope_x, best->slope_y};
  }

  bool inside(double x, double y) const noexcept override {
    if (x < bounds_.min.x() || y < bounds_.min.y() || x > bounds_.max.x() || y > bounds_.max.y())
      return false;
    switch (cells_[cell_at(x, y)].side) {
      case Side::inside:
        return true;
      case Side::outside:
        return false;
      case Side::edge:
        return contains(outline_, x, y);
    }
    return false;
  }

 private:
  enum class Side : std::uint8_t { inside, outside, edge };
  struct Cell {
    std::uint32_t first = 0, count = 0;  // of listed_
    Side side = Side::outside;
  };

  std::size_t cell_at(double x, double y) const noexcept {
    const double i = std::clamp((x - bounds_.min.x()) / cell_mm_, 0.0, columns_ - 1.0);
    const double j = std::clamp((y - bounds_.min.y()) / cell_mm_, 0.0, rows_ - 1.0);
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(i);
  }

  void build_grid(const TriangleMesh& mesh) {
    const Eigen::Vector2d size = bounds_.max - bounds_.min;
    // Half a triangle's typical side: a cell then holds two or three of them.
    cell_mm_ = 0.7 * std::sqrt(size.x() * size.y() / static_cast<double>(facets_.size()));
    columns_ = static_cast<int>(size.x() / cell_mm_) + 1;
    rows_ = static_cast<int>(size.y() / cell_mm_) + 1;
    std::vector<std::vector<std::uint32_t>> lists(static_cast<std::size_t>(columns_) *
                                                  static_cast<std::size_t>(rows_));
    for (std::size_t i = 0; i < facets_.size(); ++i) {
      Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
      for (const int v : mesh.triangles[i]) {
        low = low.cwiseMin(mesh.vertices[static_cast<std::size_t>(v)].head<2>());
        high = high.cwiseMax(mesh.vertices[static_cast<std::size_t>(v)].head<2>());
      }
      for_cells(low, high, [&](std::size_t cell, const Eigen::Vector2d& centre) {
        // A facet farther from the cell's middle than half its diagonal cannot reach into it.
        if (depth_in(facets_[i], centre.x(), centre.y()) > -0.7072 * cell_mm_) {
          lists[cell].push_back(static_cast<std::uint32_t>(i));
        }
      });
    }
    fill_empty_cells(lists);
    cells_.resize(lists.size());
    for (std::size_t c = 0; c < lists.size(); ++c) {
      cells_[c].first = static_cast<std::uint32_t>(listed_.size());
      cells_[c].count = static_cast<std::uint32_t>(lists[c].size());
      listed_.insert(listed_.end(), lists[c].begin(), lists[c].end());
    }
  }

  template <typename Visit>
  void for_cells(const Eigen::Vector2d& low, const Eigen::Vector2d& high, Visit&& visit) const {
    const auto column = [&](double x) {
      return std::clamp(static_cast<int>((x - bounds_.min.x()) / cell_mm_), 0, columns_ - 1);
    };
    const auto row = [&](double y) {
      return std::clamp(static_cast<int>((y - bounds_.min.y()) / cell_mm_), 0, rows_ - 1);
    };
    for (int j = row(low.y()); j <= row(high.y()); ++j) {
      for (int i = column(low.x()); i <= column(high.x()); ++i) {
        const Eigen::Vector2d centre = bounds_.min + cell_mm_ * Eigen::Vector2d{i + 0.5, j + 0.5};
        visit(static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(i),
              centre);
      }
    }
  }

  // Holes and the surroundings take a facet from the nearest cell that has one, wave by wave.
  void fill_empty_cells(std::vector<std::vector<std::uint32_t>>& lists) const {
    std::vector<std::size_t> wave;
    for (std::size_t c = 0; c < lists.size(); ++c) {
      if (!lists[c].empty()) wave.push_back(c);
    }
    while (!wave.empty()) {
      std::vector<std::size_t> next;
      for (const std::size_t c : wave) {
        const int i = static_cast<int>(c) % columns_, j = static_cast<int>(c) / columns_;
        for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
          if (i + di < 0 || i + di >= columns_ || j + dj < 0 || j + dj >= rows_) continue;
          const auto n = static_cast<std::size_t>((j + dj) * columns_ + i + di);
          if (!lists[n].empty()) continue;
          lists[n].push_back(lists[c].front());
          next.push_back(n);
        }
      }
      wave = std::move(next);
    }
  }

  void classify_cells() {
    for (const auto& p : sampled_outline(outline_, 0.1 * cell_mm_)) {
      const Eigen::Vector2d reach = Eigen::Vector2d::Constant(0.1 * cell_mm_);
      for_cells(p - reach, p + reach, [&](std::size_t cell, const auto&) { cells_[cell].side = Side::edge; });
    }
    for_cells(bounds_.min, bounds_.max, [&](std::size_t cell, const Eigen::Vector2d& centre) {
      if (cells_[cell].side == Side::edge) return;
      cells_[cell].side = contains(outline_, centre.x(), centre.y()) ? Side::inside : Side::outside;
    });
  }

  std::vector<Facet> facets_;
  std::vector<std::uint32_t> listed_;
  std::vector<Cell> cells_;
  double cell_mm_ = 1;
  int columns_ = 1, rows_ = 1;
};

}  // namespace

std::expected<std::shared_ptr<const Plate>, SimError> make_mesh_plate(const std::string& name,
                                                                      const TriangleMesh& mesh_mm,
                                                                      double thickness_mm) {
  const auto refused = [&](std::string_view why) {
    return std::unexpected(SimError{fmt::format("{}: {}", name, why)});
  };
  if (!(thickness_mm > 0)) return refused("the plate's thickness must be positive");
  TriangleMesh mesh = welded(mesh_mm);
  if (mesh.triangles.empty()) return refused("has no faces that span an area");
  lay_flat(mesh);
  double up = 0, down = 0;
  for (const auto& t : mesh.triangles) {
    const double area = plan_area(mesh, t);
    (area > 0 ? up : down) += std::abs(area);
  }
  if (down > most_facing_down * (up + down)) {
    return refused(
        fmt::format("not explicit: {:.0f} % of the surface faces down when the part lies flat; "
                    "a single sheet is needed",
                    100 * down / (up + down)));
  }
  const double smallest = 1e-9 * (up + down);
  std::erase_if(mesh.triangles, [&](const auto& t) { return plan_area(mesh, t) <= smallest; });
  auto outline = largest_boundary(mesh);
  if (outline.size() < 4) return refused("not explicit: the surface is closed and has no outline");
  return std::make_shared<const MeshPlate>(name, mesh, std::move(outline), thickness_mm);
}

std::expected<std::shared_ptr<const Plate>, SimError> read_mesh_plate(const std::string& path,
                                                                      LengthUnit unit, double thickness_mm) {
  auto mesh = read_ply(path);
  if (!mesh) return std::unexpected(mesh.error());
  if (unit == LengthUnit::metre) {
    for (auto& v : mesh->vertices) v *= 1000.0;
  }
  return make_mesh_plate(path, *mesh, thickness_mm);
}

}  // namespace moldloft::host_sim
