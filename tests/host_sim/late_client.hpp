// A server's end of a link whose client comes between two looks, after as many of them as one likes.
#pragma once

#include "hal/links/byte_link.hpp"

namespace moldloft::host_sim {

class LateClient final : public hal::ByteLink {
 public:
  explicit LateClient(int looks_before) : looks_left_{looks_before} {}

  void open() noexcept override {
    ++openings_;
    state_ = hal::LinkState::opening;
  }
  void close() noexcept override { state_ = hal::LinkState::closed; }
  std::size_t read(std::span<std::byte>) noexcept override { return 0; }
  std::size_t write(std::span<const std::byte>) noexcept override { return 0; }
  hal::LinkState state() noexcept override {
    if (state_ == hal::LinkState::opening && looks_left_-- == 0) state_ = hal::LinkState::open;
    return state_;
  }
  std::string_view why() const noexcept override { return ""; }

  int openings() const { return openings_; }  // each one beyond the first has thrown a client out

 private:
  hal::LinkState state_ = hal::LinkState::closed;
  int looks_left_, openings_ = 0;
};

}  // namespace moldloft::host_sim
