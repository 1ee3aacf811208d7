#include "geometry/edges/outline.hpp"

#include "geometry/tukey.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

// Vectors grow within what their constructor has reserved, and matrices of a size known only at run time have
// their most in their type: the compiler cannot know.
MOLDLOFT_GEOMETRY_CHECKED_AT_RUN_TIME

namespace moldloft::geometry {

namespace {

constexpr int most_spans = 16;
constexpr int most_control = most_spans + cubic;
using SideMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_control, most_control>;
using SideVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_control, 1>;

constexpr std::size_t points_a_step = 128;
constexpr std::uint8_t no_side = 4;
constexpr std::size_t fewest_points = 5;  // of a side
constexpr int rounds = 3;  // hints are off by millimetres: the third round moves corners by microns
constexpr int passes = 6;  // of one side in one round: plain, absolute, then Tukey

constexpr double first_gate =
    0.15;  // of the side's length: how far a bent side may leave the chord of the hints
constexpr double later_gate_mm = 5;  // about the first fit
constexpr double hint_doubt_mm = 6;  // points nearer than this to a hint wait for the second round

// Inflates the degrees of freedom in cross-validation (Kim and Gu 2004): edge points of one shot share its
// pose error, and plain cross-validation would follow it.
constexpr double dof_inflation = 1.4;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

struct OutlineBuilder::Side {
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), along = Eigen::Vector2d::UnitX();
  double length = 1;
  SideVector height;  // spline coefficients over the chord, positive to the left
  std::uint32_t begin = 0, count = 0;
  double scale = 0;  // robust standard deviation of the residuals
  double squares = 0, weights = 0, largest = 0;

