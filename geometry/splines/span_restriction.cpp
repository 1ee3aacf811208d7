#include "geometry/splines/span_restriction.hpp"

namespace moldloft::geometry {

Eigen::Matrix4d span_restriction(std::span<const double> knots, int k, double a, double b) {
  const double* t = knots.data() + k - 2;  // t[0..5]: the knots that reach into the span
  const double inv1 = 1 / (t[3] - t[2]);
  const double inv20 = 1 / (t[3] - t[1]), inv21 = 1 / (t[4] - t[2]);
  const double inv30 = 1 / (t[3] - t[0]), inv31 = 1 / (t[4] - t[1]), inv32 = 1 / (t[5] - t[2]);

  Eigen::Matrix4d r;
  for (int l = 0; l < 4; ++l) {
    // The recurrence of the basis with an argument of its own at every degree; b comes last, l times.
    const double x1 = l >= 3 ? b : a, x2 = l >= 2 ? b : a, x3 = l >= 1 ? b : a;
    const double q0 = (t[3] - x1) * inv1 * inv20, q1 = (x1 - t[2]) * inv1 * inv21;
    const double c0 = (t[3] - x2) * q0 * inv30;
    const double c1 = ((x2 - t[1]) * q0 + (t[4] - x2) * q1) * inv31;
    const double c2 = (x2 - t[2]) * q1 * inv32;
    r(0, l) = (t[3] - x3) * c0;
    r(1, l) = (x3 - t[0]) * c0 + (t[4] - x3) * c1;
    r(2, l) = (x3 - t[1]) * c1 + (t[5] - x3) * c2;
    r(3, l) = (x3 - t[2]) * c2;
  }
  return r;
}

}  // namespace moldloft::geometry
