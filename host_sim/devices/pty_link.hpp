// The robot's end of a serial line: the master of a pseudo-terminal, whose other side stands under a
// name of choice.
//
// The name is a symbolic link to the terminal's device; it is made here and taken away with the object. The state is
// `opening` until a program has opened the device, `open` while it has, `lost` when it has closed it.
//
// Thread       as ByteLink says
// Blocking     as ByteLink says
// Allocation   none after create()
// Failure      create() says why there is no terminal or why the name cannot be had
#pragma once

#include "hal/links/byte_link.hpp"
#include "host_sim/base/sim_error.hpp"

#include <expected>
#include <memory>
#include <string>

namespace moldloft::host_sim {

class PtyLink final : public hal::ByteLink {
 public:
  static std::expected<std::unique_ptr<PtyLink>, SimError> create(const std::string& link_path);
  ~PtyLink() override;
  PtyLink(const PtyLink&) = delete;
  PtyLink& operator=(const PtyLink&) = delete;

  const std::string& path() const noexcept { return path_; }

  void open() override;
  void close() noexcept override;
  std::size_t read(std::span<std::byte> out) noexcept override;
  std::size_t write(std::span<const std::byte> in) noexcept override;
  hal::LinkState state() noexcept override;
  std::string_view why() const noexcept override { return why_; }

 private:
  PtyLink(int master, std::string path) : master_(master), path_(std::move(path)) {}

  int master_;
  std::string path_;
  hal::LinkState state_ = hal::LinkState::closed;
  std::string_view why_ = "not opened yet";
};

}  // namespace moldloft::host_sim
