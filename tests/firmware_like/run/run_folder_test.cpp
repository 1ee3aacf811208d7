#include "firmware_like/run/run_folder.hpp"

#include "firmware_like/forked.hpp"
#include "hal/scanner/psc1.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <regex>
#include <set>
#include <unistd.h>

using namespace moldloft;
using namespace moldloft::firmware_like;
namespace fs = std::filesystem;

namespace {

const std::string config = "[start]\nyaw_deg = 3\n";

std::string refused(const std::expected<RunFolder, Failure>& run) { return run ? "" : run.error().what; }

}  // namespace

TEST_CASE("a run's folder is made with all folders above it, and holds the configuration as it was written") {
  const hal::TemporaryFolder folder;
  const fs::path path = folder.path() / "a" / "b";
  {
    const auto run = create_run(path, config, hal::psc1::frame_codec, RunKind::measured);
    REQUIRE_MESSAGE(run.has_value(), run.error().what);
    CHECK(run->made_folder);
    CHECK(run->archive == nullptr);
  }
  const auto run = open_run(path);
  REQUIRE(run.has_value());
  CHECK(*run->store->meta("config") == config);
  CHECK(*run->store->meta("kind") == "measured");
  CHECK(std::regex_match(*run->store->meta("begun"), std::regex{R"(20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ)"}));
  CHECK(run->archive->size() == 0);
  CHECK(run->archive->last() == 0);
}

TEST_CASE("a folder that cannot be made is refused with its path and the reason") {
  const hal::TemporaryFolder folder;
  std::ofstream{folder.file("file")} << "here\n";
  CHECK(refused(create_run(folder.file("file"), config, hal::psc1::frame_codec, RunKind::measured)) ==
        folder.file("file") + ": cannot be created (Not a directory); give another --out");
  CHECK(refused(create_run(folder.file("file/run"), config, hal::psc1::frame_codec, RunKind::measured)) ==
        folder.file("file/run") + ": cannot be created (Not a directory); give another --out");
}

TEST_CASE("a folder that cannot be written is refused before anything moves") {
  const auto run = create_run("/proc/self", config, hal::psc1::frame_codec,
                              RunKind::measured);  // is there, and takes no file from anybody
  REQUIRE_FALSE(run.has_value());
  CHECK(run.error().what.starts_with("/proc/self/run.db: cannot be written"));
}

TEST_CASE("a measured run is never overwritten, neither by a measured nor by a simulated one") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("run");
  REQUIRE(create_run(path, config, hal::psc1::frame_codec, RunKind::measured).has_value());
  CHECK(refused(create_run(path, config, hal::psc1::frame_codec, RunKind::measured)) ==
        path + ": holds a run already; give another --out, or --resume to go on with it");
  CHECK(refused(create_run(path, config, hal::psc1::frame_codec, RunKind::simulated)) ==
        path + ": holds a run already; give another --out");
  CHECK(open_run(path).has_value());
}

TEST_CASE("a simulated run, which its seed brings back, makes room for another simulated run only") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("run");
  REQUIRE(create_run(path, config, hal::psc1::frame_codec, RunKind::simulated).has_value());
  CHECK_FALSE(create_run(path, config, hal::psc1::frame_codec, RunKind::measured).has_value());
  const auto again = create_run(path, "[start]\nyaw_deg = 4\n", hal::psc1::frame_codec, RunKind::simulated);
  REQUIRE(again.has_value());
  CHECK_FALSE(again->made_folder);
  CHECK_FALSE(again->store->meta("begun").has_value());  // it happens at no time
  CHECK(*again->store->meta("config") == "[start]\nyaw_deg = 4\n");
}

