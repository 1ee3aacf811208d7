// A measured plate against its design, with the difference known: half turns, mirrors, units, templates, limits.
#include "firmware_like/inspection/inspection.hpp"

#include "firmware_like/inspection/design_reader.hpp"
#include "firmware_like/inspection/frame_page.hpp"
#include "firmware_like/inspection/inspection_files.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <functional>

using namespace moldloft;
using namespace moldloft::firmware_like;
using Eigen::Vector3d;

namespace {

using Height = std::function<double(double, double)>;

// A surface near the formula, and exactly known as what it is.
geometry::BSplineSurface surface_of(const Height& height, double width, double depth,
                                    const geometry::RigidMotion& placed = geometry::RigidMotion::Identity()) {
  constexpr int count = 16;
  geometry::BSplineSurface s;
  const auto knot = [](int i) { return std::clamp((i - 3) / static_cast<double>(count - 3), 0.0, 1.0); };
  for (auto* knots : {&s.knots_u, &s.knots_v}) {
    for (int i = 0; i < count + 4; ++i) knots->push_back(knot(i));
  }
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(count, count);
  const auto greville = [&](int i) { return (knot(i + 1) + knot(i + 2) + knot(i + 3)) / 3; };
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k) {
      const double x = (greville(i) - 0.5) * width, y = (greville(k) - 0.5) * depth;
      const Vector3d p = placed * Vector3d{x, y, height(x, y)};
      s.x(i, k) = p.x(), s.y(i, k) = p.y(), s.z(i, k) = p.z();
    }
  }
  return s;
}

geometry::RigidMotion somewhere() {
  geometry::RigidMotion m = geometry::turned_about_z(0.6, {700, -120, 35});
  return m;
}

RunResult run_of(geometry::BSplineSurface surface) {
  RunResult result;
  result.outcome = Outcome::complete;
  result.label.plate = "made";
  result.measured.emplace();
  result.measured->surface = std::move(surface);
  result.measured->outline.rms_mm = 0.03;
  result.measured->fit.spans_u = result.measured->fit.spans_v = 13;
  return result;
}

Design design_of(geometry::BSplineSurface surface) {
  Design design;
  design.file = "design.json";
  design.faces.push_back({std::move(surface), {}});
  return design;
}

InspectionSettings within(double mm) {
  InspectionSettings settings;
  settings.limit = {-mm, mm};
  return settings;
}

double hull(double x, double y) { return x * x / 9000 + y * y / 2500 + x * y / 8000 + 6 * std::sin(x / 90); }

std::string said(const std::expected<Inspection, Failure>& found) { return found ? "" : found.error().what; }

}  // namespace

TEST_CASE("a plate that is its design differs nowhere, however it lies") {
  const auto found = inspect(run_of(surface_of(hull, 400, 300, somewhere())), {},
                             design_of(surface_of(hull, 400, 300)), within(1));
  REQUIRE_MESSAGE(found.has_value(), found.error().what);
  CHECK(found->verdict == Judgement::passes);
  CHECK_FALSE(found->is_close);
  CHECK(found->inside.rms_mm < 1e-3);
  CHECK(std::abs(found->twist_mm) < 1e-3);
  CHECK(found->edges.size() == 6);
  for (const auto& e : found->edges) CHECK(std::abs(e.measured_mm - e.designed_mm) < 1e-3);
  CHECK(found->undetermined.empty());
  CHECK(found->frame_lines.size() == 7);
}

TEST_CASE(
    "a dent is where it is and as deep, the plate fails its limit, and a region of its own forgives it") {
  const auto dented = [](double x, double y) {
    const double left = 1 - (std::pow(x - 80, 2) + std::pow(y - 40, 2)) / 3600;
    return hull(x, y) - (left > 0 ? 4 * left * left * left : 0);
  };
  const auto run = run_of(surface_of(dented, 400, 300, somewhere()));
  const auto design = design_of(surface_of(hull, 400, 300));
  auto settings = within(1);
  settings.method = AlignmentMethod::robust;
  const auto found = inspect(run, {}, design, settings);
  REQUIRE_MESSAGE(found.has_value(), found.error().what);
  CHECK(found->verdict == Judgement::fails);
  // The net smooths the dent; the difference of the two nets is the truth.
  const auto plain = surface_of(hull, 400, 300), deep = surface_of(dented, 400, 300);
  double deepest = 0;
  for (int i = 0; i <= 100; ++i) {
    for (int k = 0; k <= 100; ++k) {
      const auto a = plain.at(i / 100.0, k / 100.0), b = deep.at(i / 100.0, k / 100.0);
      deepest = std::min(deepest, (b.value - a.value).dot(a.normal()));
    }
  }
  CHECK(found->worst[0].mm == doctest::Approx(deepest).epsilon(0.02));
  CHECK((found->worst[0].at.head<2>() - Eigen::Vector2d{80, 40}).norm() < 12);
  settings.regions.push_back({"weld", {20, -20}, {140, 100}, {-5, 1}});
  CHECK(inspect(run, {}, design, settings)->verdict == Judgement::passes);
}

