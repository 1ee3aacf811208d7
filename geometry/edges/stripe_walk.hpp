// One stripe walked from point to point and cut into pieces where its height leaves the line so far. One or
// two points that leave it and come back are outliers and skipped.
//
// What most points are, the next one on a smooth surface, is done for eight stripes at a time (stripe_kernel.hpp);
// the first that is anything else is left to step().
//
// Units        mm
// Cost         about 12 ns a point alone, 3 ns when eight stripes go in turn
// Allocation   none; what is found goes where the constructor is told, one index a good point and one piece
//              for every `fewest_piece_points` points and one more
#pragma once

#include "geometry/edges/plate_runs.hpp"
#include "geometry/edges/stripe_kernel.hpp"
#include "geometry/edges/stripe_line.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace moldloft::geometry {

struct StripePiece {
  std::uint32_t begin, count;  // in the list of good points
};

constexpr std::size_t fewest_piece_points = 4;  // fewer have no slope

class StripeWalk {
 public:
  StripeWalk() = default;
  StripeWalk(const StripeView& stripe, const PlateRunSettings& settings, std::uint32_t* good,
             StripePiece* pieces)
      : x_(stripe.x.data()),
        y_(stripe.y.data()),
        z_(stripe.z.data()),
        size_(stripe.z.size()),
        good_(good),
        pieces_(pieces),
        spacing_(usual_spacing(stripe)),
        noise_(std::max(jump_sigmas * settings.noise_mm, 0.1 * settings.min_step_mm)),
        bridge_mm_(settings.bridge_mm) {
    at_ = size_ == 0 || is_good(0) ? 0 : next_good(0);
    if (at_ < size_) start(at_);
  }

  // Takes the next good point and what belongs to it; false when there is none.
  bool step() {
    at_ = next_good(at_);
    if (at_ >= size_) return false;
    if (y_[at_] - y_before_ > bridge_mm_) {
      start(at_);
    } else if (fits(at_)) {
      filter_.update(y_[at_], z_[at_], spacing_);
      take(at_);
    } else {
      leave_line();
    }
    return true;
  }

  // Walks at most eight stripes further, each by about `points`; true when all have come to their ends.
  static bool walk_in_turn(std::span<StripeWalk> walks, const StripeKernel& kernel, std::size_t points);

  std::span<const std::uint32_t> good() const { return {good_, good_count_}; }
  std::span<const StripePiece> pieces() const { return {pieces_, piece_count_}; }

 private:
  // A height that differs from the line so far by more than this many standard deviations does not continue
  // it: with 50,000 points a frame, 5.5 lets one good point in a thousand frames go, and a point on the
  // plate's side wall has to lie within 0.3 mm of the top to be taken for the plate.
  static constexpr double jump_sigmas = 5.5;
  static constexpr double start_slope = 0.6;  // tan 31 degrees: what a line may be while its slope is unknown
  static constexpr double slope_doubt = 0.1;  // five standard deviations of a slope over the filter's memory
  static constexpr double curvature = 1.0 / 50;  // 1/mm, sharper than any bend that a gap may hide
  static constexpr int slope_known_after = 6;    // points
  static constexpr std::size_t outliers_in_a_row = 2;

  // The stripe's usual distance between neighbouring points, from a sample of them; missing points
  // do not count.
  static double usual_spacing(const StripeView& stripe) {
    std::array<double, 31> sample;
    std::size_t count = 0;
    const std::size_t stride = std::max<std::size_t>(1, stripe.y.size() / sample.size());
    for (std::size_t i = 1; i < stripe.y.size() && count < sample.size(); i += stride) {
      const double dy = stripe.y[i] - stripe.y[i - 1];
      if (std::isfinite(dy) && dy > 0) sample[count++] = dy;
    }
    if (count == 0) return 0.2;
    std::nth_element(sample.begin(), sample.begin() + count / 2, sample.begin() + count);
    return sample[count / 2];
  }

  bool is_good(std::size_t i) const {
    return std::isfinite(z_[i]) && std::isfinite(y_[i]) && std::isfinite(x_[i]);
  }
  std::size_t next_good(std::size_t i) const {
    for (++i; i < size_ && !is_good(i);) ++i;
    return i;
  }
  bool fits(std::size_t i) const {
    const double dy = std::max(0.0, y_[i] - y_before_);
    const double doubt = filter_.count() >= slope_known_after ? slope_doubt : start_slope;
    return std::abs(z_[i] - filter_.predict(y_[i])) <= noise_ + doubt * dy + 0.5 * curvature * dy * dy;
  }
  void take(std::size_t i) {
    good_[good_count_++] = static_cast<std::uint32_t>(i);
    ++pieces_[piece_count_ - 1].count;
    y_before_ = y_[i];
  }
  void start(std::size_t i) {
    if (piece_count_ > 0 && pieces_[piece_count_ - 1].count < fewest_piece_points)
      good_count_ = pieces_[--piece_count_].begin;
    pieces_[piece_count_++] = {good_count_, 0};
    filter_.restart(y_[i], z_[i]);
    take(i);
  }
  // The line is taken up again if the point after the outliers fits, and the one after that confirms it.
  void leave_line() {
    std::size_t back = at_;
    for (std::size_t skipped = 0; skipped < outliers_in_a_row && back < size_; ++skipped) {
      back = next_good(back);
      if (back < size_ && fits(back)) break;
    }
    const bool returns = back < size_ && y_[back] - y_before_ <= bridge_mm_ && fits(back);
    const std::size_t after = returns ? next_good(back) : size_;
    if (!returns || (after < size_ && !fits(after))) return start(at_);
    at_ = back;
    filter_.update(y_[at_], z_[at_], spacing_);
    take(at_);
  }

  // To the next point after which the line is steady; false when the stripe ends before.
  bool step_until_steady() {
    while (step()) {
      if (filter_.is_steady()) return true;
    }
    return false;
  }
  void put_into(StripeLanes& lanes, std::size_t lane) const;
  void take_from(const StripeLanes& lanes, std::size_t lane, std::span<const std::uint8_t> taken);

  const float *x_ = nullptr, *y_ = nullptr, *z_ = nullptr;
  std::size_t size_ = 0, at_ = 0;
  std::uint32_t* good_ = nullptr;
  StripePiece* pieces_ = nullptr;
  std::uint32_t good_count_ = 0, piece_count_ = 0;
  double spacing_ = 0, noise_ = 0, bridge_mm_ = 0, y_before_ = 0;
  HeightFilter filter_;
};

}  // namespace moldloft::geometry
