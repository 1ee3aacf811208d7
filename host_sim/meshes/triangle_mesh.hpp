// A surface as triangles, as it comes out of a file and as it is worked on.
#pragma once

#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace moldloft::host_sim {

using Triangle = std::array<int, 3>;  // indices of its corners

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Triangle> triangles;

  const Eigen::Vector3d& corner(const Triangle& t, std::size_t k) const {
    return vertices[static_cast<std::size_t>(t[k])];
  }
  // Along the face's normal, as long as the face's area doubled.
  Eigen::Vector3d doubled_area(const Triangle& t) const {
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
  }
};

// What a file holds: lengths in the file's own unit. A vertex that no face uses may be not a number.
struct MeshFile {
  TriangleMesh mesh;
  double number_step = 0;  // the distance of two neighbouring numbers, farthest out; 0: exact enough
  std::vector<std::string> remarks;  // what a person should know of the file
};

// The distance of neighbouring 32-bit numbers at the vertex farthest from the origin.
double single_step(std::span<const Eigen::Vector3d>);

// Faces of any number of corners, collected while a file is read. Vertices may still be to come.
class Polygons {
 public:
  void add(std::span<const int> corners) {
    corners_.insert(corners_.end(), corners.begin(), corners.end());
    ends_.push_back(corners_.size());
  }
  std::size_t count() const { return ends_.size(); }

  // Cuts each face into triangles: a convex one into a fan, any other by its ears. Faces of fewer than three different
  // corners give none. False when a face that is not convex has more than 5,000 corners. Cost
  // linear but for such faces.
  bool cut_into_triangles(TriangleMesh&) const;

 private:
  std::vector<int> corners_;
  std::vector<std::size_t> ends_;
};

}  // namespace moldloft::host_sim
