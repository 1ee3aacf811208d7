#include "firmware_like/results/ply_writer.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>

namespace moldloft::firmware_like {
namespace {

static_assert(std::endian::native == std::endian::little, "the writers copy memory as it lies");

template <typename T>
void put(std::string& out, T value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

}  // namespace

std::string points_ply(const std::vector<MeasuredPoint>& points) {
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment moldloft, registered points of the surface "
      "shots\ncomment unit mm\n"
      "comment frame world\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property float quality\nproperty float scalar_residual\nproperty ushort scalar_shot\n"
      "property ushort scalar_stripe\nend_header\n",
      points.size());
  out.reserve(out.size() + points.size() * 24);
  for (const auto& p : points) {
    for (int axis = 0; axis < 3; ++axis) put(out, p.position[axis]);
    put(out, p.residual_mm);  // as quality
    put(out, p.residual_mm);  // as scalar_residual
    put(out, p.shot);
    put(out, p.stripe);
  }
  return out;
}

std::string boundary_ply(const geometry::BSplineSurface& surface, int points_per_side) {
  const int count = 4 * points_per_side;
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment moldloft, the plate's outline\ncomment unit mm\ncomment "
      "frame world\n"
      "element vertex {0}\nproperty double x\nproperty double y\nproperty double z\nelement edge {0}\n"
      "property int vertex1\nproperty int vertex2\nend_header\n",
      count);
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i % points_per_side) / points_per_side;
    const int side = i / points_per_side;
    const double u = side == 0 ? t : side == 1 ? 1 : side == 2 ? 1 - t : 0;
    const double v = side == 0 ? 0 : side == 1 ? t : side == 2 ? 1 : 1 - t;
    const Eigen::Vector3d p = surface.at(u, v).value;
    for (int axis = 0; axis < 3; ++axis) put(out, p[axis]);
  }
  for (int i = 0; i < count; ++i) {
    put(out, i);
    put(out, (i + 1) % count);
  }
  return out;
}

}  // namespace moldloft::firmware_like
