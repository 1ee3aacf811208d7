// Meshes as plates: laid flat, repaired, and refused with a true word where they are no single sheet.
#include "host_sim/plates/mesh_plate.hpp"

#include "geometry/splines/convex_hull.hpp"
#include "host_sim/base/plan_polygon.hpp"
#include "host_sim/meshes/mesh_weld.hpp"
#include "host_sim/plates/outline_grid.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

using namespace moldloft::host_sim;

namespace {

namespace fs = std::filesystem;

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

// A sheet of 400 x 300 mm in steps of 25, deep enough to tell heights apart.
TriangleMesh plate_400() {
  return sheet(16, 12, 25.0, [](double x, double y) {
    return 8 * std::sin(std::numbers::pi * x / 400) * std::cos(std::numbers::pi * y / 300);
  });
}

std::shared_ptr<const Plate> made(const TriangleMesh& mesh) {
  const auto plate = make_mesh_plate("p", mesh, 6);
  REQUIRE_MESSAGE(plate.has_value(), plate.error().what);
  return *plate;
}

std::string refusal(const TriangleMesh& mesh) {
  const auto plate = make_mesh_plate("p", mesh, 6);
  return plate ? "made: " + (*plate)->remarks() : plate.error().what;
}

// The same plate as the undisturbed one: outline and heights.
void check_is_plate_400(const Plate& plate, double within_mm = 1e-6) {
  const auto good = made(plate_400());
  CHECK(plate.outline().size() == good->outline().size());
  CHECK(std::abs(signed_area(plate.outline()) - signed_area(good->outline())) < 400 * within_mm + 1e-6);
  for (std::size_t k = 0; k < 4; ++k)
    CHECK((plate.corners()[k] - good->corners()[k]).norm() < within_mm + 1e-6);
  for (double x = -190; x < 195; x += 17.3) {
    for (double y = -140; y < 145; y += 13.1)
      CHECK(std::abs(plate.height(x, y) - good->height(x, y)) < within_mm + 1e-6);
  }
}

void append(TriangleMesh& mesh, const TriangleMesh& other, const Eigen::Vector3d& shift) {
  const int first = static_cast<int>(mesh.vertices.size());
  for (const auto& v : other.vertices) mesh.vertices.push_back(v + shift);
  for (const auto& t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

// Two halves that meet at x = 200, the second one moved along x.
TriangleMesh two_halves(double gap) {
  const auto whole = plate_400();
  TriangleMesh mesh;
  for (const bool second : {false, true}) {
    TriangleMesh half;
    half.vertices = whole.vertices;
    for (const auto& t : whole.triangles) {
      const double middle = (whole.corner(t, 0) + whole.corner(t, 1) + whole.corner(t, 2)).x() / 3;
      if ((middle > 200) == second) half.triangles.push_back(t);
    }
    append(mesh, half, {second ? gap : 0.0, 0, 0});
  }
  return mesh;
}

}  // namespace

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
  // A hairpin: the sheet goes on, below itself, through a narrow wall.
  auto mesh = sheet(20, 10, 1.0, [](double, double) { return 0.0; });
  for (auto& v : mesh.vertices) {
    if (v.x() > 10) v = {20.5 - v.x(), v.y(), -1};
  }
  const auto plate = make_mesh_plate("box", mesh, 6);
  REQUIRE_FALSE(plate.has_value());
  CHECK(plate.error().what.starts_with("box: not explicit: 49 % of the surface faces down"));
}

TEST_CASE("the scanned panel, where it is present, lies flat and has its known size") {
  const std::string path =
      std::string(MOLDLOFT_SOURCE_DIR) + "/../shared/data/scanned-panels/snp_panel_part_scan.ply";
  if (!fs::exists(path)) return;
  const auto plate = read_mesh_plate(path, LengthUnit::metre, 6);
  REQUIRE(plate.has_value());
  CHECK(welded(read_mesh_file(path)->mesh).vertices.size() == 10196);  // the data set's own notice
  const auto& b = (*plate)->bounds();
  CHECK(b.max.x() - b.min.x() == doctest::Approx(1416).epsilon(0.002));
  CHECK(b.z_max - b.z_min == doctest::Approx(32.5).epsilon(0.02));
  CHECK(std::abs((*plate)->height(0, 0) - (*plate)->height(0, 3)) < 1);
}

TEST_CASE("a vertex that no face uses may be anything") {
  auto mesh = plate_400();
  mesh.vertices.emplace_back(NAN, NAN, NAN);
  mesh.vertices.emplace_back(1e300, 0, 0);
  check_is_plate_400(*made(mesh));
  mesh.triangles.push_back({0, 1, static_cast<int>(mesh.vertices.size()) - 2});
  CHECK(refusal(mesh) == "p: vertex 221 is not a number, and a face uses it");
}

TEST_CASE("faces that are turned the other way are turned back, and it is said") {
  auto mesh = plate_400();
  int turned = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    std::swap(mesh.triangles[t][0], mesh.triangles[t][1]), ++turned;
  const auto plate = made(mesh);
  check_is_plate_400(*plate);
  const int fewer = std::min(turned, 384 - turned);
  CHECK(plate->remarks().find("turned " + std::to_string(fewer) + " faces") != std::string::npos);

  auto half = plate_400();
  for (std::size_t t = 0; t < half.triangles.size() / 2; ++t)
    std::swap(half.triangles[t][0], half.triangles[t][1]);
  CHECK(made(half)->remarks().find("; turned ") != std::string::npos);
}

TEST_CASE("a seam within the tolerance is welded and said, a wider gap is refused with its width") {
  for (const double gap : {0.0, 1e-9, 1e-6, 1e-3, 0.02}) {
    CAPTURE(gap);
    const auto plate = made(two_halves(gap));
    check_is_plate_400(*plate, 2 * gap);
    CHECK((plate->remarks().find("welded 13 seam vertices") != std::string::npos) == (gap > 0));
  }
  for (const auto& [gap, width] : {std::pair{0.04, "0.04 mm"}, {0.5, "0.5 mm"}, {30.0, "30 mm"}}) {
    const auto line = refusal(two_halves(gap));
    CHECK_MESSAGE(line.starts_with("p: not a single sheet: 2 pieces"), line);
    CHECK_MESSAGE((line.find(std::string(width) + " apart") != line.npos), line);
  }
}

TEST_CASE("slivers, doubled faces and faces without an area are dropped before the border is walked") {
  auto mesh = plate_400();
  mesh.triangles.push_back({0, 1, 2});           // along the border, a sliver in plan
  mesh.triangles.push_back({50, 50, 51});        // two corners
  mesh.triangles.push_back(mesh.triangles[17]);  // twice
  mesh.triangles.push_back(
      {mesh.triangles[40][1], mesh.triangles[40][0], mesh.triangles[40][2]});  // and turned
  mesh.vertices.push_back(mesh.vertices[100]);
  mesh.triangles.push_back({100, 101, static_cast<int>(mesh.vertices.size()) - 1});
  const auto plate = made(mesh);
  check_is_plate_400(*plate);
  CHECK(plate->remarks().find("dropped 2 slivers; dropped 2 doubled faces") != std::string::npos);
}

TEST_CASE("a sliver that sews two differently divided sides together stays") {
  // Left of x = 1 one side of length 2, right of it two sides of 1: only the sliver joins them.
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0},    {100, 0, 0}, {100, 100, 0}, {0, 100, 0},
                   {100, 50, 0}, {200, 0, 0}, {200, 100, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 2}, {1, 5, 4}, {5, 6, 4}, {4, 6, 2}};
  const auto plate = made(mesh);
  CHECK(signed_area(plate->outline()) == doctest::Approx(20000));
}

