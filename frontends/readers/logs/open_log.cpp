#include "frontends/readers/logs/open_log.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "core/error.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/readers/csv/csv_log.h"
#include "frontends/readers/logs/compression.h"
#include "frontends/readers/logs/file_bytes.h"
#include "frontends/readers/logs/merged_source.h"
#include "frontends/readers/logs/recording_parts.h"
#include "frontends/readers/logs/segment_source.h"
#include "frontends/readers/mcap/mcap_index.h"
#include "frontends/readers/ros2/bag_metadata.h"
#include "frontends/readers/ros2/sqlite_source.h"
#include "frontends/readers/rosbag/checked_bag.h"
#include "frontends/readers/rosbag/cut_bag.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;
using Source = std::unique_ptr<MessageSource>;

enum class FileKind { ros1_bag, sqlite, mcap, zstd, other };

FileKind kind_of(const std::string& path) {
  const FileBytes file(path);
  std::vector<std::uint8_t> bytes;
  file.read(0, static_cast<std::size_t>(std::min<std::uint64_t>(16, file.size())), bytes);
  const std::string_view start(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (start.starts_with("#ROSBAG V")) return FileKind::ros1_bag;
  if (start.starts_with("SQLite format 3")) return FileKind::sqlite;
  if (start.starts_with(mcap::magic.substr(0, 5))) return FileKind::mcap;
  if (starts_like_zstd(bytes)) return FileKind::zstd;
  return FileKind::other;
}

/// The folder of temporary files.
fs::path temporary_folder() {
  std::error_code error;
  const fs::path folder = fs::temp_directory_path(error);
  if (error) throw InputError("TMPDIR: is no folder (" + error.message() + "); set it to one with room for an unpacked log");
  return folder;
}

/// What a killed process has unpacked there: a day old, for a process of another container may live unseen.
void remove_leftovers(const fs::path& folder) {
  const auto oldest = fs::file_time_type::clock::now() - std::chrono::hours(24);
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    int process = 0;
    if (std::sscanf(name.c_str(), "lodestone-%d-", &process) != 1 || fs::exists("/proc/" + std::to_string(process), ignored)) continue;
    if (fs::last_write_time(entry.path(), ignored) > oldest) continue;
    fs::remove(entry.path(), ignored);
  }
}

/// A file that is gone when this is.
class TemporaryFile {
 public:
  TemporaryFile() {
    const fs::path folder = temporary_folder();
    remove_leftovers(folder);
    path_ = (folder / fmt::format("lodestone-{}-XXXXXX", ::getpid())).string();
    const int file = mkstemp(path_.data());
    if (file < 0) throw InputError(fmt::format("{}: cannot be written ({}); set TMPDIR to another folder", folder.string(), std::strerror(errno)));
    ::close(file);
  }
  ~TemporaryFile() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

Source open_file(const std::string& path, WarningLog& warnings);

/// A bag that was packed as a whole: a database needs to be read anywhere, so it is unpacked beside.
class UnpackedSource : public MessageSource {
 public:
  UnpackedSource(const std::string& path, WarningLog& warnings) {
    unpack_zstd_file(path, file_.path());
    if (kind_of(file_.path()) == FileKind::zstd) throw InputError(path + ": is packed by zstd twice; unpack it with 'zstd -d'");
    source_ = open_file(file_.path(), warnings);
  }
  const std::vector<TopicInfo>& topics() const override { return source_->topics(); }
  void select(const std::vector<std::string>& names) override { source_->select(names); }
  bool next(RawMessage& message) override { return source_->next(message); }

 private:
  TemporaryFile file_;
  Source source_;
};

Source open_bag(const std::string& path, WarningLog& warnings) {
  try {
    return std::make_unique<CheckedBag>(path);
  } catch (const BagCutOff&) {
    return std::make_unique<SegmentSource>(std::make_unique<CutBag>(path, warnings), warnings);
  }
}

Source open_file(const std::string& path, WarningLog& warnings) {
  switch (kind_of(path)) {
    case FileKind::ros1_bag:
      return open_bag(path, warnings);
    case FileKind::sqlite:
      return std::make_unique<SqliteSource>(path, warnings);
    case FileKind::mcap:
      return std::make_unique<SegmentSource>(std::make_unique<mcap::McapIndex>(path, warnings), warnings);
    case FileKind::zstd:
      return std::make_unique<UnpackedSource>(path, warnings);
    case FileKind::other:
      break;
  }
  throw InputError(path + ": is no log: expected a ROS 1 bag (it starts with '#ROSBAG V'), an MCAP file, or an SQLite bag of "
                          "ROS 2" + looks_like(path));
}

/// Files of a folder that are logs by their content, in the order of names.
std::vector<std::string> logs_in(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file() && kind_of(entry.path().string()) != FileKind::other) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

Source open_folder(const fs::path& folder, WarningLog& warnings) {
  const fs::path metadata = folder / "metadata.yaml";
  const bool listed = fs::exists(metadata);
  const std::vector<std::string> files = listed ? bag_files(metadata.string()) : logs_in(folder);
  if (files.empty() && CsvLog::is_in(folder.string())) return std::make_unique<CsvLog>(folder.string(), warnings);
  if (files.empty()) {
    throw InputError(folder.string() + ": the folder holds no log: no bag, no MCAP file, no CSV file");
  }
  if (!listed && CsvLog::is_in(folder.string())) {
    warnings.add("log.csv_passed_over", folder.string() + ": holds bags, which are read, and CSV or PCD files beside them, which are not", 0);
  }
  std::vector<RecordingPart> parts;
  for (const std::string& file : files) parts.push_back({file, open_file(file, warnings)});
  check_one_recording(folder.string(), parts, listed ? PartsListed::by_metadata : PartsListed::by_nobody);
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
