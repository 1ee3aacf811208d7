// A driver on a cable with its peer at the other end, in ticks of 1 ms of virtual time, and all that it has reported.
#pragma once

#include "hal/links/cable.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

namespace moldloft::hal {

template <class Driver, class Peer, class Event>
struct DriverBench {
  using Kind = typename Event::Kind;

  explicit DriverBench(const Cable::Settings& wire, const typename Driver::Settings& settings = {})
      : cable{clock, wire}, peer{cable.device(), clock}, driver{cable.host(), settings} {}

  VirtualClock clock;
  Cable cable;
  Peer peer;
  Driver driver;
  std::vector<Event> events;

  void tick() {
    driver.receive(clock.now());
    while (const auto event = driver.next_event()) events.push_back(*event);
    driver.transmit(clock.now());
    peer.step();
    clock.sleep_until(clock.now() + std::chrono::milliseconds{1});
  }
  void run(Duration time) {
    for (const Instant end = clock.now() + time; clock.now() < end;) tick();
  }
  bool run_until(Kind kind, Duration limit = std::chrono::seconds{10}) {
    const std::size_t seen = events.size();
    for (const Instant end = clock.now() + limit; clock.now() < end;) {
      tick();
      if (events.size() > seen && events.back().kind == kind) return true;
    }
    return false;
  }
  void start() {
    driver.start(clock.now());
    REQUIRE(run_until(Kind::ready));
  }
  std::size_t count(Kind kind) const {
    return static_cast<std::size_t>(std::ranges::count(events, kind, &Event::kind));
  }
};

}  // namespace moldloft::hal
