#include "hal/scanner/psc_scanner.hpp"

#include "hal/base/crc32c.hpp"
#include "hal/base/printable_text.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace moldloft::hal {

using namespace psc1;

namespace {

// A FRAME payload of this many stripes and points in the larger encoding, with its
// CRC (PROTOCOLS.md, "FRAME").
constexpr std::size_t largest_body(std::uint32_t stripes, std::uint32_t points) {
  return 48 + std::size_t{12} * stripes + std::size_t{13} * points + payload_crc_size;
}

// Everything that is not a FRAME fits into this, whatever the limits of a frame are.
constexpr std::size_t smallest_body = 4096;

}  // namespace

PscScanner::PscScanner(ByteLink& link, const Settings& settings)
    : session_{link,
               {.connect_timeout = settings.connect_timeout,
                .first_back_off = settings.first_back_off,
                .last_back_off = settings.last_back_off,
                .heartbeat = settings.ping_period,
                .silent_limit = settings.silent_pings * settings.ping_period,
                .outbox_bytes = 256}},
      settings_{settings},
      body_(std::max(largest_body(settings.max_stripes, settings.max_points), smallest_body)),
      frame_{settings.max_stripes, settings.max_points} {
  assert(settings.bytes_a_tick >= header_size && settings.silent_pings >= 1 && settings.retries >= 0);
}

std::size_t PscScanner::plan_bytes() const {
  return sizeof *this + session_.plan_bytes() + body_.size() + frame_.stripes.size() * sizeof(Stripe) +
         frame_.x.size() * (3 * sizeof(float) + sizeof(std::uint8_t));
}

void PscScanner::cue(Cue what, Instant now) {
  const auto* row = find_transition(psc_transitions(), phase_, what, context());
  if (row == nullptr) return;
  phase_ = row->to;
  carry_out(row->action, now);
}

PscContext PscScanner::context() const {
  return {.has_retries = shot_.attempts <= settings_.retries,
          .outstanding = shot_.outstanding,
          .exposed = shot_.exposed,
          .same_session = shot_.session_id == info_.session_id};
}

// ---- what the cell asks

void PscScanner::start(Instant now) {
  if (session_.state() == DeviceSession::State::closed) why_ = "its link is not open yet";
  session_.start(now);
}

bool PscScanner::trigger(std::uint32_t shot_id, Instant now) {
  if (phase_ != Phase::ready || shot_id == 0) return false;  // 0 stands for no shot on the wire
  shot_ = {.id = shot_id, .outstanding = true};
  cue(Cue::triggered, now);
  return true;
}

void PscScanner::forget_shot() {
  shot_.outstanding = false;
  cue(Cue::forgotten, Instant{});
}

ScannerState PscScanner::state() const {
  switch (phase_) {
    case Phase::offline:
      return ScannerState::offline;
    case Phase::greeting:
    case Phase::configuring:
      return ScannerState::greeting;
    case Phase::ready:
      return ScannerState::ready;
    case Phase::exposing:
      return ScannerState::exposing;
    case Phase::computing:
      return ScannerState::computing;
  }
  return ScannerState::offline;
}

// ---- actions of the table

void PscScanner::carry_out(PscAction action, Instant now) {
  switch (action) {
    case PscAction::back_off:
      return back_off(now);
    case PscAction::report_loss:
      return report_loss(now);
    case PscAction::greet:
      return greet(now);
    case PscAction::configure:
      return configure(now);
    case PscAction::announce:
      return announce(now);
    case PscAction::announce_and_trigger:
      announce(now);
      return send_trigger(now);
    case PscAction::announce_and_fail:
      announce(now);
      explain_void_shot();
      return fail_shot();
    case PscAction::send_trigger:
      return send_trigger(now);
    case PscAction::report_exposed:
      return report_exposed(now);
    case PscAction::report_frame:
      return report_frame();
    case PscAction::report_both:
      report_exposed(now);
      return report_frame();
    case PscAction::fail_shot:
      return fail_shot();
    case PscAction::drop_shot:
      return drop_shot();
  }
}

void PscScanner::back_off(Instant now) {
  session_.lose(now);
  drop_arriving();
  ask_again_at_.reset();
}

