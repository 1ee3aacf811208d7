#include "host_sim/plates/plate_shape.hpp"

#include "host_sim/base/plan_polygon.hpp"
#include "host_sim/base/portable_math.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace moldloft::host_sim {

namespace {

constexpr std::array<std::string_view, 6> shapes = {"flat", "cylinder", "saddle", "twist", "dome", "wave"};
constexpr std::array<std::string_view, 4> outlines = {"square", "rectangle", "trapezoid", "parallelogram"};

template <typename Enum, std::size_t count>
std::expected<Enum, SimError> named(std::string_view name, const std::array<std::string_view, count>& names,
                                    std::string_view what) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<Enum>(found - names.begin());
  return std::unexpected(
      SimError{fmt::format("no {} is called '{}': choose {}", what, name, fmt::join(names, ", "))});
}

double or_default(double value, double fallback) { return value > 0 ? value : fallback; }

class FormedPlate final : public Plate {
 public:
  explicit FormedPlate(const PlateDescription& d) : shape_(d.shape), amplitude_(d.amplitude_mm) {
    name_ = shapes[static_cast<std::size_t>(d.shape)];
    corners_ = d.corners;
    outline_.assign(corners_.begin(), corners_.end());
    thickness_mm_ = d.thickness_mm;
    bounds_.min = bounds_.max = corners_[0];
    for (const auto& c : corners_) {
      bounds_.min = bounds_.min.cwiseMin(c);
      bounds_.max = bounds_.max.cwiseMax(c);
    }
    middle_ = 0.5 * (bounds_.min + bounds_.max);
    half_ = 0.5 * (bounds_.max - bounds_.min);
    radius_ = shape_ == Shape::dome ? dome_radius() : d.radius_mm;
    if (shape_ == Shape::dome) dome_foot_ = std::sqrt(radius_ * radius_ - 0.5 * half_.squaredNorm());
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d along = corners_[(i + 1) % 4] - corners_[i];
      side_normal_[i] = Eigen::Vector2d{-along.y(), along.x()}.normalized();
      side_offset_[i] = side_normal_[i].dot(corners_[i]);
    }
    find_height_range();
  }

  // A surface that has a slope everywhere inside: a sphere or cylinder must reach past the outline.
  bool is_possible() const {
    const double reach = shape_ == Shape::cylinder ? half_.x() : shape_ == Shape::dome ? half_.norm() : 0.0;
    return (shape_ != Shape::cylinder && shape_ != Shape::dome) || reach < 0.9 * radius_;
  }

  SurfaceSample sample(double x_plan, double y_plan) const noexcept override {
    const double x = x_plan - middle_.x(), y = y_plan - middle_.y();
    const double p = x / half_.x(), q = y / half_.y();
    switch (shape_) {
      case Shape::flat:
        return {};
      case Shape::cylinder: {
        const double root = std::sqrt(std::max(radius_ * radius_ - x * x, 0.01 * radius_ * radius_));
        return {root - radius_, -x / root, 0.0};
      }
      case Shape::saddle:
        return {amplitude_ * (p * p - q * q), 2 * amplitude_ * p / half_.x(),
                -2 * amplitude_ * q / half_.y()};
      case Shape::twist:
        return {amplitude_ * p * q, amplitude_ * q / half_.x(), amplitude_ * p / half_.y()};
      case Shape::dome: {
        const double root = std::sqrt(std::max(radius_ * radius_ - x * x - y * y, 0.01 * radius_ * radius_));
        return {root - dome_foot_, -x / root, -y / root};
      }
      case Shape::wave: {
        constexpr double pi = std::numbers::pi;
        const auto u = portable_sin_cos(pi * p), v = portable_sin_cos(0.5 * pi * q);
        return {amplitude_ * u.sine * v.cosine, amplitude_ * pi / half_.x() * u.cosine * v.cosine,
                -amplitude_ * 0.5 * pi / half_.y() * u.sine * v.sine};
      }
    }
    return {};
  }

  bool inside(double x, double y) const noexcept override {
    for (std::size_t i = 0; i < 4; ++i) {
      if (side_normal_[i].x() * x + side_normal_[i].y() * y < side_offset_[i]) return false;
    }
    return true;
  }

 private:
  // A crown of h = 2 A over the corners, whose distance from the middle is d: R = (d^2 + h^2) / (2 h).
  double dome_radius() const {
    const double crown = 2 * amplitude_;
    return (half_.squaredNorm() + crown * crown) / (2 * crown);
  }

  void find_height_range() {
    constexpr int steps = 200;  // the range is off by a curvature times a squared step: micrometres
    bounds_.z_min = std::numeric_limits<double>::infinity();
    bounds_.z_max = -bounds_.z_min;
    const auto take = [this](const Eigen::Vector2d& p) {
      const double z = height(p.x(), p.y());
      bounds_.z_min = std::min(bounds_.z_min, z);
      bounds_.z_max = std::max(bounds_.z_max, z);
    };
    for (const auto& p : sampled_outline(outline_, 1.0)) take(p);
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; j <= steps; ++j) {
        const Eigen::Vector2d p{bounds_.min.x() + 2 * half_.x() * i / steps,
                                bounds_.min.y() + 2 * half_.y() * j / steps};
        if (inside(p.x(), p.y())) take(p);
      }
    }
  }

  Shape shape_;
  double amplitude_, radius_ = 0, dome_foot_ = 0;
  Eigen::Vector2d middle_, half_;
  std::array<Eigen::Vector2d, 4> side_normal_{};  // inwards
  std::array<double, 4> side_offset_{};
};

}  // namespace

