#include "geometry/inspection/curvature.hpp"

#include "geometry/polynomial_surface.hpp"
#include "geometry/rigid_motion.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

using namespace moldloft;
using Eigen::Vector2d, Eigen::Vector3d;
using geometry::Curvature, geometry::CurvatureSample, geometry::Error, geometry::FundamentalForms,
    geometry::SurfacePoint, geometry::curvature_at, geometry::curvature_map, geometry::fundamental_forms;
using test::height_surface, test::polynomial_surface;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

// z(x, y) with its derivatives, as a point of the graph.
SurfacePoint graph(double zx, double zy, double zxx, double zxy, double zyy) {
  return {{0, 0, 0}, {1, 0, zx}, {0, 1, zy}, {0, 0, zxx}, {0, 0, zxy}, {0, 0, zyy}};
}

// The header's bound on the error of k1, k2 and H.
double bound(const SurfacePoint& p) {
  const double e = p.du.squaredNorm(), g = p.dv.squaredNorm(), area = p.du.cross(p.dv).norm();
  const double bend =
      (p.duu.norm() * g + 2 * p.duv.norm() * std::sqrt(e * g) + p.dvv.norm() * e) / (area * area);
  return 32 * eps * std::sqrt(e * g) / area * bend;
}

// K and H by eq. 2.24 and k1, k2 by eq. 2.25, in long double.
struct Exact {
  long double gaussian, mean, k1, k2;
};
Exact exact(const SurfacePoint& p) {
  using Long = Eigen::Matrix<long double, 3, 1>;
  const Long u = p.du.cast<long double>(), v = p.dv.cast<long double>();
  const Long normal = u.cross(v).normalized();
  const long double e = u.dot(u), f = u.dot(v), g = v.dot(v), area = e * g - f * f;
  const long double l = p.duu.cast<long double>().dot(normal), m = p.duv.cast<long double>().dot(normal),
                    n = p.dvv.cast<long double>().dot(normal);
  const long double gaussian = (l * n - m * m) / area, mean = (e * n + g * l - 2 * f * m) / (2 * area);
  const long double root = std::sqrt(std::max(0.0L, mean * mean - gaussian));
  return {gaussian, mean, mean + root, mean - root};
}

SurfacePoint random_point(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  return {vector(), 300 * vector(), 200 * vector(), 900 * vector(), 500 * vector(), 700 * vector()};
}

}  // namespace

TEST_CASE("curvatures agree with the textbook formulas in long double within the stated bound") {
  std::mt19937 random(11);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    SurfacePoint p = random_point(random);
    if (i % 3 == 0) p.dv = 0.7 * p.du + 1e-3 * p.dv;  // parameter lines at a milliradian
    const auto c = curvature_at(p);
    REQUIRE(c.has_value());
    const Exact truth = exact(p);
    const double allowed = bound(p);
    const auto off = [&](double ours, long double theirs) {
      return std::abs(static_cast<double>(ours - theirs));
    };
    CHECK(off(c->k1, truth.k1) <= allowed);
    CHECK(off(c->k2, truth.k2) <= allowed);
    CHECK(off(c->mean, truth.mean) <= allowed);
    CHECK(off(c->gaussian, truth.gaussian) <= allowed * (c->absolute() + allowed));
    worst = std::max(worst, off(c->k1, truth.k1) / allowed);
  }
  MESSAGE("at most " << worst << " of the bound");
}

TEST_CASE("a paraboloid curves as its closed form says, and by the stated sign: a bowl is positive") {
  const double a = 0.02, b = 0.005;
  const auto bowl =
      height_surface([&](double x, double y) { return 0.5 * (a * x * x + b * y * y); }, -40, 60, 5);
  for (double u = 0; u <= 1; u += 0.125) {
    for (double v = 0; v <= 1; v += 0.125) {
      const SurfacePoint p = bowl.at(u, v);
      const double x = p.value.x(), y = p.value.y(), w = 1 + a * a * x * x + b * b * y * y;
      const double gaussian = a * b / (w * w);
      const double mean = 0.5 * (a * (1 + b * b * y * y) + b * (1 + a * a * x * x)) / std::pow(w, 1.5);
      const auto c = curvature_at(p);
      REQUIRE(c.has_value());
      CHECK(c->gaussian == doctest::Approx(gaussian).epsilon(1e-11));
      CHECK(c->mean == doctest::Approx(mean).epsilon(1e-12));
      CHECK(c->k1 >= c->k2);
      CHECK(c->k2 > 0);
    }
  }
  const auto vertex = curvature_at(bowl.at(0.4, 0.4));  // x = y = 0
  REQUIRE(vertex.has_value());
  CHECK(vertex->k1 == doctest::Approx(a).epsilon(1e-12));
  CHECK(vertex->k2 == doctest::Approx(b).epsilon(1e-12));
  CHECK(std::abs(vertex->tangent_1.x()) == doctest::Approx(1));
  CHECK(vertex->absolute() == doctest::Approx(a + b).epsilon(1e-12));

  const auto dome = curvature_at(graph(0, 0, -a, 0, -b));
  CHECK(dome->k1 == doctest::Approx(-b).epsilon(1e-15));
  CHECK(dome->k2 == doctest::Approx(-a).epsilon(1e-15));
  CHECK(dome->absolute() == doctest::Approx(a + b).epsilon(1e-15));
}

