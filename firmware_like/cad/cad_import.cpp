#include "firmware_like/cad/cad_import.hpp"

#include "geometry/fit/greville.hpp"

#include <BRepTools.hxx>
#include <BRepTools_WireExplorer.hxx>
#include <BRep_Tool.hxx>
#include <Geom2dAdaptor_Curve.hxx>
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
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <ranges>

namespace moldloft::firmware_like {
namespace {

namespace fs = std::filesystem;
using geometry::DesignFace;
using geometry::TrimPolygon;

constexpr double farthest_mm = 1e7;     // of a control point: no ship is longer
constexpr int most_halvings = 10;       // of a smooth piece of the border
constexpr double border_slack = 1e-4;   // of the domain: what a writer's tolerance leaves beyond its end
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

// How far `at` lies from the chord, in space: the nearest place in (u, v) counts, not the one of the same share.
double off_chord_mm(const geometry::BSplineSurface& s, const gp_Pnt2d& at, const gp_Pnt2d& from,
                    const gp_Pnt2d& to) {
  const auto here = s.at(at.X(), at.Y());
  const Eigen::Vector3d chord = here.du * (to.X() - from.X()) + here.dv * (to.Y() - from.Y());
  const Eigen::Vector3d gone = here.du * (at.X() - from.X()) + here.dv * (at.Y() - from.Y());
  const double square = chord.squaredNorm();
  const double share = square > 0 ? std::clamp(gone.dot(chord) / square, 0.0, 1.0) : 0;
  return (gone - share * chord).norm();
}

// The places of one smooth piece of a border, its end left to the next piece. A chord is halved until it follows.
void add_piece(const Geom2dAdaptor_Curve& curve, const geometry::BSplineSurface& s, double from, double to,
               int halvings, TrimPolygon& polygon) {
  const gp_Pnt2d a = curve.Value(from), b = curve.Value(to);
  double off = 0;
  for (const double part : {0.25, 0.5, 0.75})
    off = std::max(off, off_chord_mm(s, curve.Value(from + (to - from) * part), a, b));
  if (halvings == 0 || (halvings <= most_halvings && off < border_mm)) {
    polygon.push_back({a.X(), a.Y()});
    return;
  }
  const double middle = (from + to) / 2;
  add_piece(curve, s, from, middle, halvings - 1, polygon);
  add_piece(curve, s, middle, to, halvings - 1, polygon);
}

// The wire's edges in its own order, in (u, v) of the face's surface. Corners of a curve are kept.
std::expected<TrimPolygon, std::string> polygon_of(const TopoDS_Wire& wire, const TopoDS_Face& face,
                                                   const geometry::BSplineSurface& s) {
  TrimPolygon polygon;
  int edges = 0, in_order = 0;
  for (TopExp_Explorer all(wire, TopAbs_EDGE); all.More(); all.Next()) ++edges;
  for (BRepTools_WireExplorer all(wire, face); all.More(); all.Next(), ++in_order) {
    double first = 0, last = 0;
    const Handle(Geom2d_Curve) drawn = BRep_Tool::CurveOnSurface(all.Current(), face, first, last);
    if (drawn.IsNull()) return std::unexpected("has a border that does not lie on it");
    const Geom2dAdaptor_Curve curve(drawn, first, last);
    TColStd_Array1OfReal ends(1, curve.NbIntervals(GeomAbs_C1) + 1);
    curve.Intervals(ends, GeomAbs_C1);
    const bool reversed = all.Current().Orientation() == TopAbs_REVERSED;
    for (int i = 1; i < ends.Length(); ++i) {
      const int k = reversed ? ends.Length() - i : i;
      add_piece(curve, s, ends(reversed ? k + 1 : k), ends(reversed ? k : k + 1), most_halvings + 1, polygon);
    }
  }
  if (in_order != edges) return std::unexpected("has a border that is not closed");
  return polygon;
}

// Moves a border of a closed surface by whole turns into the surface's knots; what still leaves them is refused, but
// for what a writer's tolerance leaves.
bool fits_into(TrimPolygon& polygon, int axis, const std::vector<double>& knots, bool closed) {
  if (polygon.empty()) return true;
  const double first = knots.front(), last = knots.back(), length = last - first;
  const auto [low, high] =
      std::ranges::minmax(polygon | std::views::transform([axis](const auto& p) { return p[axis]; }));
  const double turns = closed ? std::round(((first + last) - (low + high)) / 2 / length) * length : 0;
  const double slack = border_slack * length;
  if (!(low + turns >= first - slack && high + turns <= last + slack)) return false;
  for (auto& p : polygon) p[axis] = std::clamp(p[axis] + turns, first, last);
  return true;
}

// Every chord runs along one side of the knots' rectangle: no trim at all.
bool is_natural(const TrimPolygon& polygon, const geometry::BSplineSurface& s) {
  const auto along = [](double a, double b, const std::vector<double>& knots) {
    const double slack = natural_share * (knots.back() - knots.front());
    const auto both = [&](double side) { return std::abs(a - side) < slack && std::abs(b - side) < slack; };
    return both(knots.front()) || both(knots.back());
  };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    if (!along(a.x(), b.x(), s.knots_u) && !along(a.y(), b.y(), s.knots_v)) return false;
  }
  return true;
}

struct Closed {
  bool u = false, v = false;
};

std::expected<void, std::string> add_trims(const TopoDS_Face& face, Closed closed, DesignFace& one) {
  const TopoDS_Wire outer = BRepTools::OuterWire(face);
  if (outer.IsNull()) return {};
  std::vector<TrimPolygon> borders;
  for (TopExp_Explorer wires(face, TopAbs_WIRE); wires.More(); wires.Next()) {
    auto polygon = polygon_of(TopoDS::Wire(wires.Current()), face, one.surface);
    if (!polygon) return std::unexpected(polygon.error());
    if (polygon->size() < 3) return std::unexpected("has a border without an area");
    if (!fits_into(*polygon, 0, one.surface.knots_u, closed.u) ||
        !fits_into(*polygon, 1, one.surface.knots_v, closed.v))
      return std::unexpected("has a border beyond the end of its surface");
    const bool is_outer = wires.Current().IsSame(outer);
    borders.insert(is_outer ? borders.begin() : borders.end(), std::move(*polygon));
  }
  if (borders.size() > 1 || !is_natural(borders.front(), one.surface)) one.trims = std::move(borders);
  return {};
}

bool is_within_reach(const geometry::BSplineSurface& s) {
  return std::ranges::all_of(std::array{&s.x, &s.y, &s.z}, [](const Eigen::MatrixXd* net) {
    return net->allFinite() && net->cwiseAbs().maxCoeff() <= farthest_mm;
  });
}

// Fails with the name of what the face is instead. A fault of a face that is a B-spline goes to `fault`.
std::expected<void, std::string> add_face(const TopoDS_Face& face, ImportedDesign& design,
                                          std::string& fault) {
  const Handle(Geom_Surface) given = BRep_Tool::Surface(face);
  Handle(Geom_BSplineSurface) spline = spline_of(given);
  if (spline.IsNull()) return std::unexpected(name_of(given));
  spline = Handle(Geom_BSplineSurface)::DownCast(spline->Copy());
  const Closed closed{spline->IsUPeriodic(), spline->IsVPeriodic()};
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
  if (!is_within_reach(one.surface)) {
    fault = fmt::format("reaches beyond {:g} mm: its numbers or its unit are wrong", farthest_mm);
  } else if (const auto trimmed = add_trims(face, closed, one); !trimmed) {
    fault = trimmed.error();
  }
  design.faces.push_back(std::move(one));
  return {};
}

// OpenCASCADE searches without end for a place that is no number. STEP has no such word outside of its strings.
bool says_no_number(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::istreambuf_iterator<char> end;
  bool in_string = false, begins = false;
  std::string word;
  for (std::istreambuf_iterator<char> at(in); at != end; ++at) {
    const char c = *at;
    if (c == '\'') in_string = !in_string;
    if (in_string) continue;
    if (c == '(' || c == ',' || c == ')') {
      begins = c != ')';
      if (word.starts_with("NAN") || word.starts_with("INF")) return true;
      word.clear();
    } else if (begins && word.size() < 4 && std::isalpha(static_cast<unsigned char>(c)) != 0) {
      word += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    } else if (c != '+' && c != '-' && std::isspace(static_cast<unsigned char>(c)) == 0) {
      begins = false;
    }
  }
  return false;
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
  if (says_no_number(path)) return std::unexpected("holds a coordinate that is no number (NAN or INF)");
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
  if (fs::exists(path, failed) && !fs::is_regular_file(path, failed)) return refuse("is no file");
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
      std::string fault;
      const auto added = add_face(TopoDS::Face(all.Current()), design, fault);
      if (!added) ++others[added.error()];
      if (!fault.empty())
        return refuse(
            fmt::format("face {} {}; heal it where it was drawn, and export it again", faces + 1, fault));
    }
    if (faces == 0) return refuse("holds no face");
    if (others.empty()) return design;
    if (others.size() == 1 && others.contains("a plane") && design.faces.empty())
      return refuse(fmt::format(
          "holds only planes ({}), and no formed face: export the plate's face as B-spline", faces));
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
