#include "geometry/fit/greville.hpp"

#include <Eigen/LU>

namespace moldloft::geometry {
namespace {

// The value of each basis function at each place.
Eigen::MatrixXd collocation(const std::vector<double>& knots) {
  const auto places = greville_places(knots);
  const auto count = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd basis(count, count);
  HeightCurve one{knots, std::vector<HeightCurve::Point>(places.size(), HeightCurve::Point::Zero())};
  for (Eigen::Index k = 0; k < count; ++k) {
    one.control[static_cast<std::size_t>(k)][0] = 1;
    for (Eigen::Index i = 0; i < count; ++i) basis(i, k) = one.value(places[static_cast<std::size_t>(i)])[0];
    one.control[static_cast<std::size_t>(k)][0] = 0;
  }
  return basis;
}

}  // namespace

std::vector<double> greville_places(const std::vector<double>& knots) {
  std::vector<double> places;
  for (std::size_t i = 1; i + 3 < knots.size(); ++i)
    places.push_back((knots[i] + knots[i + 1] + knots[i + 2]) / 3);
  return places;
}

BSplineSurface surface_through(const std::vector<double>& knots_u, const std::vector<double>& knots_v,
                               const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& z) {
  const Eigen::PartialPivLU<Eigen::MatrixXd> along_u{collocation(knots_u)}, along_v{collocation(knots_v)};
  const auto net = [&](const Eigen::MatrixXd& values) -> Eigen::MatrixXd {
    const Eigen::MatrixXd half = along_u.solve(values);
    return along_v.solve(half.transpose()).transpose();
  };
  BSplineSurface s;
  s.knots_u = knots_u, s.knots_v = knots_v;
  s.x = net(x), s.y = net(y), s.z = net(z);
  return s;
}

}  // namespace moldloft::geometry
