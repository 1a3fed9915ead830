#include "frontends/logs/ros2/sqlite_writer.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "core/error.h"
#include "frontends/configuration/aside.h"
#include "frontends/logs/ros2/sqlite_handle.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/topic_list.h"

namespace lodestone {

struct SqliteWriter::Implementation {
  std::string path, aside;
  Codec codec = Codec::none;
  SqliteDatabase database;
  std::optional<SqliteStatement> insert;
  std::map<std::string, std::int64_t> topics;
  std::set<std::string> types;

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}: cannot be written: {}; free disk space or choose another --out", path, what));
  }
  void open();
  std::int64_t id_of(const TopicInfo& topic);
};

void SqliteWriter::Implementation::open() {
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

std::int64_t SqliteWriter::Implementation::id_of(const TopicInfo& topic) {
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

SqliteWriter::SqliteWriter(const std::string& path, Codec codec) : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  self.path = path;
  self.aside = aside_name(path);
  self.codec = codec;
  try {
    self.open();
  } catch (const SqliteError& error) {
    self.fail(error.what());
  }
}

SqliteWriter::~SqliteWriter() {
  Implementation& self = *implementation_;
  if (self.database == nullptr) return;
  self.insert.reset();
  self.database.reset();
  std::error_code ignored;
  std::filesystem::remove(self.aside, ignored);
}

void SqliteWriter::write(const TopicInfo& topic, const RawMessage& message) {
  Implementation& self = *implementation_;
  const std::span<const std::uint8_t> bytes(message.data, message.size);
  try {
    const std::vector<std::uint8_t> packed =
        self.codec == Codec::none ? std::vector<std::uint8_t>{} : pack(self.codec, bytes);
    self.insert->reset();
    self.insert->bind(1, self.id_of(topic));
    self.insert->bind(2, message.record_time);
    self.insert->bind(3, self.codec == Codec::none ? bytes : std::span<const std::uint8_t>(packed));
    self.insert->step();
  } catch (const SqliteError& error) {
    self.fail(error.what());
  }
}

void SqliteWriter::close() {
  Implementation& self = *implementation_;
  try {
    execute_sqlite(self.database.get(), "COMMIT");
  } catch (const SqliteError& error) {
    self.fail(error.what());
  }
  self.insert.reset();
  self.database.reset();
  std::error_code error;
  std::filesystem::rename(self.aside, self.path, error);
  if (error) self.fail(error.message());
}

}  // namespace lodestone
