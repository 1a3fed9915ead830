#pragma once

namespace lodestone {

/// Which sensors a run needs. A log may lack those that it does not.
struct SensorChoice {
  bool lidar = true;
  bool imu = true;
  bool magnetometers = true;
};

}  // namespace lodestone
