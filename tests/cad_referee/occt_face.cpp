#include "cad_referee/occt_face.hpp"

#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <Geom_BSplineSurface.hxx>
#include <IGESControl_Reader.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <ShapeAnalysis_ShapeTolerance.hxx>
#include <StepBasic_Product.hxx>
#include <StepData_StepModel.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>

namespace moldloft::referee {

namespace {

geometry::BSplineSurface surface_of(const TopoDS_Face& face) {
  geometry::BSplineSurface s;
  const auto spline = Handle(Geom_BSplineSurface)::DownCast(BRep_Tool::Surface(face));
  if (spline.IsNull() || spline->IsURational() || spline->IsVRational() || spline->UDegree() != 3 ||
      spline->VDegree() != 3)
    return s;
  for (const double k : spline->UKnotSequence()) s.knots_u.push_back(k);
  for (const double k : spline->VKnotSequence()) s.knots_v.push_back(k);
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(spline->NbUPoles(), spline->NbVPoles());
  for (int i = 0; i < s.control_u(); ++i) {
    for (int j = 0; j < s.control_v(); ++j) {
      const gp_Pnt p = spline->Pole(i + 1, j + 1);
      s.x(i, j) = p.X(), s.y(i, j) = p.Y(), s.z(i, j) = p.Z();
    }
  }
  return s;
}

Eigen::Vector3d normal_of(const TopoDS_Face& face, const geometry::BSplineSurface& s) {
  gp_Pnt p;
  gp_Vec du, dv;
  BRep_Tool::Surface(face)->D1((s.knots_u.front() + s.knots_u.back()) / 2,
                               (s.knots_v.front() + s.knots_v.back()) / 2, p, du, dv);
  const gp_Vec n = du.Crossed(dv).Normalized() * (face.Orientation() == TopAbs_REVERSED ? -1 : 1);
  return {n.X(), n.Y(), n.Z()};
}

void triangulate(const TopoDS_Face& face, OcctFace& read) {
  BRepMesh_IncrementalMesh(face, 0.05, false, 0.1);
  TopLoc_Location location;
  const auto mesh = BRep_Tool::Triangulation(face, location);
  if (mesh.IsNull()) return;
  for (int i = 1; i <= mesh->NbNodes(); ++i) {
    const gp_Pnt p = mesh->Node(i).Transformed(location);
    read.points.push_back({p.X(), p.Y(), p.Z()});
  }
  for (int i = 1; i <= mesh->NbTriangles(); ++i) {
    int a = 0, b = 0, c = 0;
    mesh->Triangle(i).Get(a, b, c);
    read.triangles.push_back({a - 1, b - 1, c - 1});
  }
}

OcctFace look_at(const TopoDS_Shape& shape) {
  OcctFace read;
  TopTools_IndexedMapOfShape faces, edges, wires;
  TopExp::MapShapes(shape, TopAbs_FACE, faces);
  read.faces = faces.Extent();
  if (read.faces == 0) return read;
  const TopoDS_Face face = TopoDS::Face(faces(1));
  read.valid = BRepCheck_Analyzer(shape).IsValid();
  TopExp::MapShapes(face, TopAbs_EDGE, edges);
  TopExp::MapShapes(face, TopAbs_WIRE, wires);
  read.edges = edges.Extent(), read.wires = wires.Extent();
  read.surface = surface_of(face);
  if (read.surface.x.size() == 0) return read;
  GProp_GProps area, length;
  read.area_error = BRepGProp::SurfaceProperties(face, area, 1e-9);
  read.area = area.Mass();
  BRepGProp::LinearProperties(face, length, true);
  read.outline = length.Mass();
  read.tolerance = ShapeAnalysis_ShapeTolerance().Tolerance(face, 1);
  read.normal = normal_of(face, read.surface);
  triangulate(face, read);
  return read;
}

void be_quiet() {
  for (const auto& printer : Message::DefaultMessenger()->Printers()) printer->SetTraceLevel(Message_Fail);
}

template <typename Reader>
TopoDS_Shape shape_in(Reader& reader, const std::string& path) {
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone) return {};
  reader.TransferRoots();
  return reader.OneShape();
}

}  // namespace

bool OcctFace::covers(double x, double y) const {
  const auto side = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
  };
  for (const auto& t : triangles) {
    const double a = side(points[t[0]], points[t[1]]), b = side(points[t[1]], points[t[2]]),
                 c = side(points[t[2]], points[t[0]]);
    if ((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0)) return true;
  }
  return false;
}

OcctFace read_step(const std::string& path) {
  be_quiet();
  STEPControl_Reader reader;
  OcctFace read;
  const TopoDS_Shape shape = shape_in(reader, path);
  if (!shape.IsNull()) read = look_at(shape);
  const auto model = reader.StepModel();
  for (int i = 1; !model.IsNull() && i <= model->NbEntities(); ++i) {
    const auto product = Handle(StepBasic_Product)::DownCast(model->Value(i));
    if (!product.IsNull()) read.name = product->Name()->ToCString();
  }
  return read;
}

OcctFace read_iges(const std::string& path) {
  be_quiet();
  IGESControl_Reader reader;
  const TopoDS_Shape shape = shape_in(reader, path);
  return shape.IsNull() ? OcctFace{} : look_at(shape);
}

}  // namespace moldloft::referee
