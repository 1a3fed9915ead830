#pragma once

#include <vector>

#include "estimators/calibration/calibration_problem.h"

namespace lodestone {

/// Size of a change of the map from its information and gradient, see change_size().
struct ChangeSize {
  double size_ut = 0.0;  ///< standard deviation of its components with the highest likelihood
  double p_value = 1.0;  ///< probability of such a likelihood ratio without a change
};

/// The size of a change x (µT, components drawn with this standard deviation) by type-II maximum likelihood.
/// `information`: of the log about x without a prior; `gradient`: that information times the estimate of x without a
/// prior. Components that the log does not determine have no effect.
ChangeSize change_size(const Eigen::Matrix4d& information, const Eigen::Vector4d& gradient);

/// A cell of the map that the array visited, and the mean deviation of all calibrated magnetometers there.
struct ComparedPlace {
  Vector3 centre_m = Vector3::Zero();       ///< mean position of the array, map axes
  std::size_t moments = 0;                  ///< number of moments of the array here
  Vector3 difference_ut = Vector3::Zero();  ///< measured minus map, map axes
  double sigma_ut = 0.0;                    ///< per component, root mean square
  double p_value = 1.0;                     ///< of such a difference in an unchanged field
  bool changed = false;                     ///< p_value below field_change_probability
};

/// Deviations from the map that all magnetometers share: these are attributed to the map.
struct FieldChange {
  bool compared = false;                 ///< there is a map and several magnetometers
  bool everywhere = false;               ///< the whole map deviates, significantly and by three of its sigmas
  double p_value = 1.0;                  ///< of such a scale and offset without a change
  MapChange change = MapChange::Zero();  ///< zero unless `everywhere`
  MapChange sigma = MapChange::Zero();
  double difference_ut = 0.0;         ///< rms over the places of the deviation that all magnetometers share
  std::vector<ComparedPlace> places;  ///< in the order of the drive
  std::vector<int> like_sensors;  ///< axes of the map along which a change cannot be distinguished from a common offset
                                  ///< of all magnetometers

  std::size_t changed_places() const;
  bool found() const { return everywhere || changed_places() > 0; }
};

/// False alarm probability of each test.
constexpr double field_change_probability = 1e-3;

/// Compares calibrated readings with the map at each place. `calibrations`: of each magnetometer;
/// `usual_error_covariances`: of each one's remaining error in the usual field, magnetometer axes.
std::vector<ComparedPlace> compare_places(const CalibrationLog& log, const FieldProcess& process,
                                          const std::vector<MagnetometerCalibration>& calibrations,
                                          const std::vector<Matrix3>& usual_error_covariances);

}  // namespace lodestone
