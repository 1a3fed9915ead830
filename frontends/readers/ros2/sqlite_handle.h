#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

/// SQLite's C interface with owners. For .cpp files only.
namespace lodestone {

/// What SQLite says is wrong; whoever knows the file adds where.
class SqliteError : public std::runtime_error {
 public:
  SqliteError(int code, const std::string& what) : std::runtime_error(what), code(code & 0xFF) {}
  int code;  ///< the primary result code
};

using SqliteDatabase = std::unique_ptr<sqlite3, int (*)(sqlite3*)>;

inline SqliteDatabase open_sqlite(const std::string& path, int flags) {
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &raw, flags, nullptr);
  SqliteDatabase database(raw, sqlite3_close);
  if (code != SQLITE_OK) throw SqliteError(code, raw != nullptr ? sqlite3_errmsg(raw) : sqlite3_errstr(code));
  return database;
}

/// One statement. Columns and parameters are numbered as SQLite does it: from 0 and from 1.
class SqliteStatement {
 public:
  SqliteStatement(sqlite3* database, const std::string& text) : database_(database), handle_(nullptr, sqlite3_finalize) {
    sqlite3_stmt* raw = nullptr;
    const int code = sqlite3_prepare_v2(database, text.c_str(), -1, &raw, nullptr);
    handle_.reset(raw);
    check(code);
  }

  /// Whether there is a row. Throws SqliteError.
  bool step() {
    const int code = sqlite3_step(handle_.get());
    if (code == SQLITE_ROW) return true;
    if (code != SQLITE_DONE) check(code);
    return false;
  }
  void reset() { sqlite3_reset(handle_.get()); }

  std::int64_t integer(int column) { return sqlite3_column_int64(handle_.get(), column); }
  std::string text(int column) {
    const auto* value = reinterpret_cast<const char*>(sqlite3_column_text(handle_.get(), column));
    return value == nullptr ? std::string() : std::string(value);
  }
  /// Holds until the statement is stepped or reset.
  std::span<const std::uint8_t> blob(int column) {
    const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(handle_.get(), column));
    if (data == nullptr) return {};
    return {data, static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column))};
  }

  void bind(int parameter, std::int64_t value) { check(sqlite3_bind_int64(handle_.get(), parameter, value)); }
  void bind(int parameter, const std::string& value) {
    check(sqlite3_bind_text(handle_.get(), parameter, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT));
  }
  /// The bytes must live until the step.
  void bind(int parameter, std::span<const std::uint8_t> value) {
    check(sqlite3_bind_blob64(handle_.get(), parameter, value.data(), value.size(), SQLITE_STATIC));
  }

 private:
  void check(int code) const {
    if (code != SQLITE_OK) throw SqliteError(code, sqlite3_errmsg(database_));
  }

  sqlite3* database_;
  std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> handle_;
};

inline void execute_sqlite(sqlite3* database, const std::string& text) {
  SqliteStatement statement(database, text);
  while (statement.step()) {
  }
}

}  // namespace lodestone