TEST_CASE("a saddle has negative Gaussian curvature and its asymptotic lines do not bend") {
  const auto saddle = height_surface([](double x, double y) { return 0.01 * x * y; }, -30, 30);
  const SurfacePoint p = saddle.at(0.5, 0.5);
  const auto c = curvature_at(p);
  REQUIRE(c.has_value());
  CHECK(c->gaussian == doctest::Approx(-1e-4).epsilon(1e-12));
  CHECK(c->k1 == doctest::Approx(0.01).epsilon(1e-12));
  CHECK(c->k2 == doctest::Approx(-0.01).epsilon(1e-12));
  CHECK(std::abs(c->tangent_1.normalized().dot(Vector3d(1, 1, 0).normalized())) == doctest::Approx(1));
  CHECK_FALSE(c->umbilic);
  const auto forms = fundamental_forms(p);
  CHECK(std::abs(forms->normal_curvature(1, 0)) < 1e-16);
  CHECK(std::abs(forms->normal_curvature(0, 1)) < 1e-16);
}

TEST_CASE("the monkey saddle's Gaussian curvature is its closed form, and its middle a flat umbilic") {
  const auto monkey = height_surface([](double x, double y) { return x * x * x - 3 * x * y * y; }, -1, 1, 3);
  for (double u = 0; u <= 1; u += 0.1) {
    for (double v = 0; v <= 1; v += 0.1) {
      const SurfacePoint p = monkey.at(u, v);
      const double r2 = p.value.head<2>().squaredNorm(), w = 1 + 9 * r2 * r2;
      CHECK(curvature_at(p)->gaussian == doctest::Approx(-36 * r2 / (w * w)).epsilon(1e-11));
    }
  }
  const auto middle = curvature_at(monkey.at(0.5, 0.5), 1e-12);
  REQUIRE(middle.has_value());
  CHECK(middle->umbilic);
  CHECK(middle->absolute() < 1e-12);
}

TEST_CASE("a parabolic sheet bends in one direction only, whatever the direction of its rulings") {
  const double a = 0.01;
  for (const double turn : {0.0, 0.3, 1.1}) {
    const Vector2d along(std::cos(turn), std::sin(turn));
    const auto sheet = height_surface(
        [&](double x, double y) { return 0.5 * a * std::pow(along.dot(Vector2d(x, y)), 2); }, -50, 50, 4);
    for (const auto& [u, v] : {std::pair{0.5, 0.5}, {0.1, 0.8}, {0.9, 0.35}}) {
      const SurfacePoint p = sheet.at(u, v);
      const double s = along.dot(p.value.head<2>());
      const auto c = curvature_at(p);
      REQUIRE(c.has_value());
      CHECK(c->k1 == doctest::Approx(a * std::pow(1 + a * a * s * s, -1.5)).epsilon(1e-11));
      CHECK(std::abs(c->k2) <= bound(p));
      CHECK(std::abs(c->gaussian) <= bound(p) * (c->absolute() + bound(p)));
      // The ruling is the direction that does not bend.
      CHECK(std::abs(c->tangent_2.dot(Vector3d(-along.y(), along.x(), 0))) ==
            doctest::Approx(1).epsilon(1e-12));
    }
  }
}

