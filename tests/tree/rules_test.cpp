// Each rule is seen failing on text that breaks it, and silent on the nearest text that does not.
#include "tree/rules.hpp"

#include "tree/source_text.hpp"

#include <doctest/doctest.h>

using namespace moldloft::tree;

namespace {

std::string include(const std::string& name) { return "#include \"" + name + "\"\n"; }
std::string library(const std::string& name) { return "#include <" + name + ">\n"; }

bool breaks(const Findings& findings) { return !findings.empty(); }

std::string lines(std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += "int a;\n";
  return text;
}

}  // namespace

TEST_CASE("an include against an arrow is found, one along it is not") {
  const std::vector<std::string> order = {"host_sim", "firmware_like", "tasks", "hal"};
  for (std::size_t from = 0; from < order.size(); ++from) {
    for (std::size_t to = 0; to < order.size(); ++to) {
      CAPTURE(order[from]);
      CAPTURE(order[to]);
      CHECK(breaks(include_findings(order[from] + "/a.cpp", include(order[to] + "/b.hpp"))) == (to < from));
    }
    const bool may_see_geometry = order[from] != "hal";
    CHECK(breaks(include_findings(order[from] + "/a.hpp", include("geometry/b.hpp"))) == !may_see_geometry);
    CHECK(breaks(include_findings("geometry/a.hpp", include(order[from] + "/b.hpp"))));
  }
}

TEST_CASE("an include is found however it is written, and not where it is only talked about") {
  CHECK(breaks(include_findings("hal/a.hpp", "#include <tasks/cell/cell.hpp>\n")));
  CHECK(breaks(include_findings("hal/a.hpp", "  #  include\t\"tasks/cell/cell.hpp\" // why\n")));
  CHECK(breaks(include_findings("hal/a.hpp", include("clock.hpp"))));  // without the room's name
  CHECK_FALSE(breaks(include_findings("hal/a.hpp", "// #include \"tasks/cell/cell.hpp\"\n")));
  CHECK_FALSE(breaks(include_findings("hal/a.hpp", "/*\n#include \"tasks/cell/cell.hpp\"\n*/\n")));
  CHECK(include_findings("hal/a.hpp", "\n\n" + include("tasks/cell/cell.hpp")) ==
        Findings{"hal/a.hpp:3: includes tasks/cell/cell.hpp against the arrows"});
}

TEST_CASE("a room's tests see what the room sees") {
  CHECK(breaks(include_findings("tests/geometry/a.cpp", include("hal/base/clock.hpp"))));
  CHECK(breaks(include_findings("tests/tasks/a.cpp", include("host_sim/cell/world.hpp"))));
  CHECK_FALSE(breaks(include_findings("tests/tasks/a.cpp", include("tasks/scripted_clock.hpp"))));
  CHECK_FALSE(breaks(
      include_findings("tests/tasks/a.cpp", include("hal/base/clock.hpp") + library("doctest/doctest.h"))));
}

TEST_CASE("geometry knows Eigen and the standard library only") {
  CHECK_FALSE(
      breaks(include_findings("geometry/a.hpp", library("Eigen/Core") + library("span") + library("cmath"))));
  for (const char* name : {"fmt/format.h", "nlohmann/json.hpp", "unistd.h", "sys/mman.h", "ceres/ceres.h"}) {
    CAPTURE(name);
    CHECK(breaks(include_findings("geometry/a.cpp", library(name))));
  }
}

TEST_CASE("a library stays in its rooms: Asio and the serial port behind headers of our own") {
  CHECK_FALSE(breaks(include_findings("hal/a.cpp", library("asio/ip/tcp.hpp") + library("libserialport.h"))));
  CHECK_FALSE(breaks(include_findings("host_sim/a.cpp", library("asio/ip/tcp.hpp"))));
  CHECK(breaks(include_findings("hal/a.hpp", library("asio/ip/tcp.hpp"))));
  CHECK(breaks(include_findings("hal/a.hpp", library("libserialport.h"))));
  CHECK(breaks(include_findings("tasks/a.cpp", library("asio.hpp"))));
  CHECK(breaks(include_findings("firmware_like/a.cpp", library("sqlite3.h"))));
  CHECK(breaks(include_findings("hal/a.cpp", library("Eigen/Core"))));
  CHECK(breaks(include_findings("host_sim/a.cpp", library("toml++/toml.h"))));
  CHECK(breaks(include_findings("tasks/a.cpp", library("poll.h"))));
  CHECK(breaks(include_findings("hal/a.cpp", library("newlib/thing.hpp"))));  // nobody has decided about it
}

