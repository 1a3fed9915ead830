#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/lidar/voxel_planes.h"
#include "core/mapping/free_space.h"
#include "core/option_checks.h"
#include "core/thread_limit.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/scan_survey.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/map/survey_drives.h"
#include "tools/messages.h"
#include "tools/origin_option.h"
#include "tools/progress.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

struct MapCloudCall {
  SurveyFiles survey;
  std::string platform;
  std::string out;
  Vector3 origin_m = Vector3::Zero();
  double voxel_m = 0.05;
  int min_points = 2;
  std::optional<double> max_range_m;
  bool keep_moving = false;
  bool force = false;
  int threads = 0;
};

constexpr SensorChoice lidar_only{.lidar = true, .imu = false, .magnetometers = false, .wheels = false};

void check_options(const MapCloudCall& call) {
  option_checks::within("--voxel-m", call.voxel_m, 0.01, 0.5);
  option_checks::within("--min-points", call.min_points, 1, 1000);
  if (call.max_range_m) option_checks::positive("--max-range", *call.max_range_m);
}

Platform platform_of(const MapCloudCall& call) {
  Platform platform = load_platform(call.platform, lidar_only);
  if (call.max_range_m) platform.suite.set_max_range(*call.max_range_m);
  return platform;
}

/// Voxels have numbers up to their reach, and floats are coarse farther away than cloud maps may be.
void check_origin(const SurveyDrive& drive, const MapCloudCall& call) {
  const double reach_m = std::min(kSiteReach_m, voxels_reach_m(call.voxel_m));
  for (const StampedPose& pose : drive.trajectory) {
    if (pose.pose.position.cwiseAbs().maxCoeff() < reach_m) continue;
    const Vector3& at = pose.pose.position;
    throw InputError(
        fmt::format("{}: the pose at {} s is at ({:.0f}, {:.0f}, {:.0f}) m; expected less than {:.0f} m from an origin "
                    "at the site; {} --origin x,y,z",
                    drive.trajectory_file, format_stamp(pose.time), at.x(), at.y(), at.z(), reach_m,
                    call.origin_m.isZero(0.0) ? "give one with" : "correct or omit"));
  }
}

/// Largest accepted distance of neighbouring poses, ns. A trajectory with a pose for each scan of a slow LiDAR has no
/// closer poses.
Time largest_pose_gap(const SensorSuite& suite) {
  return std::max(kLargestPoseGap, from_seconds(1.5 * suite.lidar.scan_period_s));
}

ScanSurvey read_scan_drive(const SurveyDrive& drive, const Platform& platform, const std::string& pass,
                           WarningLog& warnings, const std::function<void(std::span<const LidarRay>)>& use) {
  BagSource source(drive.log, platform, warnings, lidar_only, LogPause::is_bridged);
  Progress progress(std::filesystem::path(drive.log).filename().string() + ", " + pass, source.begin_time(),
                    source.end_time());
  const ScanSurvey survey = read_scans(source, drive.trajectory, platform.suite, largest_pose_gap(platform.suite), use,
                                       [&](Time time) { progress.advance(time); });
  progress.finish();
  return survey;
}

double percent(std::int64_t part, std::int64_t all) {
  return all == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(all);
}

void print_drive(const SurveyDrive& drive, const ScanSurvey& survey) {
  const std::int64_t all = survey.points + survey.out_of_range + survey.without_pose;
  fmt::print("{}: {} scans, {} points, of which {:.1f} % are out of range\n", drive.log, survey.scans, all,
             percent(survey.out_of_range, all));
  if (survey.gaps.empty()) return;
  Time total = 0;
  ScanGap longest;
  for (const ScanGap& gap : survey.gaps) {
    total += gap.end - gap.begin;
    if (gap.end - gap.begin > longest.end - longest.begin) longest = gap;
  }
  fmt::print(
      "warning: {} points ({:.1f} %) have no pose in {} and are ignored: {} gaps of {:.3f} s in all, the longest "
      "from {} to {} s\n",
      survey.without_pose, percent(survey.without_pose, all), drive.trajectory_file, survey.gaps.size(),
      to_seconds(total), format_stamp(longest.begin), format_stamp(longest.end));
}

/// The first pass: means of all points.
std::vector<VoxelMean> read_means(const std::vector<SurveyDrive>& drives, const Platform& platform,
                                  const MapCloudCall& call) {
  VoxelMeans means(call.voxel_m);
  for (const SurveyDrive& drive : drives) {
    WarningLog warnings;
    const ScanSurvey survey = read_scan_drive(drive, platform, "points", warnings, [&](std::span<const LidarRay> rays) {
      for (const LidarRay& ray : rays) means.add(ray.end);
    });
    print_warnings(warnings);
    if (survey.points == 0 && survey.without_pose == 0 && survey.out_of_range > 0) {
      throw InputError(
          fmt::format("{}: all {} points are nearer than lidar.min_range_m ({:g} m) or farther than "
                      "lidar.max_range_m ({:g} m) of {}; correct these keys, or --max-range",
                      drive.log, survey.out_of_range, platform.suite.lidar.min_range_m,
                      platform.suite.lidar.max_range_m, platform.file_name()));
    }
    check_poses(drive, "LiDAR points", survey.points, survey.without_pose, largest_pose_gap(platform.suite));
    print_drive(drive, survey);
  }
  const std::size_t all = means.size();
  std::vector<VoxelMean> result = means.means(call.min_points);
  fmt::print("{} voxels of {:g} m, of which {} have less than {} points\n", all, call.voxel_m, all - result.size(),
             call.min_points);
  if (result.empty()) {
    throw InputError(
        fmt::format("no voxel of {:g} m has {} points; nothing is written; lower --min-points, or raise "
                    "--voxel-m",
                    call.voxel_m, call.min_points));
  }
  return result;
}

