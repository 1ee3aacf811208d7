// A byte link over TCP from the server's side: one client at a time on a loopback port; a new
// client replaces the one before.
//
// open() listens. The state is `opening` until a client has connected, `open` while it is there, `lost` when
// it has gone. Another open() waits for the next one.
//
// Thread       as ByteLink says
// Blocking     as ByteLink says
// Allocation   none after listen_on()
// Failure      listen_on() says why a port cannot be had
#pragma once

#include "hal/links/byte_link.hpp"
#include "host_sim/base/sim_error.hpp"

#include <cstdint>
#include <expected>
#include <memory>

namespace moldloft::host_sim {

class TcpServerLink final : public hal::ByteLink {
 public:
  // Port 0 takes any that is free; port() says which. `option`: what chooses another where this one is taken.
  static std::expected<std::unique_ptr<TcpServerLink>, SimError> listen_on(
      std::uint16_t port, std::string_view option = "--scanner-port");
  ~TcpServerLink() override;
  TcpServerLink(const TcpServerLink&) = delete;
  TcpServerLink& operator=(const TcpServerLink&) = delete;

  std::uint16_t port() const noexcept { return port_; }

  void open() override;
  void close() noexcept override;
  std::size_t read(std::span<std::byte> out) noexcept override;
  std::size_t write(std::span<const std::byte> in) noexcept override;
  hal::LinkState state() noexcept override;
  std::string_view why() const noexcept override { return why_; }

 private:
  TcpServerLink(int listener, std::uint16_t port) : listener_(listener), port_(port) {}
  int accept_one() noexcept;
  void lose(std::string_view why) noexcept;
  std::size_t moved(std::ptrdiff_t result, bool reading) noexcept;

  int listener_;
  int client_ = -1;
  int next_client_ = -1;  // has connected while another was there
  std::uint16_t port_;
  hal::LinkState state_ = hal::LinkState::closed;
  std::string_view why_ = "not opened yet";
};

}  // namespace moldloft::host_sim
