#include "hal/triplet/triplet_scanner.hpp"

#include "hal/base/crc32c.hpp"

#include <algorithm>
#include <cstring>

namespace moldloft::triplet {

using namespace std::chrono_literals;
using Kind = hal::ScannerEvent::Kind;

namespace {

constexpr hal::Duration greeting_limit = 1s, scan_limit = 2s;
constexpr int most_attempts = 3;
constexpr std::size_t bytes_a_tick = 32u << 10, points_a_tick = 2048;

}  // namespace

TripletScanner::TripletScanner(hal::ByteLink& link, std::size_t max_stripes, std::size_t max_points)
    : session_{link, {.outbox_bytes = 64}},
      message_(largest_scan(max_stripes, max_points)),
      frame_{max_stripes, max_points} {}

void TripletScanner::lose(hal::Instant now, std::string_view why) {
  why_ = why;
  session_.lose(now);
  if (std::exchange(announced_, false)) events_.push({Kind::lost, shot_, why_});
  have_ = 0;
  packed_ = false;
  phase_ = Phase::offline;
}

void TripletScanner::send(Type type, std::uint32_t id, std::size_t body_size) {
  std::array<std::byte, head_size + sizeof id> message;
  std::memcpy(message.data() + head_size, &id, body_size);
  session_.write(std::span{message}.first(finish(type, body_size, message)));
}

bool TripletScanner::trigger(std::uint32_t shot_id, hal::Instant now) {
  if (phase_ != Phase::ready || shot_id == 0) return false;
  shot_ = shot_id;
  attempts_ = 1;
  phase_ = Phase::exposing;
  deadline_ = now + scan_limit;
  send(Type::shot, shot_, 4);
  return true;
}

void TripletScanner::forget_shot() {
  shot_ = 0;
  if (phase_ == Phase::exposing) phase_ = Phase::ready;
}

hal::ScannerState TripletScanner::state() const {
  switch (phase_) {
    case Phase::greeting:
      return hal::ScannerState::greeting;
    case Phase::ready:
      return hal::ScannerState::ready;
    case Phase::exposing:
      return hal::ScannerState::exposing;
    default:
      return hal::ScannerState::offline;
  }
}

void TripletScanner::receive(hal::Instant now) {
  const auto news = session_.receive();
  if (news == hal::DeviceSession::News::lost) return lose(now, session_.why());
  if (news == hal::DeviceSession::News::opened) {
    phase_ = Phase::greeting;
    deadline_ = now + greeting_limit;
    send(Type::hello, 0, 0);
  }
  if (packed_) unpack(points_a_tick);
  for (std::size_t budget = bytes_a_tick; budget > 0 && !packed_ && phase_ != Phase::offline;) {
    const auto head = decode_head(std::span{message_}.first(have_));
    if (have_ >= head_size && (!head || head->body_size > message_.size() - head_size))
      return lose(now, "what comes from the scanner's port is no message of this make");
    const std::size_t wanted = head ? head_size + head->body_size : head_size;
    const std::size_t count =
        session_.read(std::span{message_}.subspan(have_, std::min(budget, wanted - have_)));
    have_ += count, budget -= count;
    if (head && have_ == wanted) {
      take_message(now);
    } else if (count == 0) {
      return;
    }
  }
}

void TripletScanner::take_message(hal::Instant now) {
  const auto head = *decode_head(message_);
  const auto body = std::span<const std::byte>{message_}.subspan(head_size, head.body_size);
  have_ = 0;
  if (hal::crc32c(body) != head.crc) return lose(now, "a message of the scanner was damaged");
  if (head.type == Type::hello && phase_ == Phase::greeting) take_info(body, now);
  if (head.type == Type::scan && phase_ == Phase::exposing) take_scan(body, now);
}

void TripletScanner::take_info(std::span<const std::byte> body, hal::Instant now) {
  Info info;
  if (body.size() != sizeof info) return lose(now, "the scanner's hello has another size");
  std::memcpy(&info, body.data(), sizeof info);
  if (info.stripes > frame_.stripes.size() || std::uint64_t{info.stripes} * info.points > frame_.x.size()) {
    events_.push({Kind::unfit, 0, "the scanner's frames are larger than [scanner] allows"});
    return lose(now, "the scanner's frames are larger than [scanner] allows");
  }
  const auto* end = std::ranges::find(info.name, '\0');
  info_.sensor = std::string_view{info.name.data(), static_cast<std::size_t>(end - info.name.begin())};
  info_ = {info_.sensor, 1, info.stripes, info.stripes * info.points, info.field_x_mm, info.field_y_mm,
           info.depth_mm};
  session_.greeted();
  phase_ = Phase::ready;
  announced_ = true;
  why_ = "";
  events_.push({Kind::ready, 0, {}});
  // The arm stands where it stood: nobody has told it that it may go.
  if (const auto shot = shot_; shot != 0 && attempts_ < most_attempts) {
    const int before = attempts_;
    trigger(shot, now);
    attempts_ = before + 1;
  }
}

void TripletScanner::take_scan(std::span<const std::byte> body, hal::Instant now) {
  if (!begin_scan(body, frame_)) return lose(now, "a scan contradicts itself");
  if (frame_.shot_id != shot_) return;
  frame_.session_id = info_.session_id;
  frame_.arrived = now;
  frame_offset_ = session_.received() - body.size();
  frame_bytes_ = static_cast<std::uint32_t>(body.size());
  unpacked_ = 0;
  packed_ = frame_.point_count > 0;
  phase_ = Phase::ready;
  events_.push({Kind::exposed, shot_, {}});
  events_.push({Kind::frame, std::exchange(shot_, 0), {}});
}

void TripletScanner::unpack(std::size_t at_most_points) {
  const std::size_t count = std::min(at_most_points, packed());
  const auto body = std::span<const std::byte>{message_}.subspan(head_size, frame_bytes_);
  decode_points(body, unpacked_, unpacked_ + count, frame_);
  unpacked_ += count;
  if (unpacked_ == frame_.point_count) packed_ = false;
}

void TripletScanner::transmit(hal::Instant now) {
  if (session_.transmit(now) == hal::DeviceSession::News::no_connection)
    return lose(now, "the scanner does not answer the connection request");
  if (phase_ == Phase::greeting && now >= deadline_) return lose(now, "the scanner does not answer");
  if (phase_ == Phase::exposing && now >= deadline_) {
    if (attempts_++ < most_attempts) {
      deadline_ = now + scan_limit;
      send(Type::shot, shot_, 4);
    } else {
      phase_ = Phase::ready;
      events_.push({Kind::shot_failed, std::exchange(shot_, 0), "the scanner sends no scan"});
    }
  }
  session_.flush();
}

}  // namespace moldloft::triplet
