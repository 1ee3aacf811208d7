#include "geometry/cad/step_writer.hpp"

#include "geometry/cad/sample_faces.hpp"
#include "geometry/cad/step_file.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <set>
#include <sstream>

using namespace moldloft;
using geometry::CadLabel, geometry::Error, geometry::TrimmedSurface, geometry::step_text;
using test::StepFile;

namespace {

const CadLabel label{.name = "plate 7",
                     .description = "saddle; sigma 0.05 mm",
                     .file_name = "surface.step",
                     .stamp = {2026, 11, 25, 7, 8, 9}};

std::set<int> referenced_by(const test::StepInstance& instance) {
  std::set<int> ids;
  for (const auto& p : instance.parameters) {
    bool quoted = false;
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (p[i] == '\'') quoted = !quoted;
      if (p[i] == '#' && !quoted) ids.insert(std::stoi(p.substr(i + 1)));
    }
  }
  return ids;
}

std::vector<double> knots(const std::string& values, const std::string& multiplicities) {
  std::vector<double> all;
  const auto value = test::step_numbers(values), times = test::step_numbers(multiplicities);
  REQUIRE(value.size() == times.size());
  for (std::size_t i = 0; i < value.size(); ++i)
    all.insert(all.end(), static_cast<std::size_t>(times[i]), value[i]);
  return all;
}

}  // namespace

TEST_CASE("a STEP file has its four parts, names its schema and carries the caller's time") {
  const std::string text = step_text({.surface = test::bent_plate()}, label).value();
  const StepFile file(text);
  CHECK(text.starts_with("ISO-10303-21;\nHEADER;\n"));
  CHECK(text.ends_with("ENDSEC;\nEND-ISO-10303-21;\n"));
  CHECK(file.others() ==
        std::vector<std::string>{
            "ISO-10303-21", "HEADER", "FILE_DESCRIPTION(('saddle; sigma 0.05 mm'),'2;1')",
            "FILE_NAME('surface.step','2026-11-25T07:08:09Z',(''),(''),'Moldloft','Moldloft','')",
            "FILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }'))",
            "ENDSEC", "DATA", "ENDSEC", "END-ISO-10303-21"});
  for (const char c : text) CHECK((c == '\n' || (c >= ' ' && c <= '~')));
}

TEST_CASE(
    "every instance that is referred to exists, comes before its use, and nothing but the roots stands "
    "alone") {
  for (const auto& face : {TrimmedSurface{.surface = test::bent_plate()}, test::trimmed_plate()}) {
    const StepFile file(step_text(face, label).value());
    std::set<int> used;
    for (const auto& [id, instance] : file.instances()) {
      for (const int other : referenced_by(instance)) {
        CHECK(file.instances().contains(other));
        CHECK(other < id);
        used.insert(other);
      }
    }
    std::set<std::string> roots;
    for (const auto& [id, instance] : file.instances()) {
      if (!used.contains(id)) roots.insert(instance.type);
    }
    roots.erase("");  // the plane of the parameters, where no curve lies in it
    CHECK(roots == std::set<std::string>{"APPLICATION_PROTOCOL_DEFINITION",
                                         "PRODUCT_RELATED_PRODUCT_CATEGORY",
                                         "SHAPE_DEFINITION_REPRESENTATION"});
  }
}

