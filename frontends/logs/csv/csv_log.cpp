#include "frontends/logs/csv/csv_log.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "core/error.h"
#include "frontends/logs/folder_files.h"
#include "frontends/messages/topic_list.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

/// Every CSV file below the folder, and every folder with PCD files.
std::set<fs::path> parts_of(const fs::path& folder) {
  std::set<fs::path> parts;
  for (const fs::path& file : files_below(folder)) {
    if (file.extension() == ".csv") parts.insert(file);
    if (file.extension() == ".pcd" && file.lexically_relative(folder).has_parent_path())
      parts.insert(file.parent_path());
  }
  return parts;
}

}  // namespace

/// The next message of a chosen stream.
struct CsvLog::Head {
  Stream* stream = nullptr;
  std::size_t selected = 0;  ///< index into the list of select()
  Time time = 0;
  bool ended = false;
};

CsvLog::CsvLog(const std::string& folder, WarningLog& warnings) : folder_(folder) {
  std::map<std::string, std::unique_ptr<Stream>> found;
  for (const fs::path& part : parts_of(folder)) {
    const std::string topic = "/" + fs::path(part).replace_extension().lexically_relative(folder).generic_string();
    if (found.count(topic) > 0)
      throw InputError(part.string() + ": a CSV file and a folder of clouds have the same name; rename one of them");
    found[topic] =
        fs::is_directory(part) ? open_cloud_stream(part.string(), topic) : open_csv_stream(part.string(), topic);
  }
  for (auto& [topic, stream] : found) {
    topics_.push_back(stream->inspect(warnings));
    streams_.push_back(std::move(stream));
  }
}

CsvLog::~CsvLog() = default;

bool CsvLog::is_in(const std::string& folder) {
  return !parts_of(folder).empty();
}

void CsvLog::select(const std::vector<std::string>& names) {
  const std::vector<int> selection = selection_of(topics_, names, folder_);
  heads_.clear();
  given_ = 0;
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    if (selection[i] < 0) continue;
    Head head{streams_[i].get(), static_cast<std::size_t>(selection[i]), 0, false};
    head.stream->rewind();
    head.ended = !head.stream->advance(head.time);
    heads_.push_back(head);
  }
}

bool CsvLog::next(RawMessage& message) {
  if (given_ > 0) {
    Head& given = heads_[given_ - 1];
    given.ended = !given.stream->advance(given.time);
    given_ = 0;
  }
  for (std::size_t i = 0; i < heads_.size(); ++i) {
    if (!heads_[i].ended && (given_ == 0 || heads_[i].time < heads_[given_ - 1].time)) given_ = i + 1;
  }
  if (given_ == 0) return false;
  const Head& head = heads_[given_ - 1];
  const std::vector<std::uint8_t>& bytes = head.stream->message();
  message = {head.time, head.selected, bytes.data(), bytes.size()};
  return true;
}

}  // namespace lodestone
