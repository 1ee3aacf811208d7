// The scanner as a device: serves PSC1 (hal/PROTOCOLS.md) on a byte link, sans-IO.
//
// A TRIGGER exposes for 0.1 ms, EXPOSED goes out, the frame is computed for 100 ms, FRAME goes out. The last
// shot is kept until power goes: its id asked again brings the stored frame, and nothing is exposed. A
// message that is not one drops the connection. The work outlives the connection, as in the real head.
//
// Thread       one thread; step() as often as time is looked at
// Blocking     never
// Allocation   at construction only
// Failure      none of its own; what a client does wrong is answered by ERROR
#pragma once

#include "hal/base/clock.hpp"
#include "hal/links/byte_link.hpp"
#include "hal/scanner/psc1.hpp"
#include "host_sim/devices/scanner_device.hpp"

#include <cstdint>
#include <vector>

namespace moldloft::host_sim {

class ScannerServer final : public ScannerDevice {
 public:
  ScannerServer(hal::ByteLink&, Optics, const Scene&, const ScannerTimes&, std::uint64_t seed);

  void step(hal::Instant now) override;
  void power_cycle() override;  // the session is a new one

  hal::Instant busy_from() const noexcept override { return busy_from_; }
  hal::Instant busy_until() const noexcept override { return busy_until_; }
  const ScannerCounters& counters() const noexcept override { return counters_; }
  std::uint32_t session_id() const noexcept { return session_id_; }

 private:
  enum class Phase { no_shot, exposing, computing, stored };
  static constexpr std::size_t largest_request = 4096;  // no request of a client comes near it
  static constexpr std::size_t room_for_replies = 16384;

  void forget_connection();
  void receive(hal::Instant now);
  std::size_t take_message(std::span<const std::byte> bytes, hal::Instant now);
  void answer(const hal::psc1::Header&, std::span<const std::byte> payload, hal::Instant now);
  void answer_hello(const hal::psc1::Header&, std::span<const std::byte> payload);
  void answer_config(const hal::psc1::Header&, std::span<const std::byte> payload);
  void answer_trigger(const hal::psc1::Header&, std::span<const std::byte> payload, hal::Instant now);
  void work(hal::Instant now);
  void answer_reset(const hal::psc1::Header&, hal::Instant now);
  void send_exposed();
  void wrong_payload(const hal::psc1::Header&, hal::psc1::Flaw);
  void send_frame();
  void refuse(std::uint32_t request_id, hal::psc1::Status, std::uint32_t shot_id, std::string_view text);
  template <typename Reply>
  void send(std::uint32_t request_id, const Reply&);
  void flush();
  void drop();

  hal::ByteLink& link_;
  Optics optics_;
  const Scene& scene_;
  ScannerTimes times_;
  std::uint64_t seed_;
  Random sessions_;
  std::uint32_t session_id_ = 0;
  ScannerCounters counters_;

  bool connected_ = false, greeted_ = false, configured_ = false;
  hal::psc1::Config config_;
  Raster raster_;
  std::vector<std::byte> in_, out_;
  std::size_t in_used_ = 0, out_used_ = 0, out_sent_ = 0;

  Phase phase_ = Phase::no_shot;
  std::uint32_t shot_id_ = 0, request_id_ = 0;
  bool owes_exposed_ = false, owes_frame_ = false, repeated_ = false;
  hal::Instant busy_from_{-1}, busy_until_{-1};
  hal::Frame frame_;
};

std::unique_ptr<ScannerDevice> make_scanner_server(hal::ByteLink&, Optics, const Scene&, const ScannerTimes&,
                                                   std::uint64_t seed);

}  // namespace moldloft::host_sim
