#include "host_sim/plates/mesh_plate.hpp"

#include "host_sim/meshes/mesh_flat.hpp"
#include "host_sim/plates/outline_grid.hpp"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace moldloft::host_sim {

namespace {

constexpr double most_step =
    0.1;  // of a typical edge, between neighbouring numbers of the file: a mesh is lost there
constexpr double said_step_mm = 0.01;

struct Facet {                       // a triangle in plan and its plane
  std::array<double, 9> half_plane;  // nx x + ny y + c >= 0 inside, three times, (nx, ny) of unit length
  double slope_x, slope_y, offset;   // z = offset + slope_x x + slope_y y
};

Facet facet_of(const TriangleMesh& mesh, const Triangle& t) {
  Facet f{};
  std::array<Eigen::Vector3d, 3> p;
  for (std::size_t k = 0; k < 3; ++k) p[k] = mesh.corner(t, k);
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
            double thickness_mm, std::string remarks)
      : grid_(outline) {
    name_ = std::move(name);
    remarks_ = std::move(remarks);
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
    facets_.reserve(mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
      facets_.push_back(facet_of(mesh, t));
      for (std::size_t k = 0; k < 3; ++k) {
        bounds_.z_min = std::min(bounds_.z_min, mesh.corner(t, k).z());
        bounds_.z_max = std::max(bounds_.z_max, mesh.corner(t, k).z());
      }
    }
    list_facets(mesh);
  }

  SurfaceSample sample(double x, double y) const noexcept override {
    const auto& cell = cells_[raster_.cell_at(x, y)];
    const Facet* best = &facets_[listed_[cell.first]];
    double best_depth = depth_in(*best, x, y);
    for (std::uint32_t k = 1; k < cell.count && best_depth < 0; ++k) {
      const Facet& f = facets_[listed_[cell.first + k]];
      const double depth = depth_in(f, x, y);
      if (depth > best_depth) best = &f, best_depth = depth;
    }
    return {best->offset + best->slope_x * x + best->slope_y * y, best->slope_x, best->slope_y};
  }

  bool inside(double x, double y) const noexcept override { return grid_.contains(x, y); }

 private:
  struct Cell {
    std::uint32_t first = 0, count = 0;  // of listed_
  };

  void list_facets(const TriangleMesh& mesh) {
    const Eigen::Vector2d size = bounds_.max - bounds_.min;
    // Half a triangle's typical side: a cell then holds two or three of them.
    const double cell_mm = 0.7 * std::sqrt(size.x() * size.y() / static_cast<double>(facets_.size()));
    raster_ = PlanRaster::over(bounds_.min, bounds_.max, cell_mm);
    cells_.resize(raster_.cells());
    const auto for_cells = [&](auto&& visit) {
      for (std::size_t i = 0; i < facets_.size(); ++i) {
        std::array<Eigen::Vector2d, 3> plan;
        for (std::size_t k = 0; k < 3; ++k) plan[k] = mesh.corner(mesh.triangles[i], k).head<2>();
        // A facet farther from the cell's middle than half its diagonal cannot reach into it.
        const double reach = 0.7072 * cell_mm;
        raster_.for_rows(plan, reach, [&](int row, int first, int last) {
          for (int column = first; column <= last; ++column) {
            const Eigen::Vector2d middle = raster_.centre(column, row);
            if (depth_in(facets_[i], middle.x(), middle.y()) > -reach)
              visit(cells_[raster_.index(column, row)], static_cast<std::uint32_t>(i));
          }
        });
      }
    };
    listed_ = listed_by_cell<std::uint32_t>(cells_, for_cells);
    fill_empty_cells();
  }

  // Holes and the surroundings take a facet from the nearest cell that has one, wave by wave.
  void fill_empty_cells() {
    std::vector<std::size_t> wave;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
      if (cells_[c].count > 0) wave.push_back(c);
    }
    while (!wave.empty()) {
      std::vector<std::size_t> next;
      for (const std::size_t c : wave) {
        const int i = static_cast<int>(c % static_cast<std::size_t>(raster_.columns));
        const int j = static_cast<int>(c / static_cast<std::size_t>(raster_.columns));
        for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
          if (i + di < 0 || i + di >= raster_.columns || j + dj < 0 || j + dj >= raster_.rows) continue;
          const std::size_t n = raster_.index(i + di, j + dj);
          if (cells_[n].count > 0) continue;
          cells_[n] = {cells_[c].first, 1};
          next.push_back(n);
        }
      }
      wave = std::move(next);
    }
  }

  OutlineGrid grid_;
  std::vector<Facet> facets_;
  std::vector<std::uint32_t> listed_;
  std::vector<Cell> cells_;
  PlanRaster raster_;
};