TEST_CASE("a plate that stands too high is above its design whichever way the design's normals point") {
  const auto higher = [](double x, double y) {
    return hull(x, y) + 3 * std::cos(x / 130) * std::cos(y / 100) - 1.2;
  };
  const auto run = run_of(surface_of(higher, 400, 300, somewhere()));
  const auto up = surface_of(hull, 400, 300);
  auto down = up;  // u and v exchanged: the normal points the other way
  down.knots_u.swap(down.knots_v);
  for (auto* net : {&down.x, &down.y, &down.z}) *net = Eigen::MatrixXd{net->transpose()};
  const auto a = inspect(run, {}, design_of(up), {}), b = inspect(run, {}, design_of(down), {});
  REQUIRE(a);
  REQUIRE_MESSAGE(b.has_value(), b.error().what);
  CHECK(a->inside.most_mm > 1);
  CHECK(b->inside.most_mm == doctest::Approx(a->inside.most_mm).epsilon(0.01));
}

TEST_CASE("what is another plate, mirrored, in another unit or elsewhere is refused in one line") {
  const auto run = run_of(surface_of(hull, 400, 300, somewhere()));
  const auto scaled = [](double factor) {
    auto s = surface_of(hull, 400, 300);
    s.x *= factor, s.y *= factor, s.z *= factor;
    return s;
  };
  auto mirrored = surface_of(hull, 400, 300);
  mirrored.x *= -1;
  const auto bowl = [](double x, double y) { return 9 * std::cos(x / 45) * std::sin(y / 50); };
  auto none = within(1);
  none.method = AlignmentMethod::none;
  const struct {
    Design design;
    InspectionSettings settings;
    const char* says;
  } wrong[] = {{design_of(scaled(1 / 25.4)), {}, "the design is in inches"},
               {design_of(scaled(0.001)), {}, "the design is in metres"},
               {design_of(surface_of(hull, 340, 300)), {}, "another plate's design?"},
               {design_of(mirrored), {}, "mirrored"},
               {design_of(surface_of(bowl, 400, 300)), {}, "another plate's design?"},
               {design_of(surface_of(hull, 400, 300)), none, "do not lie on each other"}};
  for (const auto& w : wrong) {
    CAPTURE(std::string{w.says});
    const auto found = inspect(run, {}, w.design, w.settings);
    CAPTURE(found ? fmt::format("{:.2f} rms", found->inside.rms_mm) : std::string{});
    REQUIRE_FALSE(found);
    CHECK(said(found).find(w.says) != std::string::npos);
    CHECK(said(found).find('\n') == std::string::npos);
  }
  auto insists = InspectionSettings{};
  insists.insists = true;
  CHECK(inspect(run, {}, design_of(surface_of(bowl, 400, 300)), insists));
}

TEST_CASE("a turn that nothing tells apart is said") {
  const auto tent = [](double x, double y) { return (x * x + y * y) / 5000; };
  const auto found =
      inspect(run_of(surface_of(tent, 300, 300)), {}, design_of(surface_of(tent, 300, 300)), {});
  REQUIRE(found);
  REQUIRE_FALSE(found->remarks.empty());
  CHECK(found->remarks[0].find("4 ways of turning it fit equally well") != std::string::npos);
  // And of those the one that leaves the plate as it lies.
  CHECK(found->design_from_world.isApprox(geometry::RigidMotion::Identity(), 1e-3));
}

TEST_CASE("one-sided: nowhere below, and it touches, corners and datum lie where they are told") {
  const auto bent = [](double x, double y) { return 1.04 * hull(x, y) + y / 400; };
  const auto run = run_of(surface_of(bent, 400, 300, somewhere()));
  const auto design = design_of(surface_of(hull, 400, 300));
  InspectionSettings settings;
  settings.method = AlignmentMethod::one_sided_above;
  const auto above = inspect(run, {}, design, settings);
  REQUIRE_MESSAGE(above.has_value(), above.error().what);
  CHECK(above->inside.least_mm > -0.02);
  CHECK(std::min(above->inside.least_mm, above->border.least_mm) < 0.05);
  settings.method = AlignmentMethod::corners;
  const auto corners = inspect(run, {}, design, settings);
  REQUIRE(corners);
  settings.method = AlignmentMethod::datum;
  const auto placed = somewhere();
  for (const auto& p : {Vector3d{0, 0, 0}, {100, 0, 0}, {0, 100, 5}})
    settings.datum.push_back({placed * p, p});
  const auto datum = inspect(run, {}, design, settings);
  REQUIRE(datum);
  CHECK(datum->design_from_world.isApprox(placed.inverse(), 1e-9));
  settings.datum.resize(2);
  CHECK(said(inspect(run, {}, design, settings)).find("three places") != std::string::npos);
}

