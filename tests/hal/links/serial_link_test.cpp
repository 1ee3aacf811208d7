// What a serial port says when it cannot be had. Bytes through a pseudo-terminal are tested in
// tests/host_sim, where the preload library that libserialport needs for one is built.
#include "hal/links/serial_link.hpp"

#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/stat.h>
#include <unistd.h>

using namespace moldloft::hal;

namespace {

std::string why_not(const std::string& device) {
  const auto link = make_serial_link(device, 115200);
  link->open();
  std::byte byte{};
  CHECK(link->state() == LinkState::lost);
  CHECK(link->read({&byte, 1}) == 0);
  CHECK(link->write({&byte, 1}) == 0);
  return std::string{link->why()};
}

}  // namespace

TEST_CASE("a port that cannot be had gives one line that names it and the reason") {
  CHECK(why_not("/dev/tty-that-is-not-there") ==
        "/dev/tty-that-is-not-there does not exist: is the robot's cable plugged in, is the name right?");
  CHECK(why_not("no/such/path") ==
        "no/such/path does not exist: is the robot's cable plugged in, is the name right?");
  CHECK(why_not("/dev/null") == "/dev/null is not a serial port");
}

TEST_CASE("a file is no serial port, and one that may not be read says so") {
  const auto folder =
      std::filesystem::temp_directory_path() / ("moldloft-serial-" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  const std::string file = folder / "port";
  std::ofstream{file} << "not a port";
  CHECK(why_not(file) == file + " is not a serial port");
  ::chmod(file.c_str(), 0);
  if (::geteuid() != 0) {  // root may read everything
    CHECK(why_not(file) ==
          "no permission for " + file + ": the user must be in the group that owns it (often dialout)");
  }
  std::filesystem::remove_all(folder);
}

TEST_CASE("a serial link that was never opened is closed") {
  const auto link = make_serial_link("/dev/null", 9600);
  CHECK(link->state() == LinkState::closed);
  link->close();
  CHECK(link->state() == LinkState::closed);
}
