// Four Gauss nodes and weights on [0, 1]: exact to degree 7, and a product of two cubics has 6.
//
// Source       roots of the Legendre polynomial of degree 4, moved from [-1, 1]; rounded to the nearest double
#pragma once

#include <array>

namespace moldloft::geometry {

constexpr std::array<double, 4> gauss_node{0.06943184420297371, 0.33000947820757187, 0.66999052179242813,
                                           0.93056815579702629};
constexpr std::array<double, 4> gauss_weight{0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                             0.17392742256872693};

}  // namespace moldloft::geometry