/// The second pass: removes what rays show to be free.
std::vector<VoxelMean> without_moving(std::vector<VoxelMean> means, const std::vector<SurveyDrive>& drives,
                                      const Platform& platform, double voxel_m) {
  FreeSpace space(std::move(means), voxel_m);
  for (const SurveyDrive& drive : drives) {
    WarningLog repeated;  // the first pass printed them
    read_scan_drive(drive, platform, "moving objects", repeated,
                    [&](std::span<const LidarRay> rays) { space.add_scan(rays); });
  }
  std::vector<VoxelMean> occupied = space.occupied();
  const std::size_t removed = space.size() - occupied.size();
  fmt::print("moving objects: {} voxels ({:.1f} %) removed\n", removed,
             percent(static_cast<std::int64_t>(removed), static_cast<std::int64_t>(space.size())));
  if (occupied.empty()) {
    throw InputError(
        "all voxels are free for most rays; nothing is written; check that the trajectories are of these drives and "
        "clocks, and check T_imu_lidar in the platform file");
  }
  return occupied;
}

void map_cloud(const MapCloudCall& call) {
  const ThreadLimit limit(call.threads);
  check_options(call);
  const bool at_site = call.origin_m.isZero(0.0);
  if (!at_site && std::filesystem::path(call.out).extension() == ".pcd") {
    throw InputError(call.out + ": with --origin, the map needs doubles, which a PCD has not; name it .ply");
  }
  output_with_ending(call.out, at_site ? ".pcd" : ".ply");
  refuse_to_replace(call.out, call.force);
  const Platform platform = platform_of(call);
  const std::vector<SurveyDrive> drives = read_survey_drives(call.survey, call.origin_m);
  for (const SurveyDrive& drive : drives) check_origin(drive, call);

  std::vector<VoxelMean> means = read_means(drives, platform, call);
  if (!call.keep_moving) means = without_moving(std::move(means), drives, platform, call.voxel_m);
  std::vector<Eigen::Vector3f> points;
  points.reserve(means.size());
  Eigen::AlignedBox3d box;
  for (const VoxelMean& mean : means) {
    points.push_back(mean.position);
    box.extend(mean.position.cast<double>() + call.origin_m);
  }
  PointCloudWriter writer(call.out, call.origin_m);
  writer.add(points);
  writer.commit();
  fmt::print("{} points; x {:.1f} to {:.1f}, y {:.1f} to {:.1f}, z {:.1f} to {:.1f} m\nwrote {}\n", points.size(),
             box.min().x(), box.max().x(), box.min().y(), box.max().y(), box.min().z(), box.max().z(), call.out);
}

}  // namespace

void add_map_cloud(CLI::App& map) {
  const auto call = std::make_shared<MapCloudCall>();
  CLI::App* command = map.add_subcommand(
      "cloud", "Build a cloud map from the scans of survey drives with known trajectories, without moving objects");
  CommandFiles files(*command);
  add_survey_files(*command, files, "the LiDARs", call->survey);
  files.input(command->add_option("--platform", call->platform, "the robot's platform file"))->required();
  files.output(command->add_option("--out", call->out, "MAP.pcd, with --origin MAP.ply: one point for each voxel"))
      ->required();
  command->add_flag("--force", call->force, "replace the file if it exists");
  add_origin(*command, "subtracted from trajectories; added to the map's points", call->origin_m);
  command->add_option("--voxel-m", call->voxel_m, "edge of the voxels in which points are averaged, metres")
      ->capture_default_str();
  command->add_option("--min-points", call->min_points, "voxels with fewer points are no part of the map")
      ->capture_default_str();
  command->add_option("--max-range", call->max_range_m,
                      "largest range of LiDAR points, metres (default: that of the platform file)");
  command->add_flag("--keep-moving", call->keep_moving,
                    "keep moving objects; the logs are then read once instead of twice");
  at_least_one(command->add_option("--threads", call->threads,
                                   "number of threads (default: all); the map does not depend on it"));
  command->footer(R"(
Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel`:
  lodestone map cloud /tmp/tunnel/log.bag --trajectory /tmp/tunnel/truth.tum --platform /tmp/tunnel/platform.yaml \
      --out /tmp/tunnel/map.pcd
  lodestone map cloud /tmp/tunnel/log.bag --trajectory /tmp/tunnel/truth.tum --platform /tmp/tunnel/platform.yaml \
      --out /tmp/tunnel/coarse.pcd --voxel-m 0.1 --max-range 30 --keep-moving)");
  command->callback([call] { map_cloud(*call); });
}

}  // namespace lodestone