TEST_CASE(
    "a run is resumed with the configuration that it was begun with, whatever the devices' addresses are "
    "today") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("run");
  REQUIRE(create_run(path, config, hal::psc1::frame_codec, RunKind::measured).has_value());
  CHECK(resume_run(path, config).has_value());
  CHECK(resume_run(path, config + "[scanner]\nport = 9\n").has_value());
  CHECK(refused(resume_run(path, "[start]\nyaw_deg = 4\n")) ==
        path +
            ": was begun with another configuration ('start.yaw_deg' differs); resume it with the same, or "
            "begin a new run with another --out");
}

TEST_CASE("a run is resumed with a larger memory plan, and fitted with it from then on") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("run"), larger = config + "[plate]\nlargest_mm = [900, 900]\n";
  REQUIRE(create_run(path, config, hal::psc1::frame_codec, RunKind::measured).has_value());
  REQUIRE(resume_run(path, larger).has_value());
  CHECK(*open_run(path)->store->meta("config") == larger);
}

TEST_CASE("what is resumed is appended to, what is opened to be read is not") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("run");
  REQUIRE(create_run(path, config, hal::psc1::frame_codec, RunKind::measured).has_value());
  {
    const auto resumed = resume_run(path, config);
    REQUIRE(resumed.has_value());
    CHECK(resumed->store->set_meta("note", "gone on").has_value());
  }
  const auto read = open_run(path);
  REQUIRE(read.has_value());
  CHECK(*read->store->meta("note") == "gone on");
  CHECK_FALSE(read->store->set_meta("note", "changed").has_value());
}

TEST_CASE(
    "a folder without a run, or with something else under the store's name, is refused by what is wrong") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.path();
  CHECK(refused(open_run(path)) == path + ": no run.db there; give the folder of a run");
  CHECK(refused(resume_run(path, config)) == path + ": no run.db there; give the folder of a run");
  CHECK(refused(open_run(folder.file("none"))) ==
        folder.file("none") + ": no run.db there; give the folder of a run");
  std::ofstream{folder.file("run.db")} << "these are no tables\n";
  CHECK(refused(open_run(path)) == folder.file("run.db") + ": is not a run store");
}

TEST_CASE("a discarded run leaves no trace, and what else lies in the folder stays") {
  const hal::TemporaryFolder folder;
  auto own = create_run(folder.file("own"), config, hal::psc1::frame_codec, RunKind::measured);
  REQUIRE(own.has_value());
  discard_run(std::move(*own));
  CHECK_FALSE(fs::exists(folder.file("own")));

  fs::create_directories(folder.file("mine"));
  auto empty = create_run(folder.file("mine"), config, hal::psc1::frame_codec, RunKind::measured);
  REQUIRE(empty.has_value());
  discard_run(std::move(*empty));
  CHECK(fs::is_directory(folder.file("mine")));  // was there before
  CHECK(fs::is_empty(folder.file("mine")));

  std::ofstream{folder.file("mine/notes.txt")} << "keep\n";
  auto beside = create_run(folder.file("mine"), config, hal::psc1::frame_codec, RunKind::measured);
  REQUIRE(beside.has_value());
  discard_run(std::move(*beside));
  CHECK(fs::exists(folder.file("mine/notes.txt")));
  CHECK_FALSE(fs::exists(folder.file("mine/run.db")));
}

TEST_CASE("runs begun in one second get a folder each, named by date and time") {
  const hal::TemporaryFolder folder;
  const fs::path before = fs::current_path();
  fs::current_path(folder.file(""));
  std::set<fs::path> made;
  for (int i = 0; i < 5; ++i) {
    const auto run = create_run({}, config, hal::psc1::frame_codec, RunKind::measured);
    REQUIRE(run.has_value());
    CHECK(std::regex_match(run->path.string(), std::regex{R"(out/run-\d{8}-\d{6}(-\d)?)"}));
    made.insert(run->path);
  }
  auto refused_one = create_run({}, config, hal::psc1::frame_codec, RunKind::measured);
  REQUIRE(refused_one.has_value());
  const fs::path gone = refused_one->path;
  discard_run(std::move(*refused_one));
  CHECK_FALSE(fs::exists(gone));
  fs::current_path(before);
  CHECK(made.size() == 5);
}