  void set_chord(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    start = from;
    length = (to - from).norm();
    along = (to - from) / length;
  }
  double share_at(const Eigen::Vector2d& p) const { return (p - start).dot(along) / length; }
  double offset_at(const Eigen::Vector2d& p) const { return cross(along, p - start); }
  double height_at(std::span<const double> knots, double share) const {
    const double t = std::clamp(share, 0.0, 1.0);
    const int k = find_span(knots, t);
    const BasisValues basis = cubic_basis(knots, k, t);
    double sum = 0;
    for (int i = 0; i < 4; ++i) sum += basis.value[i] * height[k - cubic + i];
    return sum;
  }
};

// One reweighted least-squares pass over the points of one side, as far as it has come.
struct OutlineBuilder::SidePass {
  enum class Stage : std::uint8_t { add, solve, look } stage = Stage::add;
  SideMatrix a;
  SideVector b;
  double zz = 0, total = 0;
  std::size_t next = 0;  // of the side's points
  int trial = 0;
  double stiffness = 0, unit = 0, least = 0;
  SideMatrix roughness = {};
  SideVector best = {};
};

OutlineBuilder::OutlineBuilder(std::size_t max_points, const OutlineSettings& settings)
    : settings_(settings) {
  assert(settings.spans >= 1 && settings.spans <= most_spans);
  // Eigen asks the processor for its cache sizes once, behind a lock: here, or it would be in the middle of a step.
  Eigen::initParallel();
  side_of_.reserve(max_points);
  order_.reserve(max_points);
  residual_.reserve(max_points);
  scratch_.reserve(max_points);
  sides_.resize(4);
  side_pass_ = std::make_unique<SidePass>();
  for (PlanCurve& curve : outline_.sides) {
    curve.knots = uniform_clamped_knots(settings.spans);
    curve.control.assign(settings.spans + cubic, Eigen::Vector2d::Zero());
  }
  outline_.corners.fill(Eigen::Vector2d::Zero());
}

OutlineBuilder::~OutlineBuilder() = default;
OutlineBuilder::OutlineBuilder(OutlineBuilder&&) noexcept = default;

std::size_t OutlineBuilder::bytes() const {
  return side_of_.capacity() + order_.capacity() * sizeof(order_[0]) +
         (residual_.capacity() + scratch_.capacity()) * sizeof(double) + sides_.capacity() * sizeof(Side) +
         sizeof(SidePass);
}

std::expected<void, Error> OutlineBuilder::begin(std::span<const Eigen::Vector2d> points,
                                                 std::span<const Eigen::Vector2d> corner_hints,
                                                 std::span<const std::uint8_t> left_out) {
  stage_ = Stage::idle;
  if (corner_hints.size() != 4) return std::unexpected(Error::not_four_sided);
  if (points.size() > side_of_.capacity()) return std::unexpected(Error::capacity);
  if (points.size() < 4 * fewest_points) return std::unexpected(Error::too_few_points);
  if (!std::ranges::all_of(points, [](const Eigen::Vector2d& p) { return p.allFinite(); }))
    return std::unexpected(Error::not_finite);
  double area = 0;
  for (int i = 0; i < 4; ++i) {
    if (!corner_hints[i].allFinite()) return std::unexpected(Error::not_finite);
    area += 0.5 * cross(corner_hints[i], corner_hints[(i + 1) % 4]);
  }
  if (!(area > 1)) return std::unexpected(Error::collinear);  // mm^2; a clockwise outline has a negative area
  for (int i = 0; i < 4; ++i) {
    if ((corner_hints[(i + 1) % 4] - corner_hints[i]).norm() < 1) return std::unexpected(Error::collinear);
    outline_.corners[i] = corner_hints[i];
    sides_[i].set_chord(corner_hints[i], corner_hints[(i + 1) % 4]);
    sides_[i].height = SideVector::Zero(settings_.spans + cubic);
  }
  if (!left_out.empty() && left_out.size() != points.size()) return std::unexpected(Error::sizes_differ);
  points_ = points;
  left_out_ = left_out;
  side_of_.assign(points.size(), no_side);
  residual_.assign(points.size(), 0.0);
  stage_ = Stage::assign;
  round_ = 0, next_point_ = 0;
  *side_pass_ = {};
  return {};
}

std::expected<bool, Error> OutlineBuilder::step() {
  const auto fail = [&](Error error) {
    stage_ = Stage::idle;
    return std::unexpected(error);
  };
  switch (stage_) {
    case Stage::idle:
      return std::unexpected(Error::too_few_points);
    case Stage::done:
      return true;
    case Stage::assign:
      assign_chunk();
      if (next_point_ == points_.size()) stage_ = Stage::sort;
      return false;
    case Stage::sort:
      if (const auto sorted = sort_by_side(); !sorted) return fail(sorted.error());
      side_ = 0, pass_ = 0;
      stage_ = Stage::fit;
      return false;
    case Stage::fit: {
      const auto side_done = fit_pass();
      if (!side_done) return fail(side_done.error());
      if (*side_done && ++side_ == 4) stage_ = Stage::corners;
      return false;
    }
    case Stage::corners:
      if (const auto met = meet_corners(); !met) return fail(met.error());
      next_point_ = 0;
      stage_ = ++round_ < rounds ? Stage::assign : Stage::finish;
      return false;
    case Stage::finish:
      finish();
      stage_ = Stage::done;
      return true;
  }
  return std::unexpected(Error::too_few_points);
}

// Gives every point of one chunk to the side that it lies nearest to; near a corner to none.
void OutlineBuilder::assign_chunk() {
  const std::vector<double>& knots = outline_.sides[0].knots;
  const std::size_t end = std::min(points_.size(), next_point_ + points_a_step);
  for (; next_point_ < end; ++next_point_) {
    const Eigen::Vector2d& p = points_[next_point_];
    std::uint8_t nearest = no_side;
    double least = std::numeric_limits<double>::infinity();
    const bool is_out = !left_out_.empty() && left_out_[next_point_] != 0;
    for (int i = 0; i < 4 && !is_out; ++i) {
      const Side& side = sides_[i];
      const double guard =
          round_ == 0 ? std::min(hint_doubt_mm, 0.1 * side.length) : settings_.corner_guard_mm;
      const double gate = round_ == 0 ? std::max(first_gate * side.length, later_gate_mm) : later_gate_mm;
      const double share = side.share_at(p);
      if (!(share * side.length > guard && (1 - share) * side.length > guard)) continue;
      const double distance = std::abs(side.offset_at(p) - side.height_at(knots, share));
      if (distance < gate && distance < least) least = distance, nearest = static_cast<std::uint8_t>(i);
    }
    side_of_[next_point_] = nearest;
  }
}

std::expected<void, Error> OutlineBuilder::sort_by_side() {
  std::array<std::uint32_t, 5> count{};
  for (const std::uint8_t side : side_of_) ++count[side];
  std::uint32_t begin = 0;
  std::array<std::uint32_t, 5> next{};
  for (int i = 0; i < 5; ++i) {
    next[i] = begin;
    if (i < 4) {
      sides_[i].begin = begin, sides_[i].count = count[i];
      if (count[i] < fewest_points) return std::unexpected(Error::too_few_points);
    }
    begin += count[i];
  }
  order_.resize(points_.size());
  for (std::uint32_t p = 0; p < points_.size(); ++p) order_[next[side_of_[p]]++] = p;
  return {};
}

namespace {

// The integral over [0, 1] of the squared derivative of order 2 or 3 of the spline with coefficients c is c'
// P c. Order 2 costs a straight side nothing, order 3 a parabola.
SideMatrix roughness(std::span<const double> knots, int control, int order) {
  SideMatrix p = SideMatrix::Zero(control, control);
  for (int k = cubic; k < control; ++k) {
    const double h = knots[k + 1] - knots[k];
    const BasisValues start = cubic_basis(knots, k, knots[k]), end = cubic_basis(knots, k, knots[k + 1]);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const double a0 = start.second[i], a1 = end.second[i], b0 = start.second[j], b1 = end.second[j];
        p(k - cubic + i, k - cubic + j) +=
            order == 2 ? h * (2 * a0 * b0 + 2 * a1 * b1 + a0 * b1 + a1 * b0) / 6 : (a1 - a0) * (b1 - b0) / h;
      }
    }
  }
  return p;
}