TEST_CASE("iostream is found in every room") {
  for (const char* room : {"geometry", "hal", "tasks", "firmware_like", "host_sim"}) {
    CHECK(breaks(include_findings(std::string{room} + "/a.cpp", library("iostream"))));
    CHECK(breaks(banned_findings(std::string{room} + "/a.cpp", "void f() { std::cout << 1; }\n")));
  }
}

TEST_CASE("a sleep is found anywhere, waiting by the clock is not") {
  for (const char* call : {"std::this_thread::sleep_for(1ms);", "usleep(3);",
                           "std::this_thread::sleep_until(t);", "::nanosleep(&t, nullptr);", "sleep (1);"}) {
    CAPTURE(call);
    for (const char* path : {"hal/a.cpp", "tasks/a.hpp", "host_sim/a.cpp", "tests/hal/a.cpp"}) {
      CHECK(breaks(banned_findings(path, call)));
    }
  }
  CHECK_FALSE(breaks(banned_findings("tasks/a.cpp", "clock_.sleep_until(t);")));
  CHECK_FALSE(breaks(banned_findings("tests/tasks/a.hpp", "void sleep_until(Instant wake) override {}")));
  CHECK_FALSE(breaks(banned_findings("hal/base/clock.cpp", "clock_nanosleep(a, b, c, d);")));
  CHECK_FALSE(breaks(banned_findings("tasks/a.cpp", "// never usleep(1)\nauto s = \"usleep(1)\";")));
}

TEST_CASE("reading time outside hal/base/clock.cpp is found, while a test may measure") {
  CHECK(breaks(banned_findings("tasks/a.cpp", "auto t = std::chrono::steady_clock::now();")));
  CHECK(breaks(banned_findings("tasks/cell/shot_taker.cpp", "if (!robot_.move(target, 100, now)) return;")));
  CHECK(breaks(banned_findings("firmware_like/a.cpp", "cell.robot().move(target, 100, now);")));
  CHECK(breaks(banned_findings("firmware_like/a.cpp", "robot_->move(target, 100, now);")));
  CHECK_FALSE(breaks(banned_findings("tasks/cell/arm_gate.cpp", "robot_.move(target, 100, now);")));
  CHECK_FALSE(breaks(banned_findings("tasks/a.cpp", "auto b = std::move(robot_);")));
  CHECK(breaks(banned_findings("hal/links/tcp_link.cpp", "clock_gettime(CLOCK_MONOTONIC, &t);")));
  CHECK(breaks(banned_findings("host_sim/a.hpp",
                               "using C = std::chrono::system_clock; auto t = system_clock::now();")));
  CHECK_FALSE(breaks(banned_findings("hal/base/clock.cpp", "clock_gettime(CLOCK_MONOTONIC, &t);")));
  CHECK_FALSE(breaks(banned_findings("tests/geometry/a.cpp", "auto t = std::chrono::steady_clock::now();")));
}

TEST_CASE("JSON that is written past json_text() is found, a flight recorder's dump is not JSON") {
  CHECK(breaks(banned_findings("firmware_like/a.cpp", "write(summary.dump(2));")));
  CHECK(breaks(banned_findings("host_sim/a.cpp", "file << summary->dump();")));
  CHECK_FALSE(breaks(banned_findings("firmware_like/a.cpp", "flight_.dump(file);")));
  CHECK_FALSE(breaks(banned_findings("tests/firmware_like/a.cpp", "CAPTURE(seen.dump(1));")));
}

TEST_CASE("threads outside firmware_like and host_sim are found") {
  for (const char* room : {"geometry", "hal", "tasks"}) {
    CHECK(breaks(banned_findings(std::string{room} + "/a.hpp", "std::thread thread_;")));
    CHECK(breaks(banned_findings(std::string{room} + "/a.hpp", "std::jthread thread_;")));
  }
  CHECK_FALSE(breaks(banned_findings("firmware_like/a.hpp", "std::thread thread_;")));
  CHECK_FALSE(breaks(banned_findings("host_sim/a.cpp", "std::thread thread_;")));
  CHECK_FALSE(breaks(banned_findings("hal/a.hpp", "std::this_thread::get_id();")));
}