std::span<const std::string_view> shape_names() { return shapes; }
std::span<const std::string_view> outline_names() { return outlines; }

std::expected<Shape, SimError> shape_named(std::string_view name) {
  return named<Shape>(name, shapes, "plate");
}

std::expected<OutlineKind, SimError> outline_named(std::string_view name) {
  return named<OutlineKind>(name, outlines, "outline");
}

std::array<Eigen::Vector2d, 4> outline_corners(OutlineKind kind, const OutlineSizes& sizes) {
  const bool sheared = kind == OutlineKind::parallelogram;
  const double width = or_default(sizes.width_mm, sheared ? 244 : 305);
  double depth = width, top_width = width, shift = 0;  // shift: of the upper side's left end
  switch (kind) {
    case OutlineKind::square:
      depth = or_default(sizes.depth_mm, width);
      break;
    case OutlineKind::rectangle:
      depth = or_default(sizes.depth_mm, 0.75 * width);
      break;
    case OutlineKind::trapezoid:
      depth = or_default(sizes.depth_mm, 254.0 / 305.0 * width);
      top_width = or_default(sizes.top_width_mm, 0.75 * width);
      shift = 0.5 * (width - top_width);
      break;
    case OutlineKind::parallelogram:
      depth = or_default(sizes.depth_mm, width);
      shift = sizes.shear_mm != 0 ? sizes.shear_mm : 0.25 * width;
      break;
  }
  std::array<Eigen::Vector2d, 4> corners = {
      {{0.0, 0.0}, {width, 0.0}, {shift + top_width, depth}, {shift, depth}}};
  Eigen::Vector2d low = corners[0], high = corners[0];
  for (const auto& c : corners) low = low.cwiseMin(c), high = high.cwiseMax(c);
  for (auto& c : corners) c -= 0.5 * (low + high);
  return corners;
}

std::expected<std::shared_ptr<const Plate>, SimError> make_plate(const PlateDescription& description) {
  const auto name = shapes[static_cast<std::size_t>(description.shape)];
  const auto refused = [&](std::string_view why) {
    return std::unexpected(SimError{fmt::format("plate '{}': {}", name, why)});
  };
  for (const auto& c : description.corners) {
    if (!c.allFinite()) return refused("a corner is not a number");
  }
  if (!is_convex(description.corners))
    return refused("its four corners must be convex and counter-clockwise");
  if (!(description.thickness_mm > 0)) return refused("the thickness must be positive");
  if (!std::isfinite(description.amplitude_mm)) return refused("the amplitude must be a number");
  if (description.shape == Shape::dome && !(description.amplitude_mm > 0)) {
    return refused("a dome's amplitude must be positive");
  }
  auto plate = std::make_shared<const FormedPlate>(description);
  if (!plate->is_possible()) return refused("the outline reaches past 0.9 of the radius of curvature");
  return plate;
}

}  // namespace moldloft::host_sim