constexpr std::array<int, 2> roughness_orders{2, 3};
constexpr int stiffnesses = 12;  // 1e-7 to 1e4, each ten times the one before
constexpr int trials = static_cast<int>(roughness_orders.size()) * stiffnesses;
constexpr int trials_a_step = 6;

}  // namespace

void OutlineBuilder::begin_pass() {
  const int n = settings_.spans + cubic;
  SidePass& pass = *side_pass_;
  pass = {.a = SideMatrix::Zero(n, n), .b = SideVector::Zero(n)};
  pass.least = std::numeric_limits<double>::infinity();
  Side& side = sides_[side_];
  side.squares = side.weights = side.largest = 0;
}

// The normal equations of the next points; true when all of the side's are in.
bool OutlineBuilder::add_points(std::span<const std::uint32_t> members) {
  SidePass& pass = *side_pass_;
  const Side& side = sides_[side_];
  const std::vector<double>& knots = outline_.sides[0].knots;
  const std::size_t end = std::min(members.size(), pass.next + points_a_step);
  for (; pass.next < end; ++pass.next) {
    const std::uint32_t i = members[pass.next];
    const double r = std::abs(residual_[i]);
    double weight = 1;
    if (pass_ == 1) weight = side.scale / std::max(r, side.scale);
    if (pass_ > 1) weight = tukey_weight(r, side.scale);
    if (weight == 0) continue;
    const double share = std::clamp(side.share_at(points_[i]), 0.0, 1.0), z = side.offset_at(points_[i]);
    const int k = find_span(knots, share);
    const BasisValues basis = cubic_basis(knots, k, share);
    for (int p = 0; p < 4; ++p) {
      pass.b[k - cubic + p] += weight * basis.value[p] * z;
      for (int q = 0; q < 4; ++q)
        pass.a(k - cubic + p, k - cubic + q) += weight * basis.value[p] * basis.value[q];
    }
    pass.zz += weight * z * z, pass.total += weight;
  }
  return pass.next == members.size();
}

