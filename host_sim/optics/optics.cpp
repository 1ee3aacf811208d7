#include "host_sim/optics/optics.hpp"

#include "host_sim/optics/ray_cast.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace moldloft::host_sim {

namespace {

constexpr double largest_drop_out = 0.95;  // even a wall at grazing incidence returns a few points
constexpr double off_wall_mm = 1e-6;       // so that a point on a wall does not hide itself

// How bright a surface looks: its own shade, and the cosine of the laser's incidence.
std::uint8_t intensity_of(Target target, double cosine) {
  const double shade = target == Target::table ? 110.0 : 220.0;
  return static_cast<std::uint8_t>(std::clamp(shade * cosine, 0.0, 255.0));
}

}  // namespace

struct Optics::WorkSpace {
  RayCast cast;
  std::vector<PlanEdge> near_frame, near_stripe, near_shadow;
  std::vector<Eigen::Vector3d> cameras;  // in plate coordinates
  geometry::RigidMotion plate_from_scanner;
};

Optics::Optics(const OpticsSettings& settings) : settings_(settings), work_(std::make_unique<WorkSpace>()) {
  for (auto* list : {&work_->near_frame, &work_->near_stripe, &work_->near_shadow}) list->reserve(4096);
  work_->cameras.reserve(settings.cameras.size());
}
Optics::~Optics() = default;
Optics::Optics(Optics&&) noexcept = default;

Eigen::Vector3d Optics::half_extent_mm() const noexcept {
  const double widening = 1.0 + settings_.depth_mm / settings_.height_mm;
  const double room = 1.0;  // noise moves a point along its ray
  return {0.5 * settings_.field_x_mm * widening + room, 0.5 * settings_.field_y_mm * widening + room,
          settings_.depth_mm + room};
}

namespace {

// One exposure under way: everything that the loops over planes and rays need.
class Exposure {
 public:
  Exposure(const OpticsSettings& s, const RayCast& cast, const std::vector<Eigen::Vector3d>& cameras,
           const geometry::RigidMotion& plate_from_scanner, Random& random)
      : s_(s), cast_(cast), cameras_(cameras), plate_from_scanner_(plate_from_scanner), random_(random) {
    projector_ = plate_from_scanner * Eigen::Vector3d{0.0, 0.0, s.height_mm};
  }

  double x_at(int stripe) const { return s_.field_x_mm * ((stripe + 0.5) / s_.stripes - 0.5); }
  double y_at(int point) const { return s_.field_y_mm * ((point + 0.5) / s_.points_per_stripe - 0.5); }
  Ray ray_through(double x, double y) const {
    return {projector_, plate_from_scanner_ * Eigen::Vector3d{x, y, 0.0} - projector_};
  }
  // Where rays through this part of the field pass between the plate's top and the table.
  PlanWindow window(double x_low, double x_high) const {
    const double y = 0.5 * s_.field_y_mm;
    std::array<Eigen::Vector2d, 8> points;
    std::size_t k = 0;
    for (const double px : {x_low, x_high}) {
      for (const double py : {-y, y}) {
        const Ray ray = ray_through(px, py);
        const auto [begin, end] = cast_.slab(ray);
        points[k++] = ray.at(begin).head<2>();
        points[k++] = ray.at(end).head<2>();
      }
    }
    return window_of(points);
  }

  // One laser plane into the frame's columns from `first` on.
  void stripe(int index, int every_point, std::span<const PlanEdge> edges,
              std::span<const PlanEdge> shadow_edges, hal::Frame& frame, std::size_t first) {
    const double x = x_at(index);
    double guess = 1.0;
    const bool in = cast_.starts_inside(ray_through(x, y_at(0)));
    for (int j = 0; j < s_.points_per_stripe; j += every_point) {
      const double y = y_at(j);
      const Ray ray = ray_through(x, y);
      const Hit hit = !edges.empty() ? cast_.first_hit(ray, edges, guess)
                      : in           ? cast_.hit_inside(ray, guess)
                                     : cast_.hit_table(ray);
      if (hit.target == Target::top) guess = hit.t;
      record(hit, ray, shadow_edges, frame, first++, x, y);
    }
  }

