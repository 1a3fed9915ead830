#include "frontends/logs/ros2/sqlite_source.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "core/error.h"
#include "frontends/file_bytes.h"
#include "frontends/logs/compression.h"
#include "frontends/logs/isolated_times.h"
#include "frontends/logs/ros2/sqlite_handle.h"
#include "frontends/messages/topic_list.h"

namespace lodestone {
namespace {

/// A row of the messages table, without its content.
struct Row {
  Time time = 0;
  std::int64_t number = 0;  ///< row id
  std::int32_t topic = 0;   ///< index into the topics
};

/// The size in bytes according to the database's header; 0 if unknown.
std::uint64_t announced_bytes(const FileBytes& file) {
  std::vector<std::uint8_t> header;
  constexpr std::size_t header_bytes = 100;
  if (file.size() < header_bytes) return 0;
  file.read(0, header_bytes, header);
  const auto number = [&header](std::size_t at, std::size_t bytes) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | header[at + i];
    return value;
  };
  const std::uint64_t page = number(16, 2) == 1 ? 65536 : number(16, 2);
  return number(24, 4) == number(92, 4) ? page * number(28, 4)
                                        : 0;  // otherwise an old library wrote the file without updating the count
}

std::string uri_of(const std::string& path, const char* options) {
  std::string uri = "file:";
  for (const char letter : path) {
    if (letter == '%' || letter == '?' || letter == '#') {
      uri += fmt::format("%{:02X}", static_cast<unsigned char>(letter));
    } else {
      uri += letter;
    }
  }
  return uri + options;
}

}  // namespace

struct SqliteSource::Implementation {
  Implementation(const std::string& log_path, WarningLog& log) : path(log_path), warnings(log) {}

  std::string path;
  WarningLog& warnings;
  SqliteDatabase database;
  std::vector<TopicInfo> topics;
  std::map<std::int64_t, std::int32_t> topic_of_id;
  std::vector<Row> rows;   ///< of the whole file, in order of time
  std::string row_number;  ///< the column for direct access to a row
  std::optional<SqliteStatement> content;
  std::vector<int> selection;
  std::size_t next_row = 0;
  std::vector<std::uint8_t> unpacked;
  std::uint64_t file_bytes = 0, announced = 0;
  std::set<std::int64_t> lost_messages;
  std::int64_t lost = 0;  ///< number of unreachable groups of rows

  void open();
  void check_tables();
  void read_topics();
  void read_metadata(const std::string& column, const std::string& key);
  bool read_definitions(const std::string& encoding);
  std::string find_row_number();
  void read_rows();
  void process_row(SqliteStatement& statement);
  void repair_times();
  bool read_content(const Row& row, RawMessage& message);
};

void SqliteSource::Implementation::open() {
  constexpr int flags = SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX;
  const auto try_open = [&](const char* options) {
    database = open_sqlite(uri_of(path, options), flags);
    // SQLite reads truncated files only with this setting.
    execute_sqlite(database.get(), "PRAGMA writable_schema=ON");
    execute_sqlite(database.get(), "PRAGMA trusted_schema=OFF");
    execute_sqlite(database.get(), "SELECT count(*) FROM sqlite_master");
  };
  try {
    try_open("");
  } catch (const SqliteError& error) {
    if (error.code != SQLITE_CANTOPEN && error.code != SQLITE_READONLY) throw;
    try_open("?immutable=1");  // for a write-ahead log in a read-only folder
    warnings.add("log.write_ahead",
                 path +
                     ": its folder cannot be written, so that messages in its -wal file (if there is "
                     "one) are not read; copy the bag to a writable folder",
                 0);
  }
  // No value can be longer than the file.
  const std::uint64_t longest = std::clamp<std::uint64_t>(file_bytes, 1 << 20, largest_message);
  sqlite3_limit(database.get(), SQLITE_LIMIT_LENGTH, static_cast<int>(longest));
}

/// A view could be an endless query: only tables are read.
void SqliteSource::Implementation::check_tables() {
  SqliteStatement statement(database.get(),
                            "SELECT name, type, coalesce(sql, '') FROM sqlite_master WHERE lower(name) IN "
                            "('topics', 'messages', 'message_definitions')");
  while (statement.step()) {
    if (statement.text(1) == "table" && statement.text(2).rfind("CREATE TABLE", 0) == 0) continue;
    throw InputError(fmt::format("{}: is not a ROS 2 bag: '{}' is not a table of rows, but a {}", path,
                                 statement.text(0),
                                 statement.text(1) == "table" ? "virtual table" : statement.text(1)));
  }
}