void PscScanner::report_loss(Instant now) {
  failure_ = why_;
  if (std::exchange(announced_, false))
    events_.push({ScannerEvent::Kind::lost, shot_.outstanding ? shot_.id : 0, why_});
  back_off(now);
}

void PscScanner::greet(Instant now) {
  incoming_ = {};
  session_.heard(now);
  deadline_ = now + settings_.greeting_timeout;
  send(HelloRequest{});
}

void PscScanner::configure(Instant now) {
  deadline_ = now + settings_.greeting_timeout;
  send(Config{.encoding = settings_.encoding, .intensity = settings_.intensity});
}

void PscScanner::announce(Instant now) {
  session_.greeted();
  session_.said(now);
  announced_ = true;
  refused_ = false;
  why_ = "";
  events_.push({ScannerEvent::Kind::ready, 0, {}});
}

void PscScanner::explain_void_shot() {
  if (shot_.exposed && shot_.session_id != info_.session_id)
    failure_ = "the scanner restarted between EXPOSED and FRAME; the arm may have moved since";
}

void PscScanner::send_trigger(Instant now) {
  ++shot_.attempts;
  was_busy_ = false;
  ask_again_at_.reset();
  deadline_ = now + (phase_ == Phase::exposing ? settings_.exposure_timeout : settings_.frame_timeout);
  send(Trigger{.shot_id = shot_.id});
}

void PscScanner::report_exposed(Instant now) {
  shot_.exposed = true;
  shot_.exposed_request = incoming_.head.request_id;
  shot_.session_id = info_.session_id;
  deadline_ = now + settings_.frame_timeout;
  events_.push({ScannerEvent::Kind::exposed, shot_.id, {}});
}

void PscScanner::report_frame() {
  shot_.outstanding = false;
  ask_again_at_.reset();
  events_.push({ScannerEvent::Kind::frame, shot_.id, {}});
}

void PscScanner::fail_shot() {
  shot_.outstanding = false;
  drop_arriving();
  ask_again_at_.reset();
  events_.push({ScannerEvent::Kind::shot_failed, shot_.id, failure_});
}

void PscScanner::drop_shot() {
  ask_again_at_.reset();
  drop_arriving();
}

// ---- what arrives

void PscScanner::receive(Instant now) {
  const DeviceSession::News news = session_.receive();
  if (news == DeviceSession::News::lost) return lose(now, session_.why());
  if (news == DeviceSession::News::opened) return cue(Cue::link_open, now);
  if (!session_.is_open()) return;
  // The bytes of the last frame lie where the next message would go.
  if (packed_ && !arriving_) {
    unpack(settings_.points_a_tick);
    if (packed_) return;
  }
  for (std::size_t budget = settings_.bytes_a_tick; budget > 0;) {
    const std::size_t count = read_some(budget);
    if (count == 0) break;
    session_.heard(now);
    budget -= count;
    if (incoming_.header_have < header_size) continue;
    if (incoming_.payload_offset == 0 && !take_header(now)) return;
    const std::size_t body_size =
        incoming_.head.payload_length == 0 ? 0 : incoming_.head.payload_length + payload_crc_size;
    if (incoming_.body_have < body_size) continue;
    take_message(now);
    if (!session_.is_open()) return;  // the message was the connection's last
    incoming_ = {};
    if (packed_) return;
  }
  look_at_arriving();
}

std::size_t PscScanner::packed() const {
  if (!packed_) return 0;
  const std::size_t here =
      arriving_ ? points_within(incoming_.body_have, *packed_) : std::size_t{packed_->point_count};
  return here - unpacked_;
}

void PscScanner::unpack(std::size_t at_most_points) {
  if (const std::size_t count = std::min(at_most_points, packed()); count > 0) {
    // The message's bytes are still where they were received.
    decode_points(std::span<const std::byte>{body_}.first(frame_bytes_), *packed_, unpacked_,
                  unpacked_ + count, frame_);
    unpacked_ += count;
  }
  if (packed_ && !arriving_ && unpacked_ == packed_->point_count) packed_.reset();
}

