#include "tasks/cell/cycle_account.hpp"

#include <doctest/doctest.h>

using namespace moldloft;
using namespace moldloft::tasks;
using namespace std::chrono_literals;
using Robot = hal::RobotState;
using Scanner = hal::ScannerState;

TEST_CASE("a cycle is told as what stands and what idles of it, from its beginning to its end") {
  CycleAccount account;
  account.pass(5s, Robot::moving, Scanner::ready);  // before the run: nothing
  account.begin(10s);
  account.pass(12s, Robot::moving, Scanner::computing);  // 2 s of driving
  account.pass(15s, Robot::ready, Scanner::exposing);    // 3 s standing for the scanner
  account.pass(16s, Robot::ready, Scanner::computing);   // 1 s more
  account.pass(20s, Robot::commanded, Scanner::ready);   // 4 s in which nobody does anything
  account.end();
  account.pass(100s, Robot::ready, Scanner::ready);
  CHECK(account.times().total == 10s);
  CHECK(account.times().standing == 8s);
  CHECK(account.times().idle == 4s);
}

TEST_CASE("a second run adds to the first, and the time between them counts for neither") {
  CycleAccount account;
  account.begin(0s);
  account.pass(1s, Robot::ready, Scanner::ready);
  account.end();
  account.begin(50s);
  account.pass(52s, Robot::moving, Scanner::offline);
  CHECK(account.times().total == 3s);
  CHECK(account.times().standing == 1s);
  CHECK(account.times().idle == 1s);
}
