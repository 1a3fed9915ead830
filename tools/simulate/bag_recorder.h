#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "frontends/configuration/platform.h"
#include "tools/simulate/sensor_options.h"

namespace lodestone::simulation {

/// Message type and fields of a log's scans.
enum class ScanFormat {
  ouster,       ///< PointCloud2: x, y, z, intensity, t (uint32, ns since the stamp), ring
  livox,        ///< PointCloud2: x, y, z, intensity, tag, line, timestamp (float64, ns: steps of 256 ns in these years)
  livox_custom  ///< livox_ros_driver2/CustomMsg: offset_time (ns since the stamp), x, y, z, reflectivity, tag, line
};

/// The format that a world's LiDAR options select.
ScanFormat scan_format(const LidarOptions& options);
LidarMessageLayout message_layout(ScanFormat format);

/// Writes measurements as a ROS 1 bag (LZ4): scans in one of the formats above, sensor_msgs/Imu, and one MagneticField
/// topic (tesla) per magnetometer.
class BagRecorder {
 public:
  struct Topics {
    std::string lidar;
    std::string imu;
    std::vector<std::string> magnetometers;
    std::string wheels{};  ///< nav_msgs/Odometry
  };

  /// Throws InputError if the file cannot be written. close() gives the file its name; without close(), no file is
  /// left.
  BagRecorder(const std::string& path, Topics topics, ScanFormat format = ScanFormat::ouster);
  ~BagRecorder();

  void write(const Measurement& measurement);
  void close();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::simulation
