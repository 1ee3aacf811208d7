// A byte link that lets a recorder listen: every byte moved through it is handed on with its time.
//
// The drivers do not know of it. Because it sits between driver and link for the whole life of both, the
// recorder's offsets count the same bytes as the driver does.
//
// Thread, blocking, allocation, failure: as ByteLink says of the link inside.
#pragma once

#include "hal/base/clock.hpp"
#include "hal/links/byte_link.hpp"
#include "hal/record/recorder.hpp"

namespace moldloft::hal {

class TappedLink final : public ByteLink {
 public:
  TappedLink(ByteLink& link, LinkId id, Recorder& recorder, Clock& clock) noexcept
      : link_{link}, id_{id}, recorder_{recorder}, clock_{clock} {}

  void open() override { link_.open(); }
  void close() noexcept override { link_.close(); }
  std::size_t read(std::span<std::byte> out) noexcept override;
  std::size_t write(std::span<const std::byte> in) noexcept override;
  LinkState state() noexcept override { return link_.state(); }
  std::string_view why() const noexcept override { return link_.why(); }

 private:
  ByteLink& link_;
  LinkId id_;
  Recorder& recorder_;
  Clock& clock_;
};

}  // namespace moldloft::hal
