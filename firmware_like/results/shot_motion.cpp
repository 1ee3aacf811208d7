#include "firmware_like/results/shot_motion.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace moldloft::firmware_like {
namespace {

constexpr double length_scale_mm = 100;  // brings turns and tilts to the size of shifts
// What no observation determines is taken as none: motions are expected to be of a millimetre. On a twisted plate a
// shift in plan and a tilt look alike in height, and only this tells them apart where no edge was seen.
constexpr double ridge = 1;
// A mount that explains so much of what the best model does is believed. A plate that seems to move where the sweep
// begins, and the head turns, looks much the same: there less is enough.
constexpr double mount_share = 0.97, mount_share_at_sweep = 0.6;
// One unknown explains nothing by chance that six do.
constexpr double scale_share = 0.9;

// Of a body: shift along x, y and z, then turn about x, y and z in units of 1 / length_scale_mm.
using Row = Eigen::Matrix<double, 6, 1>;
// The same twice: where the plate lies at all, and what a model adds.
using TwiceRow = Eigen::Matrix<double, 12, 1>;

template <typename R>
struct Sums {
  static constexpr int size = R::RowsAtCompileTime;
  Eigen::Matrix<double, size, size> normal = Eigen::Matrix<double, size, size>::Zero();
  R right = R::Zero();
  // In units of what is expected of one observation, less one for each: what is there beyond chance.
  double excess_in_plan = 0, excess_in_height = 0;

  void add(const R& row, double value, double weight, double& excess) {
    normal += weight * row * row.transpose();
    right += weight * value * row;
    excess += weight * value * value - 1;
  }
  Sums& operator+=(const Sums& other) {
    normal += other.normal, right += other.right;
    excess_in_plan += other.excess_in_plan, excess_in_height += other.excess_in_height;
    return *this;
  }
  Sums operator-(const Sums& other) const {
    return {normal - other.normal, right - other.right, excess_in_plan - other.excess_in_plan,
            excess_in_height - other.excess_in_height};
  }
  R solution() const {
    const Eigen::Matrix<double, size, size> a =
        normal + ridge * Eigen::Matrix<double, size, size>::Identity();
    return a.ldlt().solve(right);
  }
  double explained() const { return right.dot(solution()); }
  // Of either alone: a scanner that is less noisy than expected shall not hide what the edges say.
  double excess() const { return std::max(excess_in_plan, 0.0) + std::max(excess_in_height, 0.0); }
};

// A distance far beyond what is expected counts linearly, not squared: a tooth of the rim shall not outweigh a side.
double robust_weight(double value, double sigma) {
  constexpr double knee = 5;
  const double size = std::abs(value) / sigma;
  return (size > knee ? knee / size : 1) / (sigma * sigma);
}

// How far something was seen from where it was expected, along a direction: an edge from the outline along its normal,
// a point from the surface along z. On a slope a shift in plan shows in height too.
struct Observation {
  std::size_t shot = 0;
  Eigen::Vector3d point{0, 0, 0}, along{0, 0, 0};
  double off_mm = 0;
  bool in_height = false;
};

// What a small motion of a body about `centre` does to `point`, seen along a direction.
Row body_row(const Eigen::Vector3d& along, const Eigen::Vector3d& point, const Eigen::Vector3d& centre) {
  Row row;
  row << along, (point - centre).cross(along) / length_scale_mm;
  return row;
}

// Beyond the plate by more than the map reaches: of the plate's middle.
double surface_height(const geometry::PlanMap& map, const geometry::BSplineSurface& surface,
                      const Eigen::Vector2d& place) {
  const Eigen::Vector2d uv = map.invert(place, {0.5, 0.5}).value_or(Eigen::Vector2d{0.5, 0.5});
  return surface.at(uv.x(), uv.y()).value.z();
}

std::vector<Observation> observations_of(const tasks::RunEvidence& evidence,
                                         const std::vector<SeenEdge>& edges, const geometry::PlanMap& map,
                                         const geometry::BSplineSurface& surface) {
  std::vector<Observation> all;
  Eigen::Vector2d guess{0.5, 0.5};
  for (std::size_t i = 0; i < evidence.shots.size(); ++i) {
    for (const auto& p : evidence.samples_of(i)) {
      const auto uv = map.invert(p.head<2>(), guess);
      if (!uv) continue;
      guess = *uv;
      const auto on = surface.at(uv->x(), uv->y());
      const Eigen::Vector3d n = on.du.cross(on.dv);
      all.push_back({i, p, n / n.z(), p.z() - on.value.z(), true});
    }
  }
  for (const auto& e : edges) {
    const Eigen::Vector3d point{e.point.x(), e.point.y(), surface_height(map, surface, e.point)};
    all.push_back(
        {e.shot, point, {e.place.outwards.x(), e.place.outwards.y(), 0}, e.place.distance_mm, false});
  }
  return all;
}

struct Observations {
  const tasks::RunEvidence& evidence;
  std::vector<Observation> all;
  Expected expected;
  Eigen::Vector3d middle;

