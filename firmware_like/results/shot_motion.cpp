#include "firmware_like/results/shot_motion.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace moldloft::firmware_like {
namespace {

constexpr double length_scale_mm = 100;  // brings turns and tilts to the size of shifts
// What no observation determines is taken as none: against the weight of one observation in a hundred.
constexpr double ridge = 1e-2;
// A mount that explains so much of what the best model does is believed. A plate that seems to move where the sweep
// begins, and the head turns, looks much the same: there less is enough.
constexpr double mount_share = 0.97, mount_share_at_sweep = 0.6;

// In plan: shift x, shift y, turn; in height: lift, tilt about x and y. They do not mix.
using Row = Eigen::Vector3d;
// The same twice: where the plate lies at all, and what a model adds.
using TwiceRow = Eigen::Matrix<double, 6, 1>;

template <typename R>
struct Sums {
  static constexpr int size = R::RowsAtCompileTime;
  Eigen::Matrix<double, size, size> normal = Eigen::Matrix<double, size, size>::Zero();
  R right = R::Zero();
  // In units of what is expected of one observation, less one for each: what is there beyond chance.
  double excess = 0;

  void add(const R& row, double value, double weight) {
    normal += weight * row * row.transpose();
    right += weight * value * row;
    excess += weight * value * value - 1;
  }
  Sums& operator+=(const Sums& other) {
    normal += other.normal, right += other.right, excess += other.excess;
    return *this;
  }
  Sums operator-(const Sums& other) const {
    return {normal - other.normal, right - other.right, excess - other.excess};
  }
  R solution() const {
    const Eigen::Matrix<double, size, size> a =
        normal + ridge * Eigen::Matrix<double, size, size>::Identity();
    return a.ldlt().solve(right);
  }
  double explained() const { return right.dot(solution()); }
};

template <typename R>
struct Both {
  Sums<R> plan, height;
  Both& operator+=(const Both& other) {
    plan += other.plan, height += other.height;
    return *this;
  }
  Both operator-(const Both& other) const { return {plan - other.plan, height - other.height}; }
  double explained() const { return plan.explained() + height.explained(); }
  // Of either alone: a scanner that is less noisy than expected shall not hide what the edges say.
  double excess() const { return std::max(plan.excess, 0.0) + std::max(height.excess, 0.0); }
};

Eigen::Vector2d turned(const Eigen::Vector2d& v) { return {-v.y(), v.x()}; }

// A distance far beyond what is expected counts linearly, not squared: a tooth of the rim shall not outweigh a side.
double robust_weight(double value, double sigma) {
  constexpr double knee = 5;
  const double size = std::abs(value) / sigma;
  return (size > knee ? knee / size : 1) / (sigma * sigma);
}

struct Height {
  std::size_t shot;
  Eigen::Vector3d point;
  double above_mm;
};

std::vector<Height> heights_of(const tasks::RunEvidence& evidence, const geometry::PlanMap& map,
                               const geometry::BSplineSurface& surface) {
  std::vector<Height> heights;
  Eigen::Vector2d guess{0.5, 0.5};
  for (std::size_t i = 0; i < evidence.shots.size(); ++i) {
    for (const auto& p : evidence.samples_of(i)) {
      const auto uv = map.invert(p.head<2>(), guess);
      if (!uv) continue;
      guess = *uv;
      heights.push_back({i, p, p.z() - surface.at(uv->x(), uv->y()).value.z()});
    }
  }
  return heights;
}

struct Observations {
  const tasks::RunEvidence& evidence;
  const std::vector<SeenEdge>& edges;
  std::vector<Height> heights;
  Expected expected;
  Eigen::Vector2d middle;