TEST_CASE("the shape of a STEP file hangs on a product, through every step that readers walk") {
  const StepFile file(step_text({.surface = test::bent_plate()}, label).value());
  const auto shape = file.all("SHAPE_DEFINITION_REPRESENTATION");
  REQUIRE(shape.size() == 1);
  const auto& of = file[shape[0]->parameters[0]];
  CHECK(of.type == "PRODUCT_DEFINITION_SHAPE");
  const auto& definition = file[of.parameters[2]];
  CHECK(definition.type == "PRODUCT_DEFINITION");
  const auto& version = file[definition.parameters[2]];
  CHECK(version.type == "PRODUCT_DEFINITION_FORMATION");
  const auto& product = file[version.parameters[2]];
  CHECK(product.type == "PRODUCT");
  CHECK(product.parameters[1] == "'plate 7'");
  const auto& representation = file[shape[0]->parameters[1]];
  CHECK(representation.type == "MANIFOLD_SURFACE_SHAPE_REPRESENTATION");
  const auto items = test::step_items(representation.parameters[1]);
  REQUIRE(items.size() == 2);
  const auto& model = file[items[1]];
  CHECK(model.type == "SHELL_BASED_SURFACE_MODEL");
  const auto& shell = file[test::step_items(model.parameters[1])[0]];
  CHECK(shell.type == "OPEN_SHELL");
  const auto& face = file[test::step_items(shell.parameters[1])[0]];
  CHECK(face.type == "ADVANCED_FACE");
  CHECK(face.parameters[3] == ".T.");
  CHECK(file[face.parameters[2]].type == "B_SPLINE_SURFACE_WITH_KNOTS");
}

TEST_CASE("a STEP file says millimetres, radians and how far edges may lie off") {
  const std::string text = step_text({.surface = test::bent_plate()}, label).value();
  CHECK(text.find("=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n") != text.npos);
  CHECK(text.find("=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));\n") != text.npos);
  const StepFile file(text);
  const auto uncertainty = file.all("UNCERTAINTY_MEASURE_WITH_UNIT");
  REQUIRE(uncertainty.size() == 1);
  CHECK(uncertainty[0]->parameters[0] == "LENGTH_MEASURE(1.E-05)");
}

TEST_CASE("poles and knots of the surface in a STEP file are the surface's, bit for bit") {
  for (const auto& surface : {test::bent_plate(), test::uneven_plate()}) {
    const StepFile file(step_text({.surface = surface}, label).value());
    const auto nets = file.all("B_SPLINE_SURFACE_WITH_KNOTS");
    REQUIRE(nets.size() == 1);
    const auto& p = nets[0]->parameters;
    CHECK(p[1] == "3");
    CHECK(p[2] == "3");
    CHECK(knots(p[10], p[8]) == surface.knots_u);
    CHECK(knots(p[11], p[9]) == surface.knots_v);
    const auto rows = test::step_items(p[3]);
    REQUIRE(static_cast<int>(rows.size()) == surface.control_u());
    for (int i = 0; i < surface.control_u(); ++i) {
      const auto row = test::step_items(rows[i]);
      REQUIRE(static_cast<int>(row.size()) == surface.control_v());
      for (int j = 0; j < surface.control_v(); ++j)
        CHECK(file.point(row[j]) == std::vector<double>{surface.x(i, j), surface.y(i, j), surface.z(i, j)});
    }
  }
}

TEST_CASE("the natural border is four edges with the net's outer rows, walked counter-clockwise") {
  const auto surface = test::uneven_plate();
  const StepFile file(step_text({.surface = surface}, label).value());
  const auto loops = file.all("EDGE_LOOP");
  REQUIRE(loops.size() == 1);
  const auto oriented = test::step_items(loops[0]->parameters[1]);
  REQUIRE(oriented.size() == 4);
  const int nu = surface.control_u() - 1, nv = surface.control_v() - 1;
  const std::vector<std::pair<int, int>> corner = {{0, 0}, {nu, 0}, {nu, nv}, {0, nv}};
  for (std::size_t e = 0; e < 4; ++e) {
    const auto& use = file[oriented[e]];
    const auto& edge = file[use.parameters[3]];
    const bool back = use.parameters[4] == ".F.";
    CHECK(back == (e >= 2));
    const auto at = [&](std::size_t c) {
      const auto [i, j] = corner[c % 4];
      return std::vector<double>{surface.x(i, j), surface.y(i, j), surface.z(i, j)};
    };
    const auto vertex = [&](std::size_t k) { return file.point(file[edge.parameters[k]].parameters[1]); };
    CHECK(vertex(1) == at(back ? e + 1 : e));
    CHECK(vertex(2) == at(back ? e : e + 1));
    const auto& curve = file[edge.parameters[3]];
    CHECK(curve.type == "B_SPLINE_CURVE_WITH_KNOTS");
    CHECK(knots(curve.parameters[7], curve.parameters[6]) ==
          (e % 2 == 0 ? surface.knots_u : surface.knots_v));
    CHECK(file.point(test::step_items(curve.parameters[2]).front()) == vertex(1));
    CHECK(file.point(test::step_items(curve.parameters[2]).back()) == vertex(2));
  }
}

