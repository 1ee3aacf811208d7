// The report of a measurement: what stands first, what an inspection adds, and no text from outside is markup.
#include "firmware_like/report/measurement_page.hpp"

#include "firmware_like/made_up_run.hpp"
#include "firmware_like/results/timing_report.hpp"
#include "tasks/scripted_clock.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

RunResult measured() {
  auto result = MadeUpRun{}.result();
  result.label.plate = "plate <7> & \"co\"";
  result.outcome = Outcome::complete;
  result.is_audited = true;
  tasks::ScriptedClock clock;
  tasks::ScriptedTask task{clock, {}};
  tasks::Scheduler scheduler{clock, {.tick = std::chrono::milliseconds{1}}};
  scheduler.add({.name = "cell", .budget = std::chrono::microseconds{200}}, task);
  scheduler.start();
  scheduler.run_until(std::chrono::milliseconds{50});
  result.timing = timing_report({.scheduler = scheduler});
  return result;
}

Json inspection() {
  return Json::parse(
      R"({"verdict":"fails","close_to_limit":false,"design":{"file":"a<b>.step","kind":"surface"},
    "alignment":{"method":"robust"},"inside":{"min_mm":-4.2,"max_mm":1.5,"rms_mm":0.6},
    "map":{"rows":2,"columns":2,"mm":[1,2,3,null]},"histogram":[[-1,0,3],[0,1,9]],"twist_mm":1,
    "frames":[{"name":"F7","bend_mm":3.2,"open_mm":1,"pressed_mm":2,"sight_mm":0.5},
              {"name":"F8","bend_mm":-2.1,"open_mm":1,"pressed_mm":2,"sight_mm":0.5}],
    "worst":[{"at":[1,2,3],"mm":-4.2,"sigma_mm":0.03,"border":false}],"remarks":["half a turn fits as well"]})");
}

}  // namespace

TEST_CASE("the report says first whether the result is true, then the figures, the origin and the timing") {
  const std::string page = measurement_page(measured(), "<svg xmlns='x'/>", {});
  const auto at = [&](std::string_view words) { return page.find(words); };
  CHECK(at("<h1>plate &lt;7&gt; &amp; &quot;co&quot;</h1>") != page.npos);
  CHECK(at("Is the result true?") < at("size, mm"));
  CHECK(at("300 x 200") != page.npos);
  CHECK(at("size, mm") < at("data:image/svg+xml;base64,"));
  CHECK(at("Settings and origin") < at("id=\"timing\""));
  CHECK(at("Is the plate right?") == page.npos);
  CHECK(at("<script") == page.npos);
  CHECK(at("http") == page.npos);  // the picture's own name space is inside its base64
}

TEST_CASE(
    "after an inspection the report shows where the plate differs, along frames and where it is worst") {
  const std::string page = measurement_page(measured(), "", inspection());
  for (const char* words : {"Is the plate right?", "Outside its limits.", "a&lt;b&gt;.step",
                            "-4.20 to +1.50 mm", "+3.2 bend more", "-2.1 too much",
                            "half a turn fits as well", "too low", "deviation from the design"}) {
    CAPTURE(std::string{words});
    CHECK(page.find(words) != page.npos);
  }
}
