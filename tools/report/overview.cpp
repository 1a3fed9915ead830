#include "tools/report/overview.h"

#include <nlohmann/json.hpp>
#include <system_error>

#include "core/evaluation/association.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/point_cloud_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tools/report/cloud_thinning.h"
#include "tools/report/field_raster.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

constexpr std::size_t kFieldLimit = 1'000'000;
constexpr std::size_t kCloudLimit = 150'000;
constexpr double kFinestVoxel = 0.1;    // metres; finer voxels are not visible on a plan
constexpr double kSurroundings = 40.0;  // metres around the drive

/// The drive's surroundings. A lost estimate is ignored if there is a better trajectory.
PlanExtent box_around(const Trajectory& drive) {
  PlanExtent box;
  for (const StampedPose& pose : drive) {
    if (pose.pose.position.allFinite()) box.include(pose.pose.position.x(), pose.pose.position.y());
  }
  return {box.x_low - kSurroundings, box.x_high + kSurroundings, box.y_low - kSurroundings, box.y_high + kSurroundings};
}

}  // namespace

void write_overview(const std::filesystem::path& folder, const OverviewInput& input) {
  made_folder(folder);
  std::error_code error;
  // Files of an earlier run in the same folder must not remain.
  for (const char* name : kOverviewFiles) std::filesystem::remove(folder / name, error);
  nlohmann::ordered_json json;
  json["log_begin_s"] = format_stamp(input.log_begin);
  Trajectory drive;
  if (input.truth != nullptr) {
    drive = truth_at(input.scans, *input.truth);
    if (!drive.empty())
      write_tum((folder / "truth.tum").string(), drive, "the ground truth at scan ends: t_s x_m y_m z_m qx qy qz qw");
  }
  if (drive.empty()) drive = input.estimate;
  if (!drive.empty()) {
    const PlanExtent box = box_around(drive);
    if (input.field != nullptr) {
      const PlanRaster raster = strength_raster(*input.field, mean_height(drive), box, kFieldLimit);
      if (!raster.empty()) write_raster(raster, folder / "field.png");
    }
    if (!input.cloud.empty()) {
      WarningLog told_by_the_run;
      CloudThinning thinning(box, kCloudLimit, kFinestVoxel);
      stream_point_cloud(
          input.cloud, told_by_the_run, [&](std::span<const Eigen::Vector3f> points) { thinning.add(points); },
          input.cloud_origin_m);
      if (!thinning.points().empty()) {
        write_point_cloud((folder / "cloud.pcd").string(), thinning.points());
        json["cloud_voxel_m"] = thinning.voxel_m();
      }
    }
  }
  write_text_file(folder / "overview.json", json.dump(2) + "\n");
}

}  // namespace lodestone