// A frame that the cell waits for may be looked at as soon as its heights begin to come, the last but one of its
// columns. Its head decides nothing before the CRC has been right: bytes that are wrong cost a look in vain.
void PscScanner::look_at_arriving() {
  if (arriving_ || phase_ != Phase::computing || incoming_.payload_offset == 0 ||
      incoming_.head.type != Type::frame)
    return;
  const auto payload = std::span<const std::byte>{body_}.first(incoming_.head.payload_length);
  const auto head = decode_frame_head(payload.first(std::min(payload.size(), incoming_.body_have)));
  if (!head || !is_of_our_shot(*head) || points_within(incoming_.body_have, *head) == 0) return;
  const auto begun = begin_frame(payload, frame_);
  if (!begun) return;
  packed_ = *begun, unpacked_ = 0;
  arriving_ = true;
  frame_offset_ = incoming_.payload_offset;
  frame_bytes_ = incoming_.head.payload_length;
  events_.push({ScannerEvent::Kind::arriving, shot_.id, {}});
}

void PscScanner::drop_arriving() {
  if (!std::exchange(arriving_, false)) return;
  packed_.reset();
  unpacked_ = 0;
}

bool PscScanner::is_of_our_shot(const FrameHead& head) const {
  return shot_.outstanding && head.shot_id == shot_.id && head.session_id == info_.session_id;
}

// Reads what is missing of the header, or of the body, and never beyond: nothing is copied twice.
std::size_t PscScanner::read_some(std::size_t budget) {
  if (incoming_.header_have < header_size) {
    const auto room = std::span{incoming_.header}.subspan(incoming_.header_have);
    const std::size_t count = session_.read(room.first(std::min(room.size(), budget)));
    incoming_.header_have += count;
    return count;
  }
  const std::size_t length = incoming_.head.payload_length;
  const auto room = std::span{body_}.first(length + payload_crc_size).subspan(incoming_.body_have);
  const auto wanted = room.first(std::min(room.size(), budget));
  const std::size_t count = session_.read(wanted);
  if (incoming_.body_have < length) {
    incoming_.crc = crc32c(wanted.first(std::min(count, length - incoming_.body_have)), incoming_.crc);
  }
  incoming_.body_have += count;
  return count;
}

bool PscScanner::take_header(Instant now) {
  const auto head = decode_header(incoming_.header);
  if (!head && head.error() == Flaw::magic) {
    ++broken_streams_;
    const auto* begin = reinterpret_cast<const char*>(incoming_.header.data());
    lose(now, Message::format("what comes from the scanner's port is no PSC1; it begins with \"{}\"",
                              printable_text<48>({begin, incoming_.header.size()}).view()));
    return false;
  }
  if (!head) {
    broken(now, "header", head.error());
    return false;
  }
  if (head->payload_length + payload_crc_size > body_.size()) {
    broken(now, "header", Flaw::length);
    return false;
  }
  incoming_.head = *head;
  incoming_.payload_offset = session_.received();
  return true;
}

void PscScanner::take_message(Instant now) {
  const auto payload = std::span<const std::byte>{body_}.first(incoming_.head.payload_length);
  if (!payload.empty()) {
    std::uint32_t crc = 0;
    std::memcpy(&crc, body_.data() + payload.size(), sizeof crc);
    if (crc != incoming_.crc) return broken(now, "message", Flaw::payload_crc);
  }
  switch (incoming_.head.type) {
    case Type::hello:
      return on_hello(payload, now);
    case Type::config:
      return on_config(payload, now);
    case Type::exposed:
      return on_exposed(payload, now);
    case Type::frame:
      return on_frame(payload, now);
    case Type::error:
      return on_error(payload, now);
    case Type::ping:    // that it came is all that it says
    case Type::status:  // not asked for by this driver
    case Type::trigger:
    case Type::reset:
      return;
  }
}

void PscScanner::on_hello(std::span<const std::byte> payload, Instant now) {
  if (phase_ != Phase::greeting) return;
  const auto hello = decode_hello_reply(payload);
  if (!hello) return broken(now, "HELLO", hello.error());
  if (hello->status != Status::ok && hello->status != Status::unsupported) {
    return lose(now, Message::format("the scanner answers HELLO with {} (status {})",
                                     to_string(hello->status), std::to_underlying(hello->status)));
  }
  if (const auto why = unfit(*hello)) return refuse(now, *why);
  const auto points = std::uint32_t{hello->max_stripes} * hello->max_points_per_stripe;
  const auto* name_end = std::ranges::find(hello->sensor, '\0');
  info_.sensor =
      printable_text<16>({hello->sensor.data(), static_cast<std::size_t>(name_end - hello->sensor.begin())});
  info_.session_id = hello->session_id;
  info_.max_stripes = hello->max_stripes;
  info_.max_points = points;
  info_.field_x_mm = hello->field_x_mm;
  info_.field_y_mm = hello->field_y_mm;
  info_.depth_mm = hello->depth_mm;
  cue(Cue::greeted, now);
}

