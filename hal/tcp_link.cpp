#include "hal/tcp_link.hpp"

#include "hal/fixed_text.hpp"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

#include <asio/ip/tcp.hpp>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

namespace moldloft::hal {
namespace {

using asio::ip::tcp;

// Reads the hosts file alone. getaddrinfo() would ask a name server, which can take its time-out of many
// seconds.
std::optional<asio::ip::address> from_hosts_file(const std::string& name) {
  std::optional<asio::ip::address> found;
  sethostent(0);
  while (const hostent* entry = gethostent()) {
    bool matches = name == entry->h_name;
    for (char** alias = entry->h_aliases; *alias != nullptr; ++alias) matches = matches || name == *alias;
    if (!matches || entry->h_addrtype != AF_INET) continue;
    asio::ip::address_v4::bytes_type bytes;
    std::memcpy(bytes.data(), entry->h_addr_list[0], bytes.size());
    found = asio::ip::address_v4{bytes};
    break;
  }
  endhostent();
  return found;
}

std::optional<asio::ip::address> find_address(const std::string& host) {
  asio::error_code error;
  const auto numeric = asio::ip::make_address(host, error);
  if (!error) return numeric;
  if (host == "localhost") return asio::ip::address_v4::loopback();
  return from_hosts_file(host);
}

class TcpLink final : public ByteLink {
 public:
  TcpLink(std::string host, std::uint16_t port) : host_{std::move(host)}, port_{port} {}

  void open() override {
    close();
    // Looked up once: reading the hosts file is disk and heap, and a reconnect happens between two ticks.
    if (!address_) address_ = find_address(host_);
    if (!address_) {
      lose("'{}' is neither an address nor a name in /etc/hosts: write the address in numbers", host_);
      return;
    }
    const tcp::endpoint peer{*address_, port_};
    asio::error_code error;
    socket_.open(peer.protocol(), error);
    if (!error) socket_.non_blocking(true, error);
    // Requests are a few bytes, and each waits for its answer: held back to be merged, they cost 40 ms each.
    if (!error) socket_.set_option(tcp::no_delay{true}, error);
    if (error) {
      lose("no socket for {}:{}: {}", host_, port_, strerrordesc_np(error.value()));
      return;
    }
    // Asio's own connect() waits for the answer even on a non-blocking socket.
    state_ = LinkState::opening;
    if (::connect(socket_.native_handle(), peer.data(), static_cast<socklen_t>(peer.size())) == 0) {
      state_ = LinkState::open;
    } else if (errno != EINPROGRESS) {
      lose_to_errno(errno);
    }
  }

  void close() noexcept override {
    asio::error_code ignored;  // the descriptor is gone whatever close() says
    socket_.close(ignored);
    state_ = LinkState::closed;
    why_ = "closed";
  }

  std::size_t read(std::span<std::byte> out) noexcept override {
    if (state_ != LinkState::open || out.empty()) return 0;
    asio::error_code error;
    const std::size_t count = socket_.read_some(asio::buffer(out.data(), out.size()), error);
    judge(error);
    return count;
  }

  std::size_t write(std::span<const std::byte> in) noexcept override {
    if (state_ != LinkState::open || in.empty()) return 0;
    asio::error_code error;
    const std::size_t count = socket_.write_some(asio::buffer(in.data(), in.size()), error);
    judge(error);
    return count;
  }

  LinkState state() noexcept override {
    if (state_ == LinkState::opening) look_at_connect();
    if (state_ == LinkState::open) look_for_hang_up();
    return state_;
  }

  std::string_view why() const noexcept override { return why_; }

 private:
  short poll_now(short events) noexcept {
    pollfd look{.fd = socket_.native_handle(), .events = events, .revents = 0};
    return ::poll(&look, 1, 0) > 0 ? look.revents : short{0};
  }

  void look_at_connect() noexcept {
    if (poll_now(POLLOUT) == 0) return;
    int result = 0;
    socklen_t size = sizeof result;
    if (getsockopt(socket_.native_handle(), SOL_SOCKET, SO_ERROR, &result, &size) != 0) result = errno;
    if (result != 0) {
      lose_to_errno(result);
      return;
    }
    state_ = LinkState::open;
    why_ = "";
  }

  // A peer that has hung up may have left bytes behind; they are read before the link counts as lost.
  void look_for_hang_up() noexcept {
    const short seen = poll_now(POLLRDHUP);
    if ((seen & (POLLRDHUP | POLLHUP | POLLERR)) == 0) return;
    char next = 0;
    const auto left = ::recv(socket_.native_handle(), &next, 1, MSG_PEEK | MSG_DONTWAIT);
    if (left > 0) return;
    if (left == 0) {
      lose("{}:{} has closed the connection", host_, port_);
    } else if (errno != EAGAIN) {
      lose_to_errno(errno);
    }
  }

  void judge(const asio::error_code& error) noexcept {
    if (!error || error == asio::error::would_block || error == asio::error::interrupted) return;
    if (error == asio::error::eof) {
      lose("{}:{} has closed the connection", host_, port_);
    } else {
      lose_to_errno(error.value());
    }
  }

  void lose_to_errno(int error) noexcept {
    const char* hint = error == ECONNREFUSED ? " (is the server running?)" : "";
    lose("{}:{}: {}{}", host_, port_, strerrordesc_np(error), hint);
  }

  template <typename... Args>
  void lose(fmt::format_string<Args...> pattern, Args&&... args) noexcept {
    asio::error_code ignored;
    socket_.close(ignored);
    state_ = LinkState::lost;
    why_ = Message::format(pattern, std::forward<Args>(args)...);
  }

  std::string host_;
  std::uint16_t port_;
  std::optional<asio::ip::address> address_;
  asio::io_context context_{1};  // Asio wants one; nothing ever runs in it
  tcp::socket socket_{context_};
  LinkState state_ = LinkState::closed;
  Message why_ = "not opened yet";
};

}  // namespace

std::unique_ptr<ByteLink> make_tcp_link(std::string host, std::uint16_t port) {
  return std::make_unique<TcpLink>(std::move(host), port);
}

}  // namespace moldloft::hal
