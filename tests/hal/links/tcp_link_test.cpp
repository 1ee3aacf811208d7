#include "hal/links/tcp_link.hpp"

#include "hal/base/clock.hpp"
#include "hal/loopback_server.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <netinet/tcp.h>
#include <string>

using namespace moldloft::hal;

namespace {

bool within(Duration limit, const std::function<bool()>& condition) {
  SteadyClock clock;
  while (clock.now() < limit) {
    if (condition()) return true;
    clock.sleep_until(clock.now() + 100us);
  }
  return false;
}

bool comes_to(ByteLink& link, LinkState state) {
  return within(2s, [&] { return link.state() == state; });
}

std::uint16_t port_that_nobody_serves() {
  const LoopbackServer gone;
  return gone.port();
}

}  // namespace

TEST_CASE("a connection that is refused is lost with a reason, and open() does not wait for it") {
  const std::uint16_t port = port_that_nobody_serves();
  const auto link = make_tcp_link("127.0.0.1", port);
  SteadyClock clock;
  link->open();
  CHECK(clock.now() < 50ms);
  REQUIRE(comes_to(*link, LinkState::lost));
  CHECK(std::string{link->why()} ==
        "127.0.0.1:" + std::to_string(port) + ": Connection refused (is the server running?)");
}

TEST_CASE("requests leave at once: the socket does not hold small ones back to merge them") {
  LoopbackServer server;
  const auto link = make_tcp_link("127.0.0.1", server.port());
  link->open();
  REQUIRE(comes_to(*link, LinkState::open));
  // The link's own descriptor, told by whom it is connected to.
  int found = 0;
  for (int handle = 3; handle < 1024; ++handle) {
    sockaddr_in peer{};
    socklen_t size = sizeof peer;
    if (::getpeername(handle, reinterpret_cast<sockaddr*>(&peer), &size) != 0) continue;
    if (peer.sin_family != AF_INET || ntohs(peer.sin_port) != server.port()) continue;
    ++found;
    int no_delay = 0;
    size = sizeof no_delay;
    REQUIRE(::getsockopt(handle, IPPROTO_TCP, TCP_NODELAY, &no_delay, &size) == 0);
    CHECK(no_delay != 0);
  }
  CHECK(found == 1);
}

TEST_CASE("opening is a state: an address that never answers keeps it without holding up the caller") {
  // A listener with a full queue leaves further connects unanswered.
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  REQUIRE(::bind(listener, reinterpret_cast<sockaddr*>(&address), size) == 0);
  REQUIRE(::listen(listener, 0) == 0);
  REQUIRE(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  const auto first = make_tcp_link("127.0.0.1", ntohs(address.sin_port));
  first->open();
  REQUIRE(comes_to(*first, LinkState::open));
  const auto second = make_tcp_link("127.0.0.1", ntohs(address.sin_port));
  SteadyClock clock;
  second->open();
  for (int i = 0; i < 100; ++i) (void)second->state();
  CHECK(clock.now() < 100ms);
  CHECK(second->state() == LinkState::opening);
  std::array<std::byte, 4> bytes{};
  CHECK(second->read(bytes) == 0);
  CHECK(second->write(bytes) == 0);
  second->close();
  CHECK(second->state() == LinkState::closed);
  ::close(listener);
}

TEST_CASE("what the peer sent before it hung up is still read, then the link is lost with a reason") {
  LoopbackServer server;
  const auto link = make_tcp_link("localhost", server.port());
  link->open();
  REQUIRE(within(2s, [&] {
    server.accept();
    return server.connected() && link->state() == LinkState::open;
  }));
  const std::string last_words = "last words";
  REQUIRE(server.write(std::as_bytes(std::span{last_words})) == last_words.size());
  server.hang_up();
  SteadyClock clock;
  clock.sleep_until(5ms);
  CHECK(link->state() == LinkState::open);
  std::array<std::byte, 64> bytes;
  std::size_t count = 0;
  REQUIRE(within(2s, [&] { return (count += link->read(bytes)) == last_words.size(); }));
  REQUIRE(comes_to(*link, LinkState::lost));
  CHECK(std::string{link->why()} ==
        "localhost:" + std::to_string(server.port()) + " has closed the connection");
}

TEST_CASE("a connection that is reset is lost too") {
  LoopbackServer server;
  const auto link = make_tcp_link("127.0.0.1", server.port());
  link->open();
  REQUIRE(within(2s, [&] {
    server.accept();
    return server.connected() && link->state() == LinkState::open;
  }));
  server.reset();
  REQUIRE(comes_to(*link, LinkState::lost));
  CHECK(link->why().find("reset by peer") != std::string_view::npos);
}

TEST_CASE("a name that only a name server could know is refused at once") {
  const auto link = make_tcp_link("scanner.invalid", 4014);
  SteadyClock clock;
  link->open();
  CHECK(clock.now() < 200ms);
  CHECK(link->state() == LinkState::lost);
  CHECK(link->why() ==
        "'scanner.invalid' is neither an address nor a name in /etc/hosts: write the address in numbers");
}
