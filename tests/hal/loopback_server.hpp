// A TCP server for one client at a time, on a port of its own on loopback, never waiting: the far end of the
// TCP link's tests, with the system's calls alone so that it does not lean on the code that it tests.
#pragma once

#include <arpa/inet.h>
#include <cstddef>
#include <cstdint>
#include <fcntl.h>
#include <netinet/in.h>
#include <span>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace moldloft::hal {

class LoopbackServer {
 public:
  LoopbackServer() {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
    sockaddr_in any{};
    any.sin_family = AF_INET;
    any.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof any;
    bool good =
        ::bind(listener_, reinterpret_cast<sockaddr*>(&any), size) == 0 && ::listen(listener_, 1) == 0;
    good = good && ::getsockname(listener_, reinterpret_cast<sockaddr*>(&any), &size) == 0;
    port_ = good ? ntohs(any.sin_port) : 0;
  }
  ~LoopbackServer() {
    hang_up();
    ::close(listener_);
  }
  LoopbackServer(const LoopbackServer&) = delete;
  LoopbackServer& operator=(const LoopbackServer&) = delete;

  std::uint16_t port() const { return port_; }
  bool connected() const { return client_ >= 0; }
  void accept() {
    const int next = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK);
    if (next < 0) return;
    hang_up();
    client_ = next;
  }
  std::size_t read(std::span<std::byte> out) { return moved(::recv(client_, out.data(), out.size(), 0)); }
  std::size_t write(std::span<const std::byte> in) {
    return moved(::send(client_, in.data(), in.size(), MSG_NOSIGNAL));
  }
  void hang_up() {
    if (client_ >= 0) ::close(std::exchange(client_, -1));
  }
  // Ends the connection with RST instead of FIN, as a device that lost its power and came back does.
  void reset() {
    const linger at_once{.l_onoff = 1, .l_linger = 0};
    ::setsockopt(client_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    hang_up();
  }

 private:
  static std::size_t moved(ssize_t count) { return count > 0 ? static_cast<std::size_t>(count) : 0; }

  int listener_ = -1;
  int client_ = -1;
  std::uint16_t port_ = 0;
};

}  // namespace moldloft::hal