TEST_CASE(
    "a trimmed face has one bound a loop, and every edge of it a curve in space and its path, bit for bit") {
  const auto face = test::trimmed_plate();
  const StepFile file(step_text(face, label).value());
  CHECK(file.all("FACE_OUTER_BOUND").size() == 1);
  CHECK(file.all("FACE_BOUND").size() == 2);
  CHECK(file.all("EDGE_CURVE").size() == 6);
  CHECK(file.all("VERTEX_POINT").size() == 6);
  const auto curves = file.all("SURFACE_CURVE");
  REQUIRE(curves.size() == 6);
  std::vector<const geometry::TrimCurve*> given;
  for (const auto& curve : face.outer) given.push_back(&curve);
  for (const auto& hole : face.holes) {
    for (const auto& curve : hole) given.push_back(&curve);
  }
  for (std::size_t k = 0; k < 6; ++k) {
    const auto& pcurve = file[test::step_items(curves[k]->parameters[2])[0]];
    CHECK(pcurve.type == "PCURVE");
    CHECK(file[pcurve.parameters[1]].type == "B_SPLINE_SURFACE_WITH_KNOTS");
    const auto& path = file[test::step_items(file[pcurve.parameters[2]].parameters[1])[0]];
    CHECK(knots(path.parameters[7], path.parameters[6]) == given[k]->path.knots);
    const auto control = test::step_items(path.parameters[2]);
    REQUIRE(control.size() == given[k]->path.control.size());
    for (std::size_t i = 0; i < control.size(); ++i) {
      const auto& p = given[k]->path.control[i];
      CHECK(file.point(control[i]) == std::vector<double>{p.x(), p.y()});
    }
  }
}

TEST_CASE("lines of a STEP file break between parameters at 80 columns, unless a string is longer") {
  std::istringstream lines(step_text(test::trimmed_plate(), label).value());
  for (std::string line; std::getline(lines, line);) {
    if (line.find('\'') == line.npos) CHECK(line.size() <= 80);
    CHECK((line.ends_with(',') || line.ends_with(')') || line.ends_with(';')));
  }
}

TEST_CASE("a long text with commas stays whole: a line's end inside a string would be lost") {
  CadLabel wordy = label;
  wordy.description.clear();
  for (int i = 0; i < 40; ++i) wordy.description += "one, two, ";
  const std::string text = step_text({.surface = test::bent_plate()}, wordy).value();
  CHECK(text.find("FILE_DESCRIPTION(('" + wordy.description + "'),") != text.npos);
  CHECK(text.find("\n'" + wordy.description + "',\n") != text.npos);  // of the product
}

TEST_CASE("the same face and label give the same bytes, and text from outside cannot end a statement") {
  CadLabel odd = label;
  odd.name = "Plate 'A\\B');#1=X(';";
  const TrimmedSurface face{.surface = test::bent_plate()};
  CHECK(step_text(face, odd).value() == step_text(face, odd).value());
  const StepFile file(step_text(face, odd).value());
  CHECK(file.all("PRODUCT").front()->parameters[1] == "'Plate ''A\\\\B'');#1=X('';'");
  CHECK(file.instances().size() == StepFile(step_text(face, label).value()).instances().size());
}

TEST_CASE("a face that is not one is refused by name") {
  TrimmedSurface bad{.surface = test::bent_plate()};
  bad.surface.z(3, 4) = std::numeric_limits<double>::quiet_NaN();
  CHECK(step_text(bad, label).error() == Error::not_finite);
  TrimmedSurface open = test::trimmed_plate();
  open.outer.pop_back();
  CHECK(step_text(open, label).error() == Error::open_loop);
}
