#include "hal/temporary_folder.hpp"
#include "host_sim/meshes/mesh_file.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>

using namespace moldloft::host_sim;

namespace {

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
  const auto mesh = read_mesh_file(file.path());
  return mesh ? "read" : mesh.error().what.substr(file.path().size());
}

const std::string head =
    "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string body = "0 0 0\n2 0 0\n2 1 0\n0 1 0\n4 0 1 2 3\n";

}  // namespace

TEST_CASE("an ascii PLY is read, its quadrilateral cut in two") {
  const File file(head + body);
  const auto mesh = read_mesh_file(file.path());
  REQUIRE(mesh.has_value());
  CHECK(mesh->mesh.vertices.size() == 4);
  CHECK(mesh->mesh.triangles.size() == 2);
  CHECK(mesh->mesh.vertices[2] == Eigen::Vector3d{2, 1, 0});
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
  const auto mesh = read_mesh_file(file.path());
  REQUIRE(mesh.has_value());
  CHECK(mesh->mesh.vertices[2] == Eigen::Vector3d{3, 2, 4});
  CHECK(why(content.substr(0, content.size() - 3)) ==
        ": byte " + std::to_string(content.size() - 4) + ": the file ends in the middle of a row");
}

TEST_CASE("what is no mesh is refused in one line that says why") {
  CHECK(read_mesh_file("/nonexistent.ply").error().what ==
        "/nonexistent.ply: does not exist: give the path of a PLY or STL file");
  CHECK(read_mesh_file("/dev/null").error().what ==
        "/dev/null: is a pipe or a device: give the path of a PLY or STL file");
  CHECK(read_mesh_file("/").error().what == "/: is a folder: give the path of a PLY or STL file");
  CHECK(why("") == ": is empty: export it anew");
  CHECK(why("v 0 0 0\n").starts_with(": is neither a PLY nor an STL file"));
  CHECK(why("\x1f\x8bxxxx") == ": is compressed: unpack it first");
  CHECK(why("ply\nformat ascii 1.0\n") == ":3: the PLY header has no end_header: the file is cut off");
  CHECK(why("ply\nformat text 1.0\nend_header\n") ==
        ":2: PLY format 'text' is not known: save it as ascii or binary_little_endian");
  CHECK(why("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
            "end_header\n1 2 3\n") == ": has no faces: a mesh is needed, not a point cloud");
}

namespace {

// The square of `head` and `body`, changed on its way.
std::string replaced(std::string text, std::string_view old, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(old, at)) != text.npos; at += by.size())
    text.replace(at, old.size(), by);
  return text;
}

void check_square(const std::string& content) {
  const File file(content);
  const auto read = read_mesh_file(file.path());
  REQUIRE_MESSAGE(read.has_value(), read.error().what);
  REQUIRE(read->mesh.vertices.size() == 4);
  CHECK(read->mesh.vertices[2] == Eigen::Vector3d{2, 1, 0});
  CHECK(read->mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});
}

std::string wide(std::string_view text) {
  std::string bytes = "\xff\xfe";
  for (const char c : text) bytes += c, bytes += '\0';
  return bytes;
}

}  // namespace

TEST_CASE("the same square is read however its text was written") {
  const std::string square = head + body;
  check_square(replaced(square, "\n", "\r\n"));
  check_square(replaced(square, "\n", "\r"));
  check_square("\xef\xbb\xbf" + square);
  check_square(wide(square));
  check_square(replaced(square, "\n", " \t\n"));
  check_square(replaced(square, " ", "\t "));
  check_square(replaced(square, "\n", "\n\n"));
  check_square(head + replaced(body, "2 1 0", "+2.0 1e0 +0.0D+00"));
  check_square(head + "comment corners\n" + replaced(body, "4 0", "obj_info the face\n4 0"));
  check_square(replaced(replaced(square, "float x", "float X"), "float z", "float Z"));
  check_square(replaced(replaced(replaced(square, "element", "ELEMENT"), "ascii", "ASCII"), "end_header",
                        "End_Header"));
  check_square(square.substr(0, square.size() - 1));
  check_square(square + "\n\x1a");
}