// Solves (A + stiffness P) c = b for the kind of roughness and the stiffness that generalized
// cross-validation likes best: a straight or evenly bent side takes two or three degrees of freedom from its
// noise, not seven. True when all have been tried.
bool OutlineBuilder::try_stiffnesses() {
  SidePass& pass = *side_pass_;
  const std::vector<double>& knots = outline_.sides[0].knots;
  for (int tried = 0; tried < trials_a_step && pass.trial < trials;
       ++tried, ++pass.trial, pass.stiffness *= 10) {
    if (pass.trial % stiffnesses == 0) {
      const int order = roughness_orders[static_cast<std::size_t>(pass.trial / stiffnesses)];
      pass.roughness = roughness(knots, static_cast<int>(pass.b.size()), order);
      pass.unit = pass.a.trace() / pass.roughness.trace();
      pass.stiffness = 1e-7;
    }
    const Eigen::LLT<SideMatrix> factor(pass.a + pass.stiffness * pass.unit * pass.roughness);
    if (factor.info() != Eigen::Success) continue;
    const SideVector c = factor.solve(pass.b);
    const double residual = std::max(0.0, pass.zz - 2 * c.dot(pass.b) + c.dot(pass.a * c));
    const double freedom = pass.total - dof_inflation * factor.solve(pass.a).trace();
    if (freedom <= 0) continue;
    const double score = residual / (freedom * freedom);
    if (score < pass.least) pass.least = score, pass.best = c;
  }
  return pass.trial == trials;
}

// The residuals of the next points; true when all of the side's are there.
bool OutlineBuilder::look_at_residuals(std::span<const std::uint32_t> members) {
  SidePass& pass = *side_pass_;
  const Side& side = sides_[side_];
  const std::vector<double>& knots = outline_.sides[0].knots;
  const std::size_t end = std::min(members.size(), pass.next + points_a_step);
  for (; pass.next < end; ++pass.next) {
    const std::uint32_t i = members[pass.next];
    residual_[i] = side.offset_at(points_[i]) - side.height_at(knots, side.share_at(points_[i]));
    scratch_.push_back(std::abs(residual_[i]));
  }
  return pass.next == members.size();
}

// A piece of one pass; true when it was the side's last pass and is done.
std::expected<bool, Error> OutlineBuilder::fit_pass() {
  Side& side = sides_[side_];
  SidePass& pass = *side_pass_;
  const std::span<const std::uint32_t> members(order_.data() + side.begin, side.count);
  switch (pass.stage) {
    case SidePass::Stage::add:
      if (pass.next == 0) begin_pass();
      if (!add_points(members)) return false;
      if (pass.total < fewest_points - 1.0) return std::unexpected(Error::too_few_points);
      pass.stage = SidePass::Stage::solve;
      return false;
    case SidePass::Stage::solve:
      if (!try_stiffnesses()) return false;
      if (pass.best.size() == 0) return std::unexpected(Error::singular);
      side.height = pass.best;
      scratch_.clear();
      pass.next = 0;
      pass.stage = SidePass::Stage::look;
      return false;
    case SidePass::Stage::look:
      if (!look_at_residuals(members)) return false;
      pass.next = 0;
      pass.stage = SidePass::Stage::add;
      return end_pass(members);
  }
  return false;
}