TEST_CASE("std::function in hal and tasks is found") {
  CHECK(breaks(banned_findings("tasks/a.hpp", "std::function<void()> f;")));
  CHECK(breaks(banned_findings("hal/a.cpp", "std::function<void()> f;")));
  CHECK_FALSE(breaks(banned_findings("host_sim/a.hpp", "std::function<void()> f;")));
  CHECK_FALSE(breaks(banned_findings("tasks/a.hpp", "// not a std::function\n")));
}

TEST_CASE("a header of more than 200 filled lines and a file of more than 600 are found") {
  CHECK_FALSE(breaks(size_findings("hal/a.hpp", lines(200) + "\n\n\n")));
  CHECK(breaks(size_findings("hal/a.hpp", lines(201))));
  CHECK_FALSE(breaks(size_findings("hal/a.cpp", lines(600))));
  CHECK(breaks(size_findings("hal/a.cpp", lines(601))));
  CHECK(breaks(size_findings("hal/PAGE.md", lines(601))));
}

TEST_CASE("a line of more than 120 columns is found, in a table it is not") {
  const std::string wide(121, 'x');
  CHECK_FALSE(breaks(width_findings("hal/a.cpp", std::string(120, 'x') + "\n")));
  CHECK(breaks(width_findings("hal/a.cpp", "int a;\n" + wide + "\n")));
  CHECK_FALSE(breaks(width_findings("hal/a.cpp", "// clang-format off\n" + wide + "\n// clang-format on\n")));
  CHECK(breaks(width_findings("hal/a.cpp", "// clang-format off\n// clang-format on\n" + wide + "\n")));
  std::string umlauts;
  for (int i = 0; i < 120; ++i) umlauts += "\xC3\xB6";
  CHECK_FALSE(breaks(width_findings("hal/a.cpp", umlauts)));  // columns, not bytes
}

TEST_CASE("a header without #pragma once, or with something before it, is found") {
  CHECK_FALSE(
      breaks(pragma_findings("hal/a.hpp", "// What it is.\n//\n// Failure none\n#pragma once\nint a;\n")));
  CHECK(breaks(pragma_findings("hal/a.hpp", "// What it is.\nint a;\n")));
  CHECK(breaks(pragma_findings("hal/a.hpp", "// #pragma once\nint a;\n")));
  CHECK(breaks(pragma_findings("hal/a.hpp", "int a;\n#pragma once\n")));
  CHECK(breaks(pragma_findings("tests/hal/a.hpp", "")));
  CHECK_FALSE(breaks(pragma_findings("hal/a.cpp", "int a;\n")));
}

TEST_CASE("names that say nothing are found, as rooms, as files and as parts of them") {
  for (const char* path : {"hal/utils.hpp", "utils/clock.hpp", "tasks/common.cpp", "hal/link_manager.hpp",
                           "tests/hal/test_helpers.hpp", "geometry/helper/a.cpp"}) {
    CAPTURE(path);
    CHECK(breaks(name_findings(path)));
  }
  CHECK_FALSE(breaks(name_findings("hal/base/clock.hpp")));
  CHECK_FALSE(breaks(name_findings("geometry/utilization.hpp")));
}

TEST_CASE("a semicolon in a test's name is found, also where the name goes over two lines") {
  CHECK(test_name_findings("tests/hal/a.cpp", "int a;\nTEST_CASE(\"one; two\") {\n") ==
        Findings{"tests/hal/a.cpp:2: a semicolon in a test's name: ctest would never run it"});
  CHECK(breaks(test_name_findings("tests/hal/a.cpp", "TEST_CASE(\n    \"one \"\n    \"two; three\") {\n")));
  CHECK_FALSE(breaks(test_name_findings("tests/hal/a.cpp", "TEST_CASE(\"one\") { f(\";\"); }\n")));
}

TEST_CASE("a folder that the design does not know is found at the top") {
  const std::vector<std::string> good = {"README.md", "hal/base/clock.hpp", ".ci/run",
                                         "build/a",   "out/run-1/run.db",   ".git"};
  CHECK_FALSE(breaks(top_level_findings(good)));
  const std::vector<std::string> bad = {"hal/base/clock.hpp", "docs/index.md", "docs/more.md",
                                        "src/main.cpp"};
  CHECK(top_level_findings(bad).size() == 2);
}