std::string remarks_on(const TriangleMesh& mesh, const Eigen::Vector2d& size, const MeshRepairs& repairs,
                       const FlatSheet& sheet) {
  std::string line = fmt::format("{:.1f} x {:.1f} mm, {} faces", size.x(), size.y(), mesh.triangles.size());
  if (const auto done = repairs.said(); !done.empty()) line += "; " + done;
  if (sheet.folds > 0)
    line += fmt::format("; left out {} folded or standing face{}", sheet.folds, sheet.folds == 1 ? "" : "s");
  if (sheet.holes > 0)
    line += fmt::format("; bridged {} hole{}, the largest of {:.0f} mm2", sheet.holes,
                        sheet.holes == 1 ? "" : "s", sheet.largest_hole_mm2);
  return line;
}

// The two longest sides of the box around all faces, whichever way the part stands.
std::array<double, 2> box_sides(const TriangleMesh& mesh) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!mesh.corner(t, k).allFinite()) continue;
      low = low.cwiseMin(mesh.corner(t, k));
      high = high.cwiseMax(mesh.corner(t, k));
    }
  }
  Eigen::Vector3d size = high - low;
  std::sort(size.data(), size.data() + 3);
  return {size[2], size[1]};
}

}  // namespace

std::expected<std::shared_ptr<const Plate>, SimError> make_mesh_plate(const std::string& name,
                                                                      const TriangleMesh& mesh_mm,
                                                                      double thickness_mm,
                                                                      std::span<const std::string> remarks) {
  if (!(thickness_mm > 0) || !std::isfinite(thickness_mm))
    return std::unexpected(SimError{fmt::format("{}: the plate's thickness must be positive", name)});
  TriangleMesh mesh = mesh_mm;
  const auto repairs = repair(name, mesh);
  if (!repairs) return std::unexpected(repairs.error());
  lay_flat(mesh);
  auto sheet = make_explicit(name, mesh);
  if (!sheet) return std::unexpected(sheet.error());
  Eigen::Vector2d low = sheet->outline.front(), high = low;
  for (const auto& p : sheet->outline) low = low.cwiseMin(p), high = high.cwiseMax(p);
  std::string line = remarks_on(mesh, high - low, *repairs, *sheet);
  for (const auto& remark : remarks) line += "; " + remark;
  return std::make_shared<const MeshPlate>(name, mesh, std::move(sheet->outline), thickness_mm,
                                           std::move(line));
}

std::expected<std::shared_ptr<const Plate>, SimError> read_mesh_plate(const std::string& path,
                                                                      LengthUnit unit, double thickness_mm) {
  auto file = read_mesh_file(path);
  if (!file) return std::unexpected(file.error());
  const double scale = millimetres_in(unit);
  if (scale != 1) {
    for (auto& v : file->mesh.vertices) v *= scale;
  }
  const auto refused = [&](std::string_view why) {
    return std::unexpected(SimError{fmt::format("{}: {}", path, why)});
  };
  const auto [longest, second] = box_sides(file->mesh);
  if (const auto doubt = doubt_about_unit(longest, second, unit); doubt && longest > 0)
    return refused(*doubt);
  const double step_mm = scale * file->number_step;
  const double edge_mm = longest / std::sqrt(static_cast<double>(file->mesh.triangles.size()));
  if (step_mm > most_step * edge_mm)
    return refused(fmt::format(
        "its 32-bit numbers lie {:.3g} mm apart so far from the origin, too coarse for its faces; "
        "export it with double precision or nearer to the origin",
        step_mm));
  if (step_mm > said_step_mm)
    file->remarks.push_back(
        fmt::format("its 32-bit numbers lie {:.2g} mm apart so far from the origin", step_mm));
  return make_mesh_plate(path, file->mesh, thickness_mm, file->remarks);
}

}  // namespace moldloft::host_sim
