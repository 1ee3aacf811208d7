// What every driver needs beside its device's words: a connection that is opened, watched, lost and opened again.
//
//     closed -> start() -> opening -> open -> lose() -> waiting -> opening -> ...
//
// The session never decides that a device is gone: receive() and transmit() bring news, is_silent()
// answers, and the driver calls lose(). So every fault, a bad byte or a cut cable, takes the same way
// through the driver.
//
// What is written waits in an outbox of fixed size, and flush() moves what the link takes. A request that finds
// no room is as good as lost on the way: the driver's own time-out takes care of it.
//
// Thread       the control thread: receive() early in a tick, transmit() and flush() late in it
// Blocking     never; only the link's open() and close() may (hal/README.md)
// Allocation   the outbox, in the constructor
// Failure      a lost connection is opened again after a pause, which doubles up to a limit until greeted()
#pragma once

#include "hal/base/clock.hpp"
#include "hal/base/realtime.hpp"
#include "hal/links/byte_link.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace moldloft::hal {

class DeviceSession {
 public:
  struct Settings {
    Duration connect_timeout = 2s;    // a connect that the network swallows would take minutes
    Duration first_back_off = 100ms;  // between a loss and the next attempt; doubles with each failure
    Duration last_back_off = 2s;      // a device that has booted is found within this time
    Duration heartbeat = 1s;          // between two signs of life to the device
    Duration silent_limit = 3s;       // without a sign of life from it
    std::size_t outbox_bytes = 1024;
  };
  enum class State { closed, waiting, opening, open };
  enum class News {
    none,
    opened,        // now; nothing has been read or written yet
    lost,          // the link says so, and why() says why; told again until lose()
    no_connection  // the time for connecting is over; told again until lose()
  };

  DeviceSession(ByteLink&, const Settings&);

  void start(Instant now) MOLDLOFT_NONBLOCKING;     // begins to connect; later calls change nothing
  News receive() MOLDLOFT_NONBLOCKING;              // looks at the link, once
  News transmit(Instant now) MOLDLOFT_NONBLOCKING;  // opens it again when the pause is over
  void lose(Instant now) MOLDLOFT_NONBLOCKING;      // closes the link; the next attempt comes after the pause
  // The device has proved to be the right one: the next pause is the first again. An open link alone does
  // not prove it.
  void greeted() MOLDLOFT_NONBLOCKING { back_off_ = 0ns; }

  State state() const MOLDLOFT_NONBLOCKING { return state_; }
  bool is_open() const MOLDLOFT_NONBLOCKING { return state_ == State::open; }
  std::string_view why() const MOLDLOFT_NONBLOCKING { return link_.why(); }

  // Moves bytes that have arrived into `in`, none where the connection is not open.
  std::size_t read(std::span<std::byte> in) MOLDLOFT_NONBLOCKING;
  std::uint64_t received() const MOLDLOFT_NONBLOCKING { return received_; }  // bytes, over all connections

  bool write(std::span<const std::byte> message) MOLDLOFT_NONBLOCKING;  // whole, or false
  // The same for a message that is encoded in its place: to the front of room(), then add() counts its bytes.
  std::span<std::byte> room() MOLDLOFT_NONBLOCKING { return std::span{outbox_}.subspan(waiting_bytes_); }
  void add(std::size_t bytes) MOLDLOFT_NONBLOCKING { waiting_bytes_ += bytes; }
  void flush() MOLDLOFT_NONBLOCKING;

  // Signs of life, in both directions. What counts as one is the driver's to say; beginning to connect is both.
  void heard(Instant now) MOLDLOFT_NONBLOCKING { heard_at_ = now; }
  void said(Instant now) MOLDLOFT_NONBLOCKING { said_at_ = now; }
  Duration silence(Instant now) const MOLDLOFT_NONBLOCKING { return now - heard_at_; }
  bool is_silent(Instant now) const MOLDLOFT_NONBLOCKING { return silence(now) > settings_.silent_limit; }
  bool heartbeat_due(Instant now) const MOLDLOFT_NONBLOCKING { return now - said_at_ >= settings_.heartbeat; }

  std::size_t plan_bytes() const { return outbox_.size(); }  // besides the object itself

 private:
  void open(Instant now) MOLDLOFT_NONBLOCKING;

  ByteLink& link_;
  const Settings settings_;
  State state_ = State::closed;
  Instant due_{0};        // end of the pause while waiting, of the patience while opening
  Duration back_off_{0};  // the last pause; 0 after a greeting
  Instant heard_at_{0}, said_at_{0};
  std::uint64_t received_ = 0;
  std::vector<std::byte> outbox_;
  std::size_t waiting_bytes_ = 0;  // of the outbox, from its front
};

}  // namespace moldloft::hal