TEST_CASE("elements stand in any order, and what is not wanted is passed over") {
  const std::string vertex =
      "element vertex 4\nproperty int x\nproperty list uchar int near\nproperty double y\n"
      "property short z\n";
  const std::string face = "element face 1\nproperty uchar red\nproperty list ushort uint vertex_index\n";
  check_square("ply\nobj_info scan\nformat ascii 1.0\n" + face + "element camera 2\nproperty float f\n" +
               vertex + "end_header\n7 4 0 1 2 3\n0.5\nnan\n0 0 0 0\n2 2 8 9 0 0\n2 0 1 0\n0 1 5 1 0\n");
}

TEST_CASE("a big-endian file gives the same, also where a lone CR ends its header before a byte that is LF") {
  std::string content =
      "ply\rformat binary_big_endian 1.0\relement face 1\rproperty list char short vertex_indices\r"
      "element vertex 4\rproperty float x\rproperty double y\rproperty int z\rend_header\r";
  const auto put = [&content](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    std::reverse(bytes, bytes + sizeof value);
    content.append(bytes, sizeof value);
  };
  put(static_cast<signed char>(4));
  for (short k = 0; k < 4; ++k) put(k);
  const double xs[] = {0, 2, 2, 0}, ys[] = {0, 0, 1, 1};
  for (int k = 0; k < 4; ++k) put(static_cast<float>(xs[k])), put(ys[k]), put(0);
  check_square(content);

  std::string ten = "ply\rformat binary_little_endian 1.0\relement note 10\rproperty uchar c\r" +
                    replaced(head.substr(head.find("element")), "\n", "\r");
  ten += "\n123456789";  // ten bytes, the first of them an LF
  for (int k = 0; k < 4; ++k) {
    const float p[] = {static_cast<float>(xs[k]), static_cast<float>(ys[k]), 0};
    ten.append(reinterpret_cast<const char*>(p), sizeof p);
  }
  const int corners[] = {0, 1, 2, 3};
  ten += '\4';
  ten.append(reinterpret_cast<const char*>(corners), sizeof corners);
  check_square(ten);
}

TEST_CASE("a wrong line of a text is named with what is wrong in it") {
  const auto with = [](std::string_view line) { return why(head + replaced(body, "2 1 0", line)); };
  CHECK(with("2,0 1,0 0,0") == ":13: '2,0' has a decimal comma; write the numbers with a point, such as 2.0");
  CHECK(with("2,1,0") == ":13: '2,1,0' has a comma; separate the numbers by blanks");
  CHECK(with("2 one 0") == ":13: 'one' is not a number");
  CHECK(with("2 1") == ":13: the line has fewer values than the header says");
  CHECK(with("2 1 0 255") == ":13: the line has more values than the header says");
  CHECK(why(head + "0 0 0\n2 0 0\n2 1 0\n0 1 0\n") ==
        ":15: the header announces 1 rows of 'face', but only 0 bytes follow: the file is cut off, or its "
        "header is "
        "wrong");
  CHECK(why(head + "0 0 0\n2 0 0\n2.0000000000 1 0\n")
            .starts_with(":14: the file ends after 3 of 4 rows of 'vertex': it is cut off"));
}

TEST_CASE("a face that names no vertex of the file is refused, and counting from one is guessed") {
  const auto with = [](std::string_view face) { return why(head + replaced(body, "4 0 1 2 3", face)); };
  const std::string there = ", which is not there: 4 vertices are counted from 0";
  CHECK(with("4 0 1 2 7") == ":15: a face names vertex 7" + there);
  CHECK(with("4 1 2 3 4") == ":15: a face names vertex 4" + there + "; does it count from 1?");
  CHECK(with("4 -1 2 3 0") == ":15: a face names vertex -1" + there);
  CHECK(with("3 0 1.5 2") == ":15: a face names vertex 1.5" + there);
  CHECK(with("-3 0 1 2") == ":15: a list 'vertex_indices' cannot have -3 values");
}

TEST_CASE("a header that announces more than the file can hold is refused before anything is reserved") {
  for (const std::string count : {"1000000000000", "2000000000", "18446744073709551615"}) {
    const auto line = why(replaced(head, "vertex 4", "vertex " + count) + body);
    CHECK(line.find(": ") != line.npos);
    CHECK_MESSAGE((line.find("announces " + count) != line.npos), line);
  }
}

