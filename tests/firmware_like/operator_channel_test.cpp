// The operator's words to a controller without devices, which ticks while an answer is waited for.
#include "firmware_like/operator_channel.hpp"

#include <doctest/doctest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "firmware_like/controller.hpp"
#include "firmware_like/run_command.hpp"
#include "hal/cable.hpp"
#include "hal/temporary_folder.hpp"

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;
using tasks::CellState;

namespace {

struct Bench {
  hal::VirtualClock clock;
  hal::Cable scanner{clock, {}}, robot{clock, {}};
  std::unique_ptr<Controller> controller =
      std::make_unique<Controller>(default_config(), clock, scanner.host(), robot.host(),
                                   ControllerOptions{.begin_held = true, .attended = true});
  int looks = 0;

  Bench() {
    controller->start();
    controller->tick();
  }
  std::string tell(std::string_view word) {
    return answer_to(word, controller->cell(), [this] {
      ++looks;
      controller->tick();
    });
  }
};

}  // namespace

TEST_CASE("a command is answered with the state before and after it") {
  Bench bench;
  CHECK(bench.controller->cell().state() == CellState::held);
  CHECK(bench.tell("unhold") == "done: Held -> Starting");
  CHECK(bench.tell("abort") == "done: Starting -> Aborted");
  bench.controller->tick();
  CHECK(bench.tell("clear") == "done: Aborted -> Clearing");
  CHECK(bench.looks == 3);  // each in the next tick
}

TEST_CASE("a command that means nothing in the state is refused by name, and does nothing later either") {
  Bench bench;
  CHECK(bench.tell("start") == "refused: start means nothing in Held");
  CHECK(bench.tell("hold") == "refused: hold means nothing in Held");
  CHECK(bench.tell("clear") == "refused: clear means nothing in Held");
  for (int i = 0; i < 10; ++i) bench.controller->tick();
  CHECK(bench.controller->cell().state() == CellState::held);
}

TEST_CASE("an unknown word is refused with those that are known") {
  Bench bench;
  const std::string known =
      "refused: unknown command; known: start, hold, unhold, stop, abort, clear, reset, status";
  for (const char* word : {"", "unhol", "UNHOLD", "unhold now", "done", "start held"})
    CHECK(bench.tell(word) == known);
  CHECK(bench.controller->cell().state() == CellState::held);
}

TEST_CASE("a control loop that does not run is told, after a bounded number of looks") {
  Bench bench;
  int looks = 0;
  CHECK(answer_to("unhold", bench.controller->cell(), [&] { ++looks; }) ==
        "refused: unhold was sent in Held, but the control loop does not answer");
  CHECK(looks == 50);
}

TEST_CASE("status is one line of JSON with the reason of a hold") {
  Bench bench;
  const auto status = nlohmann::json::parse(bench.tell("status"));
  CHECK(status["state"] == "Held");
  CHECK(status["hold_cause"] == "person");
  CHECK(status["why"] == "started held: nothing moves before an operator sends unhold");
  CHECK(status["surface_planned"] == 0);
  CHECK(bench.looks == 0);
}

TEST_CASE("over the socket a word comes in and the answer goes back, until the socket is gone") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("control");
  Bench bench;
  {
    const auto socket = OperatorSocket::open(path);
    REQUIRE_MESSAGE(socket.has_value(), socket.error());
    const OperatorThread thread{*socket, bench.controller->cell()};
    const auto answer = ask_cell("status\n", path);
    REQUIRE_MESSAGE(answer.has_value(), answer.error());
    CHECK(nlohmann::json::parse(*answer)["state"] == "Held");
    CHECK(tell_cell({.word = "status", .control = path}) == exit_done);
    CHECK(tell_cell({.word = "dance", .control = path}) == exit_failed);
    struct stat file {};
    REQUIRE(::stat(path.c_str(), &file) == 0);
    CHECK((file.st_mode & 0777) == 0660);
  }
  CHECK_FALSE(std::filesystem::exists(path));
  const auto nobody = ask_cell("status", path);
  REQUIRE_FALSE(nobody.has_value());
  CHECK(nobody.error() == path + ": No such file or directory; is moldloft running with --control?");
}

TEST_CASE("a socket that a dead process has left is replaced, a living one and any other file are not") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("control");
  auto living = OperatorSocket::open(path);
  REQUIRE(living.has_value());
  const auto second = OperatorSocket::open(path);
  REQUIRE_FALSE(second.has_value());
  CHECK(second.error() == "--control " + path + ": another moldloft listens there");

  std::filesystem::create_hard_link(path, folder.file("left"));
  { const OperatorSocket gone = std::move(*living); }
  CHECK(std::filesystem::exists(folder.file("left")));
  CHECK(OperatorSocket::open(folder.file("left")).has_value());

  std::ofstream{folder.file("notes")} << "keep me";
  const auto file = OperatorSocket::open(folder.file("notes"));
  REQUIRE_FALSE(file.has_value());
  CHECK(file.error() == "--control " + folder.file("notes") + ": is there and no socket");
  CHECK(std::filesystem::file_size(folder.file("notes")) == 7);
}

TEST_CASE("a path that is no address of a socket is refused before anything is begun") {
  CHECK(OperatorSocket::open(std::string(108, 'x'))
            .error()
            .ends_with(": a path of 1 to 107 characters is wanted"));
  CHECK(OperatorSocket::open("").error() == "--control : a path of 1 to 107 characters is wanted");
  CHECK(OperatorSocket::open("/nowhere/control").error() ==
        "--control /nowhere/control: No such file or directory");
}
