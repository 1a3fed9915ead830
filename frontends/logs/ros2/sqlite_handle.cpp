#include "frontends/logs/ros2/sqlite_handle.h"

#include <sqlite3.h>

namespace lodestone {

void SqliteCloser::operator()(sqlite3* database) const {
  sqlite3_close(database);
}
void SqliteCloser::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

SqliteDatabase open_sqlite(const std::string& path, int flags) {
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &raw, flags, nullptr);
  SqliteDatabase database(raw);
  if (code != SQLITE_OK) throw SqliteError(code, raw != nullptr ? sqlite3_errmsg(raw) : sqlite3_errstr(code));
  return database;
}

void execute_sqlite(sqlite3* database, const std::string& text) {
  SqliteStatement statement(database, text);
  while (statement.step()) {
  }
}

SqliteStatement::SqliteStatement(sqlite3* database, const std::string& text) : database_(database) {
  sqlite3_stmt* raw = nullptr;
  const int code = sqlite3_prepare_v2(database, text.c_str(), -1, &raw, nullptr);
  handle_.reset(raw);
  check(code);
}

void SqliteStatement::check(int code) const {
  if (code != SQLITE_OK) throw SqliteError(code, sqlite3_errmsg(database_));
}

bool SqliteStatement::step() {
  const int code = sqlite3_step(handle_.get());
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) check(code);
  return false;
}

void SqliteStatement::reset() {
  sqlite3_reset(handle_.get());
}

std::int64_t SqliteStatement::integer(int column) {
  return sqlite3_column_int64(handle_.get(), column);
}

std::string SqliteStatement::text(int column) {
  const auto* value = reinterpret_cast<const char*>(sqlite3_column_text(handle_.get(), column));
  return value == nullptr ? std::string() : std::string(value);
}

std::span<const std::uint8_t> SqliteStatement::blob(int column) {
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(handle_.get(), column));
  if (data == nullptr) return {};
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column))};
}

void SqliteStatement::bind(int parameter, std::int64_t value) {
  check(sqlite3_bind_int64(handle_.get(), parameter, value));
}

void SqliteStatement::bind(int parameter, const std::string& value) {
  check(sqlite3_bind_text(handle_.get(), parameter, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT));
}

void SqliteStatement::bind(int parameter, std::span<const std::uint8_t> value) {
  check(sqlite3_bind_blob64(handle_.get(), parameter, value.data(), value.size(), SQLITE_STATIC));
}

}  // namespace lodestone
