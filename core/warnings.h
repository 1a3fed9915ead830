#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/time.h"

namespace lodestone {

/// Counts warnings by kind, for a summary at the end of a run. Not thread-safe: each run has its own.
class WarningLog {
 public:
  struct Entry {
    std::int64_t count = 0;
    std::string first_detail;  ///< of the first warning: content, expectation, remedy
    Time first_time = 0;
    Time last_time = 0;
  };

  /// `kind` is a short stable name in the form part.what, for example "lidar.nan_points".
  void add(const std::string& kind, const std::string& detail, Time time, std::int64_t count = 1) {
    auto [iterator, is_new] = entries_.try_emplace(kind);
    Entry& entry = iterator->second;
    if (is_new) {
      entry.first_detail = detail;
      entry.first_time = time;
    }
    entry.count += count;
    entry.last_time = time;
  }

  /// Adds warnings that were counted elsewhere since the last of these.
  void add(const WarningLog& later) {
    for (const auto& [kind, entry] : later.entries_) {
      add(kind, entry.first_detail, entry.first_time, entry.count);
      entries_[kind].last_time = entry.last_time;
    }
  }

  std::int64_t count(const std::string& kind) const {
    const auto found = entries_.find(kind);
    return found == entries_.end() ? 0 : found->second.count;
  }

  const std::map<std::string, Entry>& entries() const { return entries_; }

 private:
  std::map<std::string, Entry> entries_;
};

}  // namespace lodestone