// What no second HELLO will change.
std::optional<Message> PscScanner::unfit(const HelloReply& hello) const {
  if (hello.status == Status::unsupported || hello.version != protocol_version)
    return Message::format("the scanner does not speak version {} of PSC1", protocol_version);
  const auto points = std::uint32_t{hello.max_stripes} * hello.max_points_per_stripe;
  if (hello.max_stripes > settings_.max_stripes || points > settings_.max_points) {
    return Message::format(
        "the scanner's frames have {} stripes of {} points, more than [scanner] max_stripes, "
        "max_points_per_stripe allow ({} points): raise them",
        hello.max_stripes, hello.max_points_per_stripe, settings_.max_points);
  }
  const auto is_length = [](float mm) { return std::isfinite(mm) && mm > 0; };
  if (points == 0 || hello.session_id == 0 || !is_length(hello.field_x_mm) || !is_length(hello.field_y_mm) ||
      !is_length(hello.depth_mm)) {
    return Message::format(
        "the scanner's HELLO cannot be true: {} stripes of {} points, field {:.6g} x {:.6g} mm, depth {:.6g} "
        "mm, "
        "session {}",
        hello.max_stripes, hello.max_points_per_stripe, hello.field_x_mm, hello.field_y_mm, hello.depth_mm,
        hello.session_id);
  }
  return std::nullopt;
}

void PscScanner::on_config(std::span<const std::byte> payload, Instant now) {
  if (phase_ != Phase::configuring) return;
  const auto config = decode_config(payload);
  if (!config) return broken(now, "CONFIG", config.error());
  if (config->status != Status::ok) {
    return lose(now, Message::format("the scanner answers CONFIG with {} (status {})",
                                     to_string(config->status), std::to_underlying(config->status)));
  }
  cue(Cue::configured, now);
}

void PscScanner::on_exposed(std::span<const std::byte> payload, Instant now) {
  const auto exposed = decode_exposed(payload);
  if (!exposed) return broken(now, "EXPOSED", exposed.error());
  if (!shot_.outstanding || exposed->shot_id != shot_.id) return;
  if (shot_.exposed && incoming_.head.request_id == shot_.exposed_request)
    return;  // the same answer once more
  if (exposed->session_id != info_.session_id)
    return lose(now, "the scanner restarted: its session is a new one");
  if (phase_ == Phase::exposing && exposed->repeated && shot_.attempts == 1) {
    // A stored frame from before: an earlier run has used this id, the picture is of another place.
    failure_ = "the scanner has exposed this shot id before: ids must not be used twice";
    return cue(Cue::exposed_anew, now);
  }
  if (phase_ == Phase::computing && shot_.attempts > 1 && !exposed->repeated) {
    failure_ = "the scanner had lost the frame and exposed again; the arm may have moved since";
    return cue(Cue::exposed_anew, now);
  }
  cue(Cue::exposed, now);
}

void PscScanner::on_frame(std::span<const std::byte> payload, Instant now) {
  const auto head = decode_frame_head(payload);
  if (!head) return broken(now, "FRAME", head.error());
  if (!is_of_our_shot(*head)) {
    ++stale_frames_;
    return;
  }
  if (head->stripe_count > info_.max_stripes || head->point_count > info_.max_points) {
    return lose(
        now, Message::format("FRAME of {} stripes with {} points; the scanner's HELLO said {} and {} at most",
                             head->stripe_count, head->point_count, info_.max_stripes, info_.max_points));
  }
  if (!std::exchange(arriving_, false)) {
    const auto begun = begin_frame(payload, frame_);
    if (!begun) return broken(now, "FRAME", begun.error());
    packed_ = *begun, unpacked_ = 0;
  }
  if (unpacked_ == packed_->point_count) packed_.reset();
  decode_intensities(payload, *head, frame_);
  frame_.exposed_sensor_ns = incoming_.head.acquired_ns;
  frame_.arrived = now;
  frame_offset_ = incoming_.payload_offset;
  frame_bytes_ = incoming_.head.payload_length;
  cue(Cue::frame, now);
}

