// The watch on a scripted heartbeat, in virtual time, with a service manager that is a socket of the test's own.
#include "firmware_like/gateway/service_watch.hpp"

#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;

namespace {

// What systemd gives a service of Type=notify, and hears from it.
class Manager {
 public:
  explicit Manager(const std::string& watchdog_us) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    folder_.file("notify").copy(address.sun_path, sizeof address.sun_path - 1);
    file_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    REQUIRE(::bind(file_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    ::setenv("NOTIFY_SOCKET", folder_.file("notify").c_str(), 1);
    ::setenv("WATCHDOG_USEC", watchdog_us.c_str(), 1);
    ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);
  }
  ~Manager() {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) ::unsetenv(name);
    ::close(file_);
  }
  std::vector<std::string> heard() const {  // since it was asked last
    std::vector<std::string> all;
    char text[512];
    for (ssize_t n = 0; (n = ::recv(file_, text, sizeof text, 0)) > 0;)
      all.emplace_back(text, static_cast<std::size_t>(n));
    return all;
  }
  std::string report() const { return folder_.file("watchdog.json"); }

 private:
  hal::TemporaryFolder folder_;
  int file_ = -1;
};

struct Bench {
  Manager manager;
  ServiceNotify notify;
  ServiceWatch watch{notify, manager.report()};
  hal::Instant now{0};
  LoopSight sight{.task = "cell", .status = "Execute"};

  explicit Bench(const std::string& watchdog_us = "2000000") : manager{watchdog_us} {}

  // Looks for so long; the loop makes so many ticks between two looks. Returns how often the watchdog was fed.
  int look_for(hal::Duration duration, std::uint64_t ticks_between) {
    int fed = 0;
    for (const hal::Instant end = now + duration; now < end; now += ServiceWatch::period) {
      sight.ticks += ticks_between;
      watch.look(sight, now);
      for (const auto& word : manager.heard()) word == "WATCHDOG=1" ? void(++fed) : others.push_back(word);
    }
    return fed;
  }
  std::vector<std::string> others;
};

}  // namespace

TEST_CASE("the manager hears that the program is ready when the loop ticks, and not before") {
  Bench bench;
  CHECK(bench.watch.limit() == 1s);
  CHECK(bench.look_for(5s, 0) == 0);
  CHECK(bench.others.empty());
  CHECK_FALSE(bench.watch.stands());  // what has not begun does not stand
  CHECK(bench.look_for(1s, 100) == 10);
  CHECK(bench.others == std::vector<std::string>{"READY=1\nSTATUS=Execute"});
}

TEST_CASE(
    "a loop that stands is fed no more after the limit, and its task is named to manager and run folder") {
  Bench bench;
  bench.look_for(1s, 100);
  bench.others.clear();
  bench.sight.task = "surface";
  CHECK(bench.look_for(900ms, 0) == 9);
  CHECK_FALSE(bench.watch.stands());
  CHECK_FALSE(std::filesystem::exists(bench.manager.report()));
  CHECK(bench.look_for(10s, 0) == 0);
  CHECK(bench.watch.stands());
  CHECK(bench.others ==
        std::vector<std::string>{
            "STATUS=the control loop has stood in 'surface' for 1.0 s, after 1000 ticks"});  // once
  const auto report = nlohmann::json::parse(std::ifstream{bench.manager.report()});
  CHECK(report["task"] == "surface");
  CHECK(report["ticks"] == 1000);
  CHECK(report["stood_s"] == 1.0);
  CHECK(report["time"].get<std::string>().ends_with("Z"));
}

TEST_CASE("a loop that goes on after all is fed again") {
  Bench bench;
  bench.look_for(1s, 100);
  bench.look_for(3s, 0);
  CHECK(bench.watch.stands());
  bench.others.clear();
  bench.sight.status = "Held";
  CHECK(bench.look_for(100ms, 100) == 1);
  CHECK_FALSE(bench.watch.stands());
  bench.sight.status = "Unholding";  // that waits its second
  CHECK(bench.look_for(900ms, 100) == 9);
  CHECK(bench.others == std::vector<std::string>{"STATUS=Held"});  // in place of the culprit's name, once
  bench.sight.status = "Held";
  bench.look_for(1s, 100);
  CHECK(bench.others.size() == 1);  // nothing that it has not heard
}

TEST_CASE("the limit is half of the manager's when that is short") {
  Bench bench{"600000"};
  CHECK(bench.watch.limit() == 300ms);
  bench.look_for(1s, 100);
  CHECK(bench.look_for(1s, 0) == 2);  // and then the manager's 600 ms run out
}

TEST_CASE("however patient the manager is, a loop that stands for a second is named") {
  Bench bench{"30000000"};
  CHECK(bench.watch.limit() == 1s);
}

TEST_CASE("time in which the watch itself did not run is not the loop's") {
  Bench bench;
  bench.look_for(1s, 100);
  bench.now += 1h;  // the whole program was stopped
  bench.watch.look(bench.sight, bench.now);
  CHECK_FALSE(bench.watch.stands());
}

TEST_CASE("while results are written the manager is fed without a heartbeat, for a minute") {
  Bench bench;
  bench.look_for(1s, 100);
  bench.others.clear();
  bench.sight.ended = true;
  bench.sight.status = "Complete";
  CHECK(bench.look_for(59s, 0) == 590);
  CHECK(bench.others == std::vector<std::string>{"STOPPING=1\nSTATUS=Complete"});
  bench.look_for(2s, 0);
  CHECK(bench.look_for(10s, 0) == 0);
  CHECK_FALSE(bench.watch.stands());
}

TEST_CASE("the status is passed on when it changes, once a second at most") {
  Bench bench;
  bench.look_for(2s, 100);
  bench.others.clear();
  bench.look_for(3s, 100);
  CHECK(bench.others.empty());
  for (int i = 0; i < 30; ++i) {
    bench.sight.status = std::to_string(i);
    bench.look_for(100ms, 100);
  }
  CHECK(bench.others == std::vector<std::string>{"STATUS=0", "STATUS=10", "STATUS=20"});
}

TEST_CASE("the first change of the status waits its second too: ready told one") {
  Bench bench;
  bench.look_for(100ms, 100);
  bench.others.clear();
  bench.sight.status = "SeekEdge";
  bench.look_for(900ms, 100);
  CHECK(bench.others.empty());
  bench.look_for(200ms, 100);
  CHECK(bench.others == std::vector<std::string>{"STATUS=SeekEdge"});
}

TEST_CASE("a watchdog that is meant for another process, or for none, is not fed in a hurry") {
  Manager manager{"100000"};
  ::setenv("WATCHDOG_PID", "1", 1);
  CHECK(ServiceNotify{}.watchdog() == 0ns);
  ::unsetenv("WATCHDOG_USEC");
  CHECK(ServiceNotify{}.watchdog() == 0ns);
}
