// The driver of the second make. Without a word after the exposure the arm stands until the scan is there, and a shot
// whose scan is lost is exposed anew from where it stands.
//
// Thread, blocking, allocation, failure: as hal::Scanner says
#pragma once

#include "hal/base/event_queue.hpp"
#include "hal/links/device_session.hpp"
#include "hal/scanner/scanner.hpp"
#include "hal/triplet/triplet.hpp"

#include <vector>

namespace moldloft::triplet {

class TripletScanner final : public hal::Scanner {
 public:
  TripletScanner(hal::ByteLink&, std::size_t max_stripes, std::size_t max_points);

  void start(hal::Instant now) override { session_.start(now); }
  void receive(hal::Instant now) override;
  void transmit(hal::Instant now) override;
  bool trigger(std::uint32_t shot_id, hal::Instant now) override;
  void forget_shot() override;
  std::optional<hal::ScannerEvent> next_event() override { return events_.pop(); }
  hal::ScannerState state() const override;
  const hal::ScannerInfo& info() const override { return info_; }
  const hal::Frame& frame() const override { return frame_; }
  void unpack(std::size_t at_most_points) override;
  std::size_t unpacked() const override { return unpacked_; }
  std::size_t packed() const override { return packed_ ? frame_.point_count - unpacked_ : 0; }
  std::uint64_t frame_offset() const override { return frame_offset_; }
  std::uint32_t frame_bytes() const override { return frame_bytes_; }
  std::string_view why() const override { return why_; }
  std::size_t plan_bytes() const override {
    return sizeof *this + session_.plan_bytes() + message_.size() + 13 * frame_.x.size();
  }

 private:
  enum class Phase : std::uint8_t { offline, greeting, ready, exposing };

  void lose(hal::Instant now, std::string_view why);
  void send(Type, std::uint32_t id, std::size_t body_size);
  void take_message(hal::Instant now);
  void take_info(std::span<const std::byte> body, hal::Instant now);
  void take_scan(std::span<const std::byte> body, hal::Instant now);

  hal::DeviceSession session_;
  std::vector<std::byte> message_;  // the one on its way, or the one whose points are not all unpacked
  hal::Frame frame_;
  hal::ScannerInfo info_;
  hal::EventQueue<hal::ScannerEvent, 8> events_;
  std::size_t have_ = 0, unpacked_ = 0;
  std::uint64_t frame_offset_ = 0;
  std::uint32_t frame_bytes_ = 0, shot_ = 0;
  int attempts_ = 0;
  bool packed_ = false, announced_ = false;
  Phase phase_ = Phase::offline;
  hal::Instant deadline_{0};
  hal::Message why_ = "not started yet";
};

}  // namespace moldloft::triplet
