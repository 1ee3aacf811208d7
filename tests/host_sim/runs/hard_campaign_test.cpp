// The hard campaign's judge of honesty, on rows whose answer is known, and one real case of it.
#include "host_sim/runs/hard_campaign.hpp"

#include "firmware_like/process/json_text.hpp"
#include "host_sim/child_process.hpp"

#include <doctest/doctest.h>

#include <set>
#include <string>

using namespace moldloft::host_sim;
using moldloft::firmware_like::Json;

namespace {

HardRow row(int exit_code, double outline_mm, std::vector<std::string> words = {},
            const char* cause = "noise") {
  HardRow r{.seed = 1, .cause = cause, .exit_code = exit_code, .words = std::move(words)};
  for (const auto& word : r.words) r.said += word + " | ";
  r.truth = {{"normal_rms_mm", 0.01},
             {"normal_max_mm", 0.05},
             {"outline_max_mm", outline_mm},
             {"corner_max_mm", 0.1}};
  return r;
}

}  // namespace

TEST_CASE("only a run that ends with 0 and is beyond the limits is untrue") {
  CHECK_FALSE(is_untrue(row(0, 0.29)));
  CHECK(is_untrue(row(0, 0.31)));
  CHECK_FALSE(is_untrue(row(5, 7)));  // it was said
  CHECK_FALSE(is_untrue(row(2, 0)));
  HardRow surface = row(0, 0.1);
  surface.truth["normal_max_mm"] = 0.081;
  CHECK(is_untrue(surface));
}

TEST_CASE(
    "what is said must name the cause that is known, in whatever letters, and silence names none wrongly") {
  CHECK(
      says_cause(row(5, 1, {"points lie 0.3 mm off the surface: more Noise than [scanner] noise_mm says"})));
  CHECK_FALSE(says_cause(row(5, 1, {"shots disagree by 0.9 mm: check [scanner.mount]"})));
  CHECK(says_cause(row(0, 0.1)));
  CHECK_FALSE(says_cause(row(2, 0, {"no plate"}, "sound")));  // nothing is wrong with a sound plate
}

TEST_CASE("what a summary says is its message and its findings") {
  const Json both =
      Json::parse(R"({"message": "held", "findings": [{"kind": "x", "text": "a"}, {"text": "b"}]})");
  CHECK(words_of_summary(both) == std::vector<std::string>{"held", "a", "b"});
  CHECK(words_of_summary(Json::parse(R"({"message": ""})")).empty());
}

TEST_CASE("a seed is a case, the same one each time, and every cause comes round") {
  std::set<std::string> causes, cases;
  for (std::uint64_t seed = 1; seed <= 2 * hard_causes().size(); ++seed) {
    const HardCase a = hard_case(seed), b = hard_case(seed);
    CHECK(a.what == b.what);
    CHECK(a.cell.seed == seed);
    causes.insert(std::string{a.cause->name});
    cases.insert(a.what);
    CAPTURE(a.what);
    CHECK(placed_plate(a.cell));
  }
  CHECK(causes.size() == hard_causes().size());
  CHECK(cases.size() > hard_causes().size());
}

TEST_CASE("a robot that lies is held by the campaign's own run, and that it was is the true word") {
  const auto ran = run_program({MOLDLOFT_SIM, "campaign", "--plates", "hard", "--seeds", "16", "--json"});
  CHECK(ran.exit_code == 0);
  const Json rows = Json::parse(ran.out);
  REQUIRE(rows.size() == 1);
  CHECK(rows[0]["cause"] == "robot lies");
  CHECK(rows[0]["outcome"] == "held");
  CHECK(rows[0]["names_cause"] == true);
  CHECK(rows[0]["untrue"] == false);
}
