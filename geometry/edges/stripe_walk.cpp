#include "geometry/edges/stripe_walk.hpp"

namespace moldloft::geometry {

void StripeWalk::put_into(StripeLanes& lanes, std::size_t lane) const {
  lanes.x[lane] = x_ + at_ + 1, lanes.y[lane] = y_ + at_ + 1, lanes.z[lane] = z_ + at_ + 1;
  lanes.y_before[lane] = y_before_, lanes.level[lane] = filter_.level(), lanes.slope[lane] = filter_.slope();
  lanes.spacing[lane] = spacing_, lanes.noise[lane] = noise_, lanes.bridge[lane] = bridge_mm_;
}

void StripeWalk::take_from(const StripeLanes& lanes, std::size_t lane, std::span<const std::uint8_t> taken) {
  std::uint32_t end = good_count_, point = static_cast<std::uint32_t>(at_);
  for (const std::uint8_t lanes_taken : taken) {
    // Counts only when it was there. There is room: no stripe has more good points than points.
    good_[end] = ++point;
    end += lanes_taken >> lane & 1;
  }
  pieces_[piece_count_ - 1].count += end - good_count_;
  good_count_ = end, at_ = point;
  y_before_ = lanes.y_before[lane];
  filter_.follow(y_before_, lanes.level[lane], lanes.slope[lane]);
}

bool StripeWalk::walk_in_turn(std::span<StripeWalk> walks, const StripeKernel& kernel, std::size_t points) {
  constexpr HeightFilter::Gains gain = HeightFilter::steady_gains();
  constexpr SmoothLine line{slope_doubt, 0.5 * curvature, gain.level, gain.slope, HeightFilter::max_slope};
  StripeLanes lanes;
  std::array<std::uint8_t, 512> taken;
  std::array<StripeWalk*, StripeLanes::count> on_lane;
  std::size_t walking = 0;
  for (StripeWalk& walk : walks) {
    const bool goes_on = walk.piece_count_ > 0 && walk.filter_.is_steady() ? walk.at_ + 1 < walk.size_
                                                                           : walk.step_until_steady();
    if (!goes_on) continue;
    on_lane[walking] = &walk;
    walk.put_into(lanes, walking++);
  }
  while (walking > 0 && points > 0) {
    // A lane without a stripe repeats the first one's.
    for (std::size_t k = walking; k < StripeLanes::count; ++k) on_lane[0]->put_into(lanes, k);
    std::size_t at_most = std::min(points, taken.size());
    for (std::size_t k = 0; k < walking; ++k)
      at_most = std::min(at_most, on_lane[k]->size_ - on_lane[k]->at_ - 1);
    unsigned stopped = 0;
    const int gone = kernel.go_on(lanes, line, static_cast<int>(at_most), taken.data(), stopped);
    points -= static_cast<std::size_t>(gone);
    for (std::size_t k = walking; k-- > 0;) {
      StripeWalk& walk = *on_lane[k];
      walk.take_from(lanes, k, std::span{taken}.first(static_cast<std::size_t>(gone)));
      const bool at_end = walk.at_ + 1 == walk.size_;
      if (at_end || ((stopped >> k & 1) != 0 && !walk.step_until_steady())) {
        on_lane[k] = on_lane[--walking];
        if (k < walking) on_lane[k]->put_into(lanes, k);
        continue;
      }
      walk.put_into(lanes, k);
    }
  }
  return walking == 0;
}

}  // namespace moldloft::geometry
