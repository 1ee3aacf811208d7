#include "hal/record/run_store.hpp"

#include "hal/sample_frame.hpp"
#include "hal/scanner/psc1.hpp"
#include "hal/small_disk.hpp"
#include "hal/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <sqlite3.h>

#include <cstring>
#include <fstream>

using namespace moldloft::hal;
using Mode = RunStore::Mode;

namespace {

RunStore opened(const std::string& path, Mode mode) {
  auto store = RunStore::open(path, mode);
  INFO((store ? std::string{} : store.error().what));
  REQUIRE(store);
  return std::move(*store);
}

std::string refusal(const std::string& path, Mode mode) {
  const auto store = RunStore::open(path, mode);
  return store ? "" : store.error().what;
}

void sql(const std::string& path, const char* text) {
  sqlite3* database = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &database) == SQLITE_OK);
  REQUIRE(sqlite3_exec(database, text, nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(database);
}

std::vector<std::byte> counting(std::size_t count) {
  std::vector<std::byte> bytes(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::byte>(i * 31);
  return bytes;
}

void put(RunStore& store, LinkId link, Direction direction, std::uint64_t offset,
         std::span<const std::byte> bytes) {
  REQUIRE(store.write({.at = 5ms,
                       .link = link,
                       .direction = direction,
                       .offset = offset,
                       .size = static_cast<std::uint32_t>(bytes.size())},
                      bytes));
}

const ShotRecord shot{.at = 1234567ns,
                      .shot_id = 42,
                      .purpose = ShotPurpose::surface,
                      .attempts = 2,
                      .commanded = {1, 2, 3, 0.1, 0.2, 0.3},
                      .reported = {1.5, 2.5, 3.5, 0.15, 0.25, 0.35},
                      .payload_offset = 32,
                      .payload_bytes = 0};

}  // namespace

TEST_CASE("what is written is read back, by another object, in order") {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.db");
  {
    RunStore store = opened(path, Mode::create);
    REQUIRE(store.set_meta("schema", "1"));
    REQUIRE(store.set_meta("configuration", "tick = 1"));
    REQUIRE(store.set_meta("configuration", "tick = 2"));
    REQUIRE(store.begin());
    REQUIRE(store.write(EventRecord{.at = 1ms,
                                    .source = "cell",
                                    .event = "start",
                                    .from = "Idle",
                                    .to = "Starting",
                                    .text = "by operator"}));
    REQUIRE(store.write(EventRecord{.at = 2ms, .source = "robot", .event = "lost", .text = ""}));
    REQUIRE(store.write(shot));
    REQUIRE(store.commit());
  }
  const RunStore store = opened(path, Mode::read);
  CHECK(*store.meta("configuration") == "tick = 2");
  CHECK(store.meta("nothing").error().what == path + ": holds no 'nothing'");
  const auto events = store.events();
  REQUIRE(events);
  REQUIRE(events->size() == 2);
  CHECK((*events)[0].at == 1ms);
  CHECK((*events)[0].source.view() == "cell");
  CHECK((*events)[0].to.view() == "Starting");
  CHECK((*events)[0].text.view() == "by operator");
  CHECK((*events)[1].event.view() == "lost");
  CHECK((*events)[1].from.empty());
  const auto shots = store.shots();
  REQUIRE(shots);
  REQUIRE(shots->size() == 1);
  CHECK((*shots)[0].at == shot.at);
  CHECK((*shots)[0].shot_id == 42);
  CHECK((*shots)[0].purpose == ShotPurpose::surface);
  CHECK((*shots)[0].attempts == 2);
  CHECK((*shots)[0].commanded == shot.commanded);
  CHECK((*shots)[0].reported == shot.reported);
  CHECK((*shots)[0].payload_offset == 32);
}

TEST_CASE("any stretch of a link's bytes is put together from the pieces, a hole is not papered over") {
  const TemporaryFolder folder;
  RunStore store = opened(folder.file("run.db"), Mode::create);
  const auto bytes = counting(1000);
  REQUIRE(store.begin());
  for (const auto& [begin, end] : {std::pair{0, 1}, {1, 100}, {100, 700}, {800, 1000}}) {
    put(store, LinkId::scanner, Direction::received, begin, std::span{bytes}.subspan(begin, end - begin));
    put(store, LinkId::robot, Direction::sent, begin, counting(end - begin));
  }
  REQUIRE(store.commit());
  for (std::size_t begin = 0; begin < 700; begin += 37) {
    for (std::size_t size = 0; begin + size <= 700; size += 53) {
      CAPTURE(begin);
      CAPTURE(size);
      const auto part = store.bytes(LinkId::scanner, Direction::received, begin, size);
      REQUIRE(part);
      CHECK(std::ranges::equal(*part, std::span{bytes}.subspan(begin, size)));
    }
  }
  CHECK(store.bytes(LinkId::scanner, Direction::received, 800, 200));
  CHECK_FALSE(store.bytes(LinkId::scanner, Direction::received, 699, 2));
  CHECK_FALSE(store.bytes(LinkId::scanner, Direction::received, 699, 150));
  CHECK_FALSE(store.bytes(LinkId::scanner, Direction::received, 750, 60));
  CHECK_FALSE(store.bytes(LinkId::scanner, Direction::received, 900, 101));
  CHECK_FALSE(store.bytes(LinkId::scanner, Direction::sent, 0, 1));
}

TEST_CASE("a shot's frame is decoded from the bytes as they came") {
  const TemporaryFolder folder;
  RunStore store = opened(folder.file("run.db"), Mode::create);
  const Frame frame = sample_frame(10, 50);
  std::vector<std::byte> wire(psc1::encoded_frame_size(frame, psc1::Encoding::float32, true));
  REQUIRE(psc1::encode_frame(1, frame, psc1::Encoding::float32, true, {}, wire) == wire.size());
  REQUIRE(store.begin());
  put(store, LinkId::scanner, Direction::received, 0, counting(77));  // HELLO and the like
  put(store, LinkId::scanner, Direction::received, 77, std::span{wire}.first(1000));
  put(store, LinkId::scanner, Direction::received, 1077, std::span{wire}.subspan(1000));
  REQUIRE(store.commit());
  ShotRecord record = shot;
  record.payload_offset = 77 + 32;
  record.payload_bytes = static_cast<std::uint32_t>(wire.size() - 36);
  const auto back = store.frame(record, psc1::frame_codec);
  REQUIRE(back);
  CHECK(back->shot_id == 42);
  CHECK(back->exposed_sensor_ns == frame.exposed_sensor_ns);
  CHECK(back->arrived == record.at);
  CHECK(back->x == frame.x);
  CHECK(back->z == frame.z);
  CHECK(back->intensity == frame.intensity);
  record.payload_offset += 1;
  CHECK(store.frame(record, psc1::frame_codec)
            .error()
            .what.ends_with("run.db: bytes 78 to " + std::to_string(78 + wire.size() - 4) +
                            " of the link are not all there") == false);
  CHECK_FALSE(store.frame(record, psc1::frame_codec));
}

TEST_CASE("a resumed run appends: its bytes follow those of the run before, its shots find them") {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.db");
  const Frame frame = sample_frame(2, 8, 43);
  std::vector<std::byte> wire(psc1::encoded_frame_size(frame, psc1::Encoding::int16, true));
  REQUIRE(psc1::encode_frame(1, frame, psc1::Encoding::int16, true, {51, 51, 40}, wire) == wire.size());
  {
    RunStore store = opened(path, Mode::create);
    put(store, LinkId::scanner, Direction::received, 0, counting(100));
    put(store, LinkId::scanner, Direction::received, 100, counting(50));
  }
  {
    RunStore store = opened(path, Mode::append);
    put(store, LinkId::scanner, Direction::received, 0, wire);
    ShotRecord record = shot;
    record.shot_id = 43;
    record.payload_offset = 32;
    record.payload_bytes = static_cast<std::uint32_t>(wire.size() - 36);
    REQUIRE(store.write(record));
    CHECK_FALSE(store.write(record));  // a shot id is used once
  }
  const RunStore store = opened(path, Mode::read);
  CHECK(*store.bytes(LinkId::scanner, Direction::received, 0, 100) == counting(100));
  const auto back = store.frame(store.shots()->front(), psc1::frame_codec);
  REQUIRE(back);
  CHECK(back->shot_id == 43);
}

TEST_CASE("what cannot be opened says what, where and what to do") {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.db");
  CHECK(refusal(path, Mode::read) == path + ": there is no such file");
  CHECK(refusal(path, Mode::append) == path + ": there is no such file");
  opened(path, Mode::create);
  CHECK(refusal(path, Mode::create) == path + ": exists already: choose another folder, or resume that run");

  const std::string nowhere = folder.file("no/run.db");
  CHECK(refusal(nowhere, Mode::create) ==
        nowhere + ": cannot be written: check the folder and its permissions");

  const std::string text = folder.file("text.db");
  std::ofstream{text} << "this is a letter to the shipyard, and long enough to be taken for something else";
  CHECK(refusal(text, Mode::read) == text + ": is not a run store");
  CHECK(refusal(text, Mode::append) == text + ": is not a run store");

  const std::string other = folder.file("other.db");
  sql(other, "CREATE TABLE recipes(name TEXT)");
  CHECK(refusal(other, Mode::read) == other + ": is not a run store");

  sql(path, "PRAGMA user_version = 9");
  CHECK(refusal(path, Mode::read) ==
        path + ": has schema version 9, this program reads version 1: use the program that wrote it");
}

TEST_CASE("a name may hold what a URI gives a meaning to") {
  const TemporaryFolder folder;
  const std::string path = folder.file("plate #7 50%?.db");
  opened(path, Mode::create);
  CHECK(std::filesystem::exists(path));
  opened(path, Mode::read);
}

TEST_CASE("a disk that is full is said so, nothing half is kept, and it goes on when there is room") {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.db");
  RunStore store = opened(path, Mode::create);
  const auto bulk = counting(1'000'000);
  REQUIRE(store.begin());
  const auto done = [&] {
    const SmallDisk disk{300'000};
    auto written = store.write({.size = 1'000'000}, bulk);
    if (written) written = store.commit();
    store.roll_back();
    return written;
  }();
  REQUIRE_FALSE(done);
  CHECK(done.error().what.starts_with(path + ": the disk"));
  REQUIRE(store.begin());
  put(store, LinkId::scanner, Direction::received, 0, bulk);
  REQUIRE(store.commit());
  CHECK(store.bytes(LinkId::scanner, Direction::received, 0, 1'000'000)->size() == 1'000'000);
}
