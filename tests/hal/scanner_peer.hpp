// The far end of the scanner's link for the driver's tests: a sensor as PROTOCOLS.md wants it, with hooks to
// damage what it sends. It counts what is really exposed.
#pragma once

#include "hal/base/clock.hpp"
#include "hal/links/byte_link.hpp"
#include "hal/sample_frame.hpp"
#include "hal/scanner/psc1.hpp"

#include <deque>
#include <functional>
#include <vector>

namespace moldloft::hal {

class ScannerPeer {
 public:
  ScannerPeer(ByteLink& link, Clock& clock) : link_{link}, clock_{clock} {}

  // ---- the world around it
  std::uint32_t session_id = 1000;
  std::uint16_t stripes = 10, points_per_stripe = 50;
  Duration exposure_time = 1ms, processing_time = 100ms;
  bool mute = false;
  std::function<bool(std::vector<std::byte>& message, psc1::Type)> on_send;  // may damage it; false drops it
  psc1::Status hello_status = psc1::Status::ok, config_status = psc1::Status::ok;

  // ---- what happened
  int exposures = 0;
  std::vector<std::uint32_t> triggers;  // shot ids as asked for
  int hellos = 0, configs = 0, pings = 0;

  void step() {
    if (link_.state() != LinkState::open) {
      in_.clear();
      out_.clear();
      configured_ = false;
      return;
    }
    std::array<std::byte, 512> bytes;
    for (std::size_t count; (count = link_.read(bytes)) > 0;)
      in_.insert(in_.end(), bytes.begin(), bytes.begin() + count);
    while (take_message()) {
    }
    if (exposing_ && clock_.now() >= exposed_at_) finish_exposure();
    if (computing_ && clock_.now() >= computed_at_) finish_frame();
    flush();
  }
  void reboot(std::uint32_t new_session) {
    session_id = new_session;
    stored_shot_ = 0;
    exposing_ = computing_ = configured_ = false;
    in_.clear();
    out_.clear();
    link_.close();
  }
  void send_frame(std::uint32_t shot_id, std::uint32_t session) {
    const Frame frame = sample_frame(stripes, points_per_stripe, shot_id, session);
    std::vector<std::byte> message(psc1::encoded_frame_size(frame, config_.encoding, config_.intensity));
    message.resize(
        psc1::encode_frame(request_, frame, config_.encoding, config_.intensity, {51, 51, 40}, message));
    push(std::move(message), psc1::Type::frame);
  }
  void send(std::vector<std::byte> message) { out_.insert(out_.end(), message.begin(), message.end()); }
  template <typename M>
  void reply(const M& message, psc1::Type type) {
    std::vector<std::byte> wire(256);
    wire.resize(psc1::encode(request_, message, wire));
    push(std::move(wire), type);
  }
  void send_exposed(bool repeated) {
    std::vector<std::byte> wire(256);
    wire.resize(psc1::encode(request_, psc1::Exposed{stored_shot_, session_id, repeated}, 5, wire));
    push(std::move(wire), psc1::Type::exposed);
  }

 private:
  bool take_message() {
    using namespace psc1;
    if (in_.size() < header_size) return false;
    std::array<std::byte, header_size> head;
    std::copy_n(in_.begin(), header_size, head.begin());
    const auto header = decode_header(head);
    if (!header) {
      link_.close();
      return false;
    }
    const std::size_t size =
        header_size + (header->payload_length ? header->payload_length + payload_crc_size : 0);
    if (in_.size() < size) return false;
    const std::vector<std::byte> payload{in_.begin() + header_size,
                                         in_.begin() + header_size + header->payload_length};
    in_.erase(in_.begin(), in_.begin() + size);
    request_ = header->request_id;
    answer(header->type, payload);
    return true;
  }
  void answer(psc1::Type type, std::span<const std::byte> payload) {
    using namespace psc1;
    switch (type) {
      case Type::hello:
        ++hellos;
        return reply(HelloReply{.status = hello_status,
                                .session_id = session_id,
                                .max_stripes = stripes,
                                .max_points_per_stripe = points_per_stripe,
                                .field_x_mm = 102,
                                .field_y_mm = 102,
                                .depth_mm = 40,
                                .exposure_us = 100,
                                .processing_us = 100'000,
                                .sensor = {"peer"}},
                     type);
      case Type::config:
        ++configs;
        config_ = *decode_config(payload);
        configured_ = config_status == Status::ok;
        config_.status = config_status;
        return reply(config_, type);
      case Type::ping: {
        ++pings;
        std::vector<std::byte> wire(header_size);
        encode_empty(request_, type, wire);
        return push(std::move(wire), type);
      }
      case Type::trigger:
        return trigger(decode_trigger(payload)->shot_id);
      default:
        return;
    }
  }
  void trigger(std::uint32_t shot_id) {
    using namespace psc1;
    triggers.push_back(shot_id);
    if (!configured_) return reply(ErrorReply{.status = Status::bad_state, .shot_id = shot_id}, Type::error);
    if (exposing_ || (computing_ && shot_id != stored_shot_)) {
      return reply(ErrorReply{.status = Status::busy, .shot_id = shot_id, .text = "computing"}, Type::error);
    }
    if (shot_id == stored_shot_) {
      send_exposed(true);
      if (!computing_) send_frame(shot_id, session_id);
      return;
    }
    stored_shot_ = shot_id;
    exposing_ = true;
    exposed_at_ = clock_.now() + exposure_time;
  }
  void finish_exposure() {
    exposing_ = false;
    ++exposures;
    send_exposed(false);
    computing_ = true;
    computed_at_ = clock_.now() + processing_time;
  }
  void finish_frame() {
    computing_ = false;
    send_frame(stored_shot_, session_id);
  }
  void push(std::vector<std::byte> message, psc1::Type type) {
    if (!mute && (!on_send || on_send(message, type))) send(std::move(message));
  }
  void flush() {
    std::vector<std::byte> bytes{out_.begin(), out_.end()};
    const std::size_t count = link_.write(bytes);
    out_.erase(out_.begin(), out_.begin() + count);
  }

  ByteLink& link_;
  Clock& clock_;
  std::deque<std::byte> in_, out_;
  psc1::Config config_;
  bool configured_ = false, exposing_ = false, computing_ = false;
  std::uint32_t stored_shot_ = 0, request_ = 0;
  Instant exposed_at_{0}, computed_at_{0};
};

}  // namespace moldloft::hal
