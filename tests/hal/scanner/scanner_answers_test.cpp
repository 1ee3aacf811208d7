// A scanner that somebody has written from PROTOCOLS.md and that is there, but not as it should be: what the driver
// says names it.
#include "hal/driver_bench.hpp"
#include "hal/scanner/psc_scanner.hpp"
#include "hal/scanner_peer.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

using namespace moldloft::hal;
using Kind = ScannerEvent::Kind;

namespace {

struct Cell : DriverBench<PscScanner, ScannerPeer, ScannerEvent> {
  explicit Cell(const PscScanner::Settings& settings = {})
      : DriverBench{{.bytes_per_second = 12.5e6}, settings} {}
  PscScanner& scanner = driver;
};

}  // namespace

TEST_CASE("a scanner whose frames are beyond the limits is unfit at once, by the keys that limit them") {
  Cell cell{{.max_points = 499}};
  cell.scanner.start(0ms);
  cell.run(50ms);
  CHECK(cell.scanner.state() == ScannerState::offline);
  REQUIRE(cell.count(Kind::unfit) == 1);
  CHECK(cell.events.back().text.view() ==
        "the scanner's frames have 10 stripes of 50 points, more than [scanner] max_stripes, "
        "max_points_per_stripe allow (499 points): raise them");
  CHECK(cell.scanner.why() == cell.events.back().text.view());
  cell.run(10s);
  CHECK(cell.count(Kind::unfit) == 1);  // said once
  CHECK(cell.peer.hellos > 3);          // and asked again: another scanner may come
  cell.peer.points_per_stripe = 49;
  CHECK(cell.run_until(Kind::ready, 3s));
}