 private:
  void record(const Hit& hit, const Ray& ray, std::span<const PlanEdge> shadow_edges, hal::Frame& frame,
              std::size_t at, double x, double y) {
    constexpr float missing = std::numeric_limits<float>::quiet_NaN();
    frame.x[at] = frame.y[at] = frame.z[at] = missing;
    frame.intensity[at] = 0;
    if (std::abs(1.0 - hit.t) * s_.height_mm > s_.depth_mm) return;
    const double length = ray.direction.norm();
    const double cosine = -ray.direction.dot(hit.normal) / length;
    if (!(cosine > 0) || !seen(hit, ray, shadow_edges)) return;
    if (random_.uniform() < drop_out(hit, ray, cosine, length)) return;
    double along = random_.normal() * s_.noise_mm;
    if (random_.uniform() < s_.outliers) along += random_.normal() * s_.outlier_mm;
    const double t = hit.t + along / length;  // the ray runs from (0, 0, H) at 0 through (x, y, 0) at 1
    frame.x[at] = static_cast<float>(t * x);
    frame.y[at] = static_cast<float>(t * y);
    frame.z[at] = static_cast<float>((1.0 - t) * s_.height_mm);
    frame.intensity[at] = intensity_of(hit.target, cosine);
  }

  bool seen(const Hit& hit, const Ray& ray, std::span<const PlanEdge> shadow_edges) const {
    const Eigen::Vector3d point = ray.at(hit.t) + off_wall_mm * hit.normal;
    return std::any_of(cameras_.begin(), cameras_.end(), [&](const Eigen::Vector3d& camera) {
      if ((camera - point).dot(hit.normal) <= 0) return false;  // the surface looks away from it
      // The top is flat compared with the cameras' height: nothing on it hides another part of it.
      if (hit.target == Target::top || shadow_edges.empty()) return true;
      return !cast_.hidden(point, camera, shadow_edges);
    });
  }

  double drop_out(const Hit& hit, const Ray& ray, double cosine, double length) const {
    double share = s_.drop_out + s_.slope_drop_out * (1.0 / cosine - 1.0);
    if (s_.gloss > 0 && hit.target == Target::top) {
      const Eigen::Vector3d in = ray.direction / length;
      const Eigen::Vector3d mirrored = in - 2.0 * in.dot(hit.normal) * hit.normal;
      for (const auto& camera : cameras_) {
        const double away2 =
            2.0 - 2.0 * mirrored.dot((camera - ray.at(hit.t)).normalized());  // about the angle squared
        share += s_.gloss * std::max(0.0, 1.0 - away2 / (s_.glare * s_.glare));
      }
    }
    return std::min(share, largest_drop_out);
  }

  const OpticsSettings& s_;
  const RayCast& cast_;
  const std::vector<Eigen::Vector3d>& cameras_;
  const geometry::RigidMotion& plate_from_scanner_;
  Random& random_;
  Eigen::Vector3d projector_;
};

}  // namespace

void Optics::expose(const PlateInstance& plate, const geometry::RigidMotion& world_from_scanner,
                    Random& random, const Raster& raster, hal::Frame& frame) noexcept {
  auto& w = *work_;
  w.plate_from_scanner = plate.world_from_plate().inverse() * world_from_scanner;
  w.cast.look_at(plate);
  w.cameras.clear();
  double farthest = 0;  // a camera's distance from the projector
  for (const auto& camera : settings_.cameras) {
    w.cameras.push_back(w.plate_from_scanner * camera);
    farthest = std::max(farthest, (camera - Eigen::Vector3d{0.0, 0.0, settings_.height_mm}).norm());
  }

  Exposure exposure(settings_, w.cast, w.cameras, w.plate_from_scanner, random);
  const double x_edge = 0.5 * settings_.field_x_mm;
  PlanWindow window = exposure.window(-x_edge, x_edge);
  w.cast.edges_within(window, w.cast.all_edges(), w.near_frame);
  // A line of sight leaves the slab at most this far from its foot: it leans no more than camera
  // and field together.
  const double lean = (farthest + settings_.field_x_mm + settings_.field_y_mm) / (0.8 * settings_.height_mm);
  const double reach = lean * (w.cast.z_max() - w.cast.table_z());
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(reach);
  w.cast.edges_within({window.low - around, window.high + around}, w.cast.all_edges(), w.near_shadow);

  std::uint32_t first = 0, stripes = 0;
  for (int i = 0; i < settings_.stripes; i += raster.every_stripe) {
    const int points = (settings_.points_per_stripe + raster.every_point - 1) / raster.every_point;
    const double x = exposure.x_at(i);
    w.near_stripe.clear();
    if (!w.near_frame.empty()) w.cast.edges_within(exposure.window(x, x), w.near_frame, w.near_stripe);
    frame.stripes[stripes++] = {static_cast<std::uint16_t>(i), first, static_cast<std::uint32_t>(points)};
    exposure.stripe(i, raster.every_point, w.near_stripe, w.near_shadow, frame, first);
    first += static_cast<std::uint32_t>(points);
  }
  frame.stripe_count = stripes;
  frame.point_count = first;
}

}  // namespace moldloft::host_sim
