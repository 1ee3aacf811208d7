#include "bench/fit_job.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace moldloft::bench {

namespace {

// SplitMix64 (Steele, Lea and Flood 2014) and Box-Muller: std's distributions differ from library to library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double gauss() {
    const double radius = std::sqrt(-2 * std::log(1 - unit()));
    return radius * std::cos(2 * std::numbers::pi * unit());
  }

 private:
  std::uint64_t state_;
};

struct Chord {
  double x, y, length;  // start, in the shot's square
};

// The stripes that cross a square of side `side` under `angle`.
std::vector<Chord> chords(double side, double angle, int stripes) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double width = side * (c + s);  // seen along the stripes
  std::vector<Chord> all;
  for (int k = 0; k < stripes; ++k) {
    // The line of points at distance d from the corner (side, 0) that the direction (c, s) leaves
    // to the right.
    const double d = (k + 0.5) / stripes * width - side * s;
    const double px = -s * d, py = c * d;
    double from = -1e9, to = 1e9;
    for (const auto& [p, q] : {std::pair{px, c}, std::pair{py, s}}) {
      from = std::max(from, (0 - p) / q), to = std::min(to, (side - p) / q);
    }
    if (to > from) all.push_back({px + from * c, py + from * s, to - from});
  }
  return all;
}

}  // namespace

double true_height(double x, double y) {
  const double u = x / plate_mm - 0.5, v = y / plate_mm - 0.5;
  // A saddle with a bend, and the waviness that line heating leaves.
  return 60 * u * v + 30 * u * u - 24 * v * v + 1.6 * std::sin(8.2 * u + 5.1 * v + 0.4) +
         0.9 * std::cos(9.5 * v - 6.3 * u) +
         0.25 * std::exp(-60 * ((u - 0.1) * (u - 0.1) + (v + 0.15) * (v + 0.15)));
}

FitJob fit_job(std::uint64_t seed) {
  constexpr int shots_a_side = 3, points_a_shot = 50'000, stripes = 100;
  constexpr double side = plate_mm / shots_a_side;
  Random random(seed);
  FitJob job;
  for (int shot = 0; shot < shots_a_side * shots_a_side; ++shot) {
    const double angle = (12 + 26.0 * shot / 8) * std::numbers::pi / 180;
    const double x0 = shot / shots_a_side * side, y0 = shot % shots_a_side * side;
    const std::vector<Chord> lines = chords(side, angle, stripes);
    double total = 0;
    for (const Chord& line : lines) total += line.length;
    const double step = total / points_a_shot;
    std::size_t line = 0;
    double before = 0;
    for (int k = 0; k < points_a_shot; ++k) {
      const double at = (k + 0.5) * step;
      while (line + 1 < lines.size() && at > before + lines[line].length) before += lines[line++].length;
      const double along = std::min(at - before, lines[line].length);
      const double x = std::clamp(x0 + lines[line].x + along * std::cos(angle), 0.0, plate_mm);
      const double y = std::clamp(y0 + lines[line].y + along * std::sin(angle), 0.0, plate_mm);
      job.x.push_back(x), job.y.push_back(y);
      job.z.push_back(true_height(x, y) + noise_mm * random.gauss());
    }
  }
  return job;
}

FitJob with_hole(const FitJob& job) {
  FitJob out;
  for (std::size_t i = 0; i < job.size(); ++i) {
    if (std::hypot(job.x[i] - hole_x, job.y[i] - hole_y) < hole_radius) continue;
    out.x.push_back(job.x[i]), out.y.push_back(job.y[i]), out.z.push_back(job.z[i]);
  }
  return out;
}

FitJob with_outliers(const FitJob& job, std::uint64_t seed) {
  Random random(seed);
  FitJob out = job;
  for (double& z : out.z) {
    if (random.unit() < 0.01) z += random.unit() < 0.5 ? 3 : -3;
  }
  return out;
}

FitError error_of(const geometry::BSplineSurface& surface) {
  constexpr int grid = 300;
  FitError error;
  int inside = 0;
  const double length_u = surface.knots_u.back(), length_v = surface.knots_v.back();
  for (int i = 0; i <= grid; ++i) {
    for (int j = 0; j <= grid; ++j) {
      const double u = double(i) / grid, v = double(j) / grid, x = u * plate_mm, y = v * plate_mm;
      const double e = surface.at(u * length_u, v * length_v).value.z() - true_height(x, y);
      error.rms += e * e, error.max = std::max(error.max, std::abs(e));
      const bool in = std::hypot(x - hole_x, y - hole_y) < hole_radius;
      (in ? error.rms_inside : error.rms_outside) += e * e;
      inside += in;
    }
  }
  constexpr double all = (grid + 1.0) * (grid + 1.0);
  error.rms_inside = std::sqrt(error.rms_inside / inside);
  error.rms_outside = std::sqrt(error.rms_outside / (all - inside));
  error.rms = std::sqrt(error.rms / all);
  return error;
}

}  // namespace moldloft::bench
