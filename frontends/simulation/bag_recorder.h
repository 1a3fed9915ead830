#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/measurements.h"

namespace lodestone::simulation {

/// Writes measurements as the ROS 1 bag (LZ4) of a real robot: sensor_msgs/PointCloud2 with Ouster's fields (x, y, z,
/// intensity, t in ns since the stamp, ring), Imu, and one MagneticField topic (tesla) a magnetometer.
class BagRecorder {
 public:
  struct Topics {
    std::string lidar;
    std::string imu;
    std::vector<std::string> magnetometers;
  };

  /// Throws InputError where the file cannot be written. It gets its name in close(); without, nothing is left.
  BagRecorder(const std::string& path, Topics topics);
  ~BagRecorder();

  void write(const Measurement& measurement);
  void close();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::simulation
