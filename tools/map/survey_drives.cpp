#include "tools/map/survey_drives.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "core/error.h"
#include "core/geometry/pose_spacing.h"
#include "core/nearest_name.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/command_files.h"

namespace lodestone {

namespace {

/// Faster than any survey drive. In millimetres, a robot at 0.1 m/s seems to be that fast.
constexpr double kFastestSurvey_m_s = 100.0;

/// Refuses positions that are not in metres. Single jumps and rests do not matter.
void check_speed(const SurveyDrive& drive) {
  std::vector<double> speeds_m_s;
  const StampedPose* from = drive.trajectory.empty() ? nullptr : &drive.trajectory.front();
  for (const StampedPose& pose : drive.trajectory) {
    const double duration_s = to_seconds(pose.time - from->time);
    if (duration_s < 1.0) continue;
    speeds_m_s.push_back((pose.pose.position - from->pose.position).norm() / duration_s);
    from = &pose;
  }
  if (speeds_m_s.empty()) return;
  const double high_m_s = value_at_share(speeds_m_s, 0.9);
  if (high_m_s < kFastestSurvey_m_s) return;
  throw InputError(fmt::format(
      "{}: the robot moves at {:.0f} m/s; expected positions in metres, and less than {:g} m/s; if they are "
      "in millimetres, divide them by 1000",
      drive.trajectory_file, high_m_s, kFastestSurvey_m_s));
}

}  // namespace

std::string SurveyFiles::names(const std::vector<std::string>& paths) {
  return join_names(paths, [](const std::string& path) { return std::filesystem::path(path).filename().string(); });
}

void add_survey_files(CLI::App& command, CommandFiles& files, const std::string& topics, SurveyFiles& survey) {
  files
      .input(command.add_option(
          "LOG", survey.logs,
          "the log of a survey drive in any format, with the topics of " + topics + "; several logs form one survey"))
      ->required();
  files
      .input(command.add_option("--trajectory", survey.trajectories,
                                "T_map_imu of the drive, TUM, of survey accuracy; repeat the option for each further "
                                "log, in the order of the logs"))
      ->required()
      ->allow_extra_args(false);
}

std::vector<SurveyDrive> read_survey_drives(const SurveyFiles& survey, const Vector3& origin_m) {
  if (survey.logs.size() != survey.trajectories.size()) {
    throw InputError(
        fmt::format("--trajectory: expected one for each log, in the same order, found {} for {} ({}); "
                    "repeat --trajectory FILE for each log",
                    survey.trajectories.size(), survey.logs.size(), SurveyFiles::names(survey.logs)));
  }
  // Equal noise of both copies would count as the field.
  check_different(survey.logs, "expected different drives: omit one, and its --trajectory");
  std::vector<SurveyDrive> drives;
  for (std::size_t i = 0; i < survey.logs.size(); ++i) {
    drives.push_back({survey.logs[i], survey.trajectories[i], read_trajectory(survey.trajectories[i], origin_m)});
    check_speed(drives.back());
  }
  return drives;
}

void check_poses(const SurveyDrive& drive, const std::string& what, std::int64_t with_pose, std::int64_t without_pose,
                 Time largest_gap) {
  if (with_pose > 0 && without_pose <= with_pose) return;
  if (const Time spacing = pose_spacing(drive.trajectory); without_pose > 0 && spacing > largest_gap) {
    throw InputError(fmt::format(
        "{}: {} of {} {} have no pose, because the poses of {} are {:.3g} s apart (median); expected at most "
        "{:g} s; write the trajectory with more poses",
        drive.log, without_pose, with_pose + without_pose, what, drive.trajectory_file, to_seconds(spacing),
        to_seconds(largest_gap)));
  }
  const std::string span = fmt::format("{} to {} s", format_stamp(drive.trajectory.front().time),
                                       format_stamp(drive.trajectory.back().time));
  if (with_pose == 0 && without_pose > 0) {
    throw InputError(
        fmt::format("{}: none of the {} is within the time of {} ({}); set --trajectory to the trajectory "
                    "of this survey",
                    drive.log, what, drive.trajectory_file, span));
  }
  if (with_pose == 0) throw InputError(fmt::format("{}: the log has no {}", drive.log, what));
  throw InputError(
      fmt::format("{}: {} of {} {} have no pose in {} ({}); set --trajectory to the complete trajectory of "
                  "this survey",
                  drive.log, without_pose, with_pose + without_pose, what, drive.trajectory_file, span));
}

}  // namespace lodestone
