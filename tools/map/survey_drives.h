#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/trajectory.h"
#include "core/warnings.h"

namespace CLI {
class App;
}

namespace lodestone {

class CommandFiles;

/// Largest distance of neighbouring poses of a survey, ns. At an acceleration of 1 m/s², a position that is
/// interpolated over this time is off by a t² / 8 = 8 mm at most.
inline constexpr Time kLargestPoseGap = 250'000'000;

/// The drives of one survey as given on the command line.
struct SurveyFiles {
  std::vector<std::string> logs;
  std::vector<std::string> trajectories;  ///< T_map_imu, one for each log, in the same order

  /// Names without folders, joined by commas.
  static std::string names(const std::vector<std::string>& paths);
};

/// Declares LOG... and --trajectory. `topics`: the sensors whose topics a log must have, for the help.
void add_survey_files(CLI::App& command, CommandFiles& files, const std::string& topics, SurveyFiles& survey);

/// A log and the trajectory of its drive.
struct SurveyDrive {
  std::string log;
  std::string trajectory_file;
  Trajectory trajectory;
};

/// Reads the trajectories less `origin_m`. Throws InputError if their number is not that of the logs, if a log is given
/// twice, if a trajectory cannot be read, or if its positions are not in metres.
std::vector<SurveyDrive> read_survey_drives(const SurveyFiles& survey, const Vector3& origin_m = Vector3::Zero());

/// Throws InputError if most of a drive's measurements have no pose. `what`: their name, such as "LiDAR points".
/// `largest_gap`: of neighbouring poses, ns.
void check_poses(const SurveyDrive& drive, const std::string& what, std::int64_t with_pose, std::int64_t without_pose,
                 Time largest_gap);

}  // namespace lodestone
