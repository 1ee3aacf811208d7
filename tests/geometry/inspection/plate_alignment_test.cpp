// Whole plates laid on their designs: surface and outline, any start, half turns, mirrors and dents.
#include "geometry/inspection/plate_alignment.hpp"

#include "geometry/inspection/alignment_starts.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

using namespace moldloft::geometry;
using Eigen::Vector3d;

namespace {

using Height = std::function<double(double, double)>;

// A bicubic net over a rectangle whose heights are the formula's at the Greville places: a surface near the formula,
// and exactly known as what it is.
BSplineSurface surface_of(const Height& height, double width, double depth, double skew = 0) {
  constexpr int count = 12;
  BSplineSurface s;
  for (auto* knots : {&s.knots_u, &s.knots_v}) {
    for (int i = 0; i < count + 4; ++i)
      knots->push_back(std::clamp((i - 3) / static_cast<double>(count - 3), 0.0, 1.0));
  }
  for (auto* net : {&s.x, &s.y, &s.z}) net->resize(count, count);
  const auto greville = [&](int i) {
    const auto at = [&](int k) { return std::clamp((k - 3) / static_cast<double>(count - 3), 0.0, 1.0); };
    return (at(i + 1) + at(i + 2) + at(i + 3)) / 3;
  };
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k) {
      const double y = (greville(k) - 0.5) * depth, x = (greville(i) - 0.5) * width + skew * y;
      s.x(i, k) = x, s.y(i, k) = y, s.z(i, k) = height(x, y);
    }
  }
  return s;
}

struct Samples {
  std::vector<Vector3d> points, edges;
};

Samples samples_of(const BSplineSurface& s, const RigidMotion& motion, int count = 40) {
  Samples all;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k)
      all.points.push_back(motion * s.at((i + 0.5) / count, (k + 0.5) / count).value);
    const double t = (i + 0.5) / count;
    for (const auto& [u, v] : {std::pair{t, 0.0}, {1.0, t}, {t, 1.0}, {0.0, t}})
      all.edges.push_back(motion * s.at(u, v).value);
  }
  return all;
}

RigidMotion somewhere(double turn) {
  RigidMotion m = RigidMotion::Identity();
  m.linear() = (Eigen::AngleAxisd{turn, Vector3d::UnitZ()} * Eigen::AngleAxisd{0.05, Vector3d{0.6, 0.8, 0}})
                   .toRotationMatrix();
  m.translation() = Vector3d{812, -433, 97};
  return m;
}

double farthest(const RigidMotion& a, const RigidMotion& b, const std::vector<Vector3d>& points) {
  double most = 0;
  for (const auto& p : points) most = std::max(most, (a * p - b * p).norm());
  return most;
}

double wavy(double x, double y) { return 8 * std::sin(x / 70) * std::cos(y / 90) + 0.03 * x; }

// From every start, the best end.
PlateAlignment best_of(const DesignFaces& design, const Samples& plate, const Vector3d& up,
                       bool robust = false) {
  PlateAlignment best;
  double least = 1e30;
  for (const auto& start : alignment_starts(design, plate.edges, up)) {
    const auto end =
        align(design,
              {.points = plate.points, .edges = plate.edges, .point_groups = {}, .edge_groups = {}, .up = up},
              {.start = start.design_from_plate, .robust = robust});
    if (!end) continue;
    const double score = std::hypot(end->rms_mm, end->border_rms_mm);
    if (score < least) least = score, best = *end;
  }
  REQUIRE(least < 1e30);
  return best;
}

}  // namespace

TEST_CASE("a plate that was turned anyhow lies on its design again, to a micrometre") {
  const auto surface = surface_of(wavy, 305, 260, 0.1);
  const DesignFace face{surface};
  const auto design = DesignFaces::from({&face, 1});
  REQUIRE(design);
  for (const double turn : {0.0, 0.4, 1.7, 3.1, -2.2}) {
    CAPTURE(turn);
    const auto motion = somewhere(turn);
    const auto plate = samples_of(surface, motion.inverse());
    const auto found = best_of(*design, plate, motion.inverse().linear() * design->up());
    CHECK(found.rms_mm < 1e-6);
    CHECK(farthest(found.design_from_plate, motion, plate.points) < 1e-3);
    CHECK(found.undetermined.empty());
  }
}

