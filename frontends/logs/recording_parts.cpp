#include "frontends/logs/recording_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/error.h"
#include "frontends/configuration/trajectory_file.h"

namespace lodestone {
namespace {

constexpr Time kLongestQueue = from_seconds(1.0);

std::string name_of(const RecordingPart& part) {
  return std::filesystem::path(part.file).filename().string();
}

const char* encoding_name(Encoding encoding) {
  switch (encoding) {
    case Encoding::ros1:
      return "ROS 1";
    case Encoding::cdr:
      return "ROS 2";
    case Encoding::other:
      break;
  }
  return "another encoding";
}

/// Duration for which both have the topic.
Time overlap(const TopicInfo& a, const TopicInfo& b) {
  return std::min(a.end, b.end) - std::max(a.begin, b.begin);
}

void check_pair(const std::string& folder, const RecordingPart& first, const RecordingPart& second,
                PartsListed listed) {
  for (const TopicInfo& a : first.source->topics()) {
    for (const TopicInfo& b : second.source->topics()) {
      if (a.name != b.name) continue;
      if (a.type != b.type || a.encoding != b.encoding) {
        throw InputError(
            fmt::format("{}: {} is a {} of {} in {} and a {} of {} in {}: these are not parts of one recording; "
                        "use one of them, {} or {}",
                        folder, a.name, a.type, encoding_name(a.encoding), name_of(first), b.type,
                        encoding_name(b.encoding), name_of(second), first.file, second.file));
      }
      if (listed == PartsListed::by_metadata || a.messages == 0 || b.messages == 0) continue;
      const Time shorter = std::min(a.end - a.begin, b.end - b.begin);
      if (overlap(a, b) <= std::min(kLongestQueue, shorter / 2)) continue;
      throw InputError(
          fmt::format("{}: {} and {} both have {} from {} to {} s: these are not parts of one recording, whose files "
                      "follow one another in time; use one of them, {} or {}",
                      folder, name_of(first), name_of(second), a.name, format_stamp(std::max(a.begin, b.begin)),
                      format_stamp(std::min(a.end, b.end)), first.file, second.file));
    }
  }
}

}  // namespace

void check_one_recording(const std::string& folder, const std::vector<RecordingPart>& parts, PartsListed listed) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (std::size_t k = i + 1; k < parts.size(); ++k) check_pair(folder, parts[i], parts[k], listed);
  }
}

}  // namespace lodestone
