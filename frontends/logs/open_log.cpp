#include "frontends/logs/open_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <span>
#include <string_view>

#include "core/error.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/file_bytes.h"
#include "frontends/logs/compression.h"
#include "frontends/logs/csv/csv_log.h"
#include "frontends/logs/mcap/mcap_index.h"
#include "frontends/logs/merged_source.h"
#include "frontends/logs/recording_parts.h"
#include "frontends/logs/ros1/bag_index.h"
#include "frontends/logs/ros2/bag_metadata.h"
#include "frontends/logs/ros2/sqlite_source.h"
#include "frontends/logs/segment_source.h"
#include "frontends/logs/temporary_file.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using Source = std::unique_ptr<MessageSource>;

enum class FileKind { ros1_bag, sqlite, mcap, zstd, other };

/// The kind of a file by its first bytes.
FileKind kind_of(std::span<const std::uint8_t> bytes) {
  const std::string_view start(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (start.starts_with("#ROSBAG V")) return FileKind::ros1_bag;
  if (start.starts_with("SQLite format 3")) return FileKind::sqlite;
  if (start.starts_with(mcap::magic.substr(0, 5))) return FileKind::mcap;
  if (starts_like_zstd(bytes)) return FileKind::zstd;
  return FileKind::other;
}

FileKind kind_of_file(const std::string& path) {
  const FileBytes file(path);
  std::vector<std::uint8_t> bytes;
  file.read(0, static_cast<std::size_t>(std::min<std::uint64_t>(16, file.size())), bytes);
  return kind_of(bytes);
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw InputError(path + ": " + why +
                   ": expected a ROS 1 bag (begins with '#ROSBAG V'), an MCAP file, or an SQLite bag of "
                   "ROS 2" +
                   looks_like(path));
}

Source open_file(const std::string& path, WarningLog& warnings);

/// A log packed as a whole. A database requires random access, so it is unpacked to a temporary file. Messages name the
/// original file.
class UnpackedSource : public MessageSource {
 public:
  UnpackedSource(const std::string& path, WarningLog& warnings) : path_(path), warnings_(warnings) {
    unpack_zstd_file(path, file_.path(), file_.room(), [&path](std::span<const std::uint8_t> begin) {
      const FileKind kind = kind_of(begin);
      if (kind == FileKind::zstd) throw InputError(path + ": is packed with zstd twice; unpack it with 'zstd -d'");
      if (kind == FileKind::other) refuse(path, "its zstd compression contains no log");
    });
    named([this] { source_ = open_file(file_.path(), inner_warnings_); });
  }
  const std::vector<TopicInfo>& topics() const override { return source_->topics(); }
  void select(const std::vector<std::string>& names) override {
    named([&] { source_->select(names); });
  }
  bool next(RawMessage& message) override {
    bool more = false;
    named([&] { more = source_->next(message); });
    return more;
  }

 private:
  std::string with_given_name(std::string text) const {
    const std::string& name = file_.path();
    for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + path_.size())) {
      text.replace(at, name.size(), path_);
    }
    return text;
  }

  template <class Call>
  void named(const Call& call) {
    try {
      call();
    } catch (const InputError& error) {
      throw InputError(with_given_name(error.what()));
    }
    for (const auto& [kind, entry] : inner_warnings_.entries()) {
      std::int64_t& told = forwarded_[kind];
      if (entry.count > told)
        warnings_.add(kind, with_given_name(entry.first_detail), entry.last_time, entry.count - told);
      told = entry.count;
    }
  }

  std::string path_;
  WarningLog& warnings_;
  WarningLog inner_warnings_;
  std::map<std::string, std::int64_t> forwarded_;  ///< number of forwarded warnings of each kind
  TemporaryFile file_;
  Source source_;
};

Source open_file(const std::string& path, WarningLog& warnings) {
  switch (kind_of_file(path)) {
    case FileKind::ros1_bag:
      return std::make_unique<SegmentSource>(std::make_unique<BagIndex>(path, warnings), warnings);
    case FileKind::sqlite:
      return std::make_unique<SqliteSource>(path, warnings);
    case FileKind::mcap:
      return std::make_unique<SegmentSource>(std::make_unique<mcap::McapIndex>(path, warnings), warnings);
    case FileKind::zstd:
      return std::make_unique<UnpackedSource>(path, warnings);
    case FileKind::other:
      break;
  }
  if (FileBytes(path).size() == 0) {
    throw InputError(path + ": the file is empty (0 bytes); copy it again, or record the log again");
  }
  refuse(path, "is not a log");
}

/// Files of a folder that are logs by content, in order of name. Warns of files that have only the name of a log: a
/// part of the recording may be lost.
std::vector<std::string> logs_in(const fs::path& folder, WarningLog& warnings) {
  std::vector<std::string> files, others;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::error_code broken;  // a broken or circular link
    if (!entry.is_regular_file(broken)) continue;
    const std::string ending = entry.path().extension().string();
    if (kind_of_file(entry.path().string()) != FileKind::other) {
      files.push_back(entry.path().string());
    } else if (ending == ".bag" || ending == ".mcap" || ending == ".db3") {
      others.push_back(entry.path().string());
    }
  }
  std::sort(files.begin(), files.end());
  std::sort(others.begin(), others.end());
  for (const std::string& file : others) {
    warnings.add("log.file_passed_over",
                 fmt::format("{}: has the name of a log, but is none ({} bytes); it is ignored; copy it again", file,
                             FileBytes(file).size()),
                 0);
  }
  return files;
}

Source open_folder(const fs::path& folder, WarningLog& warnings) {
  const fs::path metadata = folder / "metadata.yaml";
  const bool listed = fs::exists(metadata);
  const std::vector<std::string> files = listed ? bag_files(metadata.string()) : logs_in(folder, warnings);
  if (files.empty() && CsvLog::is_in(folder.string())) return std::make_unique<CsvLog>(folder.string(), warnings);
  if (files.empty()) {
    throw InputError(folder.string() + ": the folder has no log: no bag, no MCAP file, no CSV file");
  }
  if (!listed && CsvLog::is_in(folder.string())) {
    warnings.add("log.csv_passed_over",
                 folder.string() + ": the folder has bags, which are read, and CSV or PCD files, which are ignored", 0);
  }
  std::vector<RecordingPart> parts;
  for (const std::string& file : files) parts.push_back({file, open_file(file, warnings)});
  check_one_recording(folder.string(), parts, listed ? PartsListed::by_metadata : PartsListed::unlisted);
  if (parts.size() == 1) return std::move(parts.front().source);
  std::vector<Source> sources;
  for (RecordingPart& part : parts) sources.push_back(std::move(part.source));
  return std::make_unique<MergedSource>(folder.string(), std::move(sources));
}

}  // namespace

std::unique_ptr<MessageSource> open_log(const std::string& path, WarningLog& warnings) {
  std::error_code error;
  if (fs::is_directory(path, error)) return open_folder(path, warnings);
  if (fs::path(path).filename() == "metadata.yaml") return open_folder(fs::absolute(path).parent_path(), warnings);
  return open_file(path, warnings);
}

}  // namespace lodestone
