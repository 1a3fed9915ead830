#include <fmt/format.h>
#include <sqlite3.h>

#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "core/error.h"
#include "frontends/configuration/aside.h"
#include "frontends/logs/log_writer.h"
#include "frontends/logs/ros2/sqlite_handle.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/topic_list.h"

namespace lodestone {

namespace {

/// The tables of rosbag2's schema 4.
struct SqliteWriter final : LogWriter {
  SqliteWriter(const std::string& path_in, Codec codec_in);
  ~SqliteWriter() override;
  Encoding encoding() const override { return Encoding::cdr; }
  void write(const TopicInfo& topic, const RawMessage& message) override;
  void close() override;

  std::string path, aside;
  Codec codec;
  SqliteDatabase database;
  std::optional<SqliteStatement> insert;
  std::map<std::string, std::int64_t> topics;
  std::set<std::string> types;

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: cannot be written: {}; free disk space or choose another path", path, what));
  }
  void open();
  std::int64_t id_of(const TopicInfo& topic);
};

void SqliteWriter::open() {
  std::error_code ignored;
  std::filesystem::remove(aside, ignored);
  database = open_sqlite(aside, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX);
  for (const char* statement :
       {"PRAGMA journal_mode=OFF", "PRAGMA synchronous=OFF", "BEGIN",
        "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL)",
        "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL)",
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT "
        "NOT "
        "NULL, offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL)",
        "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, "
        "encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL)",
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data "
        "BLOB NOT "
        "NULL)",
        "CREATE INDEX timestamp_idx ON messages (timestamp ASC)", "INSERT INTO schema VALUES (4, '')"}) {
    execute_sqlite(database.get(), statement);
  }
  insert.emplace(database.get(), "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)");
}

std::int64_t SqliteWriter::id_of(const TopicInfo& topic) {
  const auto [entry, is_new] = topics.try_emplace(topic.name, static_cast<std::int64_t>(topics.size()) + 1);
  if (!is_new) return entry->second;
  const std::string type = ros2_type_name(topic.type);
  const auto said = [&topic](const char* key) {
    const auto found = topic.metadata.find(key);
    return found == topic.metadata.end() ? std::string() : found->second;
  };
  const std::string hash = said("topic_type_hash");
  SqliteStatement add(database.get(), "INSERT INTO topics VALUES (?, ?, ?, 'cdr', ?, ?)");
  add.bind(1, entry->second);
  add.bind(2, topic.name);
  add.bind(3, type);
  add.bind(4, said("offered_qos_profiles"));
  add.bind(5, hash);
  add.step();
  const TypeDefinition definition = ros2_definition(topic);
  if (!definition.text.empty() && types.insert(type).second) {
    SqliteStatement define(database.get(),
                           "INSERT INTO message_definitions (topic_type, encoding, encoded_message_definition, "
                           "type_description_hash) VALUES (?, ?, ?, ?)");
    define.bind(1, type);
    define.bind(2, definition.encoding);
    define.bind(3, definition.text);
    define.bind(4, hash);
    define.step();
  }
  return entry->second;
}

SqliteWriter::SqliteWriter(const std::string& path_in, Codec codec_in)
    : path(path_in), aside(aside_name(path_in)), codec(codec_in) {
  try {
    open();
  } catch (const SqliteError& error) {
    fail(error.what());
  }
}

SqliteWriter::~SqliteWriter() {
  if (database == nullptr) return;
  insert.reset();
  database.reset();
  std::error_code ignored;
  std::filesystem::remove(aside, ignored);
}

void SqliteWriter::write(const TopicInfo& topic, const RawMessage& message) {
  const std::span<const std::uint8_t> bytes(message.data, message.size);
  try {
    const std::vector<std::uint8_t> packed = codec == Codec::none ? std::vector<std::uint8_t>{} : pack(codec, bytes);
    insert->reset();
    insert->bind(1, id_of(topic));
    insert->bind(2, message.record_time);
    insert->bind(3, codec == Codec::none ? bytes : std::span<const std::uint8_t>(packed));
    insert->step();
  } catch (const SqliteError& error) {
    fail(error.what());
  }
}

void SqliteWriter::close() {
  try {
    execute_sqlite(database.get(), "COMMIT");
  } catch (const SqliteError& error) {
    fail(error.what());
  }
  insert.reset();
  database.reset();
  std::error_code error;
  std::filesystem::rename(aside, path, error);
  if (error) fail(error.message());
}

}  // namespace

std::unique_ptr<LogWriter> make_sqlite_writer(const std::string& path, Codec codec) {
  return std::make_unique<SqliteWriter>(path, codec);
}

}  // namespace lodestone
