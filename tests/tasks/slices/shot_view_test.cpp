#include "tasks/slices/shot_view.hpp"

#include "tasks/flat_world.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>

using namespace moldloft;
using namespace moldloft::tasks;

namespace {

// A corner of the plate and the table beside it.
hal::Frame corner_of_a_plate() {
  FlatWorld world{.outline = {{-200, -150}, {20, -150}, {20, 10}, {-200, 10}}};
  hal::Frame frame{100, 50000};
  world.expose(geometry::turned_about_z(0.6, {0, 0, 100}), frame);
  return frame;
}

// A driver whose frame arrives and is unpacked as the test wants it. What is not there yet is something else.
class ArrivingFrame final : public hal::Scanner {
 public:
  explicit ArrivingFrame(const hal::Frame& whole) : whole_{whole}, frame_{whole} {
    std::ranges::fill(frame_.z, 17.0f);
    std::ranges::fill(frame_.y, -3.0f);
  }
  void arrive(std::size_t points) { arrived_ = std::min<std::size_t>(arrived_ + points, whole_.point_count); }
  bool is_whole() const { return arrived_ == whole_.point_count; }

  const hal::Frame& frame() const override { return frame_; }
  void unpack(std::size_t at_most) override {
    for (const std::size_t end = unpacked_ + std::min(at_most, packed()); unpacked_ < end; ++unpacked_) {
      frame_.y[unpacked_] = whole_.y[unpacked_];
      frame_.z[unpacked_] = whole_.z[unpacked_];
    }
  }
  std::size_t unpacked() const override { return unpacked_; }
  std::size_t packed() const override { return arrived_ - unpacked_; }

  void start(hal::Instant) override {}
  void receive(hal::Instant) override {}
  void transmit(hal::Instant) override {}
  bool trigger(std::uint32_t, hal::Instant) override { return false; }
  void forget_shot() override {}
  std::optional<hal::ScannerEvent> next_event() override { return std::nullopt; }
  hal::ScannerState state() const override { return hal::ScannerState::ready; }
  const hal::ScannerInfo& info() const override { return info_; }
  std::uint64_t frame_offset() const override { return 0; }
  std::uint32_t frame_bytes() const override { return 0; }
  std::string_view why() const override { return ""; }
  std::size_t plan_bytes() const override { return 0; }

 private:
  const hal::Frame& whole_;
  hal::Frame frame_;
  hal::ScannerInfo info_;
  std::size_t arrived_ = 0, unpacked_ = 0;
};

const ShotView::Request on_the_plate{.hint = {-20, 0, -94}, .reach_mm = 18};

int steps_to_the_end(ShotView& view) {
  int steps = 0;
  while (!view.waits() && !view.step()) ++steps;
  return steps;
}

void check_same(const ShotView& a, const ShotView& b) {
  REQUIRE(a.runs().size() == b.runs().size());
  for (std::size_t i = 0; i < a.runs().size(); ++i) {
    CHECK(a.runs()[i].stripe == b.runs()[i].stripe);
    CHECK(a.runs()[i].first == b.runs()[i].first);
    CHECK(a.runs()[i].last == b.runs()[i].last);
    CHECK(a.runs()[i].edge_last == b.runs()[i].edge_last);
  }
  REQUIRE(a.boundary().points.size() == b.boundary().points.size());
  REQUIRE(a.boundary().pieces.size() == b.boundary().pieces.size());
  for (std::size_t i = 0; i < a.boundary().pieces.size(); ++i)
    CHECK(a.boundary().pieces[i].corner == b.boundary().pieces[i].corner);
}

}  // namespace

TEST_CASE("a look that begins while the frame arrives sees what a look at the whole frame sees") {
  const hal::Frame whole = corner_of_a_plate();
  ShotView once{100, 50000, {}};
  once.begin(whole, on_the_plate);
  const int steps_at_once = steps_to_the_end(once);
  REQUIRE(once.found());
  REQUIRE(once.boundary().pieces.size() == 1);
  CHECK(once.boundary().pieces[0].kind == geometry::BoundaryPiece::Kind::corner);

  for (const std::size_t points_a_tick : {50000u, 12000u, 4000u, 3999u, 500u, 77u}) {
    for (const bool unpacked_by_others : {false, true}) {
      CAPTURE(points_a_tick);
      CAPTURE(unpacked_by_others);
      ArrivingFrame frame{whole};
      ShotView view{100, 50000, {}};
      view.begin(frame.frame(), on_the_plate, &frame);
      CHECK(view.waits());
      int last = 0;
      while (!frame.is_whole()) {
        CHECK(view.waits());
        frame.arrive(points_a_tick);
        if (unpacked_by_others) frame.unpack(points_a_tick);
        last = steps_to_the_end(view);
      }
      CHECK_FALSE(view.waits());
      CHECK(view.step());
      check_same(view, once);
      // Left after the last point: to unpack it, to cut the last one or two of 13 groups of stripes, in four steps
      // each, and to find the plate among the runs.
      if (points_a_tick <= 4000) CHECK(last <= steps_at_once - 11 * 4 + 2);
    }
  }
}

TEST_CASE("a look at nothing ends, and waits for nothing") {
  hal::Frame empty{100, 50000};
  ArrivingFrame frame{empty};
  ShotView view{100, 50000, {}};
  view.begin(frame.frame(), on_the_plate, &frame);
  CHECK_FALSE(view.waits());
  CHECK(steps_to_the_end(view) < 10);
  CHECK_FALSE(view.found());
}