TEST_CASE("a flat sheet does not slide in its own plane: the outline holds it") {
  const auto flat = surface_of([](double, double) { return 0.0; }, 300, 200, 0.2);
  const DesignFace face{flat};
  const auto design = DesignFaces::from({&face, 1});
  REQUIRE(design);
  const auto motion = somewhere(0.1);
  const auto plate = samples_of(flat, motion.inverse());
  auto start = motion;
  start.translation() += Vector3d{4, -3, 2};
  const auto found =
      align(*design, {.points = plate.points, .edges = plate.edges, .point_groups = {}, .edge_groups = {}},
            {.start = start});
  REQUIRE(found);
  CHECK(farthest(found->design_from_plate, motion, plate.points) < 1e-3);
  CHECK(found->undetermined.empty());

  start = motion;
  start.translation() += Vector3d{0.7, 0, 0};
  const auto slides =
      align(*design, {.points = plate.points, .edges = {}, .point_groups = {}, .edge_groups = {}},
            {.start = start});
  REQUIRE(slides);
  CHECK(slides->undetermined.size() == 3);
  CHECK(farthest(slides->design_from_plate, start, plate.points) < 1e-6);
}

TEST_CASE(
    "robust: a third of the plate that stands 5 mm too high bends the pose by less than a hundredth of it") {
  const auto surface = surface_of(wavy, 305, 260, 0.1);
  const DesignFace face{surface};
  const auto design = DesignFaces::from({&face, 1});
  REQUIRE(design);
  const auto motion = somewhere(-0.9);
  auto plate = samples_of(surface, RigidMotion::Identity());
  std::mt19937 draw{5};
  std::normal_distribution<double> noise{0, 0.03};
  for (auto& p : plate.points) p.z() += noise(draw) + (p.x() > 55 ? 5.0 : 0.0);
  for (auto* kind : {&plate.points, &plate.edges}) {
    for (auto& p : *kind) p = motion.inverse() * p;
  }
  const Vector3d up = motion.inverse().linear() * design->up();
  CHECK(farthest(best_of(*design, plate, up).design_from_plate, motion, plate.points) > 1);
  const auto robust = best_of(*design, plate, up, true);
  CHECK(farthest(robust.design_from_plate, motion, plate.points) < 0.05);
  CHECK(robust.outliers > plate.points.size() / 4);
}

TEST_CASE("the stated covariance holds: 400 noisy plates, their poses within it as a chi-square of six") {
  const auto surface = surface_of(wavy, 305, 260, 0.1);
  const DesignFace face{surface};
  const auto design = DesignFaces::from({&face, 1});
  REQUIRE(design);
  const auto exact = samples_of(surface, RigidMotion::Identity(), 16);
  std::vector<std::uint16_t> groups;
  for (const auto& p : exact.points)
    groups.push_back(static_cast<std::uint16_t>(static_cast<int>((p.x() + 200) / 80) +
                                                8 * static_cast<int>((p.y() + 200) / 80)));
  std::mt19937 draw{11};
  std::normal_distribution<double> unit{0, 1};
  int within = 0;
  constexpr int plates = 400;
  for (int n = 0; n < plates; ++n) {
    auto plate = exact;
    std::vector<double> shots(128);
    for (auto& s : shots) s = 0.02 * unit(draw);
    for (std::size_t i = 0; i < plate.points.size(); ++i)
      plate.points[i].z() += shots[groups[i]] + 0.05 * unit(draw);
    for (auto& p : plate.edges) p += 0.1 * unit(draw) * Vector3d{std::cos(n), std::sin(n), 0};
    const auto found = align(
        *design, {.points = plate.points, .edges = plate.edges, .point_groups = groups, .edge_groups = {}},
        {.point_sigma_mm = 0.05, .group_sigma_mm = 0.02, .edge_sigma_mm = 0.1 / std::numbers::sqrt2});
    REQUIRE(found);
    Vector6 off;  // of the true pose, the identity
    const Eigen::AngleAxisd turn{found->design_from_plate.linear()};
    off << found->design_from_plate * Vector3d{found->design_from_plate.inverse() * found->centroid} -
               found->design_from_plate.inverse() * found->centroid,
        turn.angle() * turn.axis();
    within += off.dot(found->covariance.ldlt().solve(off)) < 12.59 ? 1 : 0;  // 95 % of chi-square with 6
  }
  CHECK(within >= plates * 91 / 100);
  CHECK(within <= plates * 99 / 100);
}