TEST_CASE(
    "points in any unit lie on the plate, of another plate, too few to place, or mirrored they are refused") {
  const auto surface = surface_of(hull, 400, 300);
  const auto run = run_of(surface_of(hull, 400, 300, somewhere()));
  const auto points_of = [&](double factor, double part = 1, double mirror = 1) {
    Design design;
    design.kind = DesignKind::points;
    design.file = "points.xyz";
    for (int i = 1; i < 20; ++i) {
      for (int k = 1; k < 20; ++k) {
        Vector3d p = surface.at(i / 20.0 * part, k / 20.0 * part).value;
        p.x() *= mirror;
        design.points.push_back(p * factor);
      }
    }
    return design;
  };
  for (const double unit : {1.0, 1 / 25.4, 0.001}) {
    CAPTURE(unit);
    const auto found = inspect(run, {}, points_of(unit), {});
    REQUIRE_MESSAGE(found.has_value(), found.error().what);
    CHECK(found->inside.rms_mm < 0.01);
    CHECK(found->inside.count + found->border.count == 361);
  }
  auto said_mm = points_of(1 / 25.4);
  said_mm.mm_per_unit = 1.0;
  CHECK(said(inspect(run, {}, said_mm, {})).find("too small a part") != std::string::npos);
  CHECK(said(inspect(run, {}, points_of(1, 0.3), {})).find("--unit") != std::string::npos);
  CHECK(said(inspect(run, {}, points_of(1, 1, -1), {})).find("mirrored") != std::string::npos);
}

TEST_CASE("templates: gaps at every pin, bend, twist, and the list comes back as measured minus nominal") {
  const auto designed = [](double x, double y) { return x * x / 60000 + y * y / 9000 + x * y / 70000; };
  // Bent 10 % too little across, and one end 6 mm higher on one seam.
  const auto bent = [&](double x, double y) {
    return x * x / 60000 + 0.9 * y * y / 9000 + x * y / 70000 + 3 * (x / 1000) * (y / 500);
  };
  std::string text =
      "HEIGHTS FOR FLEXIBLE TEMPLATES PLATE= T DISTANCE BETWEEN COLUMNS= 100\nLIMITS= F1-200 -- F5+200\n"
      "FRAME;-5;-4;-3;-2;-1;0;1;2;3;4;5;LOWER;UPPER;SIGHT;ANGLE\n";
  std::string x_row = "X", z_row = "Z", y_row = "Y", names = "FRAME";
  for (int f = 0; f < 5; ++f) {
    const double x = -800 + 400 * f;
    text += fmt::format("F{}", f + 1);
    for (int pin = -5; pin <= 5; ++pin)
      text += fmt::format(";{:.3f}", designed(x, 100 * pin) - designed(x, 0));
    text += ";500;500;0;90\n";
    names += fmt::format(";F{}", f + 1), x_row += fmt::format(";{}", 20000 + x), y_row += ";5000",
        z_row += fmt::format(";{:.3f}", 300 + designed(x, 0));
  }
  text += "MIDDLE POINTS\n" + names + "\n" + x_row + ";\n";
  text.resize(text.size() - 2);
  text += "\n" + y_row + "\n" + z_row + "\n";
  const hal::TemporaryFolder folder;
  std::ofstream{folder.file("t.txt")} << text;
  const auto design = read_design(folder.file("t.txt"), "");
  REQUIRE_MESSAGE(design.has_value(), design.error().what);
  CHECK(design->kind == DesignKind::templates);
  const auto found = inspect(run_of(surface_of(bent, 2000, 1000, somewhere())), {}, *design, {});
  REQUIRE_MESSAGE(found.has_value(), found.error().what);
  REQUIRE(found->frame_lines.size() == 5);
  CHECK(found->undetermined.empty());  // the list says where seams and ends are
  CHECK(found->alignment.border_rms_mm > 0);
  for (const auto& f : found->frame_lines) {
    CHECK(f.measured >= 9);
    // 0.1 y^2 / 9000 at y = 500: a sagitta of 2.78 mm is missing.
    CHECK(f.bend_mm == doctest::Approx(2.78).epsilon(0.06));
    CHECK(words_for(f).words == "bend more");
  }
  // 3 (x/1000) (y/500) from x = -800 to 800 at y = 500.
  CHECK(found->twist_mm == doctest::Approx(4.8).epsilon(0.06));
  const auto back = read_templates(frames_text(*found, *design), "back");
  REQUIRE_MESSAGE(back.has_value(), back.error().what);
  CHECK(back->frames[2].pins[5].height_mm ==
        doctest::Approx(*found->frame_lines[2].pins[5].gap_mm()).epsilon(0.06));
  CHECK(frame_page(*found).find("bend more") != std::string::npos);
}

