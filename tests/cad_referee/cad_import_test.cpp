// Designs that OpenCASCADE wrote, read by moldloft-cad: the same surfaces, borders and distances as there.
#include "firmware_like/cad/cad_import.hpp"

#include "geometry/inspection/design_faces.hpp"
#include "hal/temporary_folder.hpp"

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepLib.hxx>
#include <BRep_Builder.hxx>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom2d_Circle.hxx>
#include <Geom2d_Line.hxx>
#include <GeomAPI_ProjectPointOnSurf.hxx>
#include <GeomConvert.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_Plane.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <Geom_SphericalSurface.hxx>
#include <IGESControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt2d.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <TopoDS_Compound.hxx>
#include <doctest/doctest.h>
#include <gp_Ax2d.hxx>
#include <gp_Pln.hxx>

#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>

using namespace moldloft;
using firmware_like::import_cad;

namespace {

// A wavy net of 7 x 6 control points of any degree over 300 x 200 mm.
Handle(Geom_BSplineSurface) wavy(int degree = 3) {
  constexpr int count_u = 7, count_v = 6;
  TColgp_Array2OfPnt poles(1, count_u, 1, count_v);
  for (int i = 1; i <= count_u; ++i) {
    for (int k = 1; k <= count_v; ++k)
      poles(i, k) = gp_Pnt(50.0 * (i - 1), 40.0 * (k - 1), 12 * std::sin(1.1 * i) * std::cos(0.9 * k));
  }
  const auto knots = [&](int count) {
    TColStd_Array1OfReal values(1, count - degree + 1);
    for (int i = 1; i <= values.Length(); ++i) values(i) = i - 1;
    return values;
  };
  const auto counts = [&](int count) {
    TColStd_Array1OfInteger values(1, count - degree + 1);
    values.Init(1);
    values(1) = values(values.Length()) = degree + 1;
    return values;
  };
  return new Geom_BSplineSurface(poles, knots(count_u), knots(count_v), counts(count_u), counts(count_v),
                                 degree, degree);
}

TopoDS_Face face_of(const Handle(Geom_Surface) & surface) {
  return BRepBuilderAPI_MakeFace(surface, 1e-6).Face();
}

void write_step(const TopoDS_Shape& shape, const std::string& path, const char* unit = "MM") {
  STEPControl_Controller::Init();  // sets up where the settings are kept; a writer takes them when it is made
  REQUIRE(Interface_Static::SetCVal("write.step.unit", unit));
  STEPControl_Writer writer;
  REQUIRE(writer.Transfer(shape, STEPControl_AsIs) == IFSelect_RetDone);
  REQUIRE(writer.Write(path.c_str()) == IFSelect_RetDone);
  Interface_Static::SetCVal("write.step.unit", "MM");
}

// Distances of points round the surface, ours against OpenCASCADE's.
void check_distances(const geometry::DesignFaces& ours, const Handle(Geom_Surface) & theirs,
                     double tolerance_mm) {
  double most = 0;
  for (int i = 1; i < 12; ++i) {
    for (int k = 1; k < 9; ++k) {
      const gp_Pnt p(25.0 * i, 22.0 * k, 20 * std::sin(i + 2.0 * k));
      GeomAPI_ProjectPointOnSurf foot(p, theirs);
      const auto found = ours.foot({p.X(), p.Y(), p.Z()});
      if (foot.NbPoints() == 0 || found.overhang_mm > 0) continue;
      most = std::max(most, std::abs(std::abs(found.signed_mm) - foot.LowerDistance()));
    }
  }
  CHECK(most < tolerance_mm);
}

}  // namespace

TEST_CASE("a cubic face comes over by STEP and IGES, and distances are OpenCASCADE's") {
  const hal::TemporaryFolder folder;
  const auto surface = wavy();
  const auto face = face_of(surface);
  write_step(face, folder.file("a.step"));
  IGESControl_Writer iges("MM", 1);
  iges.AddShape(face);
  REQUIRE(iges.Write(folder.file("a.igs").c_str()));
  for (const char* name : {"a.step", "a.igs"}) {
    CAPTURE(std::string{name});
    const auto read = import_cad(folder.file(name));
    REQUIRE_MESSAGE(read.has_value(), read.error().what);
    REQUIRE(read->faces.size() == 1);
    CHECK(read->approximated == 0);
    CHECK(read->faces[0].trims.empty());
    const auto& s = read->faces[0].surface;
    CHECK(s.control_u() == 7);
    CHECK(s.z(2, 3) == doctest::Approx(surface->Pole(3, 4).Z())
                           .epsilon(name[2] == 's' ? 1e-12 : 1e-6));  // IGES has fewer digits
    const auto design = geometry::DesignFaces::from(read->faces);
    REQUIRE(design);
    check_distances(*design, surface, 1e-6);
  }
}

