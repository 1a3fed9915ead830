#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// Inputs of a run that the report requires, so that log and maps may be deleted afterwards.
struct OverviewInput {
  Time log_begin = 0;
  const Trajectory* truth = nullptr;         ///< may be null
  const MagneticMap* field = nullptr;        ///< may be null
  std::string cloud;                         ///< PCD, PLY or LAS; may be empty
  Vector3 cloud_origin_m = Vector3::Zero();  ///< subtracted from the cloud
  std::vector<Time> scans;                   ///< scan ends of all estimators, also without a pose
  Trajectory estimate;                       ///< defines the extent if there is no truth
};

/// The files that write_overview may write. Older ones are deleted.
inline constexpr const char* kOverviewFiles[] = {"overview.json", "truth.tum", "field.png", "field.json", "cloud.pcd"};

/// Writes `folder`/overview.json and, if available, truth.tum (at scan ends), field.png with field.json, and cloud.pcd
/// (at most 150,000 points). Maps are cropped to the surroundings of the drive. Throws InputError if the folder cannot
/// be written or the cloud cannot be read.
void write_overview(const std::filesystem::path& folder, const OverviewInput& input);

}  // namespace lodestone
