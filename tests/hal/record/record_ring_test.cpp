#include "hal/record/record_ring.hpp"

#include <doctest/doctest.h>

#include <deque>
#include <random>
#include <string>
#include <thread>
#include <vector>

using namespace moldloft::hal;

namespace {

bool write(RecordRing& ring, std::uint32_t kind, const std::string& text) {
  return ring.write(kind, {std::as_bytes(std::span{text})});
}

std::string text_of(const RecordRing::Reader::Record& record) {
  return {reinterpret_cast<const char*>(record.bytes.data()), record.bytes.size()};
}

}  // namespace

TEST_CASE("records come out whole and in order, however they wrap around the end") {
  RecordRing ring{256};
  std::mt19937 random{1};
  std::deque<std::string> waiting;
  std::size_t passed = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::string text(random() % 60, static_cast<char>('a' + i % 26));
    if (write(ring, i % 7, text)) {
      waiting.push_back(std::to_string(i % 7) + text);
    } else {
      CHECK(RecordRing::space_of(text.size()) > ring.room());
    }
    if (random() % 3 != 0) continue;
    RecordRing::Reader reader{ring};
    while (const auto record = reader.next()) {
      REQUIRE(std::to_string(record->kind) + text_of(*record) == waiting.front());
      waiting.pop_front();
      ++passed;
    }
    REQUIRE(waiting.empty());
    reader.release();
    REQUIRE(ring.used() == 0);
  }
  CHECK(passed > 5000);
}

TEST_CASE("a ring is full to its last byte, and says exactly how much room is left") {
  RecordRing ring{100};  // becomes 104
  CHECK(ring.room() == 104);
  CHECK(write(ring, 0, std::string(40, 'x')));  // 8 + 40
  CHECK(ring.room() == 56);
  CHECK_FALSE(write(ring, 0, std::string(49, 'x')));  // 8 + 56
  CHECK(write(ring, 0, std::string(48, 'x')));
  CHECK(ring.room() == 0);
  CHECK_FALSE(write(ring, 0, ""));
  CHECK(ring.high_water() == 104);
}

TEST_CASE("parts become one record, an empty record is a record") {
  RecordRing ring{100};
  const std::string head = "head";
  const std::string tail = "tail";
  CHECK(ring.write(3, {std::as_bytes(std::span{head}), std::as_bytes(std::span{tail})}));
  CHECK(ring.write(4, {}));
  RecordRing::Reader reader{ring};
  CHECK(text_of(*reader.next()) == "headtail");
  CHECK(reader.next()->kind == 4);
  CHECK_FALSE(reader.next());
}

TEST_CASE("what is not released is there again, and what comes later waits for the next reader") {
  RecordRing ring{1000};
  write(ring, 0, "one");
  RecordRing::Reader first{ring};
  write(ring, 0, "two");
  CHECK(text_of(*first.next()) == "one");
  CHECK_FALSE(first.next());

  RecordRing::Reader second{ring};
  CHECK(text_of(*second.next()) == "one");
  second.release();
  RecordRing::Reader third{ring};
  CHECK(text_of(*third.next()) == "two");
}

TEST_CASE("one thread writes, another reads: every record arrives, none is torn") {
  RecordRing ring{4096};
  constexpr int count = 100'000;
  std::thread writer{[&] {
    std::mt19937 random{2};
    for (int i = 0; i < count;) {
      const std::string text =
          std::to_string(i) + std::string(random() % 50, static_cast<char>('a' + i % 26));
      if (write(ring, static_cast<std::uint32_t>(i), text))
        ++i;
      else
        std::this_thread::yield();
    }
  }};
  int next = 0;
  bool good = true;
  while (next < count) {
    RecordRing::Reader reader{ring};
    while (const auto record = reader.next()) {
      const std::string number = std::to_string(next);
      const std::string text = text_of(*record);
      good = good && record->kind == static_cast<std::uint32_t>(next) && text.starts_with(number) &&
             text.find_first_not_of(static_cast<char>('a' + next % 26), number.size()) == std::string::npos;
      ++next;
    }
    reader.release();
  }
  writer.join();
  CHECK(good);
  CHECK(ring.used() == 0);
}
