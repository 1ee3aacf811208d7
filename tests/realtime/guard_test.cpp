// The preloaded guard itself: it sees everything that a real-time section may not do, and nothing else.
#include "realtime/guarded_run.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace moldloft;
using test::report_of_probe;

TEST_CASE("the guard counts every function that it knows when a section calls it") {
  const auto report = report_of_probe("all");
  CHECK(report["calls"].size() == 70);
  for (const auto& [name, calls] : report["calls"].items()) CHECK_MESSAGE(calls.get<int>() >= 1, name);
}

TEST_CASE("what hardening calls by another name counts as what it is") {
  const auto calls = report_of_probe("checked")["calls"];
  for (const auto* each : {"read", "pread", "recv", "recvfrom", "poll", "ppoll", "fread", "open", "open64",
                           "openat", "printf", "fprintf"})
    CHECK_MESSAGE(calls[each] == 1, each);
}

TEST_CASE("what the control thread may do does not count") {
  const auto report = report_of_probe("allowed");
  CHECK(report["all"] == 0);
  CHECK(report["asked"] == 3);  // read, send and recv of descriptors that do not wait
  CHECK(report["sleeps"] == 1);
}

TEST_CASE("beside the section everything is allowed, and while its promise is suspended") {
  CHECK(report_of_probe("outside")["all"] == 0);
  CHECK(report_of_probe("suspended")["all"] == 0);
}

TEST_CASE("a section that grows a vector is seen to allocate and to free") {
  const auto report = report_of_probe("new");
  CHECK(report["calls"]["malloc"] == 1);
  CHECK(report["calls"]["free"] == 1);
  CHECK(report["all"] == 2);
}
