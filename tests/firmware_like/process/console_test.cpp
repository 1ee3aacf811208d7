// Standard error as a person's shell, a service manager or nobody at all sets it up, each in a process of its own.
#include "firmware_like/process/console.hpp"

#include "firmware_like/forked.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <fcntl.h>
#include <string>
#include <sys/socket.h>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
using namespace std::chrono_literals;

TEST_CASE("words on a full disk, into a pipe without a reader and to a journal that has gone are counted") {
  CHECK(test::in_child({}, [] {
          open_console();
          ::dup2(::open("/dev/full", O_WRONLY), 2);
          say("lost\n");
          int ends[2];
          if (::pipe(ends) != 0) return std::string{"no pipe"};
          ::dup2(ends[1], 2);
          ::close(ends[1]);
          say("read\n");
          ::close(ends[0]);
          say("lost\n");
          if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) return std::string{"no sockets"};
          ::dup2(ends[1], 2);
          ::close(ends[1]);
          say("read\n");
          ::close(ends[0]);
          say("lost\n");
          return fmt::format("{}", unsaid());
        }) == "3");
}

TEST_CASE(
    "a pipe that nobody empties holds up the first word for a second and no other, and is used again later") {
  const std::string seen = test::in_child({}, [] {
    open_console();
    int ends[2];
    if (::pipe(ends) != 0) return std::string{"no pipe"};
    const int size = ::fcntl(ends[1], F_SETPIPE_SZ, 4096);
    ::dup2(ends[1], 2);
    for (int i = 0; i < 1000; ++i) say("a line that is written again and again\n");
    const auto lost = unsaid();
    std::string text(static_cast<std::size_t>(size), ' ');
    const auto count = ::read(ends[0], text.data(), text.size());
    say("after\n");
    char after[200] = {};
    const auto rest = ::read(ends[0], after, sizeof after);
    return fmt::format("{} {} {}", lost > 800 && unsaid() == lost, count > 3000,
                       rest > 0 && std::string{after}.ends_with("\nafter\n"));
  });
  CHECK(seen == "true true true");
}

TEST_CASE("descriptors 0 to 2 that are closed are opened, so that no file gets one of their numbers") {
  CHECK(test::in_child({}, [] {
          ::close(0);
          ::close(1);
          ::close(2);
          open_console();
          const int file = ::open("/dev/null", O_RDONLY);
          show("an answer");
          return fmt::format("{} {}", file > 2, end_of_output(0, "moldloft"));
        }) == "true 1");
}

TEST_CASE("an answer that cannot be written makes the exit code 1, and keeps one that is worse") {
  CHECK(test::in_child({}, [] {
          open_console();
          ::dup2(::open("/dev/full", O_WRONLY), 1);
          show("an answer");
          return fmt::format("{} {}", end_of_output(0, "moldloft"), end_of_output(3, "moldloft"));
        }) == "1 3");
}
