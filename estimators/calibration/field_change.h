#pragma once

#include <vector>

#include "estimators/calibration/calibration_problem.h"

namespace lodestone {

/// How large a change of the map is by its information and gradient, see change_size().
struct ChangeSize {
  double size_ut = 0.0;  ///< standard deviation of its components that makes the log most likely
  double p_value = 1.0;  ///< of such a likelihood without any change
};

/// The size of a change x (µT, each component drawn with this standard deviation) by type-II maximum likelihood.
/// `information` is of the log about x without a prior, and `gradient` that information times the estimate of x without
/// a prior. A component that the log does not determine has no say.
ChangeSize change_size(const Eigen::Matrix4d& information, const Eigen::Vector4d& gradient);

/// A cell of the map that the array came through, and by how much the calibrated magnetometers together differ there.
struct ComparedPlace {
  Vector3 centre_m = Vector3::Zero();       ///< mean place of the array, map axes
  std::size_t moments = 0;                  ///< of the array here
  Vector3 difference_ut = Vector3::Zero();  ///< measured minus map, map axes
  double sigma_ut = 0.0;                    ///< of a component, root mean square
  double p_value = 1.0;                     ///< of such a difference where the field is as mapped
  bool changed = false;                     ///< p_value below field_change_probability
};

/// What all magnetometers share against the map: it is the map's, not theirs.
struct FieldChange {
  bool compared = false;                 ///< against a map, with several magnetometers
  bool everywhere = false;               ///< the map as a whole differs, significantly and by three of its sigmas
  double p_value = 1.0;                  ///< of such a scale and offset without a change
  MapChange change = MapChange::Zero();  ///< zero unless `everywhere`
  MapChange sigma = MapChange::Zero();
  double difference_ut = 0.0;         ///< root mean square of what all magnetometers share, over the places
  std::vector<ComparedPlace> places;  ///< in the order of the drive
  std::vector<int> like_sensors;      ///< axes of the map along which a change would look as all magnetometers' offset

  std::size_t changed_places() const;
  bool found() const { return everywhere || changed_places() > 0; }
};

/// False alarm rate of each of the tests.
constexpr double field_change_probability = 1e-3;

/// Compares calibrated readings with the map, place by place. `calibrations`: of each magnetometer;
/// `usual_error_covariances`: of what each still reads beside the field, magnetometer axes.
std::vector<ComparedPlace> compare_places(const CalibrationLog& log, const FieldProcess& process,
                                          const std::vector<MagnetometerCalibration>& calibrations,
                                          const std::vector<Matrix3>& usual_error_covariances);

}  // namespace lodestone
