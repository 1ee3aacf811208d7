// The simulated scanner of the second make (hal/triplet/triplet.hpp): exposes when it is asked, sends
// the scan when it is computed, keeps nothing.
#pragma once

#include "hal/triplet/triplet.hpp"
#include "host_sim/devices/scanner_device.hpp"

#include <cstring>

namespace moldloft::host_sim {

class TripletServer final : public ScannerDevice {
 public:
  TripletServer(hal::ByteLink& link, Optics optics, const Scene& scene, const ScannerTimes& times,
                std::uint64_t seed)
      : link_{link}, optics_{std::move(optics)}, scene_{scene}, times_{times}, seed_{seed} {
    const auto& s = optics_.settings();
    const auto stripes = static_cast<std::size_t>(s.stripes);
    const std::size_t points = stripes * static_cast<std::size_t>(s.points_per_stripe);
    frame_ = hal::Frame{stripes, points};
    out_.resize(triplet::largest_scan(stripes, points));
  }

  void step(hal::Instant now) override {
    if (link_.state() != hal::LinkState::open) {
      if (link_.state() != hal::LinkState::opening) link_.open();
      have_ = out_used_ = out_sent_ = 0;
      owes_scan_ = false;
      return;
    }
    have_ += link_.read(std::span{in_}.subspan(have_));
    if (const auto head = triplet::decode_head(std::span{in_}.first(have_));
        head && have_ >= triplet::head_size + head->body_size) {
      have_ = 0;
      head->type == triplet::Type::hello ? greet() : expose(now);
    }
    if (owes_scan_ && now >= busy_until_) send_scan();
    out_sent_ += link_.write(std::span{out_}.subspan(out_sent_, out_used_ - out_sent_));
  }
  void power_cycle() override {
    link_.close();
    owes_scan_ = false;
  }
  hal::Instant busy_from() const noexcept override { return busy_from_; }
  hal::Instant busy_until() const noexcept override { return busy_until_; }
  const ScannerCounters& counters() const noexcept override { return counters_; }

 private:
  void begin_message() { out_used_ = out_sent_ = 0; }

  void greet() {
    begin_message();
    const auto& s = optics_.settings();
    triplet::Info info{.name = {'t', 'r', 'i', 'p', 'l', 'e', 't'},
                       .stripes = static_cast<std::uint32_t>(s.stripes),
                       .points = static_cast<std::uint32_t>(s.points_per_stripe),
                       .field_x_mm = static_cast<float>(s.field_x_mm),
                       .field_y_mm = static_cast<float>(s.field_y_mm),
                       .depth_mm = static_cast<float>(s.depth_mm)};
    std::memcpy(out_.data() + triplet::head_size, &info, sizeof info);
    out_used_ = triplet::finish(triplet::Type::hello, sizeof info, out_);
    ++counters_.connections;
  }

  void expose(hal::Instant now) {
    std::memcpy(&frame_.shot_id, in_.data() + triplet::head_size, sizeof frame_.shot_id);
    busy_from_ = now;
    busy_until_ = now + times_.exposure + times_.processing;
    Random random(seed_, Stream::optics, ++counters_.exposures);
    optics_.expose(scene_.plate(), scene_.world_from_scanner(now), random, {}, frame_);
    frame_.exposed_sensor_ns = static_cast<std::uint64_t>(now.count());
    owes_scan_ = true;
  }

  void send_scan() {
    begin_message();
    owes_scan_ = false;
    const auto body = std::span{out_}.subspan(triplet::head_size);
    std::size_t at = 0;
    const auto put = [&](auto value) {
      std::memcpy(body.data() + at, &value, sizeof value);
      at += sizeof value;
    };
    put(frame_.shot_id);
    put(frame_.stripe_count);
    put(frame_.exposed_sensor_ns);
    for (const auto& stripe : frame_.lines()) {
      put(stripe.index);
      put(static_cast<std::uint16_t>(stripe.count));
      for (auto i = stripe.first; i < stripe.first + stripe.count; ++i)
        put(frame_.x[i]), put(frame_.y[i]), put(frame_.z[i]);
    }
    out_used_ = triplet::finish(triplet::Type::scan, at, out_);
    ++counters_.frames_sent;
  }

  hal::ByteLink& link_;
  Optics optics_;
  const Scene& scene_;
  ScannerTimes times_;
  std::uint64_t seed_;
  std::array<std::byte, 256> in_{};
  std::vector<std::byte> out_;
  hal::Frame frame_;
  std::size_t have_ = 0, out_used_ = 0, out_sent_ = 0;
  bool owes_scan_ = false;
  hal::Instant busy_from_{-1}, busy_until_{-1};
  ScannerCounters counters_;
};

}  // namespace moldloft::host_sim
