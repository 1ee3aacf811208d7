#include "firmware_like/config/plate_name.hpp"

#include "firmware_like/process/build_info.hpp"
#include "firmware_like/results/summary.hpp"
#include "firmware_like/run/run_folder.hpp"
#include "hal/scanner/psc1.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace moldloft;
using namespace moldloft::firmware_like;

namespace {

std::string refusal(std::string_view text) {
  const auto line = one_line(text, "--plate", longest_plate_name);
  return line ? "" : line.error();
}

}  // namespace

TEST_CASE("a plate's name is one line of UTF-8, with any letters, quotes and slashes") {
  for (const char* name : {"17", "Hull 7/plate 12 \"port\"", "it's <b>&amp;</b>",
                           "Au\xC3\x9F"
                           "enhaut 3",
                           "\xE6\x9D\xBF 4", "\\", "-", "a;b,c*/"}) {
    CAPTURE(name);
    CHECK(one_line(name, "--plate", longest_plate_name).value_or("refused") == name);
  }
  CHECK(one_line("  plate 4 ", "--plate", longest_plate_name).value_or("refused") == "plate 4");
  CHECK(one_line(std::string(100, 'p'), "--plate", longest_plate_name).has_value());
  std::string hundred;  // letters, of two bytes each
  for (int i = 0; i < 100; ++i) hundred += "\xC3\x9F";
  CHECK(one_line(hundred, "--plate", longest_plate_name).value_or("refused") == hundred);
}

TEST_CASE("what cannot be a name is refused with where and why, and never shown") {
  CHECK(refusal("") == "--plate: the text is blank; leave the option out, or write something");
  CHECK(refusal("   ") == refusal(""));
  CHECK(refusal("two\nlines") ==
        "--plate: character 4 is a control character (0x0A); write one line of plain text");
  CHECK(refusal("Au\xC3\x9F\x1B[2J").starts_with("--plate: character 4 is a control character (0x1B)"));
  CHECK(refusal("a\xC2\x9B"
                "2J")
            .starts_with("--plate: character 2 is a control character"));
  CHECK(refusal(std::string("a\0b", 3)).starts_with("--plate: character 2 is a control character (0x00)"));
  CHECK(refusal("61 \xB0"
                "C") == "--plate: byte 4 (0xB0) is not UTF-8; set the terminal to UTF-8, or write ASCII");
  CHECK(refusal("\xED\xA0\x80").find("is not UTF-8") != std::string::npos);  // half of a surrogate pair
  CHECK(refusal(std::string(101, 'p')) == "--plate: 101 characters are too many, 100 at most");
  CHECK(refusal(std::string(100 << 10, '\xE9')).size() < 200);
}

TEST_CASE("a plate that nobody has named is called after its folder, whatever that is called") {
  CHECK(name_of_folder("out/plate-17") == "plate-17");
  CHECK(name_of_folder("out/plate-17/") == "plate-17");
  CHECK(name_of_folder("out/plate-17/.") == "plate-17");
  CHECK(name_of_folder("/") == "plate");
  CHECK(name_of_folder("x/two\nlines") == "two?lines");
  CHECK(name_of_folder("x/a\xC2\x9B"
                       "2J") == "a?2J");
  CHECK(name_of_folder("x/\xE9t\xE9") == "\xEF\xBF\xBDt\xEF\xBF\xBD");  // Latin-1
  CHECK(name_of_folder("x/  ") == "plate");
  const std::string long_one = name_of_folder("x/" + std::string(250, 'p'));
  CHECK(long_one == std::string(100, 'p'));
}

TEST_CASE("a run's store keeps the plate's name, the remark and the program that made it") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("plate-3");
  {
    auto run = create_run(path, "", hal::psc1::frame_codec, RunKind::measured,
                          {"port side 3", "after the second pass"});
    REQUIRE(run.has_value());
    CHECK(run->names.plate == "port side 3");
    CHECK(run->store->meta("plate").value_or("") == "port side 3");
    CHECK(run->store->meta("remark").value_or("") == "after the second pass");
    CHECK(run->store->meta("version").value_or("") == build_info().version);
    CHECK(run->store->meta("commit").value_or("") == build_info().commit);
    CHECK(run->store->meta("build").value_or("") == build_info().build);
  }
  SUBCASE("it goes on under that name, said again or not") {
    CHECK(resume_run(path, "").value().names.plate == "port side 3");
    CHECK(resume_run(path, "", {"port side 3", ""}).value().names.plate == "port side 3");
    CHECK(open_run(path).value().names.plate == "port side 3");
  }
  SUBCASE("another name is refused, and changes nothing") {
    const auto other = resume_run(path, "", {"port side 4", ""});
    REQUIRE_FALSE(other.has_value());
    CHECK(other.error().what ==
          path +
              ": is the run of plate 'port side 3', not of 'port side 4'; resume it without "
              "--plate, or begin a new run with another --out");
    CHECK(open_run(path).value().names.plate == "port side 3");
  }
  SUBCASE("a new remark is added to the old one, once") {
    CHECK(resume_run(path, "", {"", "gas was empty"}).value().names.remark ==
          "after the second pass; gas was empty");
    CHECK(resume_run(path, "", {"", "gas was empty"}).value().names.remark ==
          "after the second pass; gas was empty");
    CHECK_FALSE(resume_run(path, "", {"", std::string(230, 'r')}).has_value());
    CHECK(open_run(path).value().names.remark == "after the second pass; gas was empty");
  }
}

TEST_CASE("a store of before plates had names is called by its folder, and takes a name when it goes on") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("plate-5");
  std::filesystem::create_directory(path);
  {
    auto store = hal::RunStore::open(path + "/run.db", hal::RunStore::Mode::create);
    REQUIRE(store.has_value());
    REQUIRE(store->set_meta("config", "").has_value());
  }
  CHECK(open_run(path).value().names.plate == "plate-5");
  CHECK(open_run(path).value().names.remark == "");
  CHECK(resume_run(path, "", {"plate-5", ""}).has_value());
}

TEST_CASE("what is said of a run in one line: plate, cell, time, program, remark, as far as they are known") {
  CHECK(about_run(named_in(Json::object())) == "plate measured");  // as CAD files call it
  CHECK(about_run(named_in(Json{{"plate", "17"}})) == "plate 17");
  CHECK(about_run(
            named_in(Json{{"plate", "17"},
                          {"cell", "loft"},
                          {"begun", "2026-01-31T12:00:00Z"},
                          {"program", {{"version", "1.2.3"}, {"commit", "0123456789ab"}, {"build", "Debug"}}},
                          {"remark", "cold"}})) ==
        "plate 17; cell loft; begun 2026-01-31T12:00:00Z; moldloft 1.2.3; commit 0123456789ab; remark: cold");
}
