#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// What of a run's inputs its report needs, so that log and maps may be deleted afterwards.
struct OverviewInput {
  Time log_begin = 0;
  const Trajectory* truth = nullptr;         ///< null: none was given
  const MagneticMap* field = nullptr;        ///< null: none was given
  std::string cloud;                         ///< PCD or PLY; empty: none was given
  std::vector<const Trajectory*> estimates;  ///< at scan ends; the first leads where there is no truth
};

/// Writes `folder`/overview.json, and of truth.tum (at scan ends), field.png with field.json, and cloud.pcd (at most
/// 150,000 points) those that there are. Maps are cut to the surroundings of the drive. Throws InputError where the
/// folder cannot be written or the cloud cannot be read.
void write_overview(const std::filesystem::path& folder, const OverviewInput& input);

}  // namespace lodestone
