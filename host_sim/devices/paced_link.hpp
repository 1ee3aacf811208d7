// A byte link at the speed of the wire that it stands for. A loopback socket moves a frame in a millisecond,
// and a scanner on 100 Mb/s takes 24 ms for it. A pseudo-terminal moves a line at once, and a robot on 115200
// baud takes 5 ms for it.
//
// Thread       as ByteLink says
// Blocking     as ByteLink says
// Allocation   none after open() of the link within
// Failure      those of the link within; asserts on a wire that carries less than a byte a millisecond
#pragma once

#include "hal/base/clock.hpp"
#include "hal/links/byte_link.hpp"

#include <memory>

namespace moldloft::host_sim {

class PacedLink final : public hal::ByteLink {
 public:
  PacedLink(std::unique_ptr<hal::ByteLink> within, hal::Clock&, double bytes_per_second);

  void open() override { within_->open(); }
  void close() noexcept override { within_->close(); }
  std::size_t read(std::span<std::byte> out) noexcept override;
  std::size_t write(std::span<const std::byte> in) noexcept override;
  hal::LinkState state() noexcept override { return within_->state(); }
  std::string_view why() const noexcept override { return within_->why(); }

 private:
  // One direction. While bytes wait it is as if the wire were busy all the time, however rarely somebody looks; an idle
  // wire saves nothing up.
  class Pace {
   public:
    std::size_t room(hal::Instant now, double bytes_per_second) noexcept;
    void moved(std::size_t bytes, bool more_wait) noexcept;

   private:
    double bytes_ = 0;
    hal::Instant last_{0};
    bool busy_ = false;
  };

  std::unique_ptr<hal::ByteLink> within_;
  hal::Clock& clock_;
  double bytes_per_second_;
  Pace reading_, writing_;
};

}  // namespace moldloft::host_sim