TEST_CASE("a sphere is umbilic everywhere") {
  const double radius = 250;
  for (double u = 0.1; u < 1.4; u += 0.1) {
    const double c = std::cos(u), s = std::sin(u), cv = std::cos(0.7), sv = std::sin(0.7);
    const SurfacePoint p{radius * Vector3d(c * cv, c * sv, s),  radius * Vector3d(-s * cv, -s * sv, c),
                         radius * Vector3d(-c * sv, c * cv, 0), radius * Vector3d(-c * cv, -c * sv, -s),
                         radius * Vector3d(s * sv, -s * cv, 0), radius * Vector3d(-c * cv, -c * sv, 0)};
    const auto bent = curvature_at(p);
    REQUIRE(bent.has_value());
    CHECK(bent->umbilic);
    // r_u x r_v points inwards here, so the surface bends towards its normal.
    CHECK(bent->k1 == doctest::Approx(1 / radius).epsilon(1e-14));
    CHECK(bent->gaussian == doctest::Approx(1 / (radius * radius)).epsilon(1e-14));
    CHECK(bent->direction_1.norm() > 0);
  }
}

TEST_CASE("a bicubic that follows a sphere to its fourth order curves like it within the remainder") {
  // The sphere is z = R - r^2/2R - (r^4)/8R^3 - ..., of which a bicubic takes all but x^4 + y^4: second
  // derivatives are off by 12 a^2 / 8 R^3 = 1.5 (a/R)^2 / R at most, slopes by (a/R)^3 / 2, which matters a
  // hundred times less. 3 % stands for the higher orders: r^6 / 16 R^5 adds 72 a^4 / 16 R^5, and the slopes 2
  // (a/R) (a/R)^3 / R.
  const double radius = 250;
  for (const double half : {5.0, 10.0}) {
    const auto cap = height_surface(
        [&](double x, double y) {
          return radius - (x * x + y * y) / (2 * radius) - x * x * y * y / (4 * std::pow(radius, 3));
        },
        -half, half, 2);
    double worst = 0;
    for (double u = 0; u <= 1; u += 0.05) {
      for (double v = 0; v <= 1; v += 0.05) {
        const auto c = curvature_at(cap.at(u, v));
        worst = std::max({worst, std::abs(c->k1 + 1 / radius), std::abs(c->k2 + 1 / radius)});
      }
    }
    const double remainder = 1.5 * std::pow(half / radius, 2) / radius;
    CHECK(worst < 1.03 * remainder);
    CHECK(worst > 0.9 * remainder);
  }
}

TEST_CASE("Gaussian curvature does not change when a surface is bent without stretching") {
  SUBCASE("helicoid into catenoid") {
    for (double u = -1.5; u <= 1.5; u += 0.5) {
      const double sh = std::sinh(u), ch = std::cosh(u), s = std::sin(0.4), c = std::cos(0.4);
      for (double theta = 0; theta <= 1.6; theta += 0.2) {
        const double a = std::cos(theta), b = std::sin(theta);
        // a (sh s, -sh c, v) + b (ch c, ch s, u), with its derivatives.
        const SurfacePoint p{{a * sh * s + b * ch * c, -a * sh * c + b * ch * s, a * 0.4 + b * u},
                             {a * ch * s + b * sh * c, -a * ch * c + b * sh * s, b},
                             {a * sh * c - b * ch * s, a * sh * s + b * ch * c, a},
                             {a * sh * s + b * ch * c, -a * sh * c + b * ch * s, 0},
                             {a * ch * c - b * sh * s, a * ch * s + b * sh * c, 0},
                             {-a * sh * s - b * ch * c, a * sh * c - b * ch * s, 0}};
        const auto forms = fundamental_forms(p);
        CHECK(forms->e == doctest::Approx(ch * ch));
        CHECK(forms->g == doctest::Approx(ch * ch));
        CHECK(std::abs(forms->f) < 1e-14);
        const auto bent = curvature_at(p);
        CHECK(bent->gaussian == doctest::Approx(-std::pow(ch, -4)).epsilon(1e-13));
        CHECK(std::abs(bent->mean) <= bound(p));  // minimal surfaces all the way
      }
    }
  }
  SUBCASE("a spherical cap rolled up: principal curvatures change, their product does not") {
    const double u = 0.6, v = 0.2;
    double before = 0;
    for (const double a : {1.0, 0.8, 0.5}) {
      // Profile a cos u, angle v / a, height with slope sqrt(1 - a^2 sin^2 u): the metric is that of
      // the unit sphere.
      const double c = std::cos(v / a), s = std::sin(v / a),
                   z = std::sqrt(1 - a * a * std::sin(u) * std::sin(u));
      const double cu = std::cos(u), su = std::sin(u);
      const SurfacePoint p{{a * cu * c, a * cu * s, 0}, {-a * su * c, -a * su * s, z},
                           {-cu * s, cu * c, 0},        {-a * cu * c, -a * cu * s, -a * a * su * cu / z},
                           {su * s, -su * c, 0},        {-cu * c / a, -cu * s / a, 0}};
      const auto bent = curvature_at(p);
      CHECK(bent->gaussian == doctest::Approx(1).epsilon(1e-13));
      CHECK(std::abs(bent->k1 - before) > 0.1);
      before = bent->k1;
    }
  }
}

