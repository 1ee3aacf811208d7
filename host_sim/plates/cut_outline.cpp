#include "host_sim/plates/cut_outline.hpp"

#include "host_sim/base/portable_math.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace moldloft::host_sim {

namespace {

constexpr double arc_step = 5 * std::numbers::pi / 180;  // of a corner's arc
constexpr int points_an_arc = 12;                        // of a scallop

// A side of the outline, walked along from its first corner, with the inside on the left.
struct Side {
  Eigen::Vector2d from, along, inward;
  double length = 0;
  Eigen::Vector2d at(double along_mm, double inward_mm) const {
    return from + along_mm * along + inward_mm * inward;
  }
};

Side side_of(PlanPoints corners, std::size_t k) {
  const Eigen::Vector2d whole = corners[(k + 1) % corners.size()] - corners[k];
  const Eigen::Vector2d along = whole.normalized();
  return {corners[k], along, {-along.y(), along.x()}, whole.norm()};
}

}  // namespace

Outline notched(PlanPoints corners, std::size_t side, double middle, double width_mm, double depth_mm) {
  Outline out;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    out.push_back(corners[k]);
    if (k != side) continue;
    const Side s = side_of(corners, k);
    const double from = middle * s.length - width_mm / 2, to = from + width_mm;
    for (const auto& p : {s.at(from, 0), s.at(from, depth_mm), s.at(to, depth_mm), s.at(to, 0)})
      out.push_back(p);
  }
  return out;
}

Outline stepped(PlanPoints corners, std::size_t side, double depth_mm) {
  Outline out;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Side s = side_of(corners, k);
    // The corner behind the step lies on the next side, where the deeper half of this one meets it.
    if (k == (side + 1) % corners.size()) {
      const Side before = side_of(corners, side);
      out.push_back(s.at(depth_mm / std::abs(s.along.dot(before.inward)), 0));
    } else {
      out.push_back(corners[k]);
    }
    if (k != side) continue;
    out.push_back(s.at(s.length / 2, 0));
    out.push_back(s.at(s.length / 2, depth_mm));
  }
  return out;
}

Outline corner_cut(PlanPoints corners, std::size_t corner, double length_mm) {
  Outline out;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    if (k != corner) {
      out.push_back(corners[k]);
      continue;
    }
    const Side before = side_of(corners, (k + corners.size() - 1) % corners.size()),
               after = side_of(corners, k);
    out.push_back(before.at(before.length - length_mm, 0));
    out.push_back(after.at(length_mm, 0));
  }
  return out;
}

Outline rounded(PlanPoints corners, double radius_mm) {
  Outline out;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Side before = side_of(corners, (k + corners.size() - 1) % corners.size()),
               after = side_of(corners, k);
    const double turn = std::acos(std::clamp(before.along.dot(after.along), -1.0, 1.0));
    const double tangent = radius_mm * std::tan(turn / 2);
    const Eigen::Vector2d centre = after.at(tangent, radius_mm);
    const int steps = std::max(2, static_cast<int>(turn / arc_step));
    for (int i = 0; i <= steps; ++i) {
      const auto angle = portable_sin_cos(turn * i / steps);
      out.push_back(centre + radius_mm * (angle.sine * before.along - angle.cosine * before.inward));
    }
  }
  return out;
}

Outline scalloped(PlanPoints corners, double pitch_mm, double depth_mm) {
  Outline out;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Side s = side_of(corners, k);
    const int arcs = std::max(1, static_cast<int>(s.length / pitch_mm));
    for (int i = 0; i < arcs * points_an_arc; ++i) {
      const double wave = portable_sin_cos(std::numbers::pi * i / points_an_arc).sine;
      out.push_back(s.at(s.length * i / (arcs * points_an_arc), depth_mm * std::abs(wave)));
    }
  }
  return out;
}

Outline ragged(PlanPoints corners, double pitch_mm, double depth_mm, Random& random) {
  Outline out;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Side s = side_of(corners, k);
    const int teeth = std::max(2, static_cast<int>(s.length / pitch_mm));
    out.push_back(corners[k]);
    for (int i = 1; i < teeth; ++i)
      out.push_back(s.at(s.length * i / teeth, i % 2 == 0 ? 0 : random.uniform(0.2, 1) * depth_mm));
  }
  return out;
}

Outline regular(std::size_t corners, double radius_mm) {
  Outline out;
  for (std::size_t k = 0; k < corners; ++k) {
    const auto angle =
        portable_sin_cos(2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(corners));
    out.emplace_back(radius_mm * angle.cosine, radius_mm * angle.sine);
  }
  return out;
}

}  // namespace moldloft::host_sim
