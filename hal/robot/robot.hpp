// What the cell asks of a robot arm of any make. A new make implements this and gets one row in the
// table of firmware_like/config/device_makes.
//
// Thread       the control thread; receive() early in a tick, transmit() late in it
// Blocking     never
// Allocation   none after construction
// Failure      a command is repeated on the wire until its fate is known, never issued under a second
//              number. So no fault of the link moves the arm twice. What the driver cannot mend is reported
//              as an event
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/fixed_text.hpp"
#include "hal/base/loss_count.hpp"
#include "hal/base/realtime.hpp"
#include "hal/robot/pose.hpp"

#include <optional>

namespace moldloft::hal {

enum class RobotState {
  offline,        // no link
  synchronising,  // SYN, STA, POS under way: numbered lines are refused
  ready,          // stands, takes a command
  commanded,      // a command is on its way, not yet acknowledged
  moving,         // acknowledged, not yet done
  faulted,        // error, e-stop or power loss: latched until reset()
};

struct RobotEvent {
  enum class Kind {
    ready,   // synchronised; pose says where the arm stands, calibrated whether it knows that
    moving,  // the command was checked and motion has started
    done,    // stopped and settled; pose was read back
    stands,  // asked again while it stands, it says another place than before; a driver that cannot ask never says so
    refused,  // ERR: the controller will not do it; code says why
    fault,    // e-stop, power loss, watchdog, error during motion; latched
    manual,   // the key is on manual: whoever has the pendant has the arm; latched as a fault is
    lost,     // the link is gone or the robot is silent beyond the limit
  };
  Kind kind;
  Pose pose{};
  bool calibrated = false;
  int code = 0;
  Message text{};
};

class Robot {
 public:
  virtual ~Robot() = default;

  virtual void start(Instant now) MOLDLOFT_NONBLOCKING = 0;
  virtual void receive(Instant now) MOLDLOFT_NONBLOCKING = 0;
  virtual void transmit(Instant now) MOLDLOFT_NONBLOCKING = 0;

  // One command at a time: false unless state() is ready. move() drives the tip to `target` at `speed_percent` (1-100).
  virtual bool move(const Pose& target, int speed_percent, Instant now) MOLDLOFT_NONBLOCKING = 0;
  virtual bool calibrate(Instant now) MOLDLOFT_NONBLOCKING = 0;
  virtual void stop(Instant now)
      MOLDLOFT_NONBLOCKING = 0;  // harmless, at any time: motion ends as fast as the controller allows
  virtual void reset(Instant now)
      MOLDLOFT_NONBLOCKING = 0;  // an operator has cleared the fault: synchronise again

  virtual std::optional<RobotEvent> next_event() MOLDLOFT_NONBLOCKING = 0;
  virtual RobotState state() const MOLDLOFT_NONBLOCKING = 0;
  virtual std::string_view why() const MOLDLOFT_NONBLOCKING = 0;
  virtual LossCounts losses() const { return {}; }                  // what the driver counts, all zeros too
  virtual std::size_t plan_bytes() const MOLDLOFT_NONBLOCKING = 0;  // memory taken at construction
};

}  // namespace moldloft::hal
