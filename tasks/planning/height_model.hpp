// A rough idea of the plate's height for placing the scanner: the quadric z = c . (1, x, y, x^2, xy, y^2)
// that fits best what has been seen so far. Good to a few millimetres, which is what the scanner's depth of
// field asks for.
//
// Frame world, mm, coordinates taken relative to the first point. No allocation; add() 40 ns, solve() once 6 x 6.
#pragma once

#include "hal/base/realtime.hpp"

#include <Eigen/Core>

namespace moldloft::tasks {

class HeightModel {
 public:
  void reset() { *this = HeightModel{}; }
  void add(const Eigen::Vector3d& world_point) MOLDLOFT_NONBLOCKING;
  void solve() MOLDLOFT_NONBLOCKING;  // call before at(), after the last add()
  double at(double x_mm, double y_mm) const MOLDLOFT_NONBLOCKING;
  bool empty() const { return count_ == 0; }

 private:
  using Row = Eigen::Matrix<double, 6, 1>;
  Row row(double x_mm, double y_mm) const;
  Eigen::Matrix<double, 6, 6> normal_ = Eigen::Matrix<double, 6, 6>::Zero();
  Row right_ = Row::Zero(), coefficients_ = Row::Zero();
  Eigen::Vector3d origin_{0, 0, 0};
  long count_ = 0;
};

}  // namespace moldloft::tasks
