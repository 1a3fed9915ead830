#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "bindings/bindings.h"
#include "bindings/interrupts.h"
#include "bindings/measurements.h"
#include "core/error.h"
#include "core/lidar/voxel_planes.h"
#include "core/mapping/free_space.h"
#include "core/option_checks.h"
#include "core/thread_limit.h"
#include "frontends/maps/point_cloud_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/scan_survey.h"
#include "localization/measurement_list.h"

namespace lodestone::python {

namespace {

constexpr SensorChoice lidar_only{.lidar = true, .imu = false, .magnetometers = false, .wheels = false};

py::array_t<float> array_of_points(const std::vector<Eigen::Vector3f>& points) {
  return array_of<float>(points, 3, [](const Eigen::Vector3f& one, float* out) {
    for (int i = 0; i < 3; ++i) out[i] = one(i);
  });
}

/// A survey drive: a log or measurements in memory, and the trajectory T_map_imu.
struct CloudDrive {
  std::string log;  ///< empty: measurements in memory
  std::vector<Measurement> scans;
  Trajectory trajectory;

  std::unique_ptr<MeasurementSource> open(const Platform& platform, WarningLog& warnings) const {
    if (log.empty()) return std::make_unique<MeasurementList>(scans, platform.suite);
    return std::make_unique<BagSource>(log, platform, warnings, lidar_only, LogPause::is_bridged);
  }
};

/// (log or Measurements, stamp_ns, position_m, quaternion_xyzw).
CloudDrive drive_of(const py::tuple& arguments) {
  CloudDrive drive;
  if (py::isinstance<py::str>(arguments[0])) {
    drive.log = arguments[0].cast<std::string>();
  } else {
    for (const LidarScan* scan : arguments[0].cast<const Measurements&>().all<LidarScan>()) {
      drive.scans.emplace_back(*scan);
    }
  }
  drive.trajectory = trajectory_argument(arguments[1], arguments[2], arguments[3]);
  return drive;
}

using RaySink = std::function<void(std::span<const LidarRay>)>;

/// Returns the number of points with a pose.
std::int64_t read_drives(const std::vector<CloudDrive>& drives, const Platform& platform, double max_gap_s,
                         const RaySink& use) {
  Interrupts interrupts;
  std::int64_t points = 0;
  for (const CloudDrive& drive : drives) {
    WarningLog warnings;
    points += read_scans(*drive.open(platform, warnings), drive.trajectory, platform.suite, from_seconds(max_gap_s),
                         use, [&](Time) { interrupts.check(); })
                  .points;
  }
  return points;
}

std::vector<VoxelMean> build_cloud(const std::vector<CloudDrive>& drives, const Platform& platform, double voxel_m,
                                   int min_points, double max_gap_s, bool keep_moving) {
  option_checks::within("voxel_m", voxel_m, 0.01, 0.5);
  option_checks::within("min_points", min_points, 1, 1000);
  for (const CloudDrive& drive : drives) {
    for (const StampedPose& pose : drive.trajectory) {
      if (pose.pose.position.cwiseAbs().maxCoeff() < voxels_reach_m(voxel_m)) continue;
      throw InputError(
          fmt::format("trajectory: a pose is {:.0f} m from the origin; expected less than {:.0f} m; "
                      "subtract one shift from all positions",
                      pose.pose.position.norm(), voxels_reach_m(voxel_m)));
    }
  }
  VoxelMeans means(voxel_m);
  const std::int64_t points = read_drives(drives, platform, max_gap_s, [&](std::span<const LidarRay> rays) {
    for (const LidarRay& ray : rays) means.add(ray.end);
  });
  if (points == 0) {
    throw InputError(
        "no point of the scans has a pose within the range of the LiDAR; check that the trajectory is of "
        "this drive and clock, and check lidar.min_range_m and lidar.max_range_m");
  }
  std::vector<VoxelMean> kept = means.means(min_points);
  if (kept.empty()) {
    throw InputError(
        fmt::format("no voxel of {:g} m has {} points; lower min_points, or raise voxel_m", voxel_m, min_points));
  }
  if (keep_moving) return kept;
  FreeSpace space(std::move(kept), voxel_m);
  read_drives(drives, platform, max_gap_s, [&](std::span<const LidarRay> rays) { space.add_scan(rays); });
  return space.occupied();
}

py::array_t<float> build_cloud_map(const py::list& drives, Platform platform, double voxel_m, int min_points,
                                   std::optional<double> max_range_m, double max_gap_s, bool keep_moving, int threads) {
  std::vector<CloudDrive> all;
  for (const py::handle& one : drives) all.push_back(drive_of(one.cast<py::tuple>()));
  if (max_range_m) platform.suite.set_max_range(*max_range_m);
  std::vector<Eigen::Vector3f> points;
  {
    const py::gil_scoped_release unlocked;
    const ThreadLimit limit(threads);
    for (const VoxelMean& mean : build_cloud(all, platform, voxel_m, min_points, max_gap_s, keep_moving)) {
      points.push_back(mean.position);
    }
  }
  return array_of_points(points);
}

}  // namespace

void bind_cloud_maps(py::module_& module) {
  module.def(
      "read_point_cloud",
      [](const std::string& path) {
        WarningLog warnings;
        std::vector<Eigen::Vector3f> points;
        {
          const py::gil_scoped_release unlocked;
          points = read_point_cloud(path, warnings);
        }
        return array_of_points(points);
      },
      py::arg("path"));
  module.def(
      "write_point_cloud",
      [](const std::string& path, const py::object& points_m) {
        const Array<float> values = table_argument<float>(points_m, "points_m", 3);
        std::vector<Eigen::Vector3f> points;
        points.reserve(static_cast<std::size_t>(values.shape(0)));
        for (py::ssize_t i = 0; i < values.shape(0); ++i) points.emplace_back(values.data(i, 0));
        const py::gil_scoped_release unlocked;
        write_point_cloud(path, points);
      },
      py::arg("path"), py::arg("points_m"));
  module.def("build_cloud_map", &build_cloud_map, py::arg("drives"), py::arg("platform"), py::arg("voxel_m"),
             py::arg("min_points"), py::arg("max_range_m"), py::arg("max_gap_s"), py::arg("keep_moving"),
             py::arg("threads"));
}

}  // namespace lodestone::python