TEST_CASE("inches and metres become millimetres, and placements are applied") {
  const hal::TemporaryFolder folder;
  gp_Trsf placed;
  placed.SetTranslation(gp_Vec(1000, -50, 7));
  const auto moved = BRepBuilderAPI_Transform(face_of(wavy()), placed).Shape();
  for (const auto& [unit, word] : {std::pair{"INCH", "inch"}, {"M", "metre"}}) {
    write_step(moved, folder.file("u.step"), unit);
    const auto read = import_cad(folder.file("u.step"));
    REQUIRE_MESSAGE(read.has_value(), read.error().what);
    std::string said = read->unit;
    for (char& c : said) c = static_cast<char>(std::tolower(c));
    CHECK(said.find(word) != std::string::npos);
    CHECK(read->faces[0].surface.x(0, 0) == doctest::Approx(1000));
    CHECK(read->faces[0].surface.x(6, 0) == doctest::Approx(1300));
  }
}

TEST_CASE("a face with a hole is trimmed, and its area is OpenCASCADE's") {
  const hal::TemporaryFolder folder;
  const auto surface = wavy();
  const Handle(Geom2d_Circle) circle = new Geom2d_Circle(gp_Ax2d(gp_Pnt2d(2, 1.5), gp_Dir2d(1, 0)), 0.5);
  auto hole = BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(circle, surface).Edge()).Wire();
  BRepLib::BuildCurves3d(hole);
  BRepBuilderAPI_MakeFace maker(face_of(surface));
  maker.Add(TopoDS::Wire(hole.Reversed()));
  write_step(maker.Face(), folder.file("hole.step"));
  const auto read = import_cad(folder.file("hole.step"));
  REQUIRE_MESSAGE(read.has_value(), read.error().what);
  REQUIRE(read->faces[0].trims.size() == 2);
  const auto design = geometry::DesignFaces::from(read->faces);
  REQUIRE(design);
  const auto middle = read->faces[0].surface.at(2, 1.5).value;
  CHECK(design->foot(middle).overhang_mm > 10);
  CHECK(design->foot(read->faces[0].surface.at(0.5, 1.5).value).overhang_mm == 0);
}

TEST_CASE("a border follows its curve to some micrometres, and keeps its corners") {
  // A flat net whose (u, v) are millimetres: places on it are known.
  const hal::TemporaryFolder folder;
  TColgp_Array2OfPnt poles(1, 4, 1, 4);
  for (int i = 1; i <= 4; ++i) {
    for (int k = 1; k <= 4; ++k) poles(i, k) = gp_Pnt(100.0 * (i - 1), 100.0 * (k - 1), 5);
  }
  TColStd_Array1OfReal knots(1, 2);
  knots(1) = 0, knots(2) = 300;
  TColStd_Array1OfInteger counts(1, 2);
  counts.Init(4);
  const Handle(Geom_BSplineSurface) flat = new Geom_BSplineSurface(poles, knots, knots, counts, counts, 3, 3);
  const auto trimmed = [&](const TopoDS_Wire& border, const char* name) {
    TopoDS_Wire wire = border;
    BRepLib::BuildCurves3d(wire);
    write_step(BRepBuilderAPI_MakeFace(flat, wire).Face(), folder.file(name));
    auto read = import_cad(folder.file(name));
    REQUIRE_MESSAGE(read.has_value(), read.error().what);
    REQUIRE(read->faces[0].trims.size() == 1);
    return read->faces[0].trims[0];
  };

  SUBCASE("a circle") {
    const Handle(Geom2d_Circle) circle = new Geom2d_Circle(gp_Ax2d(gp_Pnt2d(150, 150), gp_Dir2d(1, 0)), 120);
    const auto border =
        trimmed(BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(circle, flat).Edge()).Wire(), "circle.step");
    double most = 0;
    for (std::size_t i = 0; i < border.size(); ++i) {
      const Eigen::Vector2d middle = (border[i] + border[(i + 1) % border.size()]) / 2;
      most = std::max(most, std::abs((middle - Eigen::Vector2d{150, 150}).norm() - 120));
    }
    CHECK(most < 0.006);
    CHECK(border.size() < 1000);
  }
  SUBCASE("three sides whose corners are the surface's") {
    const auto side = [&](double u, double v, double to_u, double to_v) {
      const gp_Dir2d along(to_u - u, to_v - v);
      return BRepBuilderAPI_MakeEdge(new Geom2d_Line(gp_Pnt2d(u, v), along), flat, 0,
                                     std::hypot(to_u - u, to_v - v))
          .Edge();
    };
    const auto border = trimmed(
        BRepBuilderAPI_MakeWire(side(0, 0, 300, 0), side(300, 0, 300, 300), side(300, 300, 0, 0)).Wire(),
        "triangle.step");
    double area = 0;
    for (std::size_t i = 0; i < border.size(); ++i) {
      const auto &a = border[i], &b = border[(i + 1) % border.size()];
      area += (a.x() * b.y() - a.y() * b.x()) / 2;
    }
    CHECK(std::abs(area) == doctest::Approx(45000).epsilon(1e-6));
    CHECK(border.size() < 20);  // straight sides need no more
  }
  SUBCASE("one curve with corners") {
    TColgp_Array1OfPnt2d corners(1, 6);
    corners(1) = corners(6) = gp_Pnt2d(20, 20);
    corners(2) = gp_Pnt2d(271, 33), corners(3) = gp_Pnt2d(255, 207);
    corners(4) = gp_Pnt2d(140, 120), corners(5) = gp_Pnt2d(31, 266);
    TColStd_Array1OfReal places(1, 6);
    const double at[] = {0, 0.23, 0.41, 0.58, 0.77, 1};
    for (int i = 1; i <= 6; ++i) places(i) = at[i - 1];
    TColStd_Array1OfInteger often(1, 6);
    often.Init(1);
    often(1) = often(6) = 2;
    const Handle(Geom2d_BSplineCurve) zigzag = new Geom2d_BSplineCurve(corners, places, often, 1);
    const auto border =
        trimmed(BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(zigzag, flat).Edge()).Wire(), "zigzag.step");
    for (int i = 1; i <= 5; ++i) {
      double nearest = 1e9;
      for (const auto& p : border)
        nearest = std::min(nearest, std::hypot(p.x() - corners(i).X(), p.y() - corners(i).Y()));
      CHECK(nearest < 1e-3);
    }
  }
}

