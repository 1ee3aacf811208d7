// Numbers in and out of little-endian bytes, bounds-checked: what both halves of the PSC1 codec stand on.
//
// Thread       a value, like a pointer
// Allocation   none
// Failure      a write or read beyond the span does nothing and is remembered: ok() turns false
#pragma once

#include <bit>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>

namespace moldloft::hal {

static_assert(std::endian::native == std::endian::little, "the codec copies numbers as they lie in memory");

class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::byte> out) noexcept : out_{out} {}

  template <typename T>
  requires std::is_arithmetic_v<T>
  void put(T value) noexcept { bytes(std::as_bytes(std::span{&value, 1})); }
  void bytes(std::span<const std::byte> in) noexcept {
    if (in.size() > out_.size() - used_) {
      ok_ = false;
    } else if (!in.empty()) {
      std::memcpy(out_.data() + used_, in.data(), in.size());
      used_ += in.size();
    }
  }
  std::size_t used() const noexcept { return used_; }
  bool ok() const noexcept { return ok_; }

 private:
  std::span<std::byte> out_;
  std::size_t used_ = 0;
  bool ok_ = true;
};

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> in) noexcept : in_{in} {}

  template <typename T>
  requires std::is_arithmetic_v<T> T get()
  noexcept {
    T value{};
    if (sizeof value > left()) {
      ok_ = false;
    } else {
      std::memcpy(&value, in_.data() + used_, sizeof value);
      used_ += sizeof value;
    }
    return value;
  }
  std::span<const std::byte> take(std::size_t count) noexcept {
    if (count > left()) {
      ok_ = false;
      return {};
    }
    used_ += count;
    return in_.subspan(used_ - count, count);
  }
  std::size_t left() const noexcept { return in_.size() - used_; }
  bool ok() const noexcept { return ok_; }

 private:
  std::span<const std::byte> in_;
  std::size_t used_ = 0;
  bool ok_ = true;
};

}  // namespace moldloft::hal
