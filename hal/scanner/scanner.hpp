// What the cell asks of a laser-stripe scanner of any make. A new make implements this and gets one row in
// the table of firmware_like/config/device_makes.
//
// Thread       the control thread; receive() early in a tick, transmit() late in it
// Blocking     never
// Allocation   none after construction
// Failure      the driver keeps the link alive by itself: it reconnects with back-off, greets and configures
//              again, and repeats a request at most twice under its shot id. What it cannot mend is reported
//              as an event
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/base/loss_count.hpp"
#include "hal/base/realtime.hpp"
#include "hal/scanner/frame.hpp"

#include <cstdint>
#include <optional>

namespace moldloft::hal {

enum class ScannerState {
  offline,    // no link, or one that is being opened
  greeting,   // link open, HELLO or CONFIG on its way
  ready,      // may be triggered
  exposing,   // TRIGGER sent, EXPOSED awaited: the arm must stand still
  computing,  // EXPOSED seen, FRAME awaited: the arm may move
};

struct ScannerEvent {
  enum class Kind {
    ready,
    exposed,
    arriving,  // the shot's frame has begun to come; nothing of it is vouched for before `frame`
    frame,
    shot_failed,
    lost,
    unfit,  // it is there, and what it says of itself does not fit the driver or its settings: asking again is no use
  };
  Kind kind;
  std::uint32_t shot_id = 0;
  Message text{};  // for shot_failed, lost and unfit: what happened
};

struct ScannerInfo {
  FixedText<16> sensor{};
  std::uint32_t session_id = 0;
  std::uint32_t max_stripes = 0, max_points = 0;  // a frame's largest size
  double field_x_mm = 0, field_y_mm = 0;          // field of view at z = 0
  double depth_mm = 0;                            // z is measured within +-depth
};

class Scanner {
 public:
  virtual ~Scanner() = default;

  virtual void start(Instant now) MOLDLOFT_NONBLOCKING = 0;  // begins to connect
  virtual void receive(Instant now)
      MOLDLOFT_NONBLOCKING = 0;  // reads a bounded number of bytes and works on them
  virtual void transmit(Instant now) MOLDLOFT_NONBLOCKING = 0;  // time-outs, requests, heartbeats: bytes out

  // Asks for one exposure. False unless state() is ready. The caller chooses the id: not 0, and for one
  // exposure only, also across restarts of the program. The scanner answers an id that it knows with
  // the stored frame.
  virtual bool trigger(std::uint32_t shot_id, Instant now) MOLDLOFT_NONBLOCKING = 0;
  virtual void forget_shot() MOLDLOFT_NONBLOCKING = 0;  // the cell no longer wants the outstanding shot

  virtual std::optional<ScannerEvent> next_event() MOLDLOFT_NONBLOCKING = 0;
  virtual ScannerState state() const MOLDLOFT_NONBLOCKING = 0;
  virtual const ScannerInfo& info() const MOLDLOFT_NONBLOCKING = 0;
  // The last accepted frame, valid until the next trigger(). After `arriving` it is the one on its way;
  // `frame` confirms it, shot_failed and lost withdraw it. A frame's lines are there at once. Its points are
  // unpacked in pieces, so that a large frame does not fill a tick. A driver unpacks a whole frame by itself,
  // slowly, when nobody asks for it.
  virtual const Frame& frame() const MOLDLOFT_NONBLOCKING = 0;
  virtual void unpack(std::size_t at_most_points) MOLDLOFT_NONBLOCKING = 0;
  virtual std::size_t unpacked() const
      MOLDLOFT_NONBLOCKING = 0;  // points of frame(), from its first, that are there
  virtual std::size_t packed() const MOLDLOFT_NONBLOCKING = 0;  // points after them that unpack() could take
  virtual std::uint64_t frame_offset() const
      MOLDLOFT_NONBLOCKING = 0;  // where its payload began in all bytes ever received on this link
  virtual std::uint32_t frame_bytes() const MOLDLOFT_NONBLOCKING = 0;  // the payload's size
  virtual std::string_view why() const MOLDLOFT_NONBLOCKING = 0;       // the last reason for being offline
  virtual LossCounts losses() const { return {}; }                  // what the driver counts, all zeros too
  virtual std::size_t plan_bytes() const MOLDLOFT_NONBLOCKING = 0;  // memory taken at construction
};

}  // namespace moldloft::hal
