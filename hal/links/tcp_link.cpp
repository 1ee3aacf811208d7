#include "hal/links/tcp_link.hpp"

#include "hal/base/fixed_text.hpp"
#include "hal/base/realtime.hpp"
#include "hal/base/realtime_section.hpp"

#include <asio/ip/tcp.hpp>

#include <cerrno>
#include <cstring>
#include <netdb.h>
#include <optional>
#include <poll.h>
#include <sys/socket.h>
#include <utility>

namespace moldloft::hal {
namespace {

using asio::ip::tcp;

// Reads the hosts file alone. getaddrinfo() would ask a name server, which can take its time-out
// of many seconds.
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
    const PromiseSuspended opening;
    checked_at_run_time([this] { connect(); });
  }

  void close() noexcept override {
    const PromiseSuspended closing;
    checked_at_run_time([this] { release(); });
    state_ = LinkState::closed;
    why_ = "closed";
  }

  std::size_t read(std::span<std::byte> out) noexcept override {
    if (state_ != LinkState::open || out.empty()) return 0;
    return moved(
        ask([&](auto& error) { return socket_.read_some(asio::buffer(out.data(), out.size()), error); }));
  }

  std::size_t write(std::span<const std::byte> in) noexcept override {
    if (state_ != LinkState::open || in.empty()) return 0;
    return moved(
        ask([&](auto& error) { return socket_.write_some(asio::buffer(in.data(), in.size()), error); }));
  }

  LinkState state() noexcept override {
    if (state_ == LinkState::opening) look_at_connect();
    if (state_ == LinkState::open) look_for_hang_up();
    return state_;
  }

  std::string_view why() const noexcept override { return why_; }

 private:
  void connect() {
    release();
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

  void release() noexcept {
    asio::error_code ignored;  // the descriptor is gone whatever close() says
    socket_.close(ignored);
  }

  // What became of a call on the socket, which does not wait.
  struct Answer {
    std::size_t count = 0;
    int error = 0;
    bool ended = false;  // the peer has nothing more to say
  };
  template <typename Call>
  static Answer ask(Call&& call) noexcept MOLDLOFT_NONBLOCKING {
    return answered_at_once([&] {
      asio::error_code error;
      const std::size_t count = call(error);
      return Answer{count, error.value(), error == asio::error::eof};
    });
  }

  short poll_now(short events) noexcept {
    return answered_at_once([&] {
      pollfd look{.fd = socket_.native_handle(), .events = events, .revents = 0};
      return ::poll(&look, 1, 0) > 0 ? look.revents : short{0};
    });
  }

  void look_at_connect() noexcept {
    if (poll_now(POLLOUT) == 0) return;
    const int result = answered_at_once([&] {
      int error = 0;
      socklen_t size = sizeof error;
      return getsockopt(socket_.native_handle(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
    });
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
    moved(ask([&](auto& error) {
      return socket_.receive(asio::buffer(&next, 1), tcp::socket::message_peek, error);
    }));
  }

  std::size_t moved(const Answer& answer) noexcept {
    if (answer.ended) {
      lose("{}:{} has closed the connection", host_, port_);
    } else if (answer.error != 0 && answer.error != EAGAIN && answer.error != EINTR) {
      lose_to_errno(answer.error);
    }
    return answer.count;
  }

  void lose_to_errno(int error) noexcept {
    const char* hint = error == ECONNREFUSED ? " (is the server running?)" : "";
    // A table of constants.
    const char* what = checked_at_run_time([&] { return strerrordesc_np(error); });
    lose("{}:{}: {}{}", host_, port_, what, hint);
  }

  template <typename... Args>
  void lose(TextPattern<Args...> pattern, Args&&... args) noexcept {
    close();
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

bool is_known_host(const std::string& host) { return find_address(host).has_value(); }

std::string tcp_address(const std::string& host) {
  auto address = find_address(host);
  if (!address) return {};
  if (address->is_v6() && address->to_v6().is_v4_mapped())
    address = asio::ip::make_address_v4(asio::ip::v4_mapped, address->to_v6());
  // Connecting to no address in particular leads to the machine itself.
  if (*address == asio::ip::address_v4::any()) address = asio::ip::address_v4::loopback();
  return address->to_string();
}

std::unique_ptr<ByteLink> make_tcp_link(std::string host, std::uint16_t port) {
  return std::make_unique<TcpLink>(std::move(host), port);
}

}  // namespace moldloft::hal
