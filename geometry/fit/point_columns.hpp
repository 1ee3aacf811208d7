// The caller's points as they lie in memory: columns of double or float, dense or strided. Nothing is
// copied; a block at a time is read.
#pragma once

#include <cassert>
#include <cstddef>
#include <ranges>

namespace moldloft::geometry {

class Column {
 public:
  Column() = default;
  template <std::ranges::contiguous_range Values>  // of double or float: vectors, spans, arrays
  Column(const Values& values) : Column(std::ranges::data(values), std::ranges::size(values)) {}
  Column(const double* first, std::size_t size, std::ptrdiff_t stride = 1)  // stride in elements
      : doubles_(first), size_(size), stride_(stride) {}
  Column(const float* first, std::size_t size, std::ptrdiff_t stride = 1)
      : floats_(first), size_(size), stride_(stride) {}

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  double operator[](std::size_t i) const {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) * stride_;
    return doubles_ != nullptr ? doubles_[at] : floats_[at];
  }
  // `count` numbers from `first` on: the caller's own where they lie dense, else copied to `room`.
  const double* block(std::size_t first, int count, double* room) const {
    assert(first + count <= size_);
    if (doubles_ != nullptr && stride_ == 1) return doubles_ + first;
    for (int k = 0; k < count; ++k) room[k] = (*this)[first + k];
    return room;
  }

 private:
  const double* doubles_ = nullptr;
  const float* floats_ = nullptr;
  std::size_t size_ = 0;
  std::ptrdiff_t stride_ = 1;
};

// z over (u, v), all of one length; an empty weight column means that every point counts 1.
struct PointColumns {
  Column u, v, z, weight = {};
  std::size_t size() const { return z.size(); }
};

}  // namespace moldloft::geometry
