#include "hal/links/claim.hpp"

#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::hal;

namespace {

std::string refused(const std::expected<Claim, std::string>& claim) { return claim ? "" : claim.error(); }

// A process that has claimed something and waits; it ends with the test.
class Holder {
 public:
  template <typename Take>
  explicit Holder(Take take) {
    int ends[2];
    REQUIRE(::pipe(ends) == 0);
    pid_ = ::fork();
    if (pid_ == 0) {
      const auto taken = take();
      [[maybe_unused]] const auto told = ::write(ends[1], "x", 1);
      ::pause();
      ::_exit(0);
    }
    char word = 0;
    CHECK(::read(ends[0], &word, 1) == 1);
    ::close(ends[0]);
    ::close(ends[1]);
  }
  ~Holder() { kill(); }
  void kill() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }
  std::string words() const {
    return " is in use by process " + std::to_string(pid_) +
           ": one controller at a time; wait for its end, or stop it";
  }

 private:
  pid_t pid_ = 0;
};

}  // namespace

TEST_CASE("a claim names the process that has it, and a killed process has none") {
  const std::string name = "test/" + std::to_string(::getpid());
  Holder other{[&] { return Claim::take(name, "the thing"); }};
  CHECK(refused(Claim::take(name, "the thing")) == "the thing" + other.words());
  CHECK(refused(Claim::take(name + "/another", "another thing")).empty());
  other.kill();
  CHECK(refused(Claim::take(name, "the thing")).empty());
  CHECK(refused(Claim::take(name, "the thing"))
            .empty());  // the claim of the line before has gone with its value
}

TEST_CASE("one scanner is one scanner, however its address is written") {
  const Holder other{[] { return claim_address("127.0.0.1", 4099); }};
  CHECK(refused(claim_address("localhost", 4099)) == "scanner localhost:4099" + other.words());
  CHECK(refused(claim_address("::ffff:127.0.0.1", 4099)) == "scanner ::ffff:127.0.0.1:4099" + other.words());
  CHECK(refused(claim_address("0.0.0.0", 4099)) == "scanner 0.0.0.0:4099" + other.words());
  CHECK(refused(claim_address("127.0.0.1", 4098)).empty());
  CHECK(refused(claim_address("127.0.0.2", 4099)).empty());
  CHECK(refused(claim_address("nobody knows it", 4099)).empty());
}

TEST_CASE("one port is one port, whichever links lead to it") {
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE((master >= 0 && ::grantpt(master) == 0 && ::unlockpt(master) == 0));
  const std::string device = ::ptsname(master);
  const TemporaryFolder folder;
  const std::string link = folder.file("robot");
  REQUIRE(::symlink(device.c_str(), link.c_str()) == 0);
  const Holder other{[&] { return claim_serial(device); }};
  CHECK(refused(claim_serial(link)) == "robot's port " + link + other.words());
  CHECK(refused(claim_serial(folder.file("unplugged"))).empty());
  ::close(master);
}

TEST_CASE("the kernel tells which process has locked a file") {
  const TemporaryFolder folder;
  const int file = ::open(folder.file("lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  CHECK(process_with_lock(file) == 0);
  REQUIRE(::flock(file, LOCK_EX) == 0);
  CHECK(process_with_lock(file) == ::getpid());
  ::close(file);
}
