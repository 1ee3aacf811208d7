// The way from the control thread to the disk: two single-producer single-consumer rings of records. One
// is for the bulk of scanner bytes, the other for everything else, so that a frame on its way never crowds
// out an event.
//
// Thread       link_bytes(), event(), shot(), room_for_frame(): the control thread. drain(): one other thread, or the
//              simulation's idle time.
// Blocking     the control thread never; drain() writes to disk
// Allocation   in the constructor only, on the control thread's side
// Failure      a full ring drops the record and counts it in lost(). Scanner bytes are never dropped as long as the
//              cell triggers only when room_for_frame() says yes. A store that fails to write keeps the records in the
//              rings: room_for_frame() turns false and store_error() says why.
#pragma once

#include "hal/base/realtime.hpp"
#include "hal/record/run_record.hpp"

#include <atomic>
#include <cstddef>
#include <memory>
#include <span>

namespace moldloft::hal {

class FlightRecorder;
class RunStore;

class Recorder {
 public:
  struct Sizes {
    std::size_t bulk_bytes = 8u << 20;
    std::size_t events_bytes = 1u << 20;
    std::size_t largest_frame_bytes = 1u << 20;
  };

  // `flight`, when given, is told of the same bytes and transitions, so that its last second shows them.
  explicit Recorder(const Sizes&, FlightRecorder* flight = nullptr);
  ~Recorder();

  // ---- the control thread's side
  void link_bytes(LinkId, Direction, Instant, std::span<const std::byte>) noexcept MOLDLOFT_NONBLOCKING;
  void event(const EventRecord&) noexcept MOLDLOFT_NONBLOCKING;
  void shot(const ShotRecord&) noexcept MOLDLOFT_NONBLOCKING;
  bool room_for_frame() const noexcept MOLDLOFT_NONBLOCKING;
  std::uint64_t lost() const noexcept MOLDLOFT_NONBLOCKING;  // records dropped since the start
  std::uint64_t offset(LinkId, Direction) const noexcept MOLDLOFT_NONBLOCKING;  // bytes recorded so far
  std::size_t plan_bytes() const noexcept;                                      // both rings
  std::size_t high_water_bytes() const noexcept;  // the fullest that they have been

  // ---- the other side
  // Moves everything that is there into the store, in one transaction; false when the store refused.
  bool drain(RunStore&);
  bool store_failed() const noexcept MOLDLOFT_NONBLOCKING;
  Message store_error() const MOLDLOFT_NONBLOCKING;

 private:
  struct Rings;
  std::unique_ptr<Rings> rings_;
  FlightRecorder* flight_;
};

}  // namespace moldloft::hal
