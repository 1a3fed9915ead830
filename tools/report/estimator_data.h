#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "tools/report/time_buckets.h"
#include "tools/writers/covariance_file.h"
#include "tools/writers/csv_table.h"

namespace lodestone {

/// The files of one estimator in a run folder.
struct EstimatorFiles {
  std::string name;
  Trajectory trajectory;  ///< the best estimate, T_map_imu at scan ends; empty if there is none
  CsvTable diagnostics;   ///< one row per scan
  std::vector<Time> diagnostics_times;
  std::vector<StampedCovariance> covariances;  ///< of the best estimates; empty if there are none
  std::filesystem::path folder;
};

/// Reads trajectory.tum, diagnostics.csv and covariance.csv, if there is one. Throws InputError if they are missing or
/// malformed.
EstimatorFiles read_estimator(const std::filesystem::path& folder);

/// The positions on the axis of `buckets`: x, y, z, metres.
nlohmann::ordered_json position_series(const Trajectory& trajectory, const TimeBuckets& buckets);

/// Series of an estimator on the axis of `buckets`, as columns by name: x, y, z, sigma, sigma_heading, direction_1 to
/// 6, degenerate, weight, shrink, residual. With `truth` (may be null; interpolated at scan ends), also error, heading
/// and `distribution`: quantiles of the error for shares 0, 1/400, … 1 of the scans; null for the share of lost
/// scans.
nlohmann::ordered_json estimator_series(const EstimatorFiles& files, const Trajectory* truth,
                                        const TimeBuckets& buckets);

/// Where the estimates can be trusted: numbers of scans, of good ones, and of good ones with a degenerate direction but
/// no magnetic sample; their largest sigma of position (m) and heading (deg), and the stretches of scans that were not
/// good: health, reasons, first and last scan in seconds after `begin`. Null if the diagnostics have no health.
nlohmann::ordered_json health_json(const EstimatorFiles& files, Time begin);

/// A CSV file of an estimator's folder as {columns, rows of texts}, or null if there is none.
nlohmann::ordered_json table_json(const std::filesystem::path& path);

}  // namespace lodestone
