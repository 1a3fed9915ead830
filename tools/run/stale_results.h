#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace lodestone {

/// The files that a run writes or deletes, relative to its folder of results: those of all `estimators`, the pictures
/// and the bound. Without the files that every run writes.
std::vector<std::filesystem::path> replaceable_files(const std::vector<std::string>& estimators);

/// Files of an earlier run in a result folder. Those that the new run does not write are deleted. Considers only files
/// that `lodestone run` writes; other files are kept.
class StaleResults {
 public:
  /// Lists existing files. `estimators`: all names of estimators' folders.
  StaleResults(std::filesystem::path folder, const std::vector<std::string>& estimators);

  /// Keeps calibration.csv and platform.yaml of an estimator's folder: a replayed pass does not write them.
  void keep_calibration(const std::filesystem::path& folder);

  /// Deletes listed files that were not rewritten, and empty estimator folders. Called after the new results are
  /// complete, so that a killed run leaves the old results.
  void remove() const;

 private:
  struct Mark {
    std::uint64_t inode = 0;
    std::int64_t changed_ns = 0;
    bool operator==(const Mark&) const = default;
  };
  static bool mark_of(const std::filesystem::path& file, Mark& mark);
  void note(const std::filesystem::path& file);

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> estimator_folders_;
  std::map<std::filesystem::path, Mark> files_;
};

}  // namespace lodestone