TEST_CASE("a face that is not convex is cut so that nothing lies outside it") {
  const std::string arrow =
      replaced(head, "vertex 4", "vertex 4") + "0 0 0\n4 0 0\n1 1 0\n0 4 0\n4 1 2 3 0\n";
  const File file(arrow);
  const auto read = read_mesh_file(file.path());
  REQUIRE(read.has_value());
  REQUIRE(read->mesh.triangles.size() == 2);
  double area = 0;
  for (const auto& t : read->mesh.triangles) {
    CHECK(read->mesh.doubled_area(t).z() > 0);
    area += 0.5 * read->mesh.doubled_area(t).z();
  }
  CHECK(area == doctest::Approx(4));  // two triangles of base 4 and height 1
}

TEST_CASE("triangle strips are read, each second triangle turned") {
  const File file(replaced(replaced(head, "element face", "element tristrips"), "uchar int", "int int") +
                  "0 0 0\n2 0 0\n2 1 0\n0 1 0\n6 0 1 3 2 -1 1\n");
  const auto read = read_mesh_file(file.path());
  REQUIRE_MESSAGE(read.has_value(), read.error().what);
  CHECK(read->mesh.triangles == std::vector<Triangle>{{0, 1, 3}, {3, 1, 2}});
}

namespace {

const std::string stl_facets =
    "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 2 0 0\n  vertex +2 1.0E+00 0\n "
    "endloop\nendfacet\n"
    "FACET\n OUTER LOOP\n  VERTEX 0 0 0\n  VERTEX 2e0 1 0\n  VERTEX 0 1 0\n ENDLOOP\nENDFACET\n";

std::string binary_stl(std::string title, std::uint32_t count) {
  title.resize(80, '\0');
  title.append(reinterpret_cast<const char*>(&count), sizeof count);
  const float corners[2][12] = {{0, 0, 0, 0, 0, 0, 2, 0, 0, 2, 1, 0}, {0, 0, 0, 0, 0, 0, 2, 1, 0, 0, 1, 0}};
  for (const auto& facet : corners) {
    title.append(reinterpret_cast<const char*>(facet), sizeof facet);
    title.append(2, '\0');
  }
  return title;
}

void check_two_facets(const std::string& content) {
  const File file(content);
  const auto read = read_mesh_file(file.path());
  REQUIRE_MESSAGE(read.has_value(), read.error().what);
  CHECK(read->mesh.triangles.size() == 2);
  REQUIRE(read->mesh.vertices.size() == 6);
  CHECK(read->mesh.vertices[2] == Eigen::Vector3d{2, 1, 0});
  CHECK(read->mesh.vertices[5] == Eigen::Vector3d{0, 1, 0});
}

}  // namespace

TEST_CASE("an STL file is told by its bytes, whatever its name and its title") {
  check_two_facets("solid plate\n" + stl_facets + "endsolid plate\n");
  check_two_facets(replaced("solid\n" + stl_facets + "endsolid", "\n", "\r\n"));
  check_two_facets("Solid one\n" + stl_facets.substr(0, stl_facets.find("FACET")) +
                   "endsolid one\nsolid two\n" + stl_facets.substr(stl_facets.find("FACET")) +
                   "endsolid two\n");
  check_two_facets(binary_stl("made by a CAD", 2));
  check_two_facets(binary_stl("solid made by a CAD", 2));
}

TEST_CASE("an STL file that is cut off or holds nothing is refused") {
  CHECK(why("solid a\n" + stl_facets) == ":16: the file ends without endsolid: it is cut off");
  CHECK(why("solid a\n" + stl_facets.substr(0, 60)).find("cut off") != std::string::npos);
  CHECK(why("solid a\n" + replaced(stl_facets, "2e0", "2,5") + "endsolid") ==
        ":12: '2,5' has a decimal comma; write the numbers with a point, such as 2.5");
  CHECK(why("solid a\nendsolid a\n").find("the solid has no facets") != std::string::npos);
  CHECK(why(binary_stl("solid", 5)) ==
        ": byte 184: this binary STL announces 5 facets, but 2 are there: it is cut off");
}
