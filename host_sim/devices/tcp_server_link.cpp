#include "host_sim/devices/tcp_server_link.hpp"

#include <fmt/format.h>

#include <arpa/inet.h>
#include <cerrno>
#include <cstring>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

// A simulated device: its descriptors do not wait either, but it promises nothing.
MOLDLOFT_CHECKED_AT_RUN_TIME

namespace moldloft::host_sim {

using hal::LinkState;

std::expected<std::unique_ptr<TcpServerLink>, SimError> TcpServerLink::listen_on(std::uint16_t port,
                                                                                 std::string_view option) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const auto refused = [&] {
    const int error = errno;
    if (listener >= 0) ::close(listener);
    return std::unexpected(SimError{fmt::format("{} {}: {}{}", option, port, std::strerror(error),
                                                error == EADDRINUSE ? "; choose another port" : "")});
  };
  if (listener < 0) return refused();
  const int yes = 1;  // a port that was in use a minute ago may be taken again
  ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(listener, reinterpret_cast<sockaddr*>(&address), size) != 0) return refused();
  if (::listen(listener, 4) != 0) return refused();
  if (::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) != 0) return refused();
  return std::unique_ptr<TcpServerLink>(new TcpServerLink(listener, ntohs(address.sin_port)));
}

TcpServerLink::~TcpServerLink() {
  close();
  if (next_client_ >= 0) ::close(next_client_);
  ::close(listener_);
}

void TcpServerLink::open() {
  close();
  state_ = LinkState::opening;
  why_ = "waits for a client";
}

void TcpServerLink::close() noexcept {
  if (client_ >= 0) ::close(client_);
  client_ = -1;
  state_ = LinkState::closed;
  why_ = "closed";
}

std::size_t TcpServerLink::read(std::span<std::byte> out) noexcept {
  if (state_ != LinkState::open || out.empty()) return 0;
  return moved(::recv(client_, out.data(), out.size(), MSG_DONTWAIT), true);
}

std::size_t TcpServerLink::write(std::span<const std::byte> in) noexcept {
  if (state_ != LinkState::open || in.empty()) return 0;
  return moved(::send(client_, in.data(), in.size(), MSG_DONTWAIT | MSG_NOSIGNAL), false);
}

LinkState TcpServerLink::state() noexcept {
  if (state_ == LinkState::opening) {
    client_ = next_client_ >= 0 ? std::exchange(next_client_, -1) : accept_one();
    if (client_ < 0) return state_;
    state_ = LinkState::open;
    why_ = "";
  } else if (state_ == LinkState::open) {
    char next = 0;
    moved(::recv(client_, &next, 1, MSG_PEEK | MSG_DONTWAIT), true);
    if (state_ == LinkState::open) next_client_ = accept_one();
    if (next_client_ >= 0) lose("another client has taken its place");
  }
  return state_;
}

int TcpServerLink::accept_one() noexcept {
  const int client = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  const int yes = 1;
  if (client >= 0) ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  return client;
}

std::size_t TcpServerLink::moved(std::ptrdiff_t result, bool reading) noexcept {
  if (result > 0) return static_cast<std::size_t>(result);
  if (result == 0) {
    if (reading) lose("the client has hung up");
  } else if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) {
    lose("the connection broke");
  }
  return 0;
}

void TcpServerLink::lose(std::string_view why) noexcept {
  close();
  state_ = LinkState::lost;
  why_ = why;
}

}  // namespace moldloft::host_sim