TEST_CASE("a face of lower degree is the surface that its control points say") {
  const hal::TemporaryFolder folder;
  // z = x y / 1000 over 400 x 300 mm: four corners at degree 1.
  std::ofstream{folder.file("d.json")}
      << R"({"format":"moldloft-design","version":1,"unit":"mm","faces":[{"degree_u":1,"degree_v":1,)"
      << R"("knots_u":[0,0,1,1],"knots_v":[0,0,1,1],"control":[[0,0,0],[0,300,0],[400,0,0],[400,300,120]]}]})";
  const auto design = read_design(folder.file("d.json"), "");
  REQUIRE_MESSAGE(design.has_value(), design.error().what);
  const auto at = design->faces[0].surface.at(0.25, 0.6).value;
  CHECK((at - Eigen::Vector3d{100, 180, 18}).norm() < 1e-9);
}

TEST_CASE("design.json and inspection.json say what they hold, odd files are refused") {
  const hal::TemporaryFolder folder;
  const auto surface = surface_of(hull, 400, 300);
  const geometry::DesignFace face{surface, {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}}};
  std::ofstream{folder.file("d.json")} << json_text(design_json({&face, 1}, "by hand"));
  const auto design = read_design(folder.file("d.json"), "");
  REQUIRE_MESSAGE(design.has_value(), design.error().what);
  CHECK(design->faces[0].surface.z == surface.z);
  CHECK(design->faces[0].trims.size() == 1);
  const auto found = inspect(run_of(surface), {}, *design, within(1));
  REQUIRE_MESSAGE(found.has_value(), found.error().what);
  const auto json = inspection_json(*found);
  CHECK(json["verdict"] == "passes");
  CHECK(json["frames"].size() == 7);
  CHECK(json["alignment"]["covariance"]["matrix"].size() == 6);
  CHECK(deviations_csv(*found).starts_with("x_mm,y_mm,z_mm,deviation_mm,sigma_mm,class\n"));

  const std::pair<const char*, const char*> odd[] = {
      {"{}", "neither"},
      {"[1]", "neither"},
      {"{\"format\":\"moldloft-design\",\"version\":2}", "version 1"},
      {"{\"format\":\"moldloft-design\",\"version\":1,\"unit\":\"inch\"}", "in mm"},
      {"{\"format\":\"moldloft-design\",\"version\":1,\"unit\":\"mm\",\"faces\":[]}", "no face"},
      {"{\"format\":\"moldloft-design\",\"version\":1,\"unit\":\"mm\",\"faces\":[{\"degree_u\":5,\"degree_"
       "v\":3,\"knots_u\":[0],\"knots_v\":[0]}]}",
       "face 1: is of a degree beyond 3"},
      {"{\"format\":\"moldloft-design\",\"version\":1,\"unit\":\"mm\",\"faces\":[{\"degree_u\":3,\"degree_"
       "v\":3,\"knots_u\":[0],\"knots_v\":[0],\"control\":[]}]}",
       "do not fit"},
      {"no json", ""}};
  for (const auto& [text, says] : odd) {
    CAPTURE(text);
    std::ofstream{folder.file("odd.json")} << text;
    const auto refused = read_design(folder.file("odd.json"), "");
    REQUIRE_FALSE(refused);
    CHECK(refused.error().what.find(says) != std::string::npos);
  }
  // A net whose points are no points is told by the point's number.
  auto broken = design_json({&face, 1}, "by hand");
  broken["faces"][0]["control"][4] = {1, 2};
  std::ofstream{folder.file("odd.json")} << json_text(broken);
  CHECK(read_design(folder.file("odd.json"), "")
            .error()
            .what.find("face 1: control point 5 is not three numbers") != std::string::npos);
  // Equal weights change nothing, others do.
  auto weighted = design_json({&face, 1}, "by hand");
  weighted["faces"][0]["weights"] = Json(std::vector<double>(surface.x.size(), 2.0));
  std::ofstream{folder.file("odd.json")} << json_text(weighted);
  CHECK(read_design(folder.file("odd.json"), ""));
  weighted["faces"][0]["weights"][1] = 3.0;
  std::ofstream{folder.file("odd.json")} << json_text(weighted);
  CHECK(read_design(folder.file("odd.json"), "").error().what.find("rational") != std::string::npos);
  CHECK_FALSE(read_design(folder.file("nothing"), ""));
  CHECK(read_design(folder.file("d.json"), "furlong").error().what.find("--unit") != std::string::npos);
}
