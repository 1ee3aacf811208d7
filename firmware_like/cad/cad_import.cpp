#include "firmware_like/cad/cad_import.hpp"

#include "geometry/fit/greville.hpp"

#include <BRepTools.hxx>
#include <BRepTools_WireExplorer.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_Curve.hxx>
#include <GeomConvert.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_BezierSurface.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <IGESControl_Reader.hxx>
#include <IGESData_IGESModel.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Wire.hxx>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;
using geometry::DesignFace;
using geometry::TrimPolygon;

constexpr int points_an_edge = 48;      // of a trim, in (u, v): a chord of an edge of 300 mm is 6 mm
constexpr int most_spans = 200;         // of an approximated surface
constexpr double natural_share = 1e-6;  // of the domain: a trim that runs along the knots is none

std::string name_of(const Handle(Geom_Surface) & surface) {
  static const std::map<std::string, std::string> names{
      {"Geom_Plane", "a plane"},
      {"Geom_CylindricalSurface", "a cylinder"},
      {"Geom_ConicalSurface", "a cone"},
      {"Geom_SphericalSurface", "a sphere"},
      {"Geom_ToroidalSurface", "a torus"},
      {"Geom_SurfaceOfRevolution", "a surface of revolution"},
      {"Geom_SurfaceOfLinearExtrusion", "an extruded curve"},
      {"Geom_OffsetSurface", "an offset surface"}};
  const std::string type = surface->DynamicType()->Name();
  const auto known = names.find(type);
  return known == names.end() ? type : known->second;
}

Handle(Geom_BSplineSurface) spline_of(const Handle(Geom_Surface) & given) {
  Handle(Geom_Surface) surface = given;
  const auto cut = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface);
  if (!cut.IsNull()) surface = cut->BasisSurface();
  if (Handle(Geom_BSplineSurface)::DownCast(surface).IsNull() &&
      Handle(Geom_BezierSurface)::DownCast(surface).IsNull())
    return {};
  return GeomConvert::SurfaceToBSplineSurface(given);
}

bool is_exact(const Handle(Geom_BSplineSurface) & s) {
  return !s->IsURational() && !s->IsVRational() && s->UDegree() <= 3 && s->VDegree() <= 3;
}

geometry::BSplineSurface taken_over(const Handle(Geom_BSplineSurface) & spline) {
  geometry::BSplineSurface s;
  for (const double k : spline->UKnotSequence()) s.knots_u.push_back(k);
  for (const double k : spline->VKnotSequence()) s.knots_v.push_back(k);
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(spline->NbUPoles(), spline->NbVPoles());
  for (int i = 0; i < s.control_u(); ++i) {
    for (int k = 0; k < s.control_v(); ++k) {
      const gp_Pnt p = spline->Pole(i + 1, k + 1);
      s.x(i, k) = p.X(), s.y(i, k) = p.Y(), s.z(i, k) = p.Z();
    }
  }
  return s;
}

// The knots of a cubic that can bend where the given one can: every span in `pieces`, and a knot as often as the
// surface is less smooth there than a cubic.
std::vector<double> cubic_knots(const TColStd_Array1OfReal& knots, const TColStd_Array1OfInteger& counts,
                                int degree, int pieces) {
  std::vector<double> all(4, knots.First());
  for (int i = knots.Lower(); i < knots.Upper(); ++i) {
    for (int k = 1; k < pieces; ++k) all.push_back(knots(i) + (knots(i + 1) - knots(i)) * k / pieces);
    const int smooth = degree - counts(i + 1);  // continuous derivatives
    const int often = i + 1 == knots.Upper() ? 4 : std::clamp(3 - smooth, 1, 3);
    all.insert(all.end(), static_cast<std::size_t>(often), knots(i + 1));
  }
  return all;
}

