#include "firmware_like/results/plate_field.hpp"

#include <Eigen/Eigenvalues>

namespace moldloft::firmware_like {

PlateField shape_field(const geometry::BSplineSurface& surface, int count) {
  PlateField field;
  field.count_u = field.count_v = count;
  field.title = "Shape: height over the best-fit plane";
  field.unit = "mm";
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) points.push_back(surface.at((i + 0.5) / count, (j + 0.5) / count).value);
  }
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto& p : points) centre += p / static_cast<double>(points.size());
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const auto& p : points) moments += (p - centre) * (p - centre).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes{moments};
  Eigen::Vector3d normal = axes.eigenvectors().col(0);
  if (normal.z() < 0) normal = -normal;
  for (const auto& p : points) field.values.push_back(normal.dot(p - centre));
  return field;
}

}  // namespace moldloft::firmware_like
