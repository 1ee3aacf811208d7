#include "tasks/slices/frame_lease.hpp"

#include <doctest/doctest.h>

#include <csignal>
#include <optional>
#include <sys/wait.h>
#include <type_traits>
#include <unistd.h>
#include <utility>

using namespace moldloft::tasks;

static_assert(!std::is_copy_constructible_v<FrameLease> && !std::is_copy_assignable_v<FrameLease>);
static_assert(std::is_nothrow_move_constructible_v<FrameLease> &&
              std::is_nothrow_move_assignable_v<FrameLease>);
static_assert(!std::is_copy_constructible_v<FrameLender> && !std::is_move_constructible_v<FrameLender>);

TEST_CASE("a frame is free again when each of its readers has gone, in whatever order") {
  FrameLender frame;
  CHECK(frame.is_free());
  FrameLease first = frame.lend();
  std::optional<FrameLease> second{frame.lend()};
  first.end();
  CHECK_FALSE(first.is_held());
  CHECK_FALSE(frame.is_free());
  first.end();  // twice is once
  CHECK_FALSE(frame.is_free());
  second.reset();
  CHECK(frame.is_free());
}

TEST_CASE("a lease that is handed on holds the frame until its last holder has gone") {
  FrameLender frame;
  FrameLease look = frame.lend();
  {
    FrameLease fold = std::move(look);
    CHECK_FALSE(look.is_held());
    CHECK(fold.is_held());
    look = FrameLease{};  // nothing to end
    CHECK_FALSE(frame.is_free());
  }
  CHECK(frame.is_free());
}

TEST_CASE("who takes another frame's lease lets the first one go") {
  FrameLender before, after;
  FrameLease reader = before.lend();
  reader = after.lend();
  CHECK(before.is_free());
  CHECK_FALSE(after.is_free());
  FrameLease& same = reader;
  reader = std::move(same);
  CHECK(reader.is_held());
  CHECK_FALSE(after.is_free());
}

#ifndef NDEBUG
TEST_CASE("a frame that goes while somebody reads it ends the program where it happens") {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::signal(SIGABRT, SIG_DFL);
    close(STDERR_FILENO);
    FrameLease reader;
    {
      FrameLender frame;
      reader = frame.lend();
    }
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGABRT);
}
#endif