// A bicubic surface through the given one at its Greville places, cut finer until it follows within approximated_mm.
std::optional<geometry::BSplineSurface> followed(const Handle(Geom_BSplineSurface) & spline) {
  for (int pieces = 1; pieces * (spline->NbUKnots() + spline->NbVKnots()) <= 2 * most_spans; pieces *= 2) {
    const auto u = cubic_knots(spline->UKnots(), spline->UMultiplicities(), spline->UDegree(), pieces);
    const auto v = cubic_knots(spline->VKnots(), spline->VMultiplicities(), spline->VDegree(), pieces);
    const auto at_u = geometry::greville_places(u), at_v = geometry::greville_places(v);
    Eigen::MatrixXd x(static_cast<Eigen::Index>(at_u.size()), static_cast<Eigen::Index>(at_v.size())), y = x,
                                                                                                       z = x;
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      for (Eigen::Index k = 0; k < x.cols(); ++k) {
        const gp_Pnt p = spline->Value(at_u[static_cast<std::size_t>(i)], at_v[static_cast<std::size_t>(k)]);
        x(i, k) = p.X(), y(i, k) = p.Y(), z(i, k) = p.Z();
      }
    }
    auto cubic = geometry::surface_through(u, v, x, y, z);
    double off = 0;
    const int steps_u = 8 * pieces * spline->NbUKnots(), steps_v = 8 * pieces * spline->NbVKnots();
    for (int i = 0; i <= steps_u; ++i) {
      for (int k = 0; k <= steps_v; ++k) {
        const double a = u.front() + (u.back() - u.front()) * i / steps_u,
                     b = v.front() + (v.back() - v.front()) * k / steps_v;
        const gp_Pnt p = spline->Value(a, b);
        off = std::max(off, (cubic.at(a, b).value - Eigen::Vector3d{p.X(), p.Y(), p.Z()}).norm());
      }
    }
    if (off < approximated_mm) return cubic;
  }
  return std::nullopt;
}

// The wire's edges in its own order, in (u, v) of the face's surface.
TrimPolygon polygon_of(const TopoDS_Wire& wire, const TopoDS_Face& face) {
  TrimPolygon polygon;
  for (BRepTools_WireExplorer edges(wire, face); edges.More(); edges.Next()) {
    double first = 0, last = 0;
    const Handle(Geom2d_Curve) curve = BRep_Tool::CurveOnSurface(edges.Current(), face, first, last);
    if (curve.IsNull()) continue;
    const bool reversed = edges.Current().Orientation() == TopAbs_REVERSED;
    for (int i = 0; i < points_an_edge; ++i) {
      const double part = static_cast<double>(reversed ? points_an_edge - i : i) / points_an_edge;
      const gp_Pnt2d p = curve->Value(first + (last - first) * part);
      polygon.push_back({p.X(), p.Y()});
    }
  }
  return polygon;
}

bool is_natural(const TrimPolygon& polygon, const geometry::BSplineSurface& s) {
  const double u0 = s.knots_u.front(), u1 = s.knots_u.back(), v0 = s.knots_v.front(), v1 = s.knots_v.back();
  return std::ranges::all_of(polygon, [&](const Eigen::Vector2d& p) {
    const double off_u = std::min(std::abs(p.x() - u0), std::abs(p.x() - u1)) / (u1 - u0);
    const double off_v = std::min(std::abs(p.y() - v0), std::abs(p.y() - v1)) / (v1 - v0);
    return std::min(off_u, off_v) < natural_share;
  });
}

