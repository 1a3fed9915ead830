#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "tests/estimators/drive.h"
#include "tests/estimators/weak_imu/imu_grades.h"

namespace lodestone::weak_imu {

/// Parameters of a drive.
struct DriveChoice {
  ImuGrade imu;
  double scan_period_s = 0.1;  ///< also the duration of a turn of the LiDAR
  double speed_m_s = 1.5;
  double duration_s = 20.0;
  bool with_field = false;
};

/// A path around a square with rounded corners in the middle of a hall, from rest: seven seconds per side, corners as
/// tight as the robot may turn at that speed. Robot and map use the same seed.
class Site {
 public:
  Site(const std::string& reality_grade, std::uint64_t seed);

  testing::Drive drive(const DriveChoice& choice) const;

 private:
  std::uint64_t seed_;
  simulation::World world_;
  std::shared_ptr<const simulation::Environment> environment_;
  std::shared_ptr<const PlaneMap> planes_;
};

}  // namespace lodestone::weak_imu
