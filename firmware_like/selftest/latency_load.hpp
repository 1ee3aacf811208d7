// What keeps the controller busy while its timing is measured without devices: the loads of a cell at their
// heaviest. A made-up plate is measured again and again from prepared frames. The plate is found in every
// frame, the outline built, all points folded, and the surface solved. No pause comes between two plates, so
// that the slack of every tick has work. Meanwhile frames come in at the pace of a scanner on a 100 Mb/s
// link, through the tap that records them, and are decoded. Bookkeeping of the cell and the robot's line need
// a cell; they are not here.
//
// Thread       the constructor anywhere, the scheduler's tasks on the control thread; recorder().drain() on one other
// Blocking     never
// Allocation   in the constructor only
// Failure      failed() when the fit has given up: a defect of the program, since the plate is known to be good
#pragma once

#include "firmware_like/config/config.hpp"
#include "hal/base/realtime.hpp"
#include "hal/record/flight_recorder.hpp"
#include "hal/record/recorder.hpp"
#include "hal/record/tapped_link.hpp"
#include "hal/scanner/psc1.hpp"
#include "tasks/scheduler/scheduler.hpp"
#include "tasks/slices/surface_task.hpp"

#include <optional>
#include <vector>

namespace moldloft::firmware_like {

// How its frames lie in the store, whatever make the configuration names.
inline const hal::FrameCodec& load_frames = hal::psc1::frame_codec;

// The bytes of one frame, over and over, as fast as a link brings them.
class FrameWire final : public hal::ByteLink {
 public:
  explicit FrameWire(std::vector<std::byte> frame) : frame_{std::move(frame)}, sent_{frame_.size()} {}
  void begin_frame() noexcept MOLDLOFT_NONBLOCKING { sent_ = 0; }
  bool idle() const noexcept MOLDLOFT_NONBLOCKING { return sent_ == frame_.size(); }
  std::size_t frame_size() const noexcept { return frame_.size(); }

  void open() MOLDLOFT_NONBLOCKING override {}
  void close() noexcept MOLDLOFT_NONBLOCKING override {}
  std::size_t read(std::span<std::byte> out) noexcept MOLDLOFT_NONBLOCKING override;
  std::size_t write(std::span<const std::byte> in) noexcept MOLDLOFT_NONBLOCKING override {
    return in.size();
  }
  hal::LinkState state() noexcept MOLDLOFT_NONBLOCKING override { return hal::LinkState::open; }
  std::string_view why() const noexcept MOLDLOFT_NONBLOCKING override { return ""; }

 private:
  std::vector<std::byte> frame_;
  std::size_t sent_;
};

class LatencyLoad {
 public:
  LatencyLoad(const CellConfig&, hal::Clock&);
  LatencyLoad(const LatencyLoad&) = delete;
  LatencyLoad& operator=(const LatencyLoad&) = delete;

  tasks::Scheduler& scheduler() { return scheduler_; }
  const tasks::Scheduler& scheduler() const { return scheduler_; }
  hal::FlightRecorder& flight() { return flight_; }
  hal::Recorder& recorder() { return recorder_; }
  const hal::Recorder& recorder() const { return recorder_; }
  const tasks::SurfaceTask& surface() const { return surface_; }

  std::uint64_t frames() const { return frames_; }           // that have come in whole
  std::uint64_t frames_refused() const { return refused_; }  // for want of room in the recorder
  std::uint64_t frames_damaged() const { return damaged_; }  // by their checksum or content
  std::uint64_t surfaces() const { return surfaces_; }       // solved
  std::uint64_t points_seen() const { return points_; }
  bool failed() const { return surface_.stage() == tasks::SurfaceTask::Stage::failed; }

 private:
  struct Shot {
    hal::Frame frame;
    geometry::RigidMotion world_from_scanner;
    bool at_the_edge = false;
  };
  struct Row {
    LatencyLoad* owner;
    void (LatencyLoad::*function)(hal::Instant) MOLDLOFT_NONBLOCKING;
    void operator()(hal::Instant now) const MOLDLOFT_NONBLOCKING { (owner->*function)(now); }
  };
  using RowTask = tasks::FunctionTask<Row>;

  static std::vector<Shot> shots_of_a_plate(const CellConfig&);
  static std::vector<std::byte> on_the_wire(const CellConfig&, const hal::Frame&);
  void receive(hal::Instant now) MOLDLOFT_NONBLOCKING;
  void frame_arrived(hal::Instant now) MOLDLOFT_NONBLOCKING;
  void unpack() MOLDLOFT_NONBLOCKING;
  std::span<const std::byte> payload() const MOLDLOFT_NONBLOCKING;  // of the message on its way or there
  void measure(hal::Instant now) MOLDLOFT_NONBLOCKING;
  void walk_the_edge() MOLDLOFT_NONBLOCKING;
  void sweep() MOLDLOFT_NONBLOCKING;
  bool look_at_next(bool at_the_edge_only) MOLDLOFT_NONBLOCKING;

  std::vector<Shot> shots_;
  std::vector<Eigen::Vector2d> edge_points_, corners_;
  hal::FlightRecorder flight_;
  hal::Recorder recorder_;
  FrameWire wire_;
  hal::TappedLink link_;
  std::vector<std::byte> message_;
  hal::Frame decoded_;
  std::size_t bytes_a_tick_, received_ = 0;
  std::uint32_t crc_ = 0;
  std::optional<hal::psc1::FrameHead> packed_;  // the frame that is being unpacked
  std::size_t unpacked_ = 0;
  hal::Instant next_frame_{0};
  tasks::ShotView view_;
  tasks::SurfaceTask surface_;
  std::size_t next_shot_ = 0;
  const Shot* looked_at_ = nullptr;  // the view of it has not been used yet
  std::uint64_t frames_ = 0, refused_ = 0, damaged_ = 0, surfaces_ = 0, points_ = 0;
  RowTask receive_row_, measure_row_;
  tasks::Scheduler scheduler_;
};

}  // namespace moldloft::firmware_like