void PscScanner::on_error(std::span<const std::byte> payload, Instant now) {
  const auto error = decode_error(payload);
  if (!error) return broken(now, "ERROR", error.error());
  const auto text = Message::format("scanner: {} ({}, status {})", error->text.view(),
                                    to_string(error->status), std::to_underlying(error->status));
  const bool of_our_shot = shot_.outstanding && error->shot_id == shot_.id;
  if (error->status == Status::busy && of_our_shot) {
    was_busy_ = true;
    ask_again_at_ = now + settings_.busy_pause;
  } else if (error->status == Status::bad_state || phase_ == Phase::greeting ||
             phase_ == Phase::configuring) {
    lose(now, text);  // the sensor has forgotten its configuration: begin again
  } else if (of_our_shot) {
    failure_ = text;
    cue(Cue::late, now);
  }
}

// ---- time

void PscScanner::transmit(Instant now) {
  watch(now);
  session_.flush();
}

void PscScanner::watch(Instant now) {
  if (session_.transmit(now) == DeviceSession::News::no_connection)
    return lose(now, "the scanner does not answer the connection request");
  switch (phase_) {
    case Phase::offline:
      return;
    case Phase::greeting:
    case Phase::configuring:
      if (now >= deadline_)
        lose(now, phase_ == Phase::greeting ? "the scanner does not answer HELLO"
                                            : "the scanner does not answer CONFIG");
      return;
    case Phase::ready:
      break;
    case Phase::exposing:
    case Phase::computing:
      if (now >= deadline_) {
        failure_ = phase_ == Phase::exposing ? why_not_exposed() : why_no_frame();
        cue(Cue::late, now);
      } else if (ask_again_at_ && now >= *ask_again_at_) {
        ask_again_at_.reset();
        send(Trigger{.shot_id = shot_.id});
      }
      break;
  }
  if (session_.is_silent(now)) {
    lose(now, Message::format("the scanner has been silent for {} ms", session_.silence(now) / 1ms));
  } else if (session_.heartbeat_due(now)) {
    session_.said(now);
    session_.add(encode_empty(++request_id_, Type::ping, session_.room()));
  }
}

// A request that finds no room is as good as lost on the way; its deadline takes care of it.
template <typename M>
void PscScanner::send(const M& message) {
  session_.add(encode(++request_id_, message, session_.room()));
}

void PscScanner::lose(Instant now, const Message& why) {
  why_ = why;
  cue(Cue::link_lost, now);
}

void PscScanner::refuse(Instant now, const Message& why) {
  if (!std::exchange(refused_, true)) events_.push({ScannerEvent::Kind::unfit, 0, why});
  lose(now, why);
}

// A frame on its way keeps back everything behind it.
Message PscScanner::why_no_frame() const {
  const auto limit_ms = settings_.frame_timeout / 1ms;
  if (incoming_.payload_offset == 0 || incoming_.head.type != Type::frame)
    return Message::format("the frame is late: nothing of it has come {} ms after it was asked for",
                           limit_ms);
  return Message::format("the frame is late: {} of its {} bytes have come {} ms after it was asked for",
                         incoming_.body_have, incoming_.head.payload_length, limit_ms);
}

Message PscScanner::why_not_exposed() const {
  if (incoming_.payload_offset != 0 && incoming_.head.type == Type::frame) return why_no_frame();
  if (was_busy_)
    return Message::format(
        "the scanner is still BUSY with the shot before: its frames take longer than the {} ms "
        "that they have",
        settings_.frame_timeout / 1ms);
  return Message::format("the scanner did not expose within {} ms", settings_.exposure_timeout / 1ms);
}

// A stream that once went wrong is never trusted again: no hunting for the next magic.
void PscScanner::broken(Instant now, std::string_view what, Flaw flaw) {
  ++broken_streams_;
  lose(now, Message::format("{} from the scanner: {}", what, to_string(flaw)));
}

LossCounts PscScanner::losses() const {
  return {{"broken streams", broken_streams_},
          {"stale frames", stale_frames_},
          {"lost events", events_.dropped()}};
}

}  // namespace moldloft::hal