bool OutlineBuilder::end_pass(std::span<const std::uint32_t> members) {
  Side& side = sides_[side_];
  std::nth_element(scratch_.begin(), scratch_.begin() + scratch_.size() / 2, scratch_.end());
  // A side of nearly perfect points must not turn its smallest residuals into outliers.
  side.scale = std::max(1.4826 * scratch_[scratch_.size() / 2], 0.3 * settings_.noise_mm);
  if (++pass_ < passes) return false;
  for (const std::uint32_t i : members) {
    const double r = std::abs(residual_[i]), weight = tukey_weight(r, side.scale);
    side.squares += weight * r * r, side.weights += weight;
    if (weight > 0) side.largest = std::max(side.largest, r);
  }
  pass_ = 0;
  return true;
}

// Neighbouring sides meet where their end tangents cross. The sides are moved to the new corners with their
// shape kept: their heights over the new chord follow by the next round's fit.
std::expected<void, Error> OutlineBuilder::meet_corners() {
  struct Ray {
    Eigen::Vector2d point, direction;
  };
  const std::vector<double>& knots = outline_.sides[0].knots;
  const int n = settings_.spans + cubic;
  const auto end_ray = [&](const Side& side, bool at_last) {
    const Eigen::Vector2d left(-side.along.y(), side.along.x());
    const double h = at_last ? side.height[n - 1] : side.height[0];
    const double run = at_last ? greville(knots, n - 1) - greville(knots, n - 2) : greville(knots, 1);
    const double rise = at_last ? side.height[n - 1] - side.height[n - 2] : side.height[1] - side.height[0];
    return Ray{side.start + (at_last ? side.length : 0.0) * side.along + h * left,
               (run * side.length * side.along + rise * left).normalized()};
  };
  std::array<Eigen::Vector2d, 4> corners;
  for (int i = 0; i < 4; ++i) {
    const Ray in = end_ray(sides_[(i + 3) % 4], true), out = end_ray(sides_[i], false);
    const double sine = cross(in.direction, out.direction);
    if (std::abs(sine) < 0.1) return std::unexpected(Error::collinear);
    corners[i] = in.point + cross(out.point - in.point, out.direction) / sine * in.direction;
    if (!corners[i].allFinite()) return std::unexpected(Error::not_finite);
  }
  outline_.corners = corners;
  for (int i = 0; i < 4; ++i) {
    Side& side = sides_[i];
    const Eigen::Vector2d old_start = side.start, old_along = side.along;
    const double old_length = side.length;
    const SideVector old_height = side.height;
    const Eigen::Vector2d left(-old_along.y(), old_along.x());
    side.set_chord(corners[i], corners[(i + 1) % 4]);
    if (!(side.length > 1)) return std::unexpected(Error::collinear);
    for (int c = 0; c < n; ++c) {
      const Eigen::Vector2d p =
          old_start + greville(knots, c) * old_length * old_along + old_height[c] * left;
      side.height[c] = side.offset_at(p);
    }
  }
  return {};
}

void OutlineBuilder::finish() {
  const int n = settings_.spans + cubic;
  double squares = 0, weights = 0;
  outline_.max_mm = 0;
  for (int i = 0; i < 4; ++i) {
    const Side& side = sides_[i];
    const Eigen::Vector2d left(-side.along.y(), side.along.x());
    PlanCurve& curve = outline_.sides[i];
    for (int c = 0; c < n; ++c) {
      const double g = greville(curve.knots, c);
      curve.control[c] = side.start + g * side.length * side.along + side.height[c] * left;
    }
    // Both neighbours end in the corner itself; after three rounds this moves them by microns.
    curve.control.front() = outline_.corners[i];
    curve.control.back() = outline_.corners[(i + 1) % 4];
    squares += side.squares, weights += side.weights;
    outline_.max_mm = std::max(outline_.max_mm, side.largest);
  }
  outline_.rms_mm = weights > 0 ? std::sqrt(squares / weights) : 0;
}

}  // namespace moldloft::geometry
