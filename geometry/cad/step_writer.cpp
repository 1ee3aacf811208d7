#include "geometry/cad/step_writer.hpp"

#include "geometry/cad/cad_text.hpp"
#include "geometry/cad/face_edges.hpp"

#include <initializer_list>
#include <string_view>

namespace moldloft::geometry {

namespace {

constexpr std::size_t line_width = 80;

// Breaks a statement after commas, and between the parts of a complex instance; never inside a string, where
// a line's end would be lost.
void append_wrapped(std::string& out, std::string_view statement) {
  std::size_t line_start = 0, last_break = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < statement.size(); ++i) {
    if (statement[i] == '\'') quoted = !quoted;
    if (i + 1 - line_start > line_width && last_break > line_start) {
      out += statement.substr(line_start, last_break - line_start);
      out += '\n';
      line_start = last_break;
    }
    const bool part_ends =
        statement[i] == ')' && i + 1 < statement.size() && statement[i + 1] >= 'A' && statement[i + 1] <= 'Z';
    if (!quoted && (statement[i] == ',' || part_ends)) last_break = i + 1;
  }
  out += statement.substr(line_start);
  out += '\n';
}

// A name of an instance: #12.
struct Ref {
  int id;
  std::string text() const { return std::string(1, '#') + std::to_string(id); }
};

std::string list(const std::vector<std::string>& items) {
  std::string text = "(";
  for (std::size_t i = 0; i < items.size(); ++i) text += (i == 0 ? "" : ",") + items[i];
  return text + ")";
}

template <typename T, typename Spell>
std::string list_of(const std::vector<T>& items, Spell&& spell) {
  std::vector<std::string> texts;
  for (const T& item : items) texts.push_back(spell(item));
  return list(texts);
}
std::string refs(const std::vector<Ref>& items) {
  return list_of(items, [](const Ref& r) { return r.text(); });
}

class StepText {
 public:
  // Adds `entity`, such as PLANE('',#3), and returns its name.
  Ref add(const std::string& entity) {
    append_wrapped(text_, Ref{++last_}.text() + "=" + entity + ";");
    return {last_};
  }
  Ref add(std::string_view type, std::initializer_list<std::string> parameters) {
    return add(std::string(type) + list(parameters));
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  int last_ = 0;
};

template <typename Vector>
Ref point(StepText& step, const Vector& p) {
  std::vector<std::string> numbers;
  for (int axis = 0; axis < p.size(); ++axis) numbers.push_back(step_real(p[axis]));
  return step.add("CARTESIAN_POINT", {"''", list(numbers)});
}

std::string multiplicities(const KnotList& knots) {
  return list_of(knots.multiplicity, [](int m) { return std::to_string(m); });
}
std::string values(const KnotList& knots) { return list_of(knots.value, step_real); }

template <typename Curve>
Ref curve(StepText& step, const Curve& c) {
  std::vector<Ref> control;
  for (const auto& p : c.control) control.push_back(point(step, p));
  const KnotList knots = knot_list(c.knots);
  const bool closed = c.control.front() == c.control.back();
  return step.add("B_SPLINE_CURVE_WITH_KNOTS",
                  {"''", std::to_string(cubic), refs(control), ".UNSPECIFIED.", closed ? ".T." : ".F.", ".F.",
                   multiplicities(knots), values(knots), ".UNSPECIFIED."});
}

Ref net(StepText& step, const BSplineSurface& s) {
  std::vector<std::string> rows;
  for (int i = 0; i < s.control_u(); ++i) {
    std::vector<Ref> row;
    for (int j = 0; j < s.control_v(); ++j)
      row.push_back(point(step, Eigen::Vector3d(s.x(i, j), s.y(i, j), s.z(i, j))));
    rows.push_back(refs(row));
  }
  const KnotList u = knot_list(s.knots_u), v = knot_list(s.knots_v);
  return step.add(
      "B_SPLINE_SURFACE_WITH_KNOTS",
      {"''", std::to_string(cubic), std::to_string(cubic), list(rows), ".UNSPECIFIED.", ".F.", ".F.", ".F.",
       multiplicities(u), multiplicities(v), values(u), values(v), ".UNSPECIFIED."});
}

// One loop: a corner where each edge begins, the edges, and the bound.
Ref bound(StepText& step, const FaceLoop& loop, Ref surface, Ref plane_of_parameters, bool outer) {
  std::vector<Ref> corners;
  for (const FaceEdge& edge : loop.edges) {
    const auto& control = edge.image.control;
    corners.push_back(step.add("VERTEX_POINT",
                               {"''", point(step, edge.reversed ? control.back() : control.front()).text()}));
  }
  std::vector<Ref> oriented;
  for (std::size_t i = 0; i < loop.edges.size(); ++i) {
    const FaceEdge& edge = loop.edges[i];
    Ref geometry = curve(step, edge.image);
    if (!loop.natural) {
      const Ref path = curve(step, edge.path);
      const Ref in_parameters =
          step.add("DEFINITIONAL_REPRESENTATION", {"''", refs({path}), plane_of_parameters.text()});
      const Ref on_surface = step.add("PCURVE", {"''", surface.text(), in_parameters.text()});
      geometry = step.add("SURFACE_CURVE", {"''", geometry.text(), refs({on_surface}), ".PCURVE_S1."});
    }
    const Ref from = corners[i], to = corners[(i + 1) % corners.size()];
    const Ref& start = edge.reversed ? to : from;
    const Ref& end = edge.reversed ? from : to;
    const Ref whole = step.add("EDGE_CURVE", {"''", start.text(), end.text(), geometry.text(), ".T."});
    oriented.push_back(
        step.add("ORIENTED_EDGE", {"''", "*", "*", whole.text(), edge.reversed ? ".F." : ".T."}));
  }
  const Ref around = step.add("EDGE_LOOP", {"''", refs(oriented)});
  return step.add(outer ? "FACE_OUTER_BOUND" : "FACE_BOUND", {"''", around.text(), ".T."});
}

// The product that the shape is of, as every system expects it; returns what the shape's
// representation refers to.
Ref product(StepText& step, const CadLabel& label) {
  const Ref application = step.add("APPLICATION_CONTEXT", {"'managed model based 3d engineering'"});
  step.add(
      "APPLICATION_PROTOCOL_DEFINITION",
      {"'international standard'", "'ap242_managed_model_based_3d_engineering'", "2014", application.text()});
  const Ref context = step.add("PRODUCT_CONTEXT", {"''", application.text(), "'mechanical'"});
  const std::string name = step_string(label.name);
  const Ref plate = step.add("PRODUCT", {name, name, step_string(label.description), refs({context})});
  step.add("PRODUCT_RELATED_PRODUCT_CATEGORY", {"'part'", "$", refs({plate})});
  const Ref version = step.add("PRODUCT_DEFINITION_FORMATION", {"''", "''", plate.text()});
  const Ref stage =
      step.add("PRODUCT_DEFINITION_CONTEXT", {"'part definition'", application.text(), "'design'"});
  const Ref definition = step.add("PRODUCT_DEFINITION", {"'design'", "''", version.text(), stage.text()});
  return step.add("PRODUCT_DEFINITION_SHAPE", {"''", "''", definition.text()});
}

Ref space(StepText& step, double uncertainty_mm) {
  const Ref mm = step.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
  const Ref rad = step.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
  const Ref sr = step.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
  const Ref uncertainty =
      step.add("UNCERTAINTY_MEASURE_WITH_UNIT",
               {"LENGTH_MEASURE(" + step_real(uncertainty_mm) + ")", mm.text(), "'distance_accuracy_value'",
                "'how far edges, corners and surface lie apart at most'"});
  return step.add("(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(" +
                  refs({uncertainty}) + ")GLOBAL_UNIT_ASSIGNED_CONTEXT(" + refs({mm, rad, sr}) +
                  ")REPRESENTATION_CONTEXT('','3D'))");
}

Ref world_axes(StepText& step) {
  const Ref origin = point(step, Eigen::Vector3d(0, 0, 0));
  const Ref z = step.add("DIRECTION", {"''", "(0.,0.,1.)"}), x = step.add("DIRECTION", {"''", "(1.,0.,0.)"});
  return step.add("AXIS2_PLACEMENT_3D", {"''", origin.text(), z.text(), x.text()});
}

std::string two_digits(int n) {
  return {static_cast<char>('0' + n / 10 % 10), static_cast<char>('0' + n % 10)};
}

std::string iso_time(const CadStamp& s) {
  return two_digits(s.year / 100) + two_digits(s.year) + "-" + two_digits(s.month) + "-" + two_digits(s.day) +
         "T" + two_digits(s.hour) + ":" + two_digits(s.minute) + ":" + two_digits(s.second) + "Z";
}

std::string header(const CadLabel& label) {
  std::string text = "ISO-10303-21;\nHEADER;\n";
  std::string about = step_string(label.description);
  for (const std::string& note : label.notes) {
    about += ',';
    about += step_string(note);
  }
  append_wrapped(text, "FILE_DESCRIPTION((" + about + "),'2;1');");
  append_wrapped(text, "FILE_NAME(" + step_string(label.file_name) + ",'" + iso_time(label.stamp) + "',(" +
                           step_string(label.author) + "),(" + step_string(label.organization) + ")," +
                           step_string(label.system) + "," + step_string(label.system) + ",'');");
  return text +
         "FILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 "
         "}'));\nENDSEC;\n";
}

}  // namespace

std::expected<std::string, Error> step_text(const TrimmedSurface& face, const CadLabel& label) {
  const auto loops = face_edges(face, label.closure_mm);
  if (!loops) return std::unexpected(loops.error());
  StepText step;
  const std::string name = step_string(label.name);
  const Ref shape_of_product = product(step, label);
  const Ref context = space(step, label.closure_mm);
  const Ref plane_of_parameters = step.add(
      "(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('','2D')"
      ")");
  const Ref axes = world_axes(step);
  const Ref surface = net(step, face.surface);
  std::vector<Ref> bounds;
  for (const FaceLoop& loop : *loops)
    bounds.push_back(bound(step, loop, surface, plane_of_parameters, bounds.empty()));
  const Ref whole = step.add("ADVANCED_FACE", {name, refs(bounds), surface.text(), ".T."});
  const Ref shell = step.add("OPEN_SHELL", {name, refs({whole})});
  const Ref model = step.add("SHELL_BASED_SURFACE_MODEL", {name, refs({shell})});
  const Ref shape =
      step.add("MANIFOLD_SURFACE_SHAPE_REPRESENTATION", {name, refs({axes, model}), context.text()});
  step.add("SHAPE_DEFINITION_REPRESENTATION", {shape_of_product.text(), shape.text()});
  return header(label) + "DATA;\n" + step.text() + "ENDSEC;\nEND-ISO-10303-21;\n";
}

}  // namespace moldloft::geometry
