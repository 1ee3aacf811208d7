#include "hal/record/run_store.hpp"

#include "hal/base/printable_text.hpp"
#include "hal/record/statement.hpp"

#include <algorithm>
#include <array>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace moldloft::hal {
namespace {

using Result = std::expected<void, StoreError>;
namespace fs = std::filesystem;

// In the file's header, where `file` and other tools look: a SQLite file without it is somebody else's.
constexpr int application_id = 0x4D4C4654;  // "MLFT"
constexpr int schema_version = 1;

// A reader (report, replay) may hold the file for the moment of a query.
constexpr int busy_timeout_ms = 2000;

constexpr const char* schema = R"sql(
  CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT NOT NULL);
  CREATE TABLE link_bytes(
    link INTEGER NOT NULL, direction INTEGER NOT NULL, offset INTEGER NOT NULL, t_ns INTEGER NOT NULL,
    bytes BLOB NOT NULL);
  CREATE UNIQUE INDEX link_bytes_by_offset ON link_bytes(link, direction, offset);
  CREATE TABLE events(
    seq INTEGER PRIMARY KEY, t_ns INTEGER NOT NULL, source TEXT NOT NULL, event TEXT NOT NULL,
    from_state TEXT NOT NULL, to_state TEXT NOT NULL, text TEXT NOT NULL);
  CREATE TABLE shots(
    shot_id INTEGER PRIMARY KEY, t_ns INTEGER NOT NULL, purpose INTEGER NOT NULL, attempts INTEGER NOT NULL,
    commanded_x_mm REAL, commanded_y_mm REAL, commanded_z_mm REAL,
    commanded_yaw_rad REAL, commanded_pitch_rad REAL, commanded_roll_rad REAL,
    reported_x_mm REAL, reported_y_mm REAL, reported_z_mm REAL,
    reported_yaw_rad REAL, reported_pitch_rad REAL, reported_roll_rad REAL,
    payload_offset INTEGER NOT NULL, payload_bytes INTEGER NOT NULL);
)sql";

constexpr std::string_view insert_bytes =
    "INSERT INTO link_bytes(link, direction, offset, t_ns, bytes) VALUES(?, ?, ?, ?, ?)";
constexpr std::string_view insert_event =
    "INSERT INTO events(t_ns, source, event, from_state, to_state, text) VALUES(?, ?, ?, ?, ?, ?)";
constexpr std::string_view insert_shot =
    "INSERT INTO shots VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)";

StoreError error_of(int code, const std::string& path, std::string_view detail) {
  const std::string where = path + ": ";
  switch (code & 0xFF) {
    case SQLITE_FULL:
      return {where + "the disk is full: free some space"};
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_CANTOPEN:
      return {where + "cannot be written: check the folder and its permissions"};
    case SQLITE_NOTADB:
      return {where + "is not a run store"};
    case SQLITE_CORRUPT:
      return {where + "is damaged: restore it from a copy"};
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {where + "is in use by another program: close it there"};
    case SQLITE_IOERR:
      return {where + "the disk reports an error: " + std::string{detail}};
    default:
      return {where + std::string{detail}};
  }
}

// A name may hold what a URI gives a meaning to.
std::string uri_of(const std::string& path) {
  std::string uri = path.starts_with("//") ? "file://" : "file:";  // two slashes would begin a host's name
  for (const char c : path) {
    if (c == '%' || c == '?' || c == '#') {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    } else {
      uri += c;
    }
  }
  return uri;
}

// Reads a store in a folder that cannot be written (a read-only disk, another user's folder). SQLite cannot
// make the files there that it shares with a writer. What a crashed or running program has committed last
// stands in the write-ahead log beside it, and belongs to the run.
struct ReadingWay {
  const char* options = "";
  bool index_in_memory = false;
};

std::expected<ReadingWay, StoreError> way_to_read(const std::string& path) {
  const std::string log = path + "-wal", index = path + "-shm";
  struct stat what {};
  if (::stat(log.c_str(), &what) != 0 || what.st_size == 0) return ReadingWay{"?immutable=1"};
  for (const auto& part : {path, log}) {
    if (::access(part.c_str(), R_OK) == 0) continue;
    return std::unexpected{
        StoreError{part + ": cannot be read, and belongs to the run: check its permissions"}};
  }
  // A writer that lives has its index beside the log, and SQLite reads it there. Without one nobody writes, and the
  // index of the log is made in memory.
  if (::access(index.c_str(), R_OK) == 0) return ReadingWay{};
  return ReadingWay{"?vfs=unix-none", true};
}