TEST_CASE("curvature is the same wherever the surface stands and however it is parametrized") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 500; ++i) {
    const SurfacePoint p = random_point(random);
    const auto here = curvature_at(p);
    REQUIRE(here.has_value());

    const Eigen::Matrix3d turn =
        geometry::rotation_from_zyz({3 * unit(random), 1.5 + unit(random), 3 * unit(random)});
    const SurfacePoint moved{turn * p.value, turn * p.du,  turn * p.dv,
                             turn * p.duu,   turn * p.duv, turn * p.dvv};
    const auto there = curvature_at(moved);
    CHECK(std::abs(here->k1 - there->k1) <= 4 * bound(p));
    CHECK(std::abs(here->k2 - there->k2) <= 4 * bound(p));

    // u = a p + b q + c p^2, v = d p + e q + f p q: the chain rule at p = q = 0.
    const double a = 1.5 + unit(random), b = 0.3 * unit(random), c = unit(random), d = 0.3 * unit(random),
                 e = 1.5 + unit(random), f = unit(random);
    SurfacePoint q;
    q.value = p.value, q.du = a * p.du + d * p.dv, q.dv = b * p.du + e * p.dv;
    q.duu = a * a * p.duu + 2 * a * d * p.duv + d * d * p.dvv + 2 * c * p.du;
    q.duv = a * b * p.duu + (a * e + b * d) * p.duv + d * e * p.dvv + f * p.dv;
    q.dvv = b * b * p.duu + 2 * b * e * p.duv + e * e * p.dvv;
    const auto again = curvature_at(q);
    REQUIRE(again.has_value());
    const double allowed = 2 * (bound(p) + bound(q));
    CHECK(std::abs(here->k1 - again->k1) <= allowed);
    CHECK(std::abs(here->k2 - again->k2) <= allowed);
    CHECK(std::abs(std::abs(here->tangent_1.dot(again->tangent_1)) - 1) < 1e-9);

    // Exchanging u and v turns the normal over: the sign of H and of the principal curvatures, but not
    // that of K.
    const auto turned = curvature_at({p.value, p.dv, p.du, p.dvv, p.duv, p.duu});
    CHECK(std::abs(turned->k1 + here->k2) <= 2 * bound(p));
    CHECK(std::abs(turned->mean + here->mean) <= 2 * bound(p));
    CHECK(turned->gaussian == doctest::Approx(here->gaussian).epsilon(1e-6));
  }
}

TEST_CASE("Euler's formula gives the normal curvature in every direction") {
  std::mt19937 random(7);
  for (int i = 0; i < 200; ++i) {
    const SurfacePoint p = random_point(random);
    const auto forms = fundamental_forms(p);
    const auto c = curvature_at(p);
    REQUIRE(c.has_value());
    double sum = 0;
    constexpr int directions = 12;
    for (int k = 0; k < directions; ++k) {
      const double angle = std::numbers::pi * k / directions, co = std::cos(angle), si = std::sin(angle);
      const Vector2d d = co * c->direction_1 + si * c->direction_2;
      const double bent = forms->normal_curvature(d.x(), d.y());
      CHECK(std::abs(bent - (c->k1 * co * co + c->k2 * si * si)) <= 16 * bound(p));
      // The direction travels a millimetre along the two tangents.
      CHECK((d.x() * p.du + d.y() * p.dv - co * c->tangent_1 - si * c->tangent_2).norm() < 1e-11);
      CHECK(forms->normal_curvature(-3 * d.x(), -3 * d.y()) == doctest::Approx(bent));
      sum += bent;
    }
    CHECK(std::abs(sum / directions - c->mean) <= 16 * bound(p));  // the mean over all directions
    CHECK(c->tangent_1.cross(c->tangent_2).dot(p.normal()) == doctest::Approx(1));
  }
}

