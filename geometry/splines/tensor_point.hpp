// The sum that evaluates a surface of any degrees: a patch of the net between the basis along u and
// that along v.
//
// Cost         9 (p + 1) (q + 1) multiplications and additions for each axis
// Allocation   none
#pragma once

#include "geometry/splines/bspline.hpp"

#include <Eigen/Core>

namespace moldloft::geometry {

struct TensorBasis {
  const double* values;  // `width` values, then as many first, then as many second derivatives
  int width;
};

// `row` and `column`: the control point of the net that the first functions belong to.
inline SurfacePoint tensor_point(TensorBasis u, TensorBasis v, const Eigen::MatrixXd& x,
                                 const Eigen::MatrixXd& y, const Eigen::MatrixXd& z, Eigen::Index row,
                                 Eigen::Index column) {
  SurfacePoint point;
  const Eigen::MatrixXd* nets[3] = {&x, &y, &z};
  const double *n = u.values, *m = v.values;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Index stride = nets[axis]->rows();
    const double* patch = nets[axis]->data() + row + column * stride;
    double value = 0, du = 0, dv = 0, duu = 0, duv = 0, dvv = 0;
    for (int j = 0; j < v.width; ++j) {
      double sum = 0, sum_u = 0, sum_uu = 0;
      for (int i = 0; i < u.width; ++i) {
        const double p = patch[j * stride + i];
        sum += n[i] * p, sum_u += n[u.width + i] * p, sum_uu += n[2 * u.width + i] * p;
      }
      value += m[j] * sum, du += m[j] * sum_u, duu += m[j] * sum_uu;
      dv += m[v.width + j] * sum, duv += m[v.width + j] * sum_u, dvv += m[2 * v.width + j] * sum;
    }
    point.value[axis] = value, point.du[axis] = du, point.dv[axis] = dv;
    point.duu[axis] = duu, point.duv[axis] = duv, point.dvv[axis] = dvv;
  }
  return point;
}

}  // namespace moldloft::geometry
