#include "host_sim/devices/scanner_server.hpp"

#include "hal/base/crc32c.hpp"

#include <algorithm>
#include <cstring>

namespace moldloft::host_sim {

namespace psc1 = hal::psc1;
using psc1::Status;
using psc1::Type;

namespace {

constexpr std::string_view sensor_name = "moldloft-sim";

std::size_t rays(const OpticsSettings& s) {
  return static_cast<std::size_t>(s.stripes) * static_cast<std::size_t>(s.points_per_stripe);
}

// The largest step that still leaves at least as many of `all` as were asked for; 0 asks for all.
int every(int all, int asked) { return asked <= 0 || asked >= all ? 1 : all / asked; }

}  // namespace

ScannerServer::ScannerServer(hal::ByteLink& link, Optics optics, const Scene& scene,
                             const ScannerTimes& times, std::uint64_t seed)
    : link_(link),
      optics_(std::move(optics)),
      scene_(scene),
      times_(times),
      seed_(seed),
      sessions_(seed, Stream::sessions),
      in_(psc1::header_size + largest_request + psc1::payload_crc_size),
      frame_(static_cast<std::size_t>(optics_.settings().stripes), rays(optics_.settings())) {
  frame_.stripe_count = static_cast<std::uint32_t>(optics_.settings().stripes);
  frame_.point_count = static_cast<std::uint32_t>(rays(optics_.settings()));
  out_.resize(psc1::encoded_frame_size(frame_, psc1::Encoding::float32, true) + room_for_replies);
  power_cycle();
}

void ScannerServer::power_cycle() {
  session_id_ = static_cast<std::uint32_t>(sessions_.next() >> 32) | 1u;  // never 0
  phase_ = Phase::no_shot;
  shot_id_ = 0;
  busy_until_ = busy_from_;
  if (connected_) drop();
  forget_connection();
}

void ScannerServer::forget_connection() {
  connected_ = greeted_ = configured_ = false;
  config_ = {};
  raster_ = {};
  in_used_ = out_used_ = out_sent_ = 0;
  owes_exposed_ = owes_frame_ = false;
}

void ScannerServer::step(hal::Instant now) {
  const hal::LinkState link = link_.state();
  const bool open = link == hal::LinkState::open;
  if (!open) {
    if (connected_) forget_connection();
    if (link != hal::LinkState::opening) link_.open();
  } else if (!connected_) {
    connected_ = true;
    ++counters_.connections;
  }
  if (open) receive(now);
  work(now);
  if (connected_) flush();
}

// Reads until nothing is there: requests are small, and the link itself bounds what has arrived.
void ScannerServer::receive(hal::Instant now) {
  while (connected_) {
    const std::size_t count = link_.read(std::span{in_}.subspan(in_used_));
    in_used_ += count;
    std::size_t done = 0;
    while (connected_) {
      const std::size_t taken = take_message(std::span{in_}.subspan(done, in_used_ - done), now);
      if (taken == 0) break;
      done += taken;
    }
    if (!connected_) return;
    std::memmove(in_.data(), in_.data() + done, in_used_ - done);
    in_used_ -= done;
    if (count == 0) return;
  }
}

// The first message of `bytes`, answered; its size, 0 while it is not all there or the
// connection was dropped.
std::size_t ScannerServer::take_message(std::span<const std::byte> bytes, hal::Instant now) {
  if (bytes.size() < psc1::header_size) return 0;
  const auto header = psc1::decode_header(bytes.first<psc1::header_size>());
  if (!header || header->payload_length > largest_request) {
    drop();
    return 0;
  }
  const std::size_t length = header->payload_length;
  const std::size_t total = psc1::header_size + length + (length > 0 ? psc1::payload_crc_size : 0);
  if (bytes.size() < total) return 0;
  const auto payload = bytes.subspan(psc1::header_size, length);
  if (length > 0) {
    std::array<std::byte, psc1::payload_crc_size> sent;
    std::memcpy(sent.data(), bytes.data() + psc1::header_size + length, sent.size());
    std::uint32_t crc = 0;
    for (std::size_t k = 0; k < 4; ++k) crc |= std::to_integer<std::uint32_t>(sent[k]) << (8 * k);
    if (crc != hal::crc32c(payload)) {
      drop();
      return 0;
    }
  }
  answer(*header, payload, now);
  return total;
}

void ScannerServer::answer(const psc1::Header& header, std::span<const std::byte> payload, hal::Instant now) {
  if (header.type != Type::hello && !greeted_) {
    return refuse(header.request_id, Status::bad_state, 0, "HELLO comes first");
  }
  const bool has_payload =
      header.type == Type::hello || header.type == Type::config || header.type == Type::trigger;
  if (!has_payload && !payload.empty()) return drop();
  switch (header.type) {
    case Type::hello:
      return answer_hello(header, payload);
    case Type::config:
      return answer_config(header, payload);
    case Type::trigger:
      return answer_trigger(header, payload, now);
    case Type::reset:
      return answer_reset(header, now);
    case Type::status:
      return send(header.request_id,
                  psc1::StatusReply{Status::ok, session_id_, phase_ == Phase::stored ? shot_id_ : 0, 31.5f});
    case Type::ping:
      out_used_ += psc1::encode_empty(header.request_id, Type::ping, std::span{out_}.subspan(out_used_));
      return;
    default:
      return refuse(header.request_id, Status::unsupported, 0, "no host sends this type");
  }
}

void ScannerServer::answer_reset(const psc1::Header& header, hal::Instant now) {
  phase_ = Phase::no_shot;
  shot_id_ = 0;
  owes_exposed_ = owes_frame_ = configured_ = false;
  config_ = {};
  raster_ = {};
  busy_until_ = std::min(busy_until_, now);
  out_used_ += psc1::encode_empty(header.request_id, Type::reset, std::span{out_}.subspan(out_used_));
}

void ScannerServer::answer_hello(const psc1::Header& header, std::span<const std::byte> payload) {
  const auto asked = psc1::decode_hello_request(payload);
  if (!asked) return wrong_payload(header, asked.error());
  const auto& s = optics_.settings();
  psc1::HelloReply reply;
  const bool fits =
      asked->version_min <= psc1::protocol_version && asked->version_max >= psc1::protocol_version;
  if (!fits) reply.status = Status::unsupported;
  reply.session_id = session_id_;
  reply.max_stripes = static_cast<std::uint16_t>(s.stripes);
  reply.max_points_per_stripe = static_cast<std::uint16_t>(s.points_per_stripe);
  reply.field_x_mm = static_cast<float>(s.field_x_mm);
  reply.field_y_mm = static_cast<float>(s.field_y_mm);
  reply.depth_mm = static_cast<float>(s.depth_mm);
  reply.exposure_us = static_cast<std::uint32_t>(times_.exposure / std::chrono::microseconds{1});
  reply.processing_us = static_cast<std::uint32_t>(times_.processing / std::chrono::microseconds{1});
  sensor_name.copy(reply.sensor.data(), reply.sensor.size());
  greeted_ = fits;
  send(header.request_id, reply);
}

void ScannerServer::answer_config(const psc1::Header& header, std::span<const std::byte> payload) {
  const auto asked = psc1::decode_config(payload);
  if (!asked) return wrong_payload(header, asked.error());
  const auto& s = optics_.settings();
  raster_ = {every(s.stripes, asked->stripes), every(s.points_per_stripe, asked->points_per_stripe)};
  config_ = *asked;
  config_.status = Status::ok;
  configured_ = true;
  config_.stripes = static_cast<std::uint16_t>((s.stripes + raster_.every_stripe - 1) / raster_.every_stripe);
  config_.points_per_stripe =
      static_cast<std::uint16_t>((s.points_per_stripe + raster_.every_point - 1) / raster_.every_point);
  send(header.request_id, config_);
}

void ScannerServer::answer_trigger(const psc1::Header& header, std::span<const std::byte> payload,
                                   hal::Instant now) {
  const auto asked = psc1::decode_trigger(payload);
  if (!asked) return wrong_payload(header, asked.error());
  const std::uint32_t id = asked->shot_id;
  if (!configured_) return refuse(header.request_id, Status::bad_state, id, "CONFIG comes first");
  if (id == 0) return refuse(header.request_id, Status::bad_argument, id, "shot id 0 belongs to no shot");
  const bool busy = phase_ == Phase::exposing || phase_ == Phase::computing;
  if (id == shot_id_ && phase_ != Phase::no_shot) {
    ++counters_.repeats;
    request_id_ = header.request_id;
    repeated_ = true;
    owes_exposed_ = owes_frame_ = true;
    return;
  }
  if (busy) return refuse(header.request_id, Status::busy, id, "another shot is under way");
  ++counters_.exposures;
  shot_id_ = id;
  request_id_ = header.request_id;
  phase_ = Phase::exposing;
  owes_exposed_ = owes_frame_ = true;
  repeated_ = false;
  busy_from_ = now;
  busy_until_ = now + times_.exposure + times_.processing;
}

// What time brings: the end of the exposure, the end of the processing. EXPOSED leaves before the frame is
// cast, so that in real time the robot does not wait for our arithmetic.
void ScannerServer::work(hal::Instant now) {
  if (phase_ == Phase::exposing && now >= busy_from_ + times_.exposure) {
    phase_ = Phase::computing;
    const hal::Instant middle = busy_from_ + times_.exposure / 2;
    const auto world_from_scanner = scene_.world_from_scanner(middle);
    if (owes_exposed_ && connected_) {
      send_exposed();
      flush();
    }
    Random random(seed_, Stream::optics, counters_.exposures);
    optics_.expose(scene_.plate(), world_from_scanner, random, raster_, frame_);
    scene_.spoil(frame_);
    frame_.shot_id = shot_id_;
    frame_.session_id = session_id_;
    frame_.exposed_sensor_ns = static_cast<std::uint64_t>(middle.count());
  }
  if (phase_ == Phase::computing && now >= busy_until_) phase_ = Phase::stored;
  if (!connected_ || phase_ == Phase::no_shot || phase_ == Phase::exposing) return;
  if (owes_exposed_) send_exposed();
  if (owes_frame_ && phase_ == Phase::stored) send_frame();
}

void ScannerServer::send_exposed() {
  owes_exposed_ = false;
  const psc1::Exposed reply{shot_id_, session_id_, repeated_};
  const auto acquired = static_cast<std::uint64_t>((busy_from_ + times_.exposure / 2).count());
  out_used_ += psc1::encode(request_id_, reply, acquired, std::span{out_}.subspan(out_used_));
}

void ScannerServer::send_frame() {
  const Eigen::Vector3f half = optics_.half_extent_mm().cast<float>();
  const std::size_t size =
      psc1::encode_frame(request_id_, frame_, config_.encoding, config_.intensity,
                         {half.x(), half.y(), half.z()}, std::span{out_}.subspan(out_used_));
  if (size == 0) return;  // the buffer still holds an earlier frame: next step
  out_used_ += size;
  owes_frame_ = false;
  ++counters_.frames_sent;
}

void ScannerServer::refuse(std::uint32_t request_id, Status status, std::uint32_t shot_id,
                           std::string_view text) {
  ++counters_.errors_sent;
  send(request_id, psc1::ErrorReply{status, shot_id, text});
}

// A payload of the wrong size breaks the stream's rules and ends the connection; a value of the wrong
// kind is answered.
void ScannerServer::wrong_payload(const psc1::Header& header, psc1::Flaw flaw) {
  if (flaw == psc1::Flaw::payload_size) return drop();
  refuse(header.request_id, Status::bad_argument, 0, psc1::to_string(flaw));
}

template <typename Reply>
void ScannerServer::send(std::uint32_t request_id, const Reply& reply) {
  const std::size_t size = psc1::encode(request_id, reply, std::span{out_}.subspan(out_used_));
  if (size == 0) return drop();  // a client that asks and never reads
  out_used_ += size;
}

void ScannerServer::flush() {
  while (out_sent_ < out_used_) {
    const std::size_t taken = link_.write(std::span{out_}.subspan(out_sent_, out_used_ - out_sent_));
    if (taken == 0) return;
    out_sent_ += taken;
  }
  out_sent_ = out_used_ = 0;
}

void ScannerServer::drop() {
  ++counters_.dropped;
  link_.close();
  forget_connection();
}

std::unique_ptr<ScannerDevice> make_scanner_server(hal::ByteLink& link, Optics optics, const Scene& scene,
                                                   const ScannerTimes& times, std::uint64_t seed) {
  return std::make_unique<ScannerServer>(link, std::move(optics), scene, times, seed);
}

}  // namespace moldloft::host_sim