  Row plate_row(const Observation& o) const { return body_row(o.along, o.point, middle); }
  // In the scanner's own frame.
  Row mount_row(const Observation& o) const {
    const auto scanner_from_world = evidence.shots[o.shot].world_from_scanner.inverse();
    return body_row(scanner_from_world.linear() * o.along, scanner_from_world * o.point, {0, 0, 0});
  }
  // In the scanner's own frame, too: all lengths too large.
  Row scale_row(const Observation& o) const {
    const auto scanner_from_world = evidence.shots[o.shot].world_from_scanner.inverse();
    Row row = Row::Zero();
    row[0] = (scanner_from_world.linear() * o.along).dot(scanner_from_world * o.point) / length_scale_mm;
    return row;
  }
  // Sums of every shot, with rows as `row_of` makes them.
  template <typename R, typename RowOf>
  std::vector<Sums<R>> sums(RowOf row_of) const {
    std::vector<Sums<R>> of_shot(evidence.shots.size());
    for (const Observation& o : all) {
      Sums<R>& sum = of_shot[o.shot];
      sum.add(row_of(o), o.off_mm,
              robust_weight(o.off_mm, o.in_height ? expected.height_mm : expected.edge_mm),
              o.in_height ? sum.excess_in_height : sum.excess_in_plan);
    }
    return of_shot;
  }
};

template <typename R>
Sums<R> total(const std::vector<Sums<R>>& of_shot) {
  Sums<R> sum;
  for (const auto& s : of_shot) sum += s;
  return sum;
}

void describe(Motion& m, const Row& row) {
  m.shift_mm = row.head<2>();
  m.lift_mm = row.z();
  m.tilt_rad = row.segment<2>(3) / length_scale_mm;
  m.turn_rad = row[5] / length_scale_mm;
}

Sums<Row> sum_of_plate(const Observations& o) {
  return total(o.sums<Row>([&](const Observation& seen) { return o.plate_row(seen); }));
}

Motion moved(const Observations& o, double disagreement) {
  const auto of_shot = o.sums<Row>([&](const Observation& seen) { return o.plate_row(seen); });
  const Sums all = total(of_shot);
  Motion best{.cause = Cause::moved};
  // What the plate alone would explain if it lay elsewhere from the start is no gain of any model.
  const double without = all.explained();
  Sums<Row> before;
  for (std::size_t k = 1; k < of_shot.size(); ++k) {
    before += of_shot[k - 1];
    const Sums after = all - before;
    const double explained = (before.explained() + after.explained() - without) / disagreement;
    if (explained <= best.explained) continue;
    best.explained = explained, best.shot = k;
    describe(best, after.solution() - before.solution());
  }
  return best;
}

// A model that adds six unknowns to where the plate lies.
template <typename RowOf>
Motion with(Cause cause, const Observations& o, double disagreement, RowOf model_row) {
  const Sums all = total(o.sums<TwiceRow>([&](const Observation& seen) {
    TwiceRow both;
    both << o.plate_row(seen), model_row(seen);
    return both;
  }));
  Motion m{.cause = cause, .explained = (all.explained() - sum_of_plate(o).explained()) / disagreement};
  describe(m, all.solution().template tail<6>());
  return m;
}

Motion drift(const Observations& o, double disagreement) {
  const double last = std::max<double>(1, static_cast<double>(o.evidence.shots.size() - 1));
  return with(Cause::drift, o, disagreement, [&](const Observation& seen) -> Row {
    return o.plate_row(seen) * (static_cast<double>(seen.shot) / last);
  });
}

Motion scale(const Observations& o, double disagreement) {
  Motion m = with(Cause::scale, o, disagreement, [&](const Observation& seen) { return o.scale_row(seen); });
  m.scale = std::exchange(m.shift_mm.x(), 0.0) / length_scale_mm;
  return m;
}

Motion mount(const Observations& o, double disagreement) {
  return with(Cause::mount, o, disagreement, [&](const Observation& seen) { return o.mount_row(seen); });
}

}  // namespace

Motion best_motion(const tasks::RunEvidence& evidence, const std::vector<SeenEdge>& edges,
                   const geometry::PlanMap& map, const geometry::BSplineSurface& surface,
                   const Expected& expected) {
  const auto& c = map.outline().corners;
  const Eigen::Vector2d middle = (c[0] + c[1] + c[2] + c[3]) / 4;
  const Observations o{.evidence = evidence,
                       .all = observations_of(evidence, edges, map, surface),
                       .expected = expected,
                       .middle = {middle.x(), middle.y(), surface_height(map, surface, middle)}};
  const double disagreement = std::max(sum_of_plate(o).excess(), 1.0);
  const Motion by_mount = mount(o, disagreement);
  Motion best = moved(o, disagreement);
  if (const Motion by_drift = drift(o, disagreement); by_drift.explained > best.explained) best = by_drift;
  const Motion by_scale = scale(o, disagreement);
  if (by_scale.explained > scale_share * std::max(best.explained, by_mount.explained)) return by_scale;
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
