#pragma once

#include <vector>

#include "core/evaluation/array_log.h"
#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/sensor_suite.h"
#include "estimators/calibration/calibration_options.h"

namespace lodestone {

/// One reading of one magnetometer at a moment.
struct MomentReading {
  int magnetometer = 0;
  Vector3 measured_ut = Vector3::Zero();  ///< magnetometer axes
  Vector3 known_ut = Vector3::Zero();     ///< the map's field at its place, imu axes; zero without a map
  double sigma_ut = 1.0;                  ///< white noise of this reading, a component
};

/// The array at one moment, and how it came there from the moment before.
struct CalibrationMoment {
  Time time = 0;
  std::vector<MomentReading> readings;
  bool follows = false;                      ///< what is below is known; else a new stretch of the log begins here
  Quaternion turn = Quaternion::Identity();  ///< takes imu axes of this moment to those of the one before
  Matrix3 turn_by_bias = Matrix3::Zero();    ///< turn(bias) = turn Exp(turn_by_bias · gyroscope bias)
  double turn_sigma = 0.0;                   ///< rad, of the gyroscope's white noise
  double moved_m = 0.0;                      ///< with a map: of the array's centre
  double map_sigma_ut = 0.0;  ///< with a map: of the known field here, a component; alike for neighbours, and so often
                              ///< counted as the array passes here
  double passes = 1.0;        ///< with a map: of the array through its place
  std::size_t place = 0;      ///< with a map: index of the cell of the array's centre
  Pose T_map_centre;          ///< with a map: of the array's centre, imu axes
};

/// Everything that a calibration looks at.
struct CalibrationLog {
  bool mapped = false;  ///< readings are held against a map
  std::vector<MagnetometerModel> magnetometers;
  Vector3 centre_m = Vector3::Zero();      ///< of the array, imu axes
  std::vector<CalibrationMoment> moments;  ///< in order of time, each with a reading
  std::size_t places = 0;                  ///< with a map: cells of twice its correlation length that were entered
  std::size_t off_map = 0;                 ///< readings left out: no map at their place
  std::size_t without_motion = 0;          ///< moments left out: no pose, or no IMU, at their time
};

/// A log whose only references are its own gyroscope and what its magnetometers read together. `imu` in order of time.
/// At most options.max_moments moments, evenly spread.
CalibrationLog turning_log(const ArrayLog& readings, const std::vector<ImuSample>& imu, const SensorSuite& suite,
                           const CalibrationOptions& options);

/// A log whose reference is the map at each magnetometer's pose. `trajectory`: T_map_imu.
CalibrationLog mapped_log(const ArrayLog& readings, const Trajectory& trajectory, const MagneticMap& map,
                          const SensorSuite& suite, const CalibrationOptions& options);

}  // namespace lodestone
