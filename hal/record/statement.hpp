// One prepared statement of SQLite: values in by position, columns out by position, never a
// string put together.
//
// Thread       that of its database
// Blocking     step() may write to disk
// Failure      the first error is kept and returned by step(), also that of preparing the statement
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace moldloft::hal {

class Statement {
 public:
  Statement() = default;
  Statement(sqlite3* database, std::string_view sql) noexcept {
    prepared_ = sqlite3_prepare_v3(database, sql.data(), static_cast<int>(sql.size()),
                                   SQLITE_PREPARE_PERSISTENT, &statement_, nullptr);
  }
  Statement(Statement&& other) noexcept
      : statement_{std::exchange(other.statement_, nullptr)},
        prepared_{other.prepared_},
        bound_{other.bound_},
        next_{other.next_} {}
  Statement& operator=(Statement&& other) noexcept {
    std::swap(statement_, other.statement_);
    std::swap(prepared_, other.prepared_);
    std::swap(bound_, other.bound_);
    std::swap(next_, other.next_);
    return *this;
  }
  ~Statement() { sqlite3_finalize(statement_); }

  // ---- values, in order. Text and bytes must live until step() has returned.
  Statement& bind(std::int64_t value) noexcept {
    return keep(sqlite3_bind_int64(statement_, next_++, value));
  }
  Statement& bind(double value) noexcept { return keep(sqlite3_bind_double(statement_, next_++, value)); }
  Statement& bind(std::string_view text) noexcept {
    return keep(
        sqlite3_bind_text64(statement_, next_++, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8));
  }
  Statement& bind(std::span<const std::byte> bytes) noexcept {
    return keep(sqlite3_bind_blob64(statement_, next_++, bytes.data(), bytes.size(), SQLITE_STATIC));
  }

  // SQLITE_ROW while there are rows, SQLITE_DONE at the end, else the error.
  int step() noexcept {
    if (prepared_ != SQLITE_OK) return prepared_;
    return bound_ == SQLITE_OK ? sqlite3_step(statement_) : bound_;
  }

  // Makes it ready for the next values.
  void reset() noexcept {
    sqlite3_reset(statement_);
    bound_ = SQLITE_OK;
    next_ = 1;
  }

  std::int64_t integer(int column) const noexcept { return sqlite3_column_int64(statement_, column); }
  double real(int column) const noexcept { return sqlite3_column_double(statement_, column); }
  std::string_view text(int column) const noexcept {
    const auto* begin = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return {begin == nullptr ? "" : begin,
            static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
  }
  std::span<const std::byte> bytes(int column) const noexcept {
    const auto* begin = static_cast<const std::byte*>(sqlite3_column_blob(statement_, column));
    return {begin, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
  }

 private:
  Statement& keep(int result) noexcept {
    if (bound_ == SQLITE_OK) bound_ = result;
    return *this;
  }

  sqlite3_stmt* statement_ = nullptr;
  int prepared_ = SQLITE_OK;
  int bound_ = SQLITE_OK;
  int next_ = 1;
};

}  // namespace moldloft::hal
