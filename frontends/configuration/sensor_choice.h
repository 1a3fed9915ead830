#pragma once

namespace lodestone {

/// Sensors that a run requires. Others may be missing in the log.
struct SensorChoice {
  bool lidar = true;
  bool imu = true;
  bool magnetometers = true;
  bool wheels = true;  ///< if the platform has them
};

}  // namespace lodestone
