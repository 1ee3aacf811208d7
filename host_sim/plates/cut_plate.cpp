#include "host_sim/plates/cut_plate.hpp"

#include "host_sim/base/plan_polygon.hpp"
#include "host_sim/plates/outline_grid.hpp"

#include <algorithm>
#include <utility>

namespace moldloft::host_sim {

namespace {

class CutPlate final : public Plate {
 public:
  CutPlate(std::string name, std::shared_ptr<const Plate> base, std::vector<Eigen::Vector2d> outline,
           const std::vector<std::vector<Eigen::Vector2d>>& holes)
      : base_(std::move(base)), grid_(outline) {
    name_ = std::move(name);
    outline_ = std::move(outline);
    corners_ = largest_quadrilateral(outline_);
    thickness_mm_ = base_->thickness_mm();
    bounds_ = base_->bounds();  // of the height: what is cut away may have been the highest, by a little
    bounds_.min = bounds_.max = outline_.front();
    for (const auto& p : outline_) {
      bounds_.min = bounds_.min.cwiseMin(p);
      bounds_.max = bounds_.max.cwiseMax(p);
    }
    for (const auto& hole : holes) {
      hole_grids_.emplace_back(hole);
      holes_.emplace_back(hole.rbegin(), hole.rend());
    }
  }

  SurfaceSample sample(double x, double y) const noexcept override { return base_->sample(x, y); }
  bool inside(double x, double y) const noexcept override {
    return grid_.contains(x, y) &&
           std::ranges::none_of(hole_grids_, [&](const OutlineGrid& hole) { return hole.contains(x, y); });
  }

 private:
  std::shared_ptr<const Plate> base_;
  OutlineGrid grid_;
  std::vector<OutlineGrid> hole_grids_;
};

}  // namespace

std::shared_ptr<const Plate> make_cut_plate(std::string name, std::shared_ptr<const Plate> base,
                                            std::vector<Eigen::Vector2d> outline,
                                            const std::vector<std::vector<Eigen::Vector2d>>& holes) {
  return std::make_shared<const CutPlate>(std::move(name), std::move(base), std::move(outline), holes);
}

}  // namespace moldloft::host_sim
