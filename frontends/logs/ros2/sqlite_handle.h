#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

struct sqlite3;
struct sqlite3_stmt;

/// RAII for SQLite's C interface.
namespace lodestone {

/// An error of SQLite. The caller adds the file's name.
class SqliteError : public std::runtime_error {
 public:
  SqliteError(int result_code, const std::string& what) : std::runtime_error(what), code(result_code & 0xFF) {}
  int code;  ///< SQLite's primary result code
};

struct SqliteCloser {
  void operator()(sqlite3* database) const;
  void operator()(sqlite3_stmt* statement) const;
};
using SqliteDatabase = std::unique_ptr<sqlite3, SqliteCloser>;

/// `flags` are SQLite's. Throws SqliteError.
SqliteDatabase open_sqlite(const std::string& path, int flags);

/// Runs one statement to its end. Throws SqliteError.
void execute_sqlite(sqlite3* database, const std::string& text);

/// One statement. Columns are numbered from 0 and parameters from 1, as in SQLite. All functions except the columns
/// throw SqliteError.
class SqliteStatement {
 public:
  SqliteStatement(sqlite3* database, const std::string& text);

  /// True if there is a row.
  bool step();
  void reset();

  std::int64_t integer(int column);
  std::string text(int column);
  /// Valid until the statement is stepped or reset.
  std::span<const std::uint8_t> blob(int column);

  void bind(int parameter, std::int64_t value);
  void bind(int parameter, const std::string& value);
  /// The bytes must live until the step.
  void bind(int parameter, std::span<const std::uint8_t> value);

 private:
  void check(int code) const;

  sqlite3* database_;
  std::unique_ptr<sqlite3_stmt, SqliteCloser> handle_;
};

}  // namespace lodestone
