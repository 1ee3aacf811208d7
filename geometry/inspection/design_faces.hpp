// The design of a plate as one or several faces, trimmed or not: the nearest place on all of them, and the border that
// they have together. What CAD delivers is seldom one rectangle of parameters.
//
// Up           all faces are turned to the side of the largest one's normal; signed distances are positive on that side
// Border       samples along the border of the whole: where two faces meet within `seam_mm` there is none
// Frame        the design's, mm
// Cost         foot() 0.15..0.3 us for one face without trims; each further face or trim adds as much. Built in some ms
// Allocation   in from() only
// Failure      from(): the Flaw says which face. too_few_points (no face at all, or a face that is not a bicubic net),
//              knots_not_increasing, not_finite; outside_domain: a trim that leaves the face's knots;
//              self_crossing: a trim of up to 20,000 corners that
//              crosses itself; singular_parametrization: a face without area; too_large: beyond
//              1e7 mm; no_border: the same face twice, or a tube
#pragma once

#include "geometry/error.hpp"
#include "geometry/inspection/foot_point.hpp"
#include "geometry/inspection/prepared_surface.hpp"

#include <expected>
#include <optional>
#include <span>
#include <vector>

namespace moldloft::geometry {

using TrimPolygon = std::vector<Eigen::Vector2d>;  // closed, in (u, v); the last point is joined to the first

struct DesignFace {
  BSplineSurface surface;
  std::vector<TrimPolygon> trims = {};  // first the outer one; empty: the rectangle of the knots
};

struct DesignFoot {
  Eigen::Vector3d point, normal;  // normal: to the up side
  double signed_mm = 0;           // positive above; beyond the border over the tangent plane there
  double overhang_mm = 0;         // how far beyond the border, 0 inside
  double u = 0, v = 0;
  int face = 0;
  bool converged = false;
};

struct BorderSample {
  Eigen::Vector3d at,
      outward;               // outward: the unit vector in the tangent plane that leads away from the plate
  double length_mm = 0;      // of the border that it stands for
  Eigen::Vector2d uv, step;  // its place in the face, and the way to the next one
  int face = 0;
};

class DesignFaces {
 public:
  static constexpr double seam_mm = 0.1;

  static std::expected<DesignFaces, Flaw> from(std::span<const DesignFace>);

  DesignFoot foot(const Eigen::Vector3d& p) const;

  const std::vector<BorderSample>& border() const { return border_; }
  // The place of the border nearest to p: the nearest sample, moved along the border's curve. About 1 us.
  BorderSample border_near(const Eigen::Vector3d& p) const;
  const Eigen::Vector3d& centroid() const { return centroid_; }  // of the area
  const Eigen::Vector3d& up() const { return up_; }              // mean normal
  double area_mm2() const { return area_; }
  int count() const { return static_cast<int>(faces_.size()); }
  const PreparedSurface& surface(int face) const { return faces_[static_cast<std::size_t>(face)].surface; }
  double sign(int face) const { return faces_[static_cast<std::size_t>(face)].sign; }
  bool is_on(int face, double u, double v) const;  // inside its trims

  // The place with the given coordinates across `up`, a unit vector: where a line along it meets the design. Near the
  // border the nearest face goes on as its tangent plane for `reach_mm`. nullopt: there is none.
  struct Crossing {
    Eigen::Vector3d point, normal;
    double u = 0, v = 0;
    int face = 0;
  };
  std::optional<Crossing> crossing(const Eigen::Vector3d& through, const Eigen::Vector3d& up,
                                   double reach_mm) const;

 private:
  struct Face {
    PreparedSurface surface;
    std::vector<TrimPolygon> trims;
    std::vector<BorderSample> border;  // of this face alone
    double sign = 1;
    Eigen::Vector3d mean_normal, centroid;
    double area = 0;

    bool weigh();  // false: no area
  };
  void join(std::size_t largest);
  DesignFoot foot_on(int face, const Eigen::Vector3d& p) const;

  std::vector<Face> faces_;
  std::vector<BorderSample> border_;
  Eigen::Vector3d centroid_, up_;
  double area_ = 0;
};

}  // namespace moldloft::geometry
