#pragma once

#include <vector>

#include "core/evaluation/array_log.h"
#include "core/geometry/trajectory.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/sensor_suite.h"
#include "estimators/calibration/calibration_options.h"

namespace lodestone {

/// One reading of one magnetometer.
struct MomentReading {
  int magnetometer = 0;
  Vector3 measured_ut = Vector3::Zero();  ///< magnetometer axes
  Vector3 known_ut = Vector3::Zero();     ///< the map's field at its position, imu axes; zero without a map
  double sigma_ut = 1.0;                  ///< white noise of this reading, per component
};

/// The readings of the array at one time, and the motion since the previous moment.
struct CalibrationMoment {
  Time time = 0;
  std::vector<MomentReading> readings;
  bool follows = false;  ///< whether the motion below is known; otherwise a new stretch of the log begins here
  Quaternion turn = Quaternion::Identity();  ///< transforms imu axes at this moment to those at the previous one
  Matrix3 turn_by_bias = Matrix3::Zero();    ///< turn(bias) = turn Exp(turn_by_bias · gyroscope bias)
  double turn_sigma = 0.0;                   ///< rad, from the gyroscope's white noise
  double moved_m = 0.0;                      ///< with a map: path of the array's centre since the previous moment
  double map_sigma_ut = 0.0;  ///< with a map: sigma of its field here, per component; inflated for repeated passes
  double passes = 1.0;        ///< with a map: number of passes of the array through this place
  std::size_t place = 0;      ///< with a map: index of the cell of the array's centre
  Pose T_map_centre;          ///< with a map: of the array's centre, imu axes
};

/// Input of a calibration.
struct CalibrationLog {
  bool mapped = false;  ///< the reference is a map
  std::vector<MagnetometerModel> magnetometers;
  Vector3 centre_m = Vector3::Zero();      ///< of the array, imu axes
  std::vector<CalibrationMoment> moments;  ///< in order of time, each with at least one reading
  std::size_t places = 0;   ///< with a map: number of visited cells, whose edge is twice the map's correlation length
  std::size_t off_map = 0;  ///< discarded readings: no map at their position
  std::size_t without_motion = 0;  ///< discarded moments: no pose, or no IMU, at their time
};

/// A log without a map: the references are its gyroscope and the joint readings of the magnetometers. `imu` in order of
/// time. At most options.max_moments moments, evenly distributed.
CalibrationLog turning_log(const ArrayLog& readings, const std::vector<ImuSample>& imu, const SensorSuite& suite,
                           const CalibrationOptions& options);

/// A log whose reference is the map at each magnetometer's pose. `trajectory`: T_map_imu.
CalibrationLog mapped_log(const ArrayLog& readings, const Trajectory& trajectory, const MagneticMap& map,
                          const SensorSuite& suite, const CalibrationOptions& options);

}  // namespace lodestone
