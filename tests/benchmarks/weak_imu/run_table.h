#pragma once

#include <map>
#include <string>
#include <tuple>

#include "tests/estimators/weak_imu/parting.h"

namespace lodestone::weak_imu {

/// Common settings of the runs with different seeds.
struct Cell {
  std::string reality;
  std::string variant;  ///< what differs from the defaults
  std::string grade;
  double period_s = 0.0;
  double speed_m_s = 0.0;

  auto operator<=>(const Cell&) const = default;
};

/// Finished runs, in memory and in a file with one line each.
class RunTable {
 public:
  /// Reads the runs of an earlier call. Throws InputError if a line is malformed.
  explicit RunTable(std::string path);

  bool has(const Cell& cell, int seed) const { return runs_.contains({cell, seed}); }

  /// The line is written to the file before this returns.
  void add(const Cell& cell, int seed, const Comparison& run);

  /// One row per cell, grade by grade.
  std::string markdown() const;

 private:
  std::string path_;
  std::map<std::pair<Cell, int>, Comparison> runs_;
};

}  // namespace lodestone::weak_imu
