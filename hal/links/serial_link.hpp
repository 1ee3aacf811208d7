// A byte link over a serial port: libserialport underneath, 8N1, no flow control.
//
// A path outside /dev is handed to libserialport as /dev/../../../PATH: the library takes a port only by a name in
// /dev. Outside /dev the path must be a symbolic link to the terminal (serial_link.cpp says why).
// read() tells a silent line (0 bytes) from a port that is gone (state() turns lost) by polling the handle
// for a hang-up.
//
// Thread, blocking, allocation, failure: as ByteLink says. open() allocates; read(), write() and state() do not.
#pragma once

#include "hal/links/byte_link.hpp"

#include <memory>
#include <string>

namespace moldloft::hal {

std::unique_ptr<ByteLink> make_serial_link(std::string device, int baud);

}  // namespace moldloft::hal