TEST_CASE("a mirrored plate does not lie on its design, whichever way it is turned") {
  const auto surface = surface_of([](double x, double y) { return x * y / 1000 + 0.0004 * x * x; }, 300, 300);
  const DesignFace face{surface};
  const auto design = DesignFaces::from({&face, 1});
  REQUIRE(design);
  auto plate = samples_of(surface, RigidMotion::Identity());
  for (auto* kind : {&plate.points, &plate.edges}) {
    for (auto& p : *kind) p.x() = -p.x();
  }
  double least = 1e30;
  for (const auto& start : alignment_starts(*design, plate.edges, Vector3d::UnitZ())) {
    if (start.upside_down) continue;
    const auto end =
        align(*design, {.points = plate.points, .edges = plate.edges, .point_groups = {}, .edge_groups = {}},
              {.start = start.design_from_plate});
    if (end) least = std::min(least, std::hypot(end->rms_mm, end->border_rms_mm));
  }
  CHECK(least > 1);
}

TEST_CASE("two faces and a trimmed one are one plate: no border between them, none where it is cut away") {
  const auto whole = surface_of(wavy, 300, 200);
  const auto half = [&](double u0, double u1) {
    DesignFace face{whole};
    face.trims.push_back({{u0, 0}, {u1, 0}, {u1, 1}, {u0, 1}});
    return face;
  };
  const std::vector<DesignFace> faces{half(0, 0.5), half(0.5, 1)};
  const auto design = DesignFaces::from(faces);
  REQUIRE(design);
  for (const auto& s : design->border())
    CHECK(std::abs(s.at.x()) + std::abs(std::abs(s.at.y()) - 100) > 1e-3);
  const auto middle = whole.at(0.7, 0.4);
  const auto foot = design->foot(middle.value + 2 * middle.normal());
  CHECK(foot.face == 1);
  CHECK(foot.signed_mm == doctest::Approx(2).epsilon(1e-9));
  const auto alone = DesignFaces::from({faces.data(), 1});
  REQUIRE(alone);
  CHECK(alone->foot(middle.value).overhang_mm > 40);
  CHECK(alone->area_mm2() == doctest::Approx(design->area_mm2() / 2).epsilon(0.05));
}

TEST_CASE("what cannot be aligned says why") {
  const auto surface = surface_of(wavy, 300, 200);
  const DesignFace face{surface};
  const auto design = DesignFaces::from({&face, 1});
  REQUIRE(design);
  auto plate = samples_of(surface, RigidMotion::Identity(), 4);
  CHECK(
      align(*design,
            {.points = std::span{plate.points}.first(5), .edges = {}, .point_groups = {}, .edge_groups = {}})
          .error()
          .error == Error::too_few_points);
  plate.points[3].y() = NAN;
  const auto lost =
      align(*design, {.points = plate.points, .edges = {}, .point_groups = {}, .edge_groups = {}});
  REQUIRE_FALSE(lost);
  CHECK(lost.error() == Flaw{Error::not_finite, 3});
  CHECK_FALSE(DesignFaces::from({}));
  DesignFace outside{surface, {{{0, 0}, {1.5, 0}, {1, 1}}}};
  CHECK(DesignFaces::from({&outside, 1}).error() == Flaw{Error::outside_domain, 0});
  DesignFace bow_tie{surface, {{{0, 0}, {1, 1}, {1, 0}, {0, 1}}}};
  CHECK(DesignFaces::from({&bow_tie, 1}).error() == Flaw{Error::self_crossing, 0});
  // Corners in one place are no crossing: that is how trims of several curves come.
  DesignFace repeated{surface, {{{0, 0}, {1, 0}, {1, 1e-12}, {1, 1}, {1, 1}, {0, 1}, {0, 0}}}};
  CHECK(DesignFaces::from({&repeated, 1}));
  const std::vector<DesignFace> twice{face, face};
  CHECK(DesignFaces::from(twice).error().error == Error::no_border);
  DesignFace beyond{surface};
  beyond.surface.x.array() += 1e200;
  CHECK(DesignFaces::from({&beyond, 1}).error() == Flaw{Error::too_large, 0});
  const std::vector<Vector3d> line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  CHECK(motion_between(line, line).error() == Error::collinear);
}