TEST_CASE("a far origin costs nothing") {
  auto mesh = plate_400();
  for (auto& v : mesh.vertices) v += Eigen::Vector3d{482345678.0, 5934567891.0, 12345.0};
  check_is_plate_400(*made(mesh), 1e-5);
}

TEST_CASE("what is no single sheet is refused by what it is") {
  auto stiffened = plate_400();
  stiffened.vertices.emplace_back(25, 0, 50), stiffened.vertices.emplace_back(25, 25, 50);
  const int a = 1, b = 18, c = 221, d = 222;  // a, b: the edge from (25, 0) to (25, 25)
  stiffened.triangles.push_back({a, b, c}), stiffened.triangles.push_back({b, d, c});
  CHECK(refusal(stiffened).starts_with(
      "p: not a single sheet: three faces or more meet in one edge at (25.0, 0.0, "));

  TriangleMesh band;  // of Moebius: half a turn over 24 steps
  for (int k = 0; k < 24; ++k) {
    const double angle = 2 * std::numbers::pi * k / 24;
    const Eigen::Vector3d middle{200 * std::cos(angle), 200 * std::sin(angle), 0};
    const Eigen::Vector3d across =
        40 * (std::cos(angle / 2) * middle.normalized() + std::sin(angle / 2) * Eigen::Vector3d::UnitZ());
    band.vertices.push_back(middle - across), band.vertices.push_back(middle + across);
  }
  for (int k = 0; k < 24; ++k) {
    const int p = 2 * k, q = 2 * k + 1, r = k < 23 ? p + 2 : 1, s = k < 23 ? q + 2 : 0;
    band.triangles.push_back({p, q, s}), band.triangles.push_back({p, s, r});
  }
  CHECK(refusal(band).starts_with("p: the surface has one side only, like a Moebius band"));

  TriangleMesh box;
  for (int k = 0; k < 8; ++k) box.vertices.emplace_back(400 * (k & 1), 300 * (k >> 1 & 1), 6 * (k >> 2));
  box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  CHECK(refusal(box).starts_with("p: not explicit: the surface is closed and has no outline"));

  auto layers = plate_400();
  append(layers, plate_400(), {0, 0, -6});
  CHECK(refusal(layers).starts_with("p: not a single sheet: 2 pieces"));
}

