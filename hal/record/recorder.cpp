#include "hal/record/recorder.hpp"

#include "hal/base/latest_value.hpp"
#include "hal/base/printable_text.hpp"
#include "hal/record/flight_recorder.hpp"
#include "hal/record/record_ring.hpp"
#include "hal/record/run_store.hpp"

#include <array>
#include <cstring>
#include <utility>

namespace moldloft::hal {
namespace {

enum class Kind : std::uint32_t { link_bytes = 0, event = 1, shot = 2 };

// A frame comes in pieces, one record each. The driver reads at least a header and a tick's worth of a 10
// Mb/s line (1250 bytes) at a time; a record costs 56 bytes beside its own, so a quarter on top is five times
// what that takes.
constexpr std::size_t with_record_overhead(std::size_t frame_bytes) {
  return frame_bytes + frame_bytes / 4 + 4096;
}

template <typename T>
std::span<const std::byte> bytes_of(const T& record) noexcept {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::as_bytes(std::span{&record, 1});
}

template <typename T>
T record_of(std::span<const std::byte> bytes) noexcept {
  T record;
  std::memcpy(static_cast<void*>(&record), bytes.data(), sizeof record);
  return record;
}

constexpr std::size_t index(LinkId link, Direction direction) noexcept {
  return 2 * static_cast<std::size_t>(link) + static_cast<std::size_t>(direction);
}

std::expected<void, StoreError> store(RunStore& to, const RecordRing::Reader::Record& record) {
  switch (static_cast<Kind>(record.kind)) {
    case Kind::link_bytes:
      return to.write(record_of<LinkBytes>(record.bytes), record.bytes.subspan(sizeof(LinkBytes)));
    case Kind::event:
      return to.write(record_of<EventRecord>(record.bytes));
    case Kind::shot:
      return to.write(record_of<ShotRecord>(record.bytes));
  }
  return {};
}

std::expected<void, StoreError> store_all(RunStore& to, RecordRing::Reader& from) {
  while (const auto record = from.next()) {
    if (auto stored = store(to, *record); !stored) return stored;
  }
  return {};
}

}  // namespace

struct Recorder::Rings {
  explicit Rings(const Sizes& sizes)
      : bulk{sizes.bulk_bytes},
        events{sizes.events_bytes},
        frame_bytes{with_record_overhead(sizes.largest_frame_bytes)} {}

  void keep(RecordRing& ring, Kind kind, std::initializer_list<std::span<const std::byte>> parts) noexcept {
    if (!ring.write(std::to_underlying(kind), parts)) lost.fetch_add(1, std::memory_order_relaxed);
  }

  RecordRing bulk;    // what the scanner sends
  RecordRing events;  // everything else
  std::size_t frame_bytes;
  std::array<std::atomic<std::uint64_t>, 4> offsets{};
  std::atomic<std::uint64_t> lost{0};
  std::atomic<bool> failed{false};
  LatestValue<Message> error;
};

Recorder::Recorder(const Sizes& sizes, FlightRecorder* flight)
    : rings_{std::make_unique<Rings>(sizes)}, flight_{flight} {}
Recorder::~Recorder() = default;

// ---- the control thread's side

void Recorder::link_bytes(LinkId link, Direction direction, Instant at,
                          std::span<const std::byte> bytes) noexcept {
  auto& offset = rings_->offsets[index(link, direction)];
  const LinkBytes head{.at = at,
                       .link = link,
                       .direction = direction,
                       .offset = offset.load(std::memory_order_relaxed),
                       .size = static_cast<std::uint32_t>(bytes.size())};
  // A piece that is dropped still counts: the offsets of what follows must stay those that the driver knows.
  offset.store(head.offset + bytes.size(), std::memory_order_relaxed);
  const bool is_bulk = link == LinkId::scanner && direction == Direction::received;
  rings_->keep(is_bulk ? rings_->bulk : rings_->events, Kind::link_bytes, {bytes_of(head), bytes});
  if (flight_ == nullptr) return;
  const bool in = direction == Direction::received;
  flight_->bytes(in ? FlightKind::received : FlightKind::sent, static_cast<int>(link), at, bytes.size());
}

void Recorder::event(const EventRecord& event) noexcept {
  rings_->keep(rings_->events, Kind::event, {bytes_of(event)});
  if (flight_ != nullptr) flight_->transition(event);
}
void Recorder::shot(const ShotRecord& shot) noexcept {
  rings_->keep(rings_->events, Kind::shot, {bytes_of(shot)});
}

// A shot is a frame and a record of it: both need their place, or the frame could never be found again.
bool Recorder::room_for_frame() const noexcept {
  constexpr std::size_t records_of_a_shot = 16 * RecordRing::space_of(sizeof(EventRecord));
  return !store_failed() && rings_->bulk.room() >= rings_->frame_bytes &&
         rings_->events.room() >= records_of_a_shot;
}

std::uint64_t Recorder::lost() const noexcept { return rings_->lost.load(std::memory_order_relaxed); }

std::uint64_t Recorder::offset(LinkId link, Direction direction) const noexcept {
  return rings_->offsets[index(link, direction)].load(std::memory_order_relaxed);
}

std::size_t Recorder::plan_bytes() const noexcept {
  return rings_->bulk.plan_bytes() + rings_->events.plan_bytes();
}

std::size_t Recorder::high_water_bytes() const noexcept {
  return rings_->bulk.high_water() + rings_->events.high_water();
}

// ---- the other side

bool Recorder::drain(RunStore& to) {
  // The events' end is fixed before the bulk's. Bytes are written before the shot that points at them, so
  // every shot of this transaction finds its bytes in it or in an earlier one.
  RecordRing::Reader events{rings_->events};
  RecordRing::Reader bulk{rings_->bulk};
  if (rings_->bulk.used() == 0 && rings_->events.used() == 0) return true;
  auto done = to.begin();
  if (done) done = store_all(to, bulk);
  if (done) done = store_all(to, events);
  if (done) done = to.commit();
  if (!done) {
    to.roll_back();
    rings_->error.set(printable_text<160>(done.error().what));
    rings_->failed.store(true, std::memory_order_release);
    return false;
  }
  bulk.release();
  events.release();
  rings_->failed.store(false, std::memory_order_release);
  return true;
}

bool Recorder::store_failed() const noexcept { return rings_->failed.load(std::memory_order_acquire); }
Message Recorder::store_error() const { return rings_->error.get(); }

}  // namespace moldloft::hal
