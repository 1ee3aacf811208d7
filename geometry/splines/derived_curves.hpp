// Curves that a curve or a surface contains: derivatives, isoparametric lines, and the
// derivatives across them.
//
// Source       thesis section 2.4; The NURBS Book (3.3) for derivatives, (3.14) for lines
// Accuracy     isoparametric lines within 4 p eps of the largest control coordinate, p the degree across;
//              derivatives as the differences that they are: 4 eps of p times the largest control coordinate
//              over the shortest support that is divided by
// Allocation   what is returned
// Failure      none; curves and surfaces must pass check()
#pragma once

#include "geometry/splines/bspline.hpp"

namespace moldloft::geometry {

// c'(t), one degree lower (at least degree 1 is asked for). A kink (an interior knot of full multiplicity)
// becomes a jump, whose upper side counts at the knot itself.
template <int dim>
BSplineCurve<dim> derivative(const BSplineCurve<dim>& curve);

BSplineSurface derivative_u(const BSplineSurface& surface);
BSplineSurface derivative_v(const BSplineSurface& surface);

// The line of constant v as a curve over u, and that of constant u as a curve over v; the parameter is
// clamped to the domain. `across` = 1, 2 ...: instead the derivative of that order in the other direction,
// d^k r / dv^k along u.
SpaceCurve line_along_u(const BSplineSurface& surface, double v, int across = 0);
SpaceCurve line_along_v(const BSplineSurface& surface, double u, int across = 0);

}  // namespace moldloft::geometry