  // Sums of every shot, with rows as `plan_row` and `height_row` make them.
  template <typename R, typename PlanRow, typename HeightRow>
  std::vector<Both<R>> sums(PlanRow plan_row, HeightRow height_row) const {
    std::vector<Both<R>> of_shot(evidence.shots.size());
    for (const auto& e : edges)
      of_shot[e.shot].plan.add(plan_row(e), e.place.distance_mm,
                               robust_weight(e.place.distance_mm, expected.edge_mm));
    for (const auto& h : heights)
      of_shot[h.shot].height.add(height_row(h), h.above_mm, robust_weight(h.above_mm, expected.height_mm));
    return of_shot;
  }
};

template <typename R>
Both<R> total(const std::vector<Both<R>>& of_shot) {
  Both<R> sum;
  for (const auto& s : of_shot) sum += s;
  return sum;
}

void describe(Motion& m, const Row& plan, const Row& height) {
  m.shift_mm = plan.head<2>();
  m.turn_rad = plan.z() / length_scale_mm;
  m.lift_mm = height.x();
  m.tilt_rad = height.tail<2>() / length_scale_mm;
}

auto plate_rows(const Observations& o) {
  return std::pair{[&o](const SeenEdge& e) {
                     const auto& n = e.place.outwards;
                     return Row{n.x(), n.y(), n.dot(turned(e.point - o.middle)) / length_scale_mm};
                   },
                   [&o](const Height& h) {
                     const Eigen::Vector2d d = (h.point.head<2>() - o.middle) / length_scale_mm;
                     return Row{1, d.x(), d.y()};
                   }};
}

// What the plate alone would explain if it lay elsewhere from the start: of any model that is no gain.
double explained_by_rest(const Observations& o) {
  const auto [plan_row, height_row] = plate_rows(o);
  return total(o.sums<Row>(plan_row, height_row)).explained();
}

Motion moved(const Observations& o, double disagreement) {
  const auto [plan_row, height_row] = plate_rows(o);
  const auto of_shot = o.sums<Row>(plan_row, height_row);
  const Both all = total(of_shot);
  Motion best{.cause = Cause::moved};
  const double without = all.explained();
  Both<Row> before;
  for (std::size_t k = 1; k < of_shot.size(); ++k) {
    before += of_shot[k - 1];
    const Both after = all - before;
    const double explained = (before.explained() + after.explained() - without) / disagreement;
    if (explained <= best.explained) continue;
    best.explained = explained, best.shot = k;
    describe(best, after.plan.solution() - before.plan.solution(),
             after.height.solution() - before.height.solution());
  }
  return best;
}

Motion drift(const Observations& o, double disagreement) {
  const auto [plan_row, height_row] = plate_rows(o);
  const double last = std::max<double>(1, static_cast<double>(o.evidence.shots.size() - 1));
  const auto growing = [&](const Row& row, std::size_t shot) {
    TwiceRow both;
    both << row, row * (static_cast<double>(shot) / last);
    return both;
  };
  const Both all = total(o.sums<TwiceRow>([&](const SeenEdge& e) { return growing(plan_row(e), e.shot); },
                                          [&](const Height& h) { return growing(height_row(h), h.shot); }));
  Motion m{.cause = Cause::drift, .explained = (all.explained() - explained_by_rest(o)) / disagreement};
  describe(m, all.plan.solution().tail<3>(), all.height.solution().tail<3>());
  return m;
}

Motion mount(const Observations& o, double disagreement) {
  const auto [plan_row, height_row] = plate_rows(o);
  const auto scanner_plan = [&](std::size_t shot) -> Eigen::Matrix2d {
    return o.evidence.shots[shot].world_from_scanner.linear().topLeftCorner<2, 2>();
  };
  const auto from_centre = [&](std::size_t shot, const Eigen::Vector2d& p) -> Eigen::Vector2d {
    return p - o.evidence.shots[shot].world_from_scanner.translation().head<2>();
  };
  const auto beside_rest = [](const Row& rest, const Row& of_mount) {
    TwiceRow both;
    both << rest, of_mount;
    return both;
  };
  const Both all = total(o.sums<TwiceRow>(
      [&](const SeenEdge& e) {
        const auto& n = e.place.outwards;
        const Eigen::Vector2d shift = scanner_plan(e.shot).transpose() * n;
        return beside_rest(plan_row(e), {shift.x(), shift.y(),
                                         n.dot(turned(from_centre(e.shot, e.point))) / length_scale_mm});
      },
      [&](const Height& h) {
        const Eigen::Vector2d d =
            scanner_plan(h.shot).transpose() * from_centre(h.shot, h.point.head<2>()) / length_scale_mm;
        return beside_rest(height_row(h), {0, d.x(), d.y()});
      }));
  Motion m{.cause = Cause::mount, .explained = (all.explained() - explained_by_rest(o)) / disagreement};
  describe(m, all.plan.solution().tail<3>(), all.height.solution().tail<3>());
  return m;
}

}  // namespace

Motion best_motion(const tasks::RunEvidence& evidence, const std::vector<SeenEdge>& edges,
                   const geometry::PlanMap& map, const geometry::BSplineSurface& surface,
                   const Expected& expected) {
  const auto& c = map.outline().corners;
  const Observations o{.evidence = evidence,
                       .edges = edges,
                       .heights = heights_of(evidence, map, surface),
                       .expected = expected,
                       .middle = (c[0] + c[1] + c[2] + c[3]) / 4};
  const auto [plan_row, height_row] = plate_rows(o);
  const double disagreement = std::max(total(o.sums<Row>(plan_row, height_row)).excess(), 1.0);
  const Motion by_mount = mount(o, disagreement);
  Motion best = moved(o, disagreement);
  if (const Motion by_drift = drift(o, disagreement); by_drift.explained > best.explained) best = by_drift;
  const auto& shots = evidence.shots;
  const bool at_sweep = best.cause == Cause::moved && shots[best.shot].purpose == hal::ShotPurpose::surface &&
                        shots[best.shot - 1].purpose != hal::ShotPurpose::surface;
  const double share = at_sweep ? mount_share_at_sweep : mount_share;
  if (by_mount.explained < share * best.explained) return best;
  Motion chosen = by_mount;
  if (at_sweep) chosen.shot = best.shot;
  return chosen;
}

}  // namespace moldloft::firmware_like
