// Programs under the preloaded guard, and what it reports of them.
#pragma once

#include "hal/temporary_folder.hpp"
#include "host_sim/child_process.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <string>

namespace moldloft::test {

inline nlohmann::json json_in(const std::string& file) {
  return nlohmann::json::parse(host_sim::text_of(file));
}

// What the guard says of one run of realtime_probe.
inline nlohmann::json report_of_probe(const std::string& how) {
  const hal::TemporaryFolder folder;
  host_sim::ChildProcess probe{{"/usr/bin/env", "MOLDLOFT_GUARD_REPORT=" + folder.file("report"),
                                "LD_PRELOAD=" REALTIME_GUARD, REALTIME_PROBE, how}};
  REQUIRE(probe.wait(std::chrono::seconds{20}) == 0);
  return json_in(folder.file("report"));
}

}  // namespace moldloft::test
