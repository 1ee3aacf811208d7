// A byte link over TCP, as client: standalone Asio underneath, its socket non-blocking, TCP_NODELAY set.
// Connecting is a state that state() looks at, never a wait. Only numeric addresses and localhost names that the
// resolver answers from its files are looked up, in open().
//
// Thread, blocking, allocation, failure: as ByteLink says. open() allocates; read(), write() and state() do not.
#pragma once

#include "hal/links/byte_link.hpp"

#include <cstdint>
#include <memory>
#include <string>

namespace moldloft::hal {

// The address that a host's name leads to, in numbers: one text for one address. Empty: it leads nowhere.
std::string tcp_address(const std::string& host);

std::unique_ptr<ByteLink> make_tcp_link(std::string host, std::uint16_t port);

// Whether open() would find an address for this host. Blocking: reads the hosts file.
bool is_known_host(const std::string& host);

}  // namespace moldloft::hal