std::expected<void, std::string> add_face(const TopoDS_Face& face, ImportedDesign& design) {
  const Handle(Geom_Surface) given = BRep_Tool::Surface(face);
  Handle(Geom_BSplineSurface) spline = spline_of(given);
  if (spline.IsNull()) return std::unexpected(name_of(given));
  spline = Handle(Geom_BSplineSurface)::DownCast(spline->Copy());
  if (spline->IsUPeriodic()) spline->SetUNotPeriodic();
  if (spline->IsVPeriodic()) spline->SetVNotPeriodic();
  DesignFace one;
  if (is_exact(spline)) {
    spline->IncreaseDegree(3, 3);
    one.surface = taken_over(spline);
  } else if (auto cubic = followed(spline)) {
    one.surface = std::move(*cubic);
    ++design.approximated;
  } else {
    return std::unexpected(fmt::format("a surface of degree {} x {} that no cubic one follows within {:g} mm",
                                       spline->UDegree(), spline->VDegree(), approximated_mm));
  }
  const TopoDS_Wire outer = BRepTools::OuterWire(face);
  const auto clamp = [&](TrimPolygon& polygon) {
    for (auto& p : polygon) {
      p.x() = std::clamp(p.x(), one.surface.knots_u.front(), one.surface.knots_u.back());
      p.y() = std::clamp(p.y(), one.surface.knots_v.front(), one.surface.knots_v.back());
    }
  };
  if (!outer.IsNull()) {
    auto polygon = polygon_of(outer, face);
    clamp(polygon);
    std::vector<TrimPolygon> holes;
    for (TopExp_Explorer wires(face, TopAbs_WIRE); wires.More(); wires.Next()) {
      if (wires.Current().IsSame(outer)) continue;
      holes.push_back(polygon_of(TopoDS::Wire(wires.Current()), face));
      clamp(holes.back());
    }
    if (polygon.size() >= 3 && (!is_natural(polygon, one.surface) || !holes.empty())) {
      one.trims.push_back(std::move(polygon));
      std::ranges::move(holes, std::back_inserter(one.trims));
    }
  }
  design.faces.push_back(std::move(one));
  return {};
}

std::expected<TopoDS_Shape, std::string> read_shape(const fs::path& path, std::string& unit) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".igs" || ending == ".iges") {
    IGESControl_Reader reader;
    if (reader.ReadFile(path.c_str()) != IFSelect_RetDone)
      return std::unexpected("is no IGES file that can be read");
    if (!reader.IGESModel().IsNull() && !reader.IGESModel()->GlobalSection().UnitName().IsNull())
      unit = reader.IGESModel()->GlobalSection().UnitName()->ToCString();
    reader.TransferRoots();
    return reader.OneShape();
  }
  if (ending != ".stp" && ending != ".step")
    return std::unexpected("has no ending that is known: .step, .stp, .iges or .igs");
  STEPControl_Reader reader;
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone)
    return std::unexpected("is no STEP file that can be read");
  TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
  reader.FileUnits(lengths, angles, solid_angles);
  if (lengths.Length() > 0) unit = lengths.First().ToCString();
  reader.TransferRoots();
  return reader.OneShape();
}

}  // namespace

std::expected<ImportedDesign, Failure> import_cad(const fs::path& path) {
  const auto refuse = [&](std::string_view why) {
    return std::unexpected(Failure{fmt::format("{}: {}", path.string(), why)});
  };
  std::error_code failed;
  if (!fs::is_regular_file(path, failed)) return refuse("no such file");
  Message::DefaultMessenger()->RemovePrinters(
      Message_Printer::get_type_descriptor());  // it would talk on standard output
  try {
    ImportedDesign design;
    const auto shape = read_shape(path, design.unit);
    if (!shape) return refuse(shape.error());
    if (shape->IsNull()) return refuse("holds no shape");
    std::map<std::string, int> others;
    int faces = 0;
    for (TopExp_Explorer all(*shape, TopAbs_FACE); all.More(); all.Next(), ++faces) {
      if (const auto added = add_face(TopoDS::Face(all.Current()), design); !added) ++others[added.error()];
    }
    if (faces == 0) return refuse("holds no face");
    if (others.empty()) return design;
    std::vector<std::string> words;
    for (const auto& [name, count] : others)
      words.push_back(count == 1 ? name : fmt::format("{} ({} times)", name, count));
    return refuse(fmt::format(
        "{} of its {} faces {} no B-spline: {}; export the plate's formed face alone, as B-spline",
        faces - static_cast<int>(design.faces.size()), faces,
        faces - static_cast<int>(design.faces.size()) == 1 ? "is" : "are", fmt::join(words, ", ")));
  } catch (const Standard_Failure& e) {
    return refuse(fmt::format("cannot be read: {}",
                              e.GetMessageString() == nullptr ? "no reason given" : e.GetMessageString()));
  }
}

}  // namespace moldloft::firmware_like
