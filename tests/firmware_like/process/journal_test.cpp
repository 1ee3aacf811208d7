#include "firmware_like/process/journal.hpp"

#include "firmware_like/gateway/progress_text.hpp"
#include "tasks/cell/notice_queue.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <array>
#include <sys/stat.h>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;

TEST_CASE("the journal is known by the device and inode that systemd names, and nothing else passes for it") {
  std::array<int, 2> pipe{}, other{};
  REQUIRE(::pipe(pipe.data()) == 0);
  REQUIRE(::pipe(other.data()) == 0);
  struct stat what {};
  REQUIRE(::fstat(pipe[1], &what) == 0);
  const std::string stream = fmt::format("{}:{}", what.st_dev, what.st_ino);
  CHECK(is_journal(pipe[1], stream.c_str()));
  CHECK_FALSE(is_journal(other[1], stream.c_str()));  // redirected: the variable is inherited all the same
  const std::string elsewhere = fmt::format("{}:{}", what.st_dev + 1, what.st_ino);
  CHECK_FALSE(is_journal(pipe[1], elsewhere.c_str()));
  CHECK_FALSE(is_journal(pipe[1], nullptr));
  CHECK_FALSE(is_journal(pipe[1], ""));
  CHECK_FALSE(is_journal(pipe[1], "nonsense"));
  for (const int file : {pipe[0], pipe[1], other[0], other[1]}) ::close(file);
  CHECK_FALSE(is_journal(pipe[1], stream.c_str()));
}

TEST_CASE("each line bears its own mark") {
  CHECK(for_journal(Priority::error, "moldloft: no\n") == "<3>moldloft: no\n");
  CHECK(for_journal(Priority::warning, "one\ntwo\n") == "<4>one\n<4>two\n");
  CHECK(for_journal(Priority::info, "no end") == "<6>no end");
  CHECK(for_journal(Priority::notice, "") == "");
}

TEST_CASE("a notice says what has become of the cell, when, and why") {
  using Kind = tasks::Notice::Kind;
  CHECK(notice_line({.at = 12'345ms, .kind = Kind::hold, .text = "scanner: cable pulled"}) ==
        "moldloft: held at 12.345 s: scanner: cable pulled\n");
  CHECK(notice_line({.at = 1s, .kind = Kind::abort, .text = "e-stop"}) ==
        "moldloft: aborted at 1.000 s: e-stop\n");
}

TEST_CASE("notices come out in order, and a full queue drops the newest") {
  tasks::NoticeQueue queue;
  CHECK_FALSE(queue.pop().has_value());
  for (int i = 0; i < 100; ++i) queue.push({.at = i * 1s, .kind = {}, .text = {}});
  for (int i = 0; i < 64; ++i) {
    const auto notice = queue.pop();
    REQUIRE(notice.has_value());
    CHECK(notice->at == i * 1s);
  }
  CHECK_FALSE(queue.pop().has_value());
  queue.push({.at = 7s, .kind = {}, .text = {}});
  CHECK(queue.pop()->at == 7s);
}
