#include "firmware_like/config/device_links.hpp"

#include "hal/links/serial_link.hpp"
#include "hal/links/tcp_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>

namespace moldloft::firmware_like {
namespace {

std::uint16_t port_of(const LinkConfig& c) { return static_cast<std::uint16_t>(c.port); }

struct LinkKind {
  std::string_view name;
  const char* key;
  std::unique_ptr<hal::ByteLink> (*make)(const LinkConfig&);
  std::expected<hal::Claim, std::string> (*claim)(const LinkConfig&);
  std::string (*place)(const LinkConfig&);
};

constexpr std::array<LinkKind, 2> links{{
    {"tcp", "host", [](const LinkConfig& c) { return hal::make_tcp_link(c.host, port_of(c)); },
     [](const LinkConfig& c) { return hal::claim_address(c.host, port_of(c)); },
     [](const LinkConfig& c) { return fmt::format("{}:{}", c.host, c.port); }},
    {"serial", "device", [](const LinkConfig& c) { return hal::make_serial_link(c.device, c.baud); },
     [](const LinkConfig& c) { return hal::claim_serial(c.device); },
     [](const LinkConfig& c) { return c.device; }},
}};

const LinkKind& kind_of(const LinkConfig& c) {
  const auto found = std::ranges::find(links, c.link, &LinkKind::name);
  assert(found != links.end() && "the configuration admits only known links");
  return *found;
}

}  // namespace

std::vector<std::string> link_names() {
  std::vector<std::string> names;
  for (const auto& kind : links) names.emplace_back(kind.name);
  return names;
}

std::unique_ptr<hal::ByteLink> make_link(const LinkConfig& c) { return kind_of(c).make(c); }
std::expected<hal::Claim, std::string> claim_link(const LinkConfig& c) { return kind_of(c).claim(c); }
std::string place_of(const LinkConfig& c) { return kind_of(c).place(c); }
const char* key_of_place(const LinkConfig& c) { return kind_of(c).key; }

}  // namespace moldloft::firmware_like