void SqliteSource::Implementation::read_topics() {
  SqliteStatement statement(database.get(),
                            "SELECT id, name, type, serialization_format FROM topics ORDER BY name, id");
  while (statement.step()) {
    const std::string name = statement.text(1);
    const std::string type = ros1_type_name(statement.text(2));
    const Encoding encoding = parse_encoding(statement.text(3));
    if (!topics.empty() && topics.back().name == name && topics.back().type != type) {
      warnings.add("log.mixed_topic",
                   fmt::format("{}: {} has messages of two types; those of {} are ignored", path, name, type), 0);
      continue;
    }
    if (topics.empty() || topics.back().name != name) {
      TopicInfo& topic = topics.emplace_back();
      topic.name = name;
      topic.type = type;
      topic.encoding = encoding;
    }
    topic_of_id[statement.integer(0)] = static_cast<std::int32_t>(topics.size()) - 1;
  }
}

/// Reads an optional column of the topics.
void SqliteSource::Implementation::read_metadata(const std::string& column, const std::string& key) try {
  SqliteStatement statement(database.get(), "SELECT id, " + column + " FROM topics ORDER BY id");
  while (statement.step()) {
    const auto topic = topic_of_id.find(statement.integer(0));
    const std::string text = statement.text(1);
    if (topic == topic_of_id.end() || text.empty()) continue;
    topics[static_cast<std::size_t>(topic->second)].metadata.try_emplace(key, text);
  }
} catch (const SqliteError&) {
  // Older bags do not have this column.
}

/// Newer bags also contain the types' definitions. False if there is no such table or column.
bool SqliteSource::Implementation::read_definitions(const std::string& encoding) try {
  SqliteStatement statement(database.get(),
                            "SELECT topic_type, encoded_message_definition, " + encoding + " FROM message_definitions");
  while (statement.step()) {
    const std::string type = ros1_type_name(statement.text(0));
    for (TopicInfo& topic : topics) {
      if (topic.type != type) continue;
      topic.definition = statement.text(1);
      topic.definition_encoding = statement.text(2);
    }
  }
  return true;
} catch (const SqliteError&) {
  return false;
}

/// The row id exists in every table except those made WITHOUT ROWID, which are sorted by their primary key. An `id`
/// that is not the key would require a search through the table for every message.
std::string SqliteSource::Implementation::find_row_number() {
  SqliteStatement(database.get(), "SELECT 1 FROM messages");  // there is such a table
  try {
    SqliteStatement(database.get(), "SELECT _rowid_ FROM messages");
    return "_rowid_";
  } catch (const SqliteError& error) {
    if (error.code != SQLITE_ERROR) throw;
  }
  SqliteStatement keys(database.get(),
                       "SELECT count(*), sum(lower(name) = 'id') FROM pragma_table_info('messages') WHERE pk > 0");
  if (keys.step() && keys.integer(0) == 1 && keys.integer(1) == 1) return "id";
  throw InputError(path +
                   ": the table 'messages' cannot be read: it was made WITHOUT ROWID, and 'id' is not its primary key; "
                   "write the bag again with 'ros2 bag convert'");
}

void SqliteSource::Implementation::process_row(SqliteStatement& statement) {
  const Time time =
      std::clamp(Time{statement.integer(2)}, -farthest_time, farthest_time);  // sums of two times must not overflow
  const auto topic = topic_of_id.find(statement.integer(1));
  if (topic == topic_of_id.end()) {
    warnings.add("log.unknown_channel", path + ": messages of an unnamed topic are ignored", time);
    return;
  }
  rows.push_back({time, statement.integer(0), topic->second});
}

/// A damaged time would move its message to another place of the log and lengthen the log.
void SqliteSource::Implementation::repair_times() {
  std::vector<Time> times;
  times.reserve(rows.size());
  for (const Row& row : rows) times.push_back(row.time);
  for (const std::size_t i : isolated_times(times)) {
    rows[i].time = times[i == 0 ? 1 : i - 1];
    warnings.add("log.record_time",
                 fmt::format("{}: message {} has a record time that is {:.0f} s away from those written before and "
                             "after; the time of its neighbour is used",
                             path, rows[i].number, std::abs(to_seconds(times[i] - rows[i].time))),
                 rows[i].time);
  }
}

