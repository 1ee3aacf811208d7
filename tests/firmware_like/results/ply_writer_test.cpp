#include "firmware_like/results/ply_writer.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <map>
#include <sstream>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

// A small reader of its own: header by words, body by the sizes that the header declares.
struct Ply {
  struct Property {
    std::string type, name;
  };
  struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
    std::vector<std::map<std::string, double>> rows;
  };
  std::vector<std::string> comments;
  std::vector<Element> elements;
  std::size_t bytes_left = 0;

  const Element& element(const std::string& name) const {
    for (const auto& e : elements) {
      if (e.name == name) return e;
    }
    FAIL("no such element");
    return elements.front();
  }
};

template <typename T>
double take(std::string_view& bytes) {
  REQUIRE(bytes.size() >= sizeof(T));
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes.remove_prefix(sizeof value);
  return static_cast<double>(value);
}

double take(const std::string& type, std::string_view& bytes) {
  if (type == "float") return take<float>(bytes);
  if (type == "double") return take<double>(bytes);
  if (type == "int") return take<std::int32_t>(bytes);
  if (type == "ushort") return take<std::uint16_t>(bytes);
  FAIL("a type that the reader does not know");
  return 0;
}

Ply read(const std::string& file) {
  const auto end = file.find("end_header\n");
  REQUIRE(end != std::string::npos);
  std::istringstream header{file.substr(0, end)};
  std::string line;
  std::getline(header, line);
  REQUIRE(line == "ply");
  std::getline(header, line);
  REQUIRE(line == "format binary_little_endian 1.0");
  Ply ply;
  while (std::getline(header, line)) {
    std::istringstream words{line};
    std::string first, second, third;
    words >> first >> second >> third;
    if (first == "comment") ply.comments.push_back(line.substr(8));
    if (first == "element") ply.elements.push_back({second, std::stoul(third), {}, {}});
    if (first == "property") ply.elements.back().properties.push_back({second, third});
  }
  std::string_view body = std::string_view{file}.substr(end + 11);
  for (auto& e : ply.elements) {
    for (std::size_t i = 0; i < e.count; ++i) {
      auto& row = e.rows.emplace_back();
      for (const auto& p : e.properties) row[p.name] = take(p.type, body);
    }
  }
  ply.bytes_left = body.size();
  return ply;
}

bool has(const std::vector<std::string>& comments, const std::string& wanted) {
  return std::find(comments.begin(), comments.end(), wanted) != comments.end();
}

// x = 100 u, y = 50 v, z = 7 over one span: control points at the Greville abscissae 0, 1/3, 2/3, 1.
geometry::BSplineSurface rectangle() {
  geometry::BSplineSurface s;
  s.knots_u = s.knots_v = geometry::uniform_clamped_knots(1);
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(4, 4);
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 4; ++k) {
      s.x(i, k) = 100.0 * i / 3;
      s.y(i, k) = 50.0 * k / 3;
      s.z(i, k) = 7;
    }
  }
  return s;
}

}  // namespace

TEST_CASE("points come back as they were, with unit and frame in the header") {
  const std::vector<MeasuredPoint> points = {
      {.position = {1.5f, -2.25f, 3.125f},
       .residual_mm = 0.0625f,
       .shot = 17,
       .stripe = 99,
       .u = 0.5f,
       .v = 0.5f},
      {.position = {-1e-3f, 1e6f, 0.0f}, .residual_mm = -0.5f, .shot = 4095, .stripe = 0, .u = 0, .v = 0},
  };
  const auto ply = read(points_ply(points));
  CHECK(ply.bytes_left == 0);
  CHECK(has(ply.comments, "unit mm"));
  CHECK(has(ply.comments, "frame world"));
  const auto& rows = ply.element("vertex").rows;
  REQUIRE(rows.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(rows[i].at("x") == static_cast<double>(points[i].position.x()));
    CHECK(rows[i].at("y") == static_cast<double>(points[i].position.y()));
    CHECK(rows[i].at("z") == static_cast<double>(points[i].position.z()));
    CHECK(rows[i].at("scalar_residual") == static_cast<double>(points[i].residual_mm));
    CHECK(rows[i].at("scalar_shot") == points[i].shot);
    CHECK(rows[i].at("scalar_stripe") == points[i].stripe);
  }
}

// CloudCompare (PlyFilter) makes a scalar field of every vertex property with "SCAL" in its name and takes the first
// that ends with x, y, z for the coordinates; MeshLab (vcglib's import_ply) colours by the float property `quality`.
TEST_CASE("CloudCompare and MeshLab find the residuals as what is to be coloured") {
  const std::vector<MeasuredPoint> points = {
      {.position = {1, 2, 3}, .residual_mm = 0.25f, .shot = 1, .stripe = 2, .u = 0, .v = 0}};
  const auto ply = read(points_ply(points));
  const auto& vertex = ply.element("vertex");
  std::vector<std::string> coordinates, fields, quality, unknown;
  for (const auto& p : vertex.properties) {
    std::string name = p.name;
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::toupper(c); });
    if (name.find("SCAL") != std::string::npos)
      fields.push_back(p.name);
    else if (p.name == "quality" && p.type == "float")
      quality.push_back(p.name);
    else if (name.ends_with("X") || name.ends_with("Y") || name.ends_with("Z"))
      coordinates.push_back(p.name);
    else
      unknown.push_back(p.name);
  }
  CHECK(coordinates == std::vector<std::string>{"x", "y", "z"});
  REQUIRE(!fields.empty());
  CHECK(fields.front() == "scalar_residual");  // the first is the one shown
  CHECK(fields.size() == 3);
  CHECK(quality.size() == 1);
  CHECK(unknown.empty());
  CHECK(vertex.rows[0].at("quality") == 0.25);
}

TEST_CASE("no points are a file too") {
  const auto ply = read(points_ply({}));
  CHECK(ply.element("vertex").count == 0);
  CHECK(ply.bytes_left == 0);
}

TEST_CASE("the boundary is one closed line, counter-clockwise along the surface's border") {
  const auto ply = read(boundary_ply(rectangle(), 10));
  CHECK(ply.bytes_left == 0);
  CHECK(has(ply.comments, "unit mm"));
  const auto& vertices = ply.element("vertex").rows;
  const auto& edges = ply.element("edge").rows;
  REQUIRE(vertices.size() == 40);
  REQUIRE(edges.size() == 40);
  double area = 0, length = 0;
  for (const auto& e : edges) {
    const auto& a = vertices.at(static_cast<std::size_t>(e.at("vertex1")));
    const auto& b = vertices.at(static_cast<std::size_t>(e.at("vertex2")));
    area += (a.at("x") * b.at("y") - b.at("x") * a.at("y")) / 2;
    length += std::hypot(b.at("x") - a.at("x"), b.at("y") - a.at("y"));
  }
  CHECK(area == doctest::Approx(100 * 50));  // positive: counter-clockwise
  CHECK(length == doctest::Approx(300));
  for (std::size_t i = 0; i < 40; ++i) {
    CHECK(edges[i].at("vertex1") == i);
    CHECK(edges[i].at("vertex2") == (i + 1) % 40);
    CHECK(vertices[i].at("z") == doctest::Approx(7));
  }
}