TEST_CASE("a point is an umbilic within the tolerance asked for, and then any direction will do") {
  const SurfacePoint nearly = graph(0, 0, 0.01, 0, 0.01 + 1e-9);
  CHECK_FALSE(curvature_at(nearly)->umbilic);
  CHECK(curvature_at(nearly, 1e-8)->umbilic);
  CHECK(std::abs(curvature_at(nearly)->tangent_1.y()) == doctest::Approx(1));
  CHECK(curvature_at(nearly, 1e-8)->tangent_1.x() == doctest::Approx(1));
  // A plane whose parameter lines are curved in it.
  const SurfacePoint plane{{0, 0, 0}, {3, 1, 2}, {1, 2, -1}, {4, 3, 1}, {-2, 1, -3}, {5, 5, 0}};
  const auto flat = curvature_at(plane);
  CHECK(flat->umbilic);
  CHECK(flat->absolute() <= 2 * bound(plane));
}

TEST_CASE("a surface without a tangent plane is refused by name") {
  const SurfacePoint good = graph(0.1, 0.2, 1, 2, 3);
  SurfacePoint p = good;
  p.dv = 2 * p.du;
  CHECK(curvature_at(p).error() == Error::singular_parametrization);
  CHECK(fundamental_forms(p).error() == Error::singular_parametrization);
  p = good, p.du.setZero();
  CHECK(curvature_at(p).error() == Error::singular_parametrization);
  p = good, p.du *= 1e-12;  // what rounding leaves of a side drawn together to a point
  CHECK(curvature_at(p).error() == Error::singular_parametrization);
  p = good, p.duv.y() = NAN;
  CHECK(curvature_at(p).error() == Error::not_finite);
  p = good, p.du.x() = INFINITY;
  CHECK(fundamental_forms(p).error() == Error::not_finite);
  // Milliradians between the lines, or very different speeds, are no reason.
  p = good, p.dv = p.du + 1e-3 * good.dv;
  CHECK(curvature_at(p).has_value());
  p = good, p.du *= 1e-6, p.duu *= 1e-12, p.duv *= 1e-6;
  CHECK(curvature_at(p)->k1 == doctest::Approx(curvature_at(good)->k1).epsilon(1e-12));
}

TEST_CASE("the map over a grid holds what single points say, and marks a pole") {
  // A triangle: the side u = 0 is drawn together to a point.
  const auto fan = polynomial_surface(
      [](double u, double v) { return Vector3d(100 * u, 80 * u * (v - 0.5), 7 * u * u * v); },
      geometry::uniform_clamped_knots(3), {0, 0, 0, 0, 0.2, 0.2, 0.7, 1, 1, 1, 1});
  std::vector<double> us, vs;
  for (int i = 0; i <= 20; ++i) us.push_back(i / 20.0);
  for (int j = 0; j <= 16; ++j) vs.push_back(j / 16.0);
  std::vector<CurvatureSample> map(us.size() * vs.size());
  const auto singular = curvature_map(fan, us, vs, map);
  REQUIRE(singular.has_value());
  CHECK(*singular == vs.size());
  for (std::size_t i = 0; i < us.size(); ++i) {
    for (std::size_t j = 0; j < vs.size(); ++j) {
      const CurvatureSample& sample = map[i * vs.size() + j];
      const SurfacePoint p = fan.at(us[i], vs[j]);
      const auto one = curvature_at(p);
      CHECK(one.has_value() == (i > 0));
      CHECK(std::isnan(sample.mean) == (i == 0));
      if (!one) continue;
      CHECK(std::abs(sample.k1 - one->k1) <= 2 * bound(p));
      CHECK(std::abs(sample.k2 - one->k2) <= 2 * bound(p));
      CHECK(std::abs(sample.mean - one->mean) <= 2 * bound(p));
      CHECK(sample.absolute() == doctest::Approx(one->absolute()));
    }
  }
}

TEST_CASE("a curvature map of nothing, of NaN or into too little room is refused") {
  auto surface = height_surface([](double x, double) { return x * x; }, 0, 1);
  std::vector<CurvatureSample> map(6);
  const std::vector<double> three{0, 0.5, 1}, two{0, 1}, bad{0, NAN};
  CHECK(curvature_map(surface, three, two, map).value() == 0);
  CHECK(curvature_map(surface, {}, two, map).error() == Error::too_few_points);
  CHECK(curvature_map(surface, three, {}, map).error() == Error::too_few_points);
  CHECK(curvature_map(surface, three, three, map).error() == Error::capacity);
  CHECK(curvature_map(surface, three, bad, map).error() == Error::not_finite);
  surface.z(1, 1) = NAN;
  CHECK(curvature_map(surface, three, two, map).error() == Error::not_finite);
}