TEST_CASE("a folder that is written to is refused to everybody else, and free again afterwards") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("run");
  {
    const auto first = create_run(path, config, hal::psc1::frame_codec, RunKind::measured);
    REQUIRE(first.has_value());
    const std::string link = folder.file("link");
    fs::create_directory_symlink(path, link);
    const std::string words = " is in use by process " + std::to_string(::getpid()) +
                              ": one controller at a time; wait for its end, or stop it";
    CHECK(refused(create_run(path, config, hal::psc1::frame_codec, RunKind::measured)) == path + words);
    CHECK(refused(resume_run(link, config)) == link + words);
    CHECK(open_run(path).has_value());  // reading is free
  }
  CHECK(resume_run(path, config).has_value());
}

TEST_CASE("results whose run is elsewhere are not written over by a new run") {
  const hal::TemporaryFolder folder;
  std::ofstream{folder.file("summary.json")} << "{}\n";
  CHECK(refused(create_run(folder.file(""), config, hal::psc1::frame_codec, RunKind::measured)) ==
        folder.file("") + ": holds results whose run is not there; give another --out");
  CHECK_FALSE(fs::exists(folder.file("run.db")));
}

TEST_CASE("a run whose folder is removed while it is open is brought back whole") {
  const hal::TemporaryFolder folder;
  const std::string path = folder.file("run");
  const auto run = create_run(path, config, hal::psc1::frame_codec, RunKind::measured);
  REQUIRE(run.has_value());
  CHECK(*bring_back(*run) == false);
  REQUIRE(run->store->set_meta("late", "word").has_value());
  fs::remove_all(path);
  CHECK(*bring_back(*run) == true);
  const auto again = hal::RunStore::open(path + "/run.db", hal::RunStore::Mode::read);
  REQUIRE_MESSAGE(again.has_value(), again.error().what);
  CHECK(*again->meta("late") == "word");
  CHECK(*again->meta("config") == config);
}

TEST_CASE("a crashed run is read whole from a folder that cannot be written, or refused") {
  const hal::TemporaryFolder folder;
  const fs::path crashed = folder.file("crashed");
  test::in_child({}, [&] {
    auto run = create_run(crashed, config, hal::psc1::frame_codec, RunKind::measured);
    if (run) (void)run->store->set_meta("last", "word");
    ::_exit(0);  // as a kill leaves it: the last words stand in the log alone
    return std::string{};
  });
  fs::permissions(folder.file(""), fs::perms{0755});
  const auto last_word = [&](const char* name, std::initializer_list<const char*> parts, fs::perms of_log) {
    const fs::path copy = folder.file(name);
    fs::create_directory(copy);
    for (const char* part : parts) fs::copy_file(crashed / part, copy / part);
    for (const auto& part : fs::directory_iterator{copy}) fs::permissions(part, fs::perms{0444});
    fs::permissions(copy / "run.db-wal", of_log);
    fs::permissions(copy, fs::perms{0555});
    const std::string word = test::in_child({.nobody = test::is_root(), .memlock_bytes = 65536}, [&] {
      const auto run = open_run(copy);
      return run ? run->store->meta("last").value_or("short") : run.error().what;
    });
    fs::permissions(copy, fs::perms{0755});
    return word;
  };
  constexpr fs::perms readable{0444}, closed{0};
  REQUIRE(fs::file_size(crashed / "run.db-wal") > 0);
  CHECK(last_word("with-index", {"run.db", "run.db-wal", "run.db-shm"}, readable) == "word");
  CHECK(last_word("without", {"run.db", "run.db-wal"}, readable) == "word");
  CHECK(last_word("closed", {"run.db", "run.db-wal"}, closed) ==
        folder.file("closed/run.db-wal") + ": cannot be read, and belongs to the run: check its permissions");
}