TEST_CASE("a HELLO that cannot be true is unfit, and shows what was said") {
  const auto unfit = [](auto&& change) {
    Cell cell;
    cell.peer.on_send = [&](std::vector<std::byte>& message, psc1::Type type) {
      if (type != psc1::Type::hello) return true;
      auto hello = *psc1::decode_hello_reply(std::span{message}.subspan(psc1::header_size, 48));
      change(hello);
      message.resize(psc1::encode(1, hello, message));
      return true;
    };
    cell.scanner.start(0ms);
    cell.run(50ms);
    return cell.count(Kind::unfit) == 1 ? std::string{cell.events.back().text.view()} : "";
  };
  using Hello = psc1::HelloReply;
  const std::string begins = "the scanner's HELLO cannot be true: ";
  CHECK(unfit([](Hello& h) { h.max_stripes = 0; }) ==
        begins + "0 stripes of 50 points, field 102 x 102 mm, depth 40 mm, session 1000");
  CHECK(unfit([](Hello& h) { h.max_points_per_stripe = 0; }).starts_with(begins + "10 stripes of 0 points"));
  CHECK(unfit([](Hello& h) { h.field_x_mm = NAN; }).find("field nan x 102 mm") != std::string::npos);
  CHECK(unfit([](Hello& h) { h.field_y_mm = INFINITY; }).find("102 x inf mm") != std::string::npos);
  CHECK(unfit([](Hello& h) { h.field_x_mm = -102; }).find("field -102 x") != std::string::npos);
  CHECK(unfit([](Hello& h) { h.depth_mm = 0; }).find("depth 0 mm") != std::string::npos);
  CHECK(unfit([](Hello& h) { h.session_id = 0; }).find("session 0") != std::string::npos);
  CHECK(unfit([](Hello& h) {
          h.max_stripes = h.max_points_per_stripe = 65535;
        }).find("65535 stripes of 65535") != std::string::npos);
  CHECK(unfit([](Hello& h) { h.exposure_us = h.processing_us = 4'294'967'295; }).empty());  // for people only
}

TEST_CASE("a scanner's name ends at the first NUL, whatever stands behind it") {
  Cell cell;
  cell.peer.on_send = [&](std::vector<std::byte>& message, psc1::Type type) {
    if (type != psc1::Type::hello) return true;
    auto hello = *psc1::decode_hello_reply(std::span{message}.subspan(psc1::header_size, 48));
    hello.sensor = {'S', '1', '2', '\0', 'o', 'l', 'd'};
    message.resize(psc1::encode(1, hello, message));
    return true;
  };
  cell.start();
  CHECK(cell.scanner.info().sensor.view() == "S12");
}

TEST_CASE("a scanner's name is shown as text, whatever its bytes are") {
  Cell cell;
  cell.peer.on_send = [&](std::vector<std::byte>& message, psc1::Type type) {
    if (type != psc1::Type::hello) return true;
    auto hello = *psc1::decode_hello_reply(std::span{message}.subspan(psc1::header_size, 48));
    hello.sensor = {'4', 'D', '\n', '\xB0', '\x1b', '<',    'b',    '>',
                    '"', '%', 's',  '{',    '}',    '\xED', '\xA0', '\x80'};
    message.resize(psc1::encode(1, hello, message));
    return true;
  };
  cell.start();
  CHECK(cell.scanner.info().sensor.view() == "4D °?<b>\"%s{}í");  // sixteen bytes, and no more room
}

TEST_CASE("a scanner that cannot serve says why, and is asked again") {
  Cell fault;
  fault.peer.hello_status = psc1::Status::sensor_fault;
  fault.scanner.start(0ms);
  fault.run(50ms);
  CHECK(fault.scanner.why() == "the scanner answers HELLO with SENSOR_FAULT (status 5)");
  CHECK(fault.events.empty());
  fault.peer.hello_status = psc1::Status::ok;
  CHECK(fault.run_until(Kind::ready, 3s));

  Cell refuses;
  refuses.peer.config_status = psc1::Status::unsupported;
  refuses.scanner.start(0ms);
  refuses.run(3s);
  CHECK(refuses.scanner.why() == "the scanner answers CONFIG with UNSUPPORTED (status 3)");
  CHECK(refuses.events.empty());
  refuses.peer.config_status = psc1::Status::ok;
  CHECK(refuses.run_until(Kind::ready, 3s));

  Cell other;
  other.peer.hello_status = psc1::Status::unsupported;
  other.scanner.start(0ms);
  other.run(50ms);
  CHECK(other.scanner.why() == "the scanner does not speak version 1 of PSC1");
  CHECK(other.count(Kind::unfit) == 1);
}

TEST_CASE("a frame that comes too slowly is late, and so is what has to wait behind it") {
  Cell cell;
  cell.start();
  cell.peer.on_send = [](std::vector<std::byte>&, psc1::Type type) { return type != psc1::Type::frame; };
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::shot_failed, 20s));
  CHECK(cell.events.back().text.view() ==
        "the frame is late: nothing of it has come 2000 ms after it was asked for");

  Cell slow;
  slow.start();
  std::vector<std::byte> rest;
  slow.peer.on_send = [&](std::vector<std::byte>& message, psc1::Type type) {
    if (!rest.empty()) return false;  // whatever comes behind the frame has to wait for it
    if (type != psc1::Type::frame) return true;
    rest.assign(message.begin() + 1032, message.end());
    message.resize(1032);
    return true;
  };
  REQUIRE(slow.scanner.trigger(5, slow.clock.now()));
  REQUIRE(slow.run_until(Kind::exposed));
  bool failed = false;
  for (const Instant end = slow.clock.now() + 20s; slow.clock.now() < end && !failed;) {
    slow.run(500ms);
    if (rest.size() > 100) {  // a byte now and then: the scanner is not silent
      slow.peer.send({rest.begin(), rest.begin() + 1});
      rest.erase(rest.begin());
    }
    failed = slow.count(Kind::shot_failed) > 0;
  }
  REQUIRE(failed);
  const auto text = std::ranges::find(slow.events, Kind::shot_failed, &ScannerEvent::kind)->text;
  CAPTURE(text.view());
  CHECK(text.view().starts_with("the frame is late: 10"));
  CHECK(text.view().find(" of its ") != std::string_view::npos);
}

TEST_CASE("a sensor that computes for longer than a frame may take is called BUSY, not blind") {
  Cell cell;
  cell.peer.processing_time = 60s;
  cell.start();
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::shot_failed, 20s));
  REQUIRE(cell.scanner.trigger(6, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::shot_failed, 20s));
  CHECK(cell.events.back().text.view() ==
        "the scanner is still BUSY with the shot before: its frames take longer than the 2000 ms that they "
        "have");
  CHECK(cell.peer.exposures == 1);
}

TEST_CASE("a frame larger than the sensor's own HELLO said is refused, and both figures are named") {
  Cell cell;
  cell.peer.on_send = [&](std::vector<std::byte>&, psc1::Type type) {
    if (type == psc1::Type::config) cell.peer.stripes = 11;  // after HELLO
    return true;
  };
  cell.start();
  REQUIRE(cell.scanner.trigger(5, cell.clock.now()));
  REQUIRE(cell.run_until(Kind::lost));
  CHECK(cell.events.back().text.view() ==
        "FRAME of 11 stripes with 550 points; the scanner's HELLO said 10 and 500 at most");
}

TEST_CASE("what is no PSC1 at all is shown as it begins") {
  Cell cell;
  cell.start();
  const std::string_view banner = "SSH-2.0-OpenSSH_9.2p1 Debian-2\xB0\r\n and so on";
  const auto bytes = std::as_bytes(std::span{banner});
  cell.peer.send({bytes.begin(), bytes.end()});
  REQUIRE(cell.run_until(Kind::lost));
  CHECK(cell.events.back().text.view() ==
        "what comes from the scanner's port is no PSC1; it begins with \"SSH-2.0-OpenSSH_9.2p1 Debian-2° \"");
}