/// Reads the table in the order of writing. After a missing or damaged page, the search for a readable page continues
/// with steps that double.
void SqliteSource::Implementation::read_rows() {
  SqliteStatement statement(
      database.get(),
      fmt::format("SELECT {0}, topic_id, timestamp FROM messages WHERE {0} >= ? ORDER BY {0}", row_number));
  std::int64_t from = std::numeric_limits<std::int64_t>::min();
  std::int64_t stride = 1;
  constexpr std::int64_t farthest = std::int64_t{1} << 40;
  for (bool ended = false; !ended;) {
    try {
      statement.reset();
      statement.bind(1, from);
      while (statement.step()) {
        // Pages of a damaged file may form a circle, which would repeat the same rows endlessly.
        if (statement.integer(0) < from) throw SqliteError(SQLITE_CORRUPT, "rows out of order");
        process_row(statement);
        from = statement.integer(0) + 1;
        stride = 1;
        if (from == std::numeric_limits<std::int64_t>::min()) break;
      }
      ended = true;
    } catch (const SqliteError& error) {
      if (error.code != SQLITE_CORRUPT && error.code != SQLITE_IOERR) throw;
      ++lost;
      if (from < 0) from = 0;
      if (stride > farthest) break;
      from += stride;
      stride *= 2;
    }
  }
  repair_times();
  for (const Row& row : rows) add_messages(topics[static_cast<std::size_t>(row.topic)], row.time, row.time, 1);
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.time < b.time; });
  if (lost == 0 && announced <= file_bytes) return;
  if (rows.empty())
    throw InputError(path +
                     ": the bag is cut off or damaged: no message can be read; copy it again, "
                     "or try to recover it with 'sqlite3 OLD.db3 .recover | sqlite3 NEW.db3'");
  warnings.add(
      "log.cut_off",
      fmt::format("{}: the bag is cut off or damaged: it has {} bytes, but announces {}; {} messages are readable",
                  path, file_bytes, announced, rows.size()),
      rows.back().time);
}

bool SqliteSource::Implementation::read_content(const Row& row, RawMessage& message) {
  const auto lose = [&](const std::string& what) {
    if (lost_messages.insert(row.number).second) {  // counted only in the first reading
      warnings.add("log.damaged_message", fmt::format("{}: message {}: {}; it is ignored", path, row.number, what),
                   row.time);
    }
    return false;
  };
  try {
    content->reset();
    content->bind(1, row.number);
    if (!content->step()) return lose("it is missing");
    const std::span<const std::uint8_t> bytes = unpacked_cdr(content->blob(0), unpacked);
    message.data = bytes.data();
    message.size = bytes.size();
    return true;
  } catch (const SqliteError& error) {
    return lose(error.what());
  } catch (const CompressionError& error) {
    return lose(error.what());
  }
}

SqliteSource::SqliteSource(const std::string& path, WarningLog& warnings)
    : implementation_(std::make_unique<Implementation>(path, warnings)) {
  const FileBytes file(path);  // gives clearer errors than SQLite
  Implementation& self = *implementation_;
  self.file_bytes = file.size();
  self.announced = announced_bytes(file);
  try {
    self.open();
    self.check_tables();
    self.read_topics();
    self.read_metadata("offered_qos_profiles", "offered_qos_profiles");
    self.read_metadata("type_description_hash", "topic_type_hash");
    if (!self.read_definitions("encoding")) self.read_definitions("''");
    self.row_number = self.find_row_number();
    self.read_rows();
    self.content.emplace(self.database.get(), fmt::format("SELECT data FROM messages WHERE {} = ?", self.row_number));
  } catch (const SqliteError& error) {
    throw InputError(fmt::format(
        "{}: cannot be read as a ROS 2 bag ({}); copy it again, or try to recover it with 'sqlite3 OLD.db3 .recover | "
        "sqlite3 NEW.db3'",
        path, error.what()));
  }
}

SqliteSource::~SqliteSource() = default;

const std::vector<TopicInfo>& SqliteSource::topics() const {
  return implementation_->topics;
}

void SqliteSource::select(const std::vector<std::string>& names) {
  implementation_->selection = selection_of(topics(), names, implementation_->path);
  implementation_->next_row = 0;
}

bool SqliteSource::next(RawMessage& message) {
  Implementation& self = *implementation_;
  if (self.selection.empty()) return false;
  while (self.next_row < self.rows.size()) {
    const Row& row = self.rows[self.next_row++];
    const int topic = self.selection[static_cast<std::size_t>(row.topic)];
    if (topic < 0 || !self.read_content(row, message)) continue;
    message.record_time = row.time;
    message.topic = static_cast<std::size_t>(topic);
    return true;
  }
  return false;
}

}  // namespace lodestone
