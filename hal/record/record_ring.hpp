// A ring of records of any size between one writer and one reader: a record is there whole or not at all.
//
// A record takes 8 bytes of frame (kind and size) beside its own, rounded up to 8. Records wrap around the
// end, so the whole capacity is usable and room() is exact.
//
// Thread       write(), room(), high_water(): the writer. Reader: the one reader. used(), plan_bytes(): any.
// Blocking     never; no locks
// Allocation   in the constructor only
// Failure      write() says false when the record does not fit; nothing is written then
#pragma once

#include "hal/base/realtime.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <vector>

namespace moldloft::hal {

class RecordRing {
 public:
  explicit RecordRing(std::size_t capacity_bytes);  // rounded up to 8

  // ---- the writer: the parts become one record
  bool write(std::uint32_t kind,
             std::initializer_list<std::span<const std::byte>> parts) noexcept MOLDLOFT_NONBLOCKING;
  std::size_t room() const noexcept MOLDLOFT_NONBLOCKING;  // bytes free, frames included
  std::size_t high_water() const noexcept;                 // most bytes that have waited at once

  static constexpr std::size_t space_of(std::size_t record_bytes) noexcept {
    return frame_bytes + (record_bytes + 7) / 8 * 8;
  }

  // ---- the reader: looks through what is there, then releases it, or keeps it by not doing so
  class Reader {
   public:
    struct Record {
      std::uint32_t kind = 0;
      std::span<const std::byte> bytes;  // until the next call of next()
    };

    explicit Reader(RecordRing& ring);
    std::optional<Record> next();  // in order, up to what was there when the Reader was made; may allocate
    void release() noexcept;       // everything that next() has given

   private:
    RecordRing& ring_;
    std::uint64_t at_;
    std::uint64_t end_;
  };

  std::size_t used() const noexcept;
  std::size_t plan_bytes() const noexcept { return ring_.size(); }

 private:
  static constexpr std::size_t frame_bytes = 8;

  void copy_in(std::uint64_t at, std::span<const std::byte> bytes) noexcept;
  void copy_out(std::uint64_t at, std::span<std::byte> bytes) const noexcept;

  std::vector<std::byte> ring_;
  std::vector<std::byte> scratch_;  // the reader's: a record in one piece
  // Bytes ever written and ever released; on lines of their own, so that the two threads do not
  // fight over one.
  alignas(64) std::atomic<std::uint64_t> written_{0};
  std::atomic<std::size_t> high_water_{0};
  alignas(64) std::atomic<std::uint64_t> released_{0};
};

}  // namespace moldloft::hal
