#include "tools/map/survey_drives.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "core/error.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/command_files.h"

namespace lodestone {

std::string SurveyFiles::names(const std::vector<std::string>& paths) {
  std::string names;
  for (const std::string& path : paths) {
    names += (names.empty() ? "" : ", ") + std::filesystem::path(path).filename().string();
  }
  return names;
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
  std::vector<SurveyDrive> drives;
  for (std::size_t i = 0; i < survey.logs.size(); ++i) {
    drives.push_back({survey.logs[i], survey.trajectories[i], read_trajectory(survey.trajectories[i], origin_m)});
  }
  return drives;
}

void check_poses(const SurveyDrive& drive, const std::string& what, std::int64_t with_pose, std::int64_t without_pose) {
  if (with_pose > 0 && without_pose <= with_pose) return;
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
