#include "firmware_like/config/memory_plan.hpp"

#include "firmware_like/config/cell_settings.hpp"
#include "firmware_like/controller/controller.hpp"
#include "hal/links/cable.hpp"

#include <doctest/doctest.h>

#include <malloc.h>
#include <map>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

MemoryPlan plan_for(const std::string& toml) {
  const auto config = parse_config(toml, "cell.toml");
  REQUIRE_MESSAGE(config.has_value(), config.error().what);
  hal::VirtualClock clock;
  hal::Cable scanner{clock, {}}, robot{clock, {}};
  return std::make_unique<Controller>(*config, clock, scanner.host(), robot.host())->memory();
}

std::size_t bytes_of(const MemoryPlan& plan, std::string_view subsystem) {
  for (const auto& item : plan) {
    if (item.subsystem == subsystem) return item.plan_bytes;
  }
  FAIL("no such subsystem");
  return 0;
}

}  // namespace

TEST_CASE("the plan's sums are those of its items") {
  const MemoryPlan plan = {{"a", 100, 10}, {"b", 20, 20}, {"c", 3, 0}};
  CHECK(total_plan(plan) == 123);
  CHECK(total_high_water(plan) == 30);
  CHECK(total_plan({}) == 0);
}

TEST_CASE("no subsystem has used more than its plan, and each is named once") {
  std::map<std::string, int> names;
  for (const auto& item : plan_for("")) {
    CAPTURE(item.subsystem);
    CHECK(item.plan_bytes > 0);
    CHECK(item.high_water_bytes <= item.plan_bytes);
    CHECK(++names[item.subsystem] == 1);
  }
  CHECK(names.size() >= 6);
}

TEST_CASE("the plan is what the controller takes: nothing of its heap is missing in it") {
  for (const char* more :
       {"", "[plate]\nlargest_mm = [1500, 700]", "[scanner]\nmax_points_per_stripe = 1000"}) {
    CAPTURE(more);
    const auto config = parse_config("schema = 1\n" + std::string{more}, "cell.toml");
    REQUIRE(config.has_value());
    hal::VirtualClock clock;
    hal::Cable scanner{clock, {}}, robot{clock, {}};
    const auto taken = [] { return ::mallinfo2().uordblks + ::mallinfo2().hblkhd; };
    const std::size_t before = taken();
    const auto controller = std::make_unique<Controller>(*config, clock, scanner.host(), robot.host());
    const auto heap = static_cast<double>(taken() - before);
    if (heap == 0) return;  // under a sanitizer's allocator glibc knows nothing
    // What rounding of blocks and the controller's own small members add.
    CHECK(static_cast<double>(total_plan(controller->memory())) == doctest::Approx(heap).epsilon(0.01));
  }
}

TEST_CASE("a larger plate asks for more, frame by frame, edge by edge, span by span") {
  const auto small = plan_for("[plate]\nlargest_mm = [300, 300]"),
             large = plan_for("[plate]\nlargest_mm = [1500, 700]");
  for (const char* grows : {"cell and tracker", "outline", "boundary reserve", "surface fit"}) {
    CAPTURE(grows);
    CHECK(bytes_of(large, grows) > bytes_of(small, grows));
  }
  CHECK(bytes_of(large, "recorder rings") == bytes_of(small, "recorder rings"));  // frames are no larger
  CHECK(bytes_of(large, "scheduler") == bytes_of(small, "scheduler"));
}

TEST_CASE("larger frames ask for more where frames are kept") {
  const auto small = plan_for(""), large = plan_for("[scanner]\nmax_points_per_stripe = 1000");
  CHECK(bytes_of(large, "recorder rings") >
        1.9 * static_cast<double>(bytes_of(small, "recorder rings") - (1u << 20)));
  CHECK(bytes_of(large, "cell and tracker") > bytes_of(small, "cell and tracker"));
  CHECK(total_plan(plan_for("[scanner]\nencoding = \"float32\"")) > total_plan(small));
}

TEST_CASE("the plan is enough for the plate that it is made for") {
  // 500 x 500 mm in fields of 102 mm: 57 mm of boundary a shot, 92 mm of surface.
  const auto cell = cell_settings(default_config());
  CHECK(cell.tracker.max_shots >= 4 * 500 / 57 + 1);
  CHECK(cell.max_surface_shots >= 6 * 6);
  CHECK(cell.max_points == 50000);
  // No span shorter than the finest wanted, and none twice as long: nets go by powers of two.
  const auto surface = surface_settings(default_config());
  CHECK(500.0 / surface.fit.max_spans_u >= 10);
  CHECK(500.0 / surface.fit.max_spans_u < 20);
  CHECK(surface.fit.max_shots >= static_cast<int>(cell.max_surface_shots) + cell.tracker.max_shots);
}

TEST_CASE("the cell's settings are the configuration's") {
  auto config = default_config();
  config.plate.table_z_mm = -20;
  config.plate.thickness_mm = 8;
  config.robot.speed_percent = 40;
  config.tracking_crossing_deg = 60;
  const auto cell = cell_settings(config);
  CHECK(cell.lowest_plate_z_mm == doctest::Approx(-16));  // half a thickness over the table
  CHECK(cell.speed_percent == 40);
  CHECK(cell.tracker.crossing == doctest::Approx(1.0471975512));
  CHECK(cell.tracker.max_seek_steps == 42);  // 3000 mm in steps of 70
  CHECK(cell.view.boundary.stripe_pitch_mm == doctest::Approx(102.0 / 99));
}
