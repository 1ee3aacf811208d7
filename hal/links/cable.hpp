// A simulated cable: two byte links, each the far end of the other, with a rate and a delay in the time
// of a clock.
//
// Thread       one thread
// Blocking     never
// Allocation   in the constructor only
// Failure      cut() loses the link on both sides; open() on the host's side brings it back once mend() was called
#pragma once

#include "hal/base/clock.hpp"
#include "hal/links/byte_link.hpp"

#include <memory>

namespace moldloft::hal {

class Cable {
 public:
  struct Settings {
    std::size_t capacity_bytes = 2u << 20;  // in flight, each direction; write() takes no more than fits
    double bytes_per_second = 12.5e6;       // 100 Mb/s; a serial line of 115200 baud 8N1 has 11520
    Duration delay = 0ns;                   // of the first byte
  };

  Cable(Clock&, const Settings&);
  ~Cable();

  ByteLink& host() noexcept;  // the controller's end; open() succeeds at once while the cable is whole
  // The device's end; open while the host's end is open. After the host has opened anew it is `lost` for one
  // look: that is how a server learns of the new connection.
  ByteLink& device() noexcept;
  void cut() noexcept;
  void mend() noexcept;

 private:
  struct Ends;
  std::unique_ptr<Ends> ends_;
};

}  // namespace moldloft::hal
