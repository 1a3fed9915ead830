#include "frontends/logs/ros2/bag_folder_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "core/error.h"
#include "frontends/configuration/aside.h"
#include "frontends/configuration/text_file.h"
#include "frontends/messages/topic_list.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

constexpr const char* metadata_name = "metadata.yaml";
constexpr const char* file_name = "lodestone_0.db3";  // no recorder uses this name

/// Throws InputError if there is something at `path` that this class did not write.
void check_replaceable(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(path, ignored))) return;
  const bool is_folder = fs::is_directory(path, ignored);
  const bool is_bag =
      is_folder && std::all_of(fs::directory_iterator(path), fs::directory_iterator(), [](const auto& entry) {
        return entry.path().filename() == metadata_name || entry.path().filename() == file_name;
      });
  if (is_bag) return;
  throw InputError(fmt::format("{}: is {}; choose another --out", path.string(),
                               is_folder ? "a folder with files that no export wrote" : "a file; a bag is a folder"));
}

/// The path without separators at its end, so that names beside the folder can be formed.
std::string without_slash(std::string path) {
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  return path;
}

}  // namespace

BagFolderWriter::BagFolderWriter(const std::string& path) : path_(without_slash(path)), aside_(aside_name(path_)) {
  check_replaceable(path_);
  std::error_code error;
  fs::remove_all(aside_, error);
  fs::create_directory(aside_, error);
  if (error)
    throw InputError(fmt::format("{}: cannot create the folder: {}; choose another --out", path_, error.message()));
  try {
    file_ = make_sqlite_writer((fs::path(aside_) / file_name).string(), Codec::none);
  } catch (...) {
    fs::remove_all(aside_, error);
    throw;
  }
}

BagFolderWriter::~BagFolderWriter() {
  if (aside_.empty()) return;
  file_.reset();
  std::error_code ignored;
  fs::remove_all(aside_, ignored);
}

void BagFolderWriter::write(const TopicInfo& topic, const RawMessage& message) {
  file_->write(topic, message);
  WrittenTopic& written = topics_[topic.name];
  if (written.messages == 0) written.type = ros2_type_name(topic.type);
  ++written.messages;
  begin_ = messages_ == 0 ? message.record_time : std::min(begin_, message.record_time);
  end_ = messages_ == 0 ? message.record_time : std::max(end_, message.record_time);
  ++messages_;
}

void BagFolderWriter::close() {
  file_->close();
  file_.reset();
  write_text_file(fs::path(aside_) / metadata_name, metadata());
  check_replaceable(path_);  // the folder may have changed meanwhile
  std::error_code error;
  fs::remove_all(path_, error);
  if (!error) fs::rename(aside_, path_, error);
  if (error) throw InputError(fmt::format("{}: cannot be written: {}; choose another --out", path_, error.message()));
  aside_.clear();
}

/// Version 5 is the format of ROS 2 Humble, which later versions also read. Without QoS profiles, `ros2 bag play` uses
/// its defaults; the profiles' text differs between versions.
std::string BagFolderWriter::metadata() const {
  const Time duration = end_ - begin_;
  std::string text = fmt::format(
      "rosbag2_bagfile_information:\n"
      "  version: 5\n"
      "  storage_identifier: sqlite3\n"
      "  duration:\n    nanoseconds: {}\n"
      "  starting_time:\n    nanoseconds_since_epoch: {}\n"
      "  message_count: {}\n"
      "  topics_with_message_count:\n",
      duration, begin_, messages_);
  for (const auto& [name, topic] : topics_) {
    text += fmt::format(
        "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n"
        "        offered_qos_profiles: \"\"\n      message_count: {}\n",
        name, topic.type, topic.messages);
  }
  return text + fmt::format(
                    "  compression_format: \"\"\n  compression_mode: \"\"\n"
                    "  relative_file_paths:\n    - \"{0}\"\n"
                    "  files:\n    - path: \"{0}\"\n      starting_time:\n        nanoseconds_since_epoch: {1}\n"
                    "      duration:\n        nanoseconds: {2}\n      message_count: {3}\n",
                    file_name, begin_, duration, messages_);
}

}  // namespace lodestone
