// The operator's words to a controller without devices, which ticks while an answer is waited for.
#include "firmware_like/gateway/operator_channel.hpp"

#include "firmware_like/controller/controller.hpp"
#include "firmware_like/forked.hpp"
#include "firmware_like/process/complaint.hpp"
#include "hal/file_text.hpp"
#include "hal/links/cable.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <future>
#include <set>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

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
  CHECK(status["waiting"] == "waiting for an operator: moldloft tell unhold, or stop");
  CHECK(status["seconds_left"].is_null());
  CHECK(bench.looks == 0);
}

TEST_CASE("status says how much of a phase is done, and how long the run still takes") {
  const auto status = nlohmann::json::parse(status_json({.state = CellState::execute,
                                                         .surface_shots = 4,
                                                         .surface_planned = 16,
                                                         .part_done = 0.25,
                                                         .time_left = 9s,
                                                         .left_is_planned = true}));
  CHECK(status["part_done"] == 0.25);
  CHECK(status["seconds_left"] == 9);
  CHECK(status["left_is_estimate"] == false);
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

namespace {

// A socket that listens and never answers, as that of a program that stands still.
class DeafCell {
 public:
  explicit DeafCell(const std::string& path) : file_{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)} {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    REQUIRE(::bind(file_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~DeafCell() { ::close(file_); }
  DeafCell(const DeafCell&) = delete;
  DeafCell& operator=(const DeafCell&) = delete;

 private:
  int file_;
};

}  // namespace

TEST_CASE("the only running cell is found by itself, whatever dead ones have left beside it") {
  const hal::TemporaryFolder folder;
  const std::filesystem::path cells = folder.file("cells");
  const auto none = running_cell(cells);
  REQUIRE_FALSE(none.has_value());
  CHECK(none.error() ==
        "no running cell was found: looked for " + cells.string() + "/control and " + cells.string() +
            "/*/control; a cell elsewhere is told with the --control that it was started with");

  for (const char* plate : {"plate-16", "plate-17", "plate 18", "empty"})
    std::filesystem::create_directories(cells / plate);
  const std::string left = cells / "plate-16/control", path = cells / "plate-17/control";
  { const DeafCell died{left}; }
  std::ofstream{cells / "plate 18/control"} << "no socket";
  CHECK(running_cell(cells).error().find("; nobody listens at " + left + " any more;") != std::string::npos);

  Bench bench;
  const auto socket = OperatorSocket::open(path);
  REQUIRE_MESSAGE(socket.has_value(), socket.error());
  const OperatorThread thread{*socket, bench.controller->cell()};
  CHECK(running_cell(cells) == path);
  CHECK(tell_cell({.word = "status", .control = "", .cells = cells}) == exit_done);
  CHECK(tell_cell({.word = " STATUS ", .control = "", .cells = cells}) == exit_done);

  const DeafCell second{cells / "control"};
  CHECK(running_cell(cells).error() ==
        "2 cells run: " + (cells / "control").string() + ", " + path + "; say which one with --control");
}

TEST_CASE("a word is looked at before any socket is, and a wrong one is answered with all that there are") {
  CHECK(operator_words() == "start, hold, unhold, stop, abort, clear, reset, status");
  const hal::TemporaryFolder folder;
  const auto said_to = [&](const char* word) {
    return test::in_child({}, [&] {
      const std::string said = folder.file("said");
      ::dup2(::open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
      const int code = tell_cell({.word = word, .control = "/nowhere/control"});
      return fmt::format("{} {}", code, hal::text_of(said));
    });
  };
  for (const char* word : {"dance", "", "un hold", "unhold now", "status\nstop"})
    CHECK(said_to(word).find("is no word that a cell knows; known: " + operator_words()) !=
          std::string::npos);
  for (const char* word : {"status", "STOP", " Unhold\n"})
    CHECK(said_to(word).starts_with("1 moldloft: /nowhere/control: "));
}

TEST_CASE("a cell that never answers is given up after a bounded wait, and what it was told is named") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("control");
  const DeafCell deaf{path};
  CHECK(ask_cell("unhold", path).error() ==
        path + ": no answer within 2 s; does the program stand still? 'unhold' is given up");
  CHECK(ask_cell("stop", path).error() ==
        path + ": no answer within 2 s; does the program stand still? 'stop' still waits for it");
  // The kernel keeps so many words for it and refuses the next at once.
  std::string why;
  for (int i = 0; i < 2000 && why.empty(); ++i) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    const int file = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const auto* to = reinterpret_cast<const sockaddr*>(&address);
    if (::sendto(file, "x", 1, MSG_DONTWAIT, to, sizeof address) < 0) why = ask_cell("hold", path).error();
    ::close(file);
  }
  CHECK(why == path +
                   ": Resource temporarily unavailable; it does not take any more words; does the program "
                   "stand still?");
}

TEST_CASE("what was given up is not carried out later, what makes the cell safer is") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("control");
  const auto socket = OperatorSocket::open(path);
  REQUIRE_MESSAGE(socket.has_value(), socket.error());
  REQUIRE_FALSE(ask_cell("unhold", path).has_value());  // nobody serves: after two seconds the asker has left
  REQUIRE_FALSE(ask_cell("abort", path).has_value());
  std::vector<std::string> carried_out;
  for (int i = 0; i < 3; ++i) {
    socket->serve(0ms, [&](std::string_view word) {
      carried_out.emplace_back(word);
      return "";
    });
  }
  CHECK(carried_out == std::vector<std::string>{"abort"});
}

TEST_CASE("two operators who speak at once are both answered, and only one of them has moved the cell") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("control");
  const auto socket = OperatorSocket::open(path);
  REQUIRE_MESSAGE(socket.has_value(), socket.error());
  Bench bench;
  std::array<std::future<std::expected<std::string, std::string>>, 2> operators;
  for (auto& o : operators) o = std::async(std::launch::async, [&path] { return ask_cell("unhold", path); });
  for (int served = 0; served < 2;)
    socket->serve(100ms, [&](std::string_view word) {
      ++served;
      return bench.tell(word);
    });
  std::multiset<std::string> answers;
  for (auto& o : operators) answers.insert(o.get().value());
  CHECK(answers ==
        std::multiset<std::string>{"done: Held -> Starting", "refused: unhold means nothing in Starting"});
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