void bind_pose(Statement& to, const Pose& pose) {
  for (const double value : {pose.x_mm, pose.y_mm, pose.z_mm, pose.yaw, pose.pitch, pose.roll})
    to.bind(value);
}

Pose pose_from(const Statement& from, int column) {
  return {.x_mm = from.real(column),
          .y_mm = from.real(column + 1),
          .z_mm = from.real(column + 2),
          .yaw = from.real(column + 3),
          .pitch = from.real(column + 4),
          .roll = from.real(column + 5)};
}

std::size_t index(LinkId link, Direction direction) {
  return 2 * static_cast<std::size_t>(link) + static_cast<std::size_t>(direction);
}

}  // namespace

struct RunStore::Database {
  Database(std::string p, sqlite3* opened) : path{std::move(p)}, handle{opened} {}
  ~Database() {
    for (Statement* statement : {&bytes_in, &event_in, &shot_in, &meta_in}) *statement = Statement{};
    sqlite3_close(handle);
  }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  StoreError error(int code) const { return error_of(code, path, sqlite3_errmsg(handle)); }

  Result run(const char* sql) {
    const int code = sqlite3_exec(handle, sql, nullptr, nullptr, nullptr);
    if (code != SQLITE_OK) return std::unexpected{error(code)};
    return {};
  }
  Result insert(Statement& statement) {
    const int code = statement.step();
    Result result;
    if (code != SQLITE_DONE) result = std::unexpected{error(code)};
    statement.reset();
    return result;
  }
  std::int64_t number(std::string_view sql) {
    Statement query{handle, sql};
    return query.step() == SQLITE_ROW ? query.integer(0) : -1;
  }

  Result create_tables();
  Result check_tables();
  Result prepare_writing();

  std::string path;
  sqlite3* handle;
  Statement bytes_in, event_in, shot_in, meta_in;
  bool in_transaction = false;
  // A resumed run counts its bytes from zero again; in the file they follow those of the run before.
  std::array<std::uint64_t, 4> first_offset{};
};

Result RunStore::Database::create_tables() {
  if (auto done = run("BEGIN IMMEDIATE"); !done) return done;
  if (auto done = run(schema); !done) return done;
  const auto marks = fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}; COMMIT",
                                 application_id, schema_version);
  return run(marks.c_str());
}

Result RunStore::Database::check_tables() {
  Statement query{handle, "PRAGMA application_id"};
  const int code = query.step();
  if (code != SQLITE_ROW) return std::unexpected{error(code)};
  if (query.integer(0) != application_id) return std::unexpected{StoreError{path + ": is not a run store"}};
  const auto version = number("PRAGMA user_version");
  if (version != schema_version) {
    return std::unexpected{
        StoreError{fmt::format("{}: has schema version {}, this program reads version {}: use the "
                               "program that wrote it",
                               path, version, schema_version)}};
  }
  return {};
}

Result RunStore::Database::prepare_writing() {
  // WAL with NORMAL: a commit costs no sync, a power cut loses at most the last moments, never the file.
  if (auto done = run("PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL"); !done) return done;
  bytes_in = Statement{handle, insert_bytes};
  event_in = Statement{handle, insert_event};
  shot_in = Statement{handle, insert_shot};
  meta_in = Statement{handle, "INSERT OR REPLACE INTO meta(key, value) VALUES(?, ?)"};
  Statement query{handle,
                  "SELECT offset + length(bytes) FROM link_bytes WHERE link = ? AND direction = ? "
                  "ORDER BY offset DESC LIMIT 1"};
  for (const LinkId link : {LinkId::scanner, LinkId::robot}) {
    for (const Direction direction : {Direction::received, Direction::sent}) {
      query.bind(std::int64_t{std::to_underlying(link)}).bind(std::int64_t{std::to_underlying(direction)});
      if (query.step() == SQLITE_ROW)
        first_offset[index(link, direction)] = static_cast<std::uint64_t>(query.integer(0));
      query.reset();
    }
  }
  return {};
}