TEST_CASE("a folder without its page is found, and so is a tree without one") {
  const std::vector<std::string> good = {"README.md", "hal/README.md", "hal/base/clock.hpp", ".ci/run",
                                         "build/x"};
  CHECK_FALSE(breaks(readme_findings(good)));
  const std::vector<std::string> bad = {"hal/base/clock.hpp", "tests/hal/README.md"};
  CHECK(readme_findings(bad) == Findings{"/: a README.md of a page is missing",
                                         "hal/: a README.md of a page is missing",
                                         "tests/: a README.md of a page is missing"});
}

TEST_CASE("comments and literals are told from code, also where they look like each other") {
  CHECK(code_only("a \"// no\" b // c\nd") == "a \"     \" b     \nd");
  CHECK(code_only("f('\"') + g(1'000) /* x\ny */ h") == "f(' ') + g(1'000)     \n     h");
  CHECK(code_only("R\"x(a)\" // )x\" b") == std::string(15, ' ') + "b");
  CHECK(code_only("\"a\\\"b\" c") == "\"    \" c");
}

TEST_CASE("includes stand in order: own, ours, libraries, system and standard") {
  const std::string own = include("hal/a.hpp"), ours = include("hal/b.hpp");
  const std::string fmt = library("fmt/format.h"), standard = library("vector"), system = library("unistd.h");
  const auto found = [](const std::string& text) {
    return breaks(include_order_findings("hal/a.cpp", text));
  };
  CHECK_FALSE(found(own + "\n" + ours + "\n" + fmt + "\n" + standard + system));
  CHECK_FALSE(found(own + ours + system + standard));  // those two stand in one block
  CHECK(found(ours + own));
  CHECK(found(own + fmt + ours));
  CHECK(found(own + standard + fmt));
  CHECK(found(own + system + "\n" + library("sqlite3.h")));
  CHECK(found(standard + "// why\n" + ours));
  CHECK_FALSE(found(standard + "#define THE_ORDER_MATTERS\n" + ours));
  CHECK_FALSE(breaks(include_order_findings("tests/hal/a_test.cpp", own + ours)));
  CHECK(breaks(include_order_findings("tests/hal/a_test.cpp", ours + own)));
  CHECK(include_order_findings("hal/c.cpp", standard + "\n" + ours)
            .front()
            .starts_with("hal/c.cpp:3: hal/b.hpp"));
}

TEST_CASE("a word that re-wrapping has left on a line of its own is found") {
  const auto found = [](const std::string& text) { return breaks(comment_findings("hal/a.hpp", text)); };
  CHECK(found("// A comment of several words that goes on and\n// on.\n"));
  CHECK(found("  // set in, it goes\n  // on here.\nint a;\n"));
  CHECK(found("// Thread       one that is\n//              ordinary\n"));
  CHECK_FALSE(found("// A comment of several words that goes on\n// and on and on.\n"));
  CHECK_FALSE(found("// Short.\n"));
  CHECK_FALSE(found("int a;\n// Short.\nint b;\n"));
  CHECK_FALSE(found("// A paragraph of its own.\n//\n// Another.\n"));
  CHECK_FALSE(found("// Thread       any\n// Allocation   none\n"));
  CHECK_FALSE(found("// What it is called:\n//     moldloft run\n"));
}

TEST_CASE("a function of more than 70 lines is found, and one on the list that has become shorter") {
  const auto function = [](const std::string& head, std::size_t count) {
    std::string text = head + " {\n";
    for (std::size_t i = 0; i + 2 < count; ++i) text += "  a();\n";
    return text + "}\n";
  };
  CHECK_FALSE(breaks(function_findings("hal/a.cpp", function("void A::b(int c)", 70))));
  CHECK(function_findings("hal/a.cpp", "int x;\n\n" + function("void A::b(int c)", 71)) ==
        Findings{"hal/a.cpp:3: A::b has 71 lines, 70 is the most"});
  CHECK(breaks(function_findings("hal/a.cpp", function("void b(int c,\n       int d)", 71))));
  CHECK_FALSE(breaks(function_findings("hal/a.cpp", function("struct S", 90))));
  CHECK_FALSE(breaks(function_findings("hal/a.cpp", "namespace a {\n" + lines(90) + "}\n")));
  CHECK_FALSE(breaks(function_findings("tests/hal/a.cpp", function("void b()", 71))));
  CHECK_FALSE(
      breaks(function_findings("geometry/error.cpp", function("string_view to_string(Error e)", 71))));
  CHECK(breaks(function_findings("geometry/error.cpp", function("string_view to_string(Error e)", 20))));
}
