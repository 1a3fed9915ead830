#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace lodestone {

/// What an earlier run left in a result folder, so that nothing of it stays beside the new results. Looks at the files
/// alone that `lodestone run` itself names; everything else in the folder is left as it is.
class StaleResults {
 public:
  /// Notes what is there. `estimators`: every name that a run's folder may have.
  StaleResults(std::filesystem::path folder, const std::vector<std::string>& estimators);

  /// Leaves calibration.csv and platform.yaml of an estimator's folder: a replayed pass does not write them again.
  void keep_calibration(const std::filesystem::path& folder);

  /// Removes what has not been written anew since, and the folders of estimators that are empty then. Called when the
  /// new results are in place: who is killed before has both.
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
