#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "tools/report/time_buckets.h"
#include "tools/writers/csv_table.h"

namespace lodestone {

/// What one estimator left in a run folder.
struct EstimatorFiles {
  std::string name;
  Trajectory trajectory;  ///< the best estimate, T_map_imu at scan ends; empty where it gave none
  CsvTable diagnostics;   ///< one row a scan
  std::vector<Time> diagnostics_times;
  std::filesystem::path folder;
};

/// Reads trajectory.tum and diagnostics.csv. Throws InputError where they are missing or malformed.
EstimatorFiles read_estimator(const std::filesystem::path& folder);

/// Its series on the axis of `buckets`, as columns by name: x, y, z, sigma, sigma_heading, direction_1 to 6,
/// degenerate, weight, shrink, residual; with `truth` (null: none; interpolated at scan ends) error and heading, and
/// `distribution`: the error that a share of 0, 1/400, … 1 of the scans does not exceed.
nlohmann::ordered_json estimator_series(const EstimatorFiles& files, const Trajectory* truth,
                                        const TimeBuckets& buckets);

/// A CSV file of an estimator's folder as {columns, rows of texts}, or null where there is none.
nlohmann::ordered_json table_json(const std::filesystem::path& path);

}  // namespace lodestone
