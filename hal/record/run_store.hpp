// The run store: one SQLite file that holds everything of a run as it happened, so that it can be replayed,
// fitted again or resumed.
//
// Tables: meta(key, value), link_bytes(link, direction, offset, t_ns, bytes), events(seq, t_ns, source, event,
// from_state, to_state, text), shots(shot_id, t_ns, purpose, attempts, commanded and reported pose, payload_offset,
// payload_bytes). The layout is documented in README.md; `meta` holds the schema version and the configuration.
//
// Thread       one thread at a time
// Blocking     yes: it is a disk
// Allocation   yes
// Failure      std::expected with one line for a person
#pragma once

#include "hal/record/run_record.hpp"
#include "hal/scanner/frame_codec.hpp"

#include <cstdint>
#include <expected>
#include <memory>
#include <string>
#include <vector>

namespace moldloft::hal {

struct StoreError {
  std::string what;  // what, where, what to do
};

class RunStore {
 public:
  enum class Mode { create, append, read };
  static std::expected<RunStore, StoreError> open(const std::string& path, Mode);

  RunStore(RunStore&&) noexcept;
  RunStore& operator=(RunStore&&) noexcept;
  ~RunStore();

  // ---- writing
  std::expected<void, StoreError> begin();
  std::expected<void, StoreError> write(const LinkBytes&, std::span<const std::byte>);
  std::expected<void, StoreError> write(const EventRecord&);
  std::expected<void, StoreError> write(const ShotRecord&);
  std::expected<void, StoreError> commit();
  void roll_back() noexcept;  // of what begin() began; nothing if nothing did
  std::expected<void, StoreError> set_meta(std::string_view key, std::string_view value);

  // All that is committed, in a new file; also when the store's own file has been removed meanwhile.
  std::expected<void, StoreError> save_copy(const std::string& path) const;

  // ---- reading
  std::expected<std::string, StoreError> meta(std::string_view key) const;
  std::expected<std::vector<ShotRecord>, StoreError> shots() const;
  std::expected<std::vector<EventRecord>, StoreError> events() const;
  std::expected<std::vector<std::byte>, StoreError> bytes(LinkId, Direction, std::uint64_t offset,
                                                          std::uint64_t size) const;
  // Decoded from the bytes as they came, by the codec of the scanner that sent them.
  std::expected<Frame, StoreError> frame(const ShotRecord&, const FrameCodec&) const;
  const std::string& path() const;

 private:
  struct Database;
  explicit RunStore(std::unique_ptr<Database>);
  std::unique_ptr<Database> database_;
};

}  // namespace moldloft::hal
