#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "hal/temporary_folder.hpp"
#include "host_sim/mesh_plate.hpp"
#include "host_sim/plan_polygon.hpp"

using namespace moldloft::host_sim;

namespace {

namespace fs = std::filesystem;

// A file of one test's own: cases run beside each other.
class File {
 public:
  explicit File(const std::string& content) { std::ofstream(path(), std::ios::binary) << content; }
  std::string path() const { return folder_.file("plate.ply"); }

 private:
  moldloft::hal::TemporaryFolder folder_;
};

std::string why(const std::string& content) {
  const File file(content);
  const auto mesh = read_ply(file.path());
  return mesh ? "read" : mesh.error().what.substr(file.path().size());
}

const std::string head =
    "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string body = "0 0 0\n2 0 0\n2 1 0\n0 1 0\n4 0 1 2 3\n";

// A sheet z = f(x, y) over a rectangle, as triangles.
template <typename Height>
TriangleMesh sheet(int nx, int ny, double step, Height&& height) {
  TriangleMesh mesh;
  for (int j = 0; j <= ny; ++j) {
    for (int i = 0; i <= nx; ++i) mesh.vertices.emplace_back(step * i, step * j, height(step * i, step * j));
  }
  const auto at = [&](int i, int j) { return j * (nx + 1) + i; };
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

}  // namespace

TEST_CASE("an ascii PLY is read, its quadrilateral cut in two") {
  const File file(head + body);
  const auto mesh = read_ply(file.path());
  REQUIRE(mesh.has_value());
  CHECK(mesh->vertices.size() == 4);
  CHECK(mesh->triangles.size() == 2);
  CHECK(mesh->vertices[2] == Eigen::Vector3d{2, 1, 0});
}

TEST_CASE("a binary PLY gives the same, other properties are passed over") {
  std::string content =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty uchar red\n"
      "property double y\nproperty double z\nelement face 1\n"
      "property list uchar uint vertex_indices\nend_header\n";
  const auto put = [&content](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    content.append(bytes, sizeof value);
  };
  for (int k = 0; k < 3; ++k)
    put(1.5 * k), put(static_cast<unsigned char>(9)), put(2.0), put(static_cast<double>(k * k));
  put(static_cast<unsigned char>(3));
  for (unsigned k = 0; k < 3; ++k) put(k);
  const File file(content);
  const auto mesh = read_ply(file.path());
  REQUIRE(mesh.has_value());
  CHECK(mesh->vertices[2] == Eigen::Vector3d{3, 2, 4});
  CHECK(why(content.substr(0, content.size() - 3)) == ": truncated: its 1 elements 'face' are not all there");
}

TEST_CASE("what is no mesh is refused in one line that says why") {
  CHECK(read_ply("/nonexistent.ply").error().what == "/nonexistent.ply: cannot be opened");
  CHECK(why("solid cube\n") == ": not a PLY file");
  CHECK(why("") == ": not a PLY file");
  CHECK(why("ply\nformat ascii 1.0\n") == ": the PLY header has no end_header");
  CHECK(why("ply\nformat binary_big_endian 1.0\nend_header\n") ==
        ": PLY format 'binary_big_endian' is not read: save it as ascii or binary_little_endian");
  CHECK(why(head + "0 0 0\n2 0 0\n") == ": truncated: its 4 elements 'vertex' are not all there");
  CHECK(why(head + "0 0 0\n2 0 0\n2 1 0\n0 1 0\n4 0 1 2 7\n") == ": a face names a vertex that is not there");
  CHECK(why("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
            "end_header\n1 2 3\n") == ": has no faces: a mesh is needed, not a point cloud");
}

TEST_CASE("a tilted mesh is laid flat, and its heights are those of the sheet") {
  auto mesh = sheet(40, 20, 5.0, [](double x, double y) { return 0.001 * (x - 100) * (y - 50); });
  const Eigen::AngleAxisd tilt(2.5, Eigen::Vector3d{1, 2, 0.3}.normalized());
  for (auto& v : mesh.vertices) v = tilt * v + Eigen::Vector3d{10, 20, 30};
  const auto plate = make_mesh_plate("sheet", mesh, 6);
  REQUIRE(plate.has_value());
  const auto& p = **plate;
  CHECK(p.bounds().max.x() == doctest::Approx(100).epsilon(0.01));
  CHECK(p.bounds().max.y() == doctest::Approx(50).epsilon(0.01));
  CHECK(std::abs(signed_area(p.outline())) == doctest::Approx(20000).epsilon(0.01));
  for (const auto& q : std::vector<Eigen::Vector2d>{{0, 0}, {60, 30}, {-71, 22}, {88, -41}}) {
    CHECK(std::abs(p.height(q.x(), q.y())) == doctest::Approx(std::abs(0.001 * q.x() * q.y())).epsilon(0.05));
    CHECK(p.inside(q.x(), q.y()));
  }
  CHECK_FALSE(p.inside(104, 0));
  CHECK_FALSE(p.inside(0, -53));
}

TEST_CASE("beside a ridge each point takes its own side's triangle") {
  auto mesh = sheet(40, 20, 5.0, [](double x, double) { return 0.2 * std::abs(x - 100); });
  const auto plate = make_mesh_plate("roof", mesh, 6);
  REQUIRE(plate.has_value());
  const double ridge = (*plate)->height(0, 0);
  for (double x = -98; x < 98; x += 0.7) {
    for (double y = -48; y < 48; y += 3.1) {
      CHECK(std::abs((*plate)->height(x, y) - ridge - 0.2 * std::abs(x)) < 0.02);
    }
  }
}

TEST_CASE("a sheet that folds back over itself is not explicit") {
  auto mesh = sheet(10, 10, 1.0, [](double, double) { return 0.0; });
  const auto lower = mesh.triangles;
  const int shift = static_cast<int>(mesh.vertices.size());
  for (int k = 0; k < shift; ++k)
    mesh.vertices.push_back(mesh.vertices[static_cast<std::size_t>(k)] + Eigen::Vector3d{0, 0, 1});
  for (const auto& t : lower) mesh.triangles.push_back({t[1] + shift, t[0] + shift, t[2] + shift});
  const auto plate = make_mesh_plate("box", mesh, 6);
  REQUIRE_FALSE(plate.has_value());
  CHECK(plate.error().what.starts_with("box: not explicit: 50 % of the surface faces down"));
}

TEST_CASE("the scanned panel, where it is present, lies flat and has its known size") {
  const std::string path =
      std::string(MOLDLOFT_SOURCE_DIR) + "/../shared/data/scanned-panels/snp_panel_part_scan.ply";
  if (!fs::exists(path)) return;
  const auto plate = read_mesh_plate(path, LengthUnit::metre, 6);
  REQUIRE(plate.has_value());
  CHECK(welded(*read_ply(path)).vertices.size() == 10196);  // the data set's own notice
  const auto& b = (*plate)->bounds();
  CHECK(b.max.x() - b.min.x() == doctest::Approx(1416).epsilon(0.002));
  CHECK(b.z_max - b.z_min == doctest::Approx(32.5).epsilon(0.02));
  CHECK(std::abs((*plate)->height(0, 0) - (*plate)->height(0, 3)) < 1);
}
