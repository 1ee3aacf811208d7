#include "hal/links/device_session.hpp"

#include <algorithm>
#include <cassert>

namespace moldloft::hal {

DeviceSession::DeviceSession(ByteLink& link, const Settings& settings)
    : link_{link}, settings_{settings}, outbox_(settings.outbox_bytes) {
  assert(settings.first_back_off > 0ns && settings.last_back_off >= settings.first_back_off);
  assert(settings.heartbeat <= settings.silent_limit);
}

void DeviceSession::start(Instant now) {
  if (state_ == State::closed) open(now);
}

void DeviceSession::open(Instant now) {
  state_ = State::opening;
  due_ = now + settings_.connect_timeout;
  heard_at_ = said_at_ = now;
  waiting_bytes_ = 0;  // what was meant for the connection before
  link_.open();
}

DeviceSession::News DeviceSession::receive() {
  if (state_ != State::opening && state_ != State::open) return News::none;
  const LinkState link = link_.state();
  if (link == LinkState::lost) return News::lost;
  if (state_ == State::open || link != LinkState::open) return News::none;
  state_ = State::open;
  return News::opened;
}

DeviceSession::News DeviceSession::transmit(Instant now) {
  if (state_ == State::waiting && now >= due_) {
    open(now);
  } else if (state_ == State::opening && now >= due_) {
    return News::no_connection;
  }
  return News::none;
}

void DeviceSession::lose(Instant now) {
  assert(state_ == State::opening || state_ == State::open);
  link_.close();
  state_ = State::waiting;
  back_off_ = back_off_ == 0ns ? settings_.first_back_off : std::min(2 * back_off_, settings_.last_back_off);
  due_ = now + back_off_;
}

std::size_t DeviceSession::read(std::span<std::byte> in) {
  if (!is_open()) return 0;
  const std::size_t count = link_.read(in);
  received_ += count;
  return count;
}

bool DeviceSession::write(std::span<const std::byte> message) {
  const auto to = room();
  if (message.size() > to.size()) return false;
  std::ranges::copy(message, to.begin());
  add(message.size());
  return true;
}

void DeviceSession::flush() {
  if (waiting_bytes_ == 0 || !is_open()) return;
  const std::size_t count = link_.write(std::span{outbox_}.first(waiting_bytes_));
  std::copy(outbox_.begin() + count, outbox_.begin() + waiting_bytes_, outbox_.begin());
  waiting_bytes_ -= count;
}

}  // namespace moldloft::hal
