// cyclictest's JSON as it was really written, and the program itself replaced by scripts that do what it can do.
#include "firmware_like/selftest/cyclictest.hpp"

#include "firmware_like/recorded_cyclictest.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <stdlib.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

namespace {

// PATH for the life of the object: only what the test puts there is found.
class OnlyPath {
 public:
  explicit OnlyPath(const fs::path& folder) : before_{::getenv("PATH")} {
    ::setenv("PATH", folder.c_str(), 1);
  }
  ~OnlyPath() { ::setenv("PATH", before_.c_str(), 1); }

 private:
  std::string before_;
};

void write_program(const fs::path& path, const std::string& script) {
  std::ofstream{path} << "#!/bin/sh\n" << script;
  fs::permissions(path, fs::perms::owner_all);
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  REQUIRE(at != text.npos);
  return text.replace(at, what.size(), by);
}

std::string why_not(const std::string& json) {
  const auto parsed = parse_cyclictest(json);
  REQUIRE_FALSE(parsed.has_value());
  CHECK(parsed.error().what.find('\n') == std::string::npos);
  return parsed.error().what;
}

}  // namespace

TEST_CASE(
    "a recorded cyclictest is read to the last cycle, and what is beyond its histogram counts as its "
    "maximum") {
  const auto r = parse_cyclictest(recorded_cyclictest);
  REQUIRE_MESSAGE(r.has_value(), r.error().what);
  CHECK(r->cycles == 200);
  CHECK(r->beyond == 1);
  CHECK(r->latency.count() == 200);
  // The whole microseconds that it truncated to, plus half of one; of 200 values the 100th and the 198th.
  CHECK(r->latency.min() == 53'500ns);
  CHECK(r->latency.max() == 405'500ns);
  const auto within_a_bucket = [&](double fraction, hal::Duration exact) {
    CHECK(r->latency.percentile(fraction) >= exact);
    CHECK(r->latency.percentile(fraction) <= exact + exact / 31);
  };
  within_a_bucket(0.5, 64'500ns);
  within_a_bucket(0.99, 268'500ns);
  within_a_bucket(0.999, 405'500ns);
}

TEST_CASE("JSON that is not cyclictest's is one line that says what is missing") {
  const std::string good = recorded_cyclictest;
  CHECK(why_not("") == "cyclictest: its JSON has no thread; rt-tests 2.0 or later is needed");
  CHECK(why_not("[1, 2]").find("no thread;") != std::string::npos);
  CHECK(why_not(replaced(good, "\"thread\"", "\"threads\"")).find("no thread;") != std::string::npos);
  CHECK(why_not(replaced(good, "\"0\": {\"histogram\"", "\"1\": {\"histogram\"")).find("no thread 0;") !=
        std::string::npos);
  CHECK(why_not(replaced(good, "\"histogram\"", "\"histo\"")).find("no histogram;") != std::string::npos);
  CHECK(why_not(replaced(good, "\"cycles\": 200", "\"cycles\": -200")).find("no cycles;") !=
        std::string::npos);
  CHECK(why_not(replaced(good, "\"max\"", "\"maximum\"")).find("no max;") != std::string::npos);
  CHECK(why_not(replaced(good, "\"53\": 2", "\"5x\": 2")).find("adds up;") != std::string::npos);
  CHECK(why_not(replaced(good, "\"53\": 2", "\"-53\": 2")).find("adds up;") != std::string::npos);
  // More in one bucket than cycles in all would be counted for a very long time.
  CHECK(why_not(replaced(good, "\"53\": 2", "\"53\": 99999999999999")).find("adds up;") != std::string::npos);
}

TEST_CASE("cyclictest is asked for the same priority, interval, processor and memory lock as ours has") {
  const CyclictestSettings real_time{
      .priority = 47, .cpu = 3, .lock_memory = true, .interval = 2ms, .cycles = 2500};
  CHECK(cyclictest_words(real_time, "/run/c.json") ==
        std::vector<std::string>{"cyclictest", "--quiet", "--interval=2000", "--loops=2500",
                                 "--histogram=100000", "--histfile=/dev/null", "--json=/run/c.json",
                                 "--policy=fifo", "--priority=47", "--affinity=3", "--mlockall"});
  const CyclictestSettings ordinary{
      .priority = 0, .cpu = -1, .lock_memory = false, .interval = 1ms, .cycles = 5000};
  CHECK(cyclictest_words(ordinary, "/run/c.json") ==
        std::vector<std::string>{"cyclictest", "--quiet", "--interval=1000", "--loops=5000",
                                 "--histogram=100000", "--histfile=/dev/null", "--json=/run/c.json",
                                 "--policy=other"});
}

TEST_CASE("a cyclictest that runs is read, and its files are taken away") {
  const hal::TemporaryFolder programs, scratch;
  std::ofstream{programs.file("recorded.json")} << recorded_cyclictest;
  write_program(programs.file("cyclictest"), "for word in \"$@\"; do case $word in --json=*) /bin/cp " +
                                                 programs.file("recorded.json") +
                                                 " \"${word#--json=}\";; esac; done\n");
  const OnlyPath path{programs.path()};
  const auto r = run_cyclictest({}, scratch.path());
  REQUIRE_MESSAGE(r.has_value(), r.error().what);
  CHECK(r->latency.count() == 200);
  CHECK(fs::is_empty(scratch.path()));
}

TEST_CASE("a cyclictest that is not there, fails or is killed is one line that says what to do") {
  const hal::TemporaryFolder programs, scratch;
  const OnlyPath path{programs.path()};
  const auto why = [&] {
    const auto r = run_cyclictest({}, scratch.path());
    REQUIRE_FALSE(r.has_value());
    CHECK(fs::is_empty(scratch.path()));
    return r.error().what;
  };
  CHECK(why() == "cyclictest: not found in PATH; install the package rt-tests, or leave --compare out");
  write_program(programs.file("cyclictest"),
                "echo one\necho 'Unable to change scheduling policy!' >&2\nexit 1\n");
  CHECK(why() == "cyclictest: failed: Unable to change scheduling policy!");
  write_program(programs.file("cyclictest"), "exit 0\n");  // and no JSON
  CHECK(why() == "cyclictest: failed: it says nothing");
  write_program(programs.file("cyclictest"), "kill -9 $$\n");
  CHECK(why() == "cyclictest: failed: it says nothing");
}