TEST_CASE("degree 5 and rational surfaces become cubic within a ten-thousandth of a millimetre") {
  const hal::TemporaryFolder folder;
  const auto quintic = wavy(5);
  write_step(face_of(quintic), folder.file("q.step"));
  auto read = import_cad(folder.file("q.step"));
  REQUIRE_MESSAGE(read.has_value(), read.error().what);
  CHECK(read->approximated == 1);
  auto design = geometry::DesignFaces::from(read->faces);
  REQUIRE(design);
  check_distances(*design, quintic, 1e-4);

  const Handle(Geom_SphericalSurface) sphere = new Geom_SphericalSurface(gp_Ax3(), 1000);
  const Handle(Geom_RectangularTrimmedSurface) patch =
      new Geom_RectangularTrimmedSurface(sphere, 0.1, 0.4, 0.1, 0.3);
  write_step(face_of(GeomConvert::SurfaceToBSplineSurface(patch)), folder.file("s.step"));
  read = import_cad(folder.file("s.step"));
  REQUIRE_MESSAGE(read.has_value(), read.error().what);
  const auto& s = read->faces[0].surface;
  double most = 0;
  for (int i = 0; i <= 20; ++i) {
    for (int k = 0; k <= 20; ++k) {
      const auto at = [](const std::vector<double>& knots, double part) {
        return knots.front() + (knots.back() - knots.front()) * part;
      };
      most = std::max(most,
                      std::abs(s.at(at(s.knots_u, i / 20.0), at(s.knots_v, k / 20.0)).value.norm() - 1000));
    }
  }
  CHECK(most < 1e-4);
}

TEST_CASE("what is no B-spline is refused by its name and count, what is no file in one line") {
  const hal::TemporaryFolder folder;
  write_step(BRepBuilderAPI_MakeFace(gp_Pln(), 0, 100, 0, 50).Face(), folder.file("p.step"));
  auto read = import_cad(folder.file("p.step"));
  REQUIRE_FALSE(read);
  CHECK(read.error().what.find("holds only planes (1)") != std::string::npos);

  TopoDS_Compound both;
  BRep_Builder builder;
  builder.MakeCompound(both);
  builder.Add(both, face_of(wavy()));
  builder.Add(both, BRepBuilderAPI_MakeFace(gp_Pln(), 0, 100, 0, 50).Face());
  builder.Add(both, BRepBuilderAPI_MakeFace(gp_Pln(), 0, 10, 0, 5).Face());
  write_step(both, folder.file("b.step"));
  read = import_cad(folder.file("b.step"));
  REQUIRE_FALSE(read);
  CHECK(read.error().what.find("2 of its 3 faces are no B-spline: a plane (2 times)") != std::string::npos);

  // A number that is none, and one that no plate has.
  write_step(face_of(wavy()), folder.file("n.step"));
  std::ifstream in(folder.file("n.step"));
  const std::string good{std::istreambuf_iterator<char>{in}, {}};
  for (const auto& [number, words] : {std::pair{"NAN", "no number"},
                                      {"-INF", "no number"},
                                      {" nan", "no number"},
                                      {"3.E29", "face 1 reaches"}}) {
    CAPTURE(number);
    std::string bad = good;
    const auto at = bad.find("(300.,");
    REQUIRE(at != bad.npos);
    for (auto i = at; i != bad.npos; i = bad.find("(300.,", i)) bad.replace(i + 1, 4, number);
    std::ofstream(folder.file("n.step")) << bad;
    read = import_cad(folder.file("n.step"));
    REQUIRE_FALSE(read);
    CHECK_MESSAGE(read.error().what.find(words) != std::string::npos, read.error().what);
  }
  std::string named = good;  // a word in a string is no coordinate
  named.replace(named.find("CARTESIAN_POINT('"), 17, "CARTESIAN_POINT('A,NAN,B");
  std::ofstream(folder.file("n.step")) << named;
  CHECK(import_cad(folder.file("n.step")));

  for (const char* name : {"none.step", "none.igs", "none.xyz"}) CHECK_FALSE(import_cad(folder.file(name)));
}
