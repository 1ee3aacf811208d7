// The byte links to a device, by the name that `link` in its section gives: one table. Any driver runs
// on any link.
//
// Thread       the first thread, before anything runs
// Blocking     claim() never; open links as ByteLink says
// Allocation   yes
// Failure      claim(): one line that names the device and the process that has it
#pragma once

#include "hal/links/byte_link.hpp"
#include "hal/links/claim.hpp"

#include <expected>
#include <memory>
#include <string>
#include <vector>

namespace moldloft::firmware_like {

// Where a device is found. `link` says which of the rest count.
struct LinkConfig {
  std::string link = "tcp";
  std::string host = "127.0.0.1";  // tcp
  int port = 0;
  std::string device = "/dev/ttyS0";  // serial
  int baud = 115200;
};

std::vector<std::string> link_names();
std::unique_ptr<hal::ByteLink> make_link(const LinkConfig&);
// While the claim lives, connected or not, no other process commands the device.
std::expected<hal::Claim, std::string> claim_link(const LinkConfig&);

std::string place_of(const LinkConfig&);      // "192.168.10.2:4014", "/dev/ttyS0"
const char* key_of_place(const LinkConfig&);  // "host", "device": what to change where nothing is found there

}  // namespace moldloft::firmware_like
