// A plate that is formed step by step: each pass is seen as far from its design as it is.
#include "host_sim/runs/passes.hpp"

#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>

using namespace moldloft;
using namespace moldloft::host_sim;

TEST_CASE("three passes come nearer to the design, and inspection sees each as it is") {
  const hal::TemporaryFolder folder;
  PassesOptions options;
  options.cell.plate = "dome";
  options.cell.formed = mistakes_from("springback 0.7, twist 5 mm").value();
  options.passes = 3;
  options.out = folder.file("passes");
  const auto passes = run_passes(options);
  REQUIRE_MESSAGE(passes.has_value(), passes.error().what);
  REQUIRE(passes->size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& p = (*passes)[i];
    CHECK(std::abs(p.measured.rms_mm - p.truth.rms_mm) < 0.02);
    CHECK(std::abs(p.worst_mm - p.true_worst_mm) < 0.1);
    if (i > 0) CHECK(p.measured.rms_mm < 0.6 * (*passes)[i - 1].measured.rms_mm);
    CHECK(std::filesystem::exists(options.out / ("pass-" + std::to_string(p.number)) / "inspection.json"));
  }
  CHECK_FALSE(passes->front().within);
  CHECK(passes->back().within);
}

TEST_CASE("passes to another shape are refused") {
  PassesOptions options;
  options.cell.formed = mistakes_from("dome, twist 1 mm").value();
  options.out = "nowhere";
  const auto passes = run_passes(options);
  REQUIRE_FALSE(passes);
  CHECK(passes.error().what.find("not another shape") != std::string::npos);
}