TEST_CASE("crumbs of a scan are left out and holes bridged, and both are said") {
  auto mesh = plate_400();
  TriangleMesh crumb;
  crumb.vertices = {{450, 0, 0}, {460, 0, 0}, {450, 10, 0}};
  crumb.triangles = {{0, 1, 2}};
  append(mesh, crumb, {0, 0, 0});
  mesh.triangles.erase(mesh.triangles.begin() + 200, mesh.triangles.begin() + 202);
  const auto plate = made(mesh);
  // The hole turns the axes a little.
  CHECK(plate->bounds().max.x() - plate->bounds().min.x() == doctest::Approx(400).epsilon(3e-3));
  CHECK(plate->remarks().find("left out 1 loose piece of 0.04") != std::string::npos);
  CHECK(plate->remarks().find("bridged 1 hole, the largest of 62") != std::string::npos);
}

TEST_CASE("a size that is no plate's names the unit that would make one of it") {
  const auto doubt = [](double a, double b, LengthUnit unit) {
    return doubt_about_unit(a, b, unit).value_or("fine");
  };
  CHECK(doubt(0.4, 0.3, LengthUnit::millimetre) ==
        "0.4 x 0.3 mm is no plate: metres (400 x 300 mm)? give --unit m");
  CHECK(doubt(11.8, 15.7, LengthUnit::millimetre) ==
        "15.7 x 11.8 mm is no plate: inches (399 x 300 mm)? or centimetres (157 x 118 mm)? give --unit inch "
        "or --unit cm");
  CHECK(doubt(400e3, 300e3, LengthUnit::metre)
            .starts_with("400000 x 300000 mm is no plate: millimetres (400 x 300 mm)?"));
  CHECK(doubt(30e3, 20e3, LengthUnit::millimetre) ==
        "30000 x 20000 mm is no plate: its longer side must lie between 60 and 20000 mm; check the file's "
        "unit");
  CHECK(doubt(400, 300, LengthUnit::millimetre) == "fine");
}

TEST_CASE("the grid of an outline answers as counting all sides does") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> noise(-3.0, 3.0), place(-120.0, 120.0);
  for (const int corners : {3, 4, 5, 300}) {
    std::vector<Eigen::Vector2d> outline;
    for (int k = 0; k < corners; ++k) {
      const double angle = 2 * std::numbers::pi * k / corners;
      outline.emplace_back(100 * std::cos(angle) + noise(random), 60 * std::sin(angle) + noise(random));
    }
    const OutlineGrid grid(outline);
    int wrong = 0;
    for (int k = 0; k < 20000; ++k) {
      const double x = place(random), y = place(random);
      wrong += grid.contains(x, y) != contains(outline, x, y) ? 1 : 0;
    }
    for (const auto& p : outline)
      wrong += grid.contains(p.x(), p.y()) != contains(outline, p.x(), p.y()) ? 1 : 0;
    CHECK(wrong == 0);
  }
}

TEST_CASE("the largest quadrilateral is the one that trying all of them finds") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-100.0, 100.0);
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<Eigen::Vector2d> points;
    for (int k = 0; k < 5 + trial; ++k) points.emplace_back(place(random), 0.5 * place(random));
    const auto hull = moldloft::geometry::convex_hull({points.begin(), points.end()});
    double best = 0;
    for (std::size_t a = 0; a < hull.size(); ++a)
      for (std::size_t b = a + 1; b < hull.size(); ++b)
        for (std::size_t c = b + 1; c < hull.size(); ++c)
          for (std::size_t d = c + 1; d < hull.size(); ++d)
            best = std::max(best, signed_area(std::array{hull[a], hull[b], hull[c], hull[d]}));
    if (hull.size() >= 4)
      CHECK(signed_area(largest_quadrilateral(points)) == doctest::Approx(best).epsilon(1e-12));
  }
}
