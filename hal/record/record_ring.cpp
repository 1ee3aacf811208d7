#include "hal/record/record_ring.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace moldloft::hal {
namespace {

struct RecordFrame {
  std::uint32_t kind = 0;
  std::uint32_t size = 0;
};

}  // namespace

RecordRing::RecordRing(std::size_t capacity_bytes) : ring_((capacity_bytes + 7) / 8 * 8) {
  static_assert(sizeof(RecordFrame) == frame_bytes);
}

bool RecordRing::write(std::uint32_t kind, std::initializer_list<std::span<const std::byte>> parts) noexcept {
  std::size_t size = 0;
  for (const auto part : parts) size += part.size();
  if (space_of(size) > room()) return false;
  const std::uint64_t begin = written_.load(std::memory_order_relaxed);
  const RecordFrame frame{.kind = kind, .size = static_cast<std::uint32_t>(size)};
  copy_in(begin, std::as_bytes(std::span{&frame, 1}));
  std::uint64_t at = begin + frame_bytes;
  for (const auto part : parts) {
    copy_in(at, part);
    at += part.size();
  }
  written_.store(begin + space_of(size), std::memory_order_release);
  high_water_.store(std::max(high_water_.load(std::memory_order_relaxed), used()), std::memory_order_relaxed);
  return true;
}

std::size_t RecordRing::used() const noexcept {
  // Released first: it can only grow up to what was written before, so the difference is never negative.
  const std::uint64_t released = released_.load(std::memory_order_acquire);
  return written_.load(std::memory_order_acquire) - released;
}

std::size_t RecordRing::room() const noexcept { return ring_.size() - used(); }
std::size_t RecordRing::high_water() const noexcept { return high_water_.load(std::memory_order_relaxed); }

void RecordRing::copy_in(std::uint64_t at, std::span<const std::byte> bytes) noexcept {
  if (bytes.empty()) return;
  const std::size_t begin = at % ring_.size();
  const std::size_t before_wrap = std::min(bytes.size(), ring_.size() - begin);
  std::memcpy(ring_.data() + begin, bytes.data(), before_wrap);
  if (before_wrap < bytes.size())
    std::memcpy(ring_.data(), bytes.data() + before_wrap, bytes.size() - before_wrap);
}

void RecordRing::copy_out(std::uint64_t at, std::span<std::byte> bytes) const noexcept {
  if (bytes.empty()) return;
  const std::size_t begin = at % ring_.size();
  const std::size_t before_wrap = std::min(bytes.size(), ring_.size() - begin);
  std::memcpy(bytes.data(), ring_.data() + begin, before_wrap);
  if (before_wrap < bytes.size())
    std::memcpy(bytes.data() + before_wrap, ring_.data(), bytes.size() - before_wrap);
}

RecordRing::Reader::Reader(RecordRing& ring)
    : ring_{ring},
      at_{ring.released_.load(std::memory_order_relaxed)},
      end_{ring.written_.load(std::memory_order_acquire)} {}

std::optional<RecordRing::Reader::Record> RecordRing::Reader::next() {
  if (at_ == end_) return std::nullopt;
  std::array<std::byte, frame_bytes> head;
  ring_.copy_out(at_, head);
  const auto frame = std::bit_cast<RecordFrame>(head);
  ring_.scratch_.resize(frame.size);
  ring_.copy_out(at_ + frame_bytes, ring_.scratch_);
  at_ += space_of(frame.size);
  return Record{.kind = frame.kind, .bytes = ring_.scratch_};
}

void RecordRing::Reader::release() noexcept { ring_.released_.store(at_, std::memory_order_release); }

}  // namespace moldloft::hal