std::expected<RunStore, StoreError> RunStore::open(const std::string& path, Mode mode) {
  const bool exists = ::access(path.c_str(), F_OK) == 0;
  const fs::path folder = fs::path{path}.has_parent_path() ? fs::path{path}.parent_path() : fs::path{"."};
  const bool folder_writable = ::access(folder.c_str(), W_OK) == 0;
  if (mode == Mode::create && exists) {
    return std::unexpected{StoreError{path + ": exists already: choose another folder, or resume that run"}};
  }
  if (mode == Mode::create && !folder_writable) {
    return std::unexpected{StoreError{path + ": cannot be written: check the folder and its permissions"}};
  }
  if (mode != Mode::create && !exists) return std::unexpected{StoreError{path + ": there is no such file"}};

  const std::expected<ReadingWay, StoreError> way =
      mode == Mode::read && !folder_writable ? way_to_read(path) : ReadingWay{};
  if (!way) return std::unexpected{way.error()};
  const int access = mode == Mode::read ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE;
  const int create = mode == Mode::create ? SQLITE_OPEN_CREATE : 0;
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2((uri_of(path) + way->options).c_str(), &handle,
                                   access | create | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  auto database = std::make_unique<Database>(path, handle);
  if (code != SQLITE_OK) return std::unexpected{database->error(code)};
  sqlite3_busy_timeout(handle, busy_timeout_ms);
  if (way->index_in_memory) {
    if (auto alone = database->run("PRAGMA locking_mode = EXCLUSIVE"); !alone)
      return std::unexpected{alone.error()};
  }

  Result ready = mode == Mode::create ? database->create_tables() : database->check_tables();
  if (ready && mode != Mode::read) ready = database->prepare_writing();
  if (!ready) return std::unexpected{ready.error()};
  return RunStore{std::move(database)};
}

RunStore::RunStore(std::unique_ptr<Database> database) : database_{std::move(database)} {}
RunStore::RunStore(RunStore&&) noexcept = default;
RunStore& RunStore::operator=(RunStore&&) noexcept = default;
RunStore::~RunStore() = default;

// ---- writing

Result RunStore::begin() {
  auto done = database_->run("BEGIN IMMEDIATE");
  database_->in_transaction = done.has_value();
  return done;
}

Result RunStore::commit() {
  auto done = database_->run("COMMIT");
  if (done) database_->in_transaction = false;
  return done;
}

void RunStore::roll_back() noexcept {
  if (!std::exchange(database_->in_transaction, false)) return;
  // After a full disk SQLite has rolled back by itself, and says that there is nothing to roll back.
  sqlite3_exec(database_->handle, "ROLLBACK", nullptr, nullptr, nullptr);
}

Result RunStore::write(const LinkBytes& record, std::span<const std::byte> bytes) {
  const auto offset = record.offset + database_->first_offset[index(record.link, record.direction)];
  database_->bytes_in.bind(std::int64_t{std::to_underlying(record.link)})
      .bind(std::int64_t{std::to_underlying(record.direction)})
      .bind(static_cast<std::int64_t>(offset))
      .bind(std::int64_t{record.at.count()})
      .bind(bytes);
  return database_->insert(database_->bytes_in);
}

Result RunStore::write(const EventRecord& record) {
  database_->event_in.bind(std::int64_t{record.at.count()})
      .bind(record.source.view())
      .bind(record.event.view())
      .bind(record.from.view())
      .bind(record.to.view())
      .bind(record.text.view());
  return database_->insert(database_->event_in);
}

Result RunStore::write(const ShotRecord& record) {
  auto& shot = database_->shot_in;
  shot.bind(std::int64_t{record.shot_id})
      .bind(std::int64_t{record.at.count()})
      .bind(std::int64_t{std::to_underlying(record.purpose)})
      .bind(std::int64_t{record.attempts});
  bind_pose(shot, record.commanded);
  bind_pose(shot, record.reported);
  const auto first = database_->first_offset[index(LinkId::scanner, Direction::received)];
  shot.bind(static_cast<std::int64_t>(record.payload_offset + first))
      .bind(std::int64_t{record.payload_bytes});
  return database_->insert(shot);
}

Result RunStore::set_meta(std::string_view key, std::string_view value) {
  database_->meta_in.bind(key).bind(value);
  return database_->insert(database_->meta_in);
}

Result RunStore::save_copy(const std::string& path) const {
  Statement copy{database_->handle, "VACUUM INTO ?"};
  const std::string uri = uri_of(path);
  const int code = copy.bind(std::string_view{uri}).step();
  if (code != SQLITE_DONE) return std::unexpected{error_of(code, path, sqlite3_errmsg(database_->handle))};
  return {};
}

// ---- reading

std::expected<std::string, StoreError> RunStore::meta(std::string_view key) const {
  Statement query{database_->handle, "SELECT value FROM meta WHERE key = ?"};
  query.bind(key);
  const int code = query.step();
  if (code == SQLITE_ROW) return std::string{query.text(0)};
  if (code == SQLITE_DONE)
    return std::unexpected{StoreError{database_->path + ": holds no '" + std::string{key} + "'"}};
  return std::unexpected{database_->error(code)};
}

std::expected<std::vector<ShotRecord>, StoreError> RunStore::shots() const {
  Statement query{database_->handle, "SELECT * FROM shots ORDER BY shot_id"};
  std::vector<ShotRecord> shots;
  int code = query.step();
  for (; code == SQLITE_ROW; code = query.step()) {
    shots.push_back({.at = Instant{query.integer(1)},
                     .shot_id = static_cast<std::uint32_t>(query.integer(0)),
                     .purpose = static_cast<ShotPurpose>(query.integer(2)),
                     .attempts = static_cast<std::uint16_t>(query.integer(3)),
                     .commanded = pose_from(query, 4),
                     .reported = pose_from(query, 10),
                     .payload_offset = static_cast<std::uint64_t>(query.integer(16)),
                     .payload_bytes = static_cast<std::uint32_t>(query.integer(17))});
  }
  if (code != SQLITE_DONE) return std::unexpected{database_->error(code)};
  return shots;
}

// Stores of earlier versions hold what a device had said byte by byte.
std::expected<std::vector<EventRecord>, StoreError> RunStore::events() const {
  Statement query{database_->handle,
                  "SELECT t_ns, source, event, from_state, to_state, text FROM events ORDER BY seq"};
  std::vector<EventRecord> events;
  int code = query.step();
  for (; code == SQLITE_ROW; code = query.step()) {
    events.push_back({.at = Instant{query.integer(0)},
                      .source = printable_text<16>(query.text(1)),
                      .event = printable_text<24>(query.text(2)),
                      .from = printable_text<24>(query.text(3)),
                      .to = printable_text<24>(query.text(4)),
                      .text = printable_text<160>(query.text(5))});
  }
  if (code != SQLITE_DONE) return std::unexpected{database_->error(code)};
  return events;
}

std::expected<std::vector<std::byte>, StoreError> RunStore::bytes(LinkId link, Direction direction,
                                                                  std::uint64_t offset,
                                                                  std::uint64_t size) const {
  // From the piece that holds the first byte on, piece by piece.
  Statement query{
      database_->handle,
      "SELECT offset, bytes FROM link_bytes WHERE link = ?1 AND direction = ?2 AND offset < ?4 AND offset >= "
      "coalesce((SELECT max(offset) FROM link_bytes WHERE link = ?1 AND direction = ?2 AND offset <= ?3), 0) "
      "ORDER BY offset"};
  query.bind(std::int64_t{std::to_underlying(link)})
      .bind(std::int64_t{std::to_underlying(direction)})
      .bind(static_cast<std::int64_t>(offset))
      .bind(static_cast<std::int64_t>(offset + size));
  std::vector<std::byte> bytes;
  bytes.reserve(size);
  int code = query.step();
  for (; code == SQLITE_ROW && bytes.size() < size; code = query.step()) {
    const auto begin = static_cast<std::uint64_t>(query.integer(0));
    const auto piece = query.bytes(1);
    const std::uint64_t wanted = offset + bytes.size();
    if (begin > wanted || begin + piece.size() <= wanted) break;  // a hole
    const auto part = piece.subspan(wanted - begin);
    bytes.insert(bytes.end(), part.begin(),
                 part.begin() + std::min<std::uint64_t>(part.size(), size - bytes.size()));
  }
  if (code != SQLITE_ROW && code != SQLITE_DONE) return std::unexpected{database_->error(code)};
  if (bytes.size() != size) {
    return std::unexpected{StoreError{fmt::format("{}: bytes {} to {} of the link are not all there",
                                                  database_->path, offset, offset + size)}};
  }
  return bytes;
}

std::expected<Frame, StoreError> RunStore::frame(const ShotRecord& shot, const FrameCodec& codec) const {
  const auto flawed = [&](std::string_view what) {
    return std::unexpected{StoreError{fmt::format("{}: shot {}: {}", database_->path, shot.shot_id, what)}};
  };
  if (shot.payload_offset < codec.head_bytes) return flawed("its frame begins before the link's first byte");
  const auto message = bytes(LinkId::scanner, Direction::received, shot.payload_offset - codec.head_bytes,
                             codec.head_bytes + shot.payload_bytes);
  if (!message) return std::unexpected{message.error()};
  auto frame = codec.decode(*message);
  if (!frame) return flawed(frame.error());
  frame->arrived = shot.at;
  return std::move(*frame);
}

const std::string& RunStore::path() const { return database_->path; }

}  // namespace moldloft::hal
