#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <optional>
#include <vector>

#include "estimators/calibration/calibration_log.h"
#include "estimators/calibration/field_process.h"

namespace ceres {
class LossFunction;
class Problem;
}  // namespace ceres

namespace lodestone {

/// A magnetometer's parameters: hard iron (µT), then the nine numbers of its distortion (core/calibration).
using CalibrationParameters = Eigen::Matrix<double, 12, 1>;

/// Weights of a magnetometer's readings.
struct ReadingWeights {
  double sigma_scale = 1.0;  ///< relative to the sigma of the white noise
  double huber = 3.5;        ///< in units of the scaled sigma
};

/// Readings, steps of the field and priors as one least-squares problem, solved by Ceres
/// (docs/design/025-magnetometer-calibration.md).
///
/// Without a map, the field is known only up to a distortion that all magnetometers share, and a distortion that
/// increases every reading must not decrease the steps of the field. The state of the field is therefore the reading of
/// the whole array. Each magnetometer is calibrated against this state, with a mean distortion of zero, and the common
/// distortion affects only the steps (FieldStepFactor). In the public interface, parameters are those of each
/// magnetometer against the field.
///
/// With a map, the field may have changed since the survey: by a scale and an offset in map axes (MapChange), and at
/// each moment by an error that all magnetometers share. An offset in map axes rotates relative to the robot, an offset
/// of all magnetometers does not. A scale of all magnetometers is equivalent to a scale of the field; the priors divide
/// it between both.
class CalibrationProblem {
 public:
  CalibrationProblem(const CalibrationLog& log, const CalibrationOptions& options);
  ~CalibrationProblem();
  CalibrationProblem(const CalibrationProblem&) = delete;
  CalibrationProblem& operator=(const CalibrationProblem&) = delete;

  /// Resets to the initial values: no calibration, no gradient, the mean of the readings as field.
  void reset();

  /// Solves from the last solution. `held`: rows × (12 per magnetometer with readings, in their order); the products of
  /// these rows with the parameters are constrained to zero. May be empty. At most `iterations` steps; few suffice
  /// before the weights change.
  void solve(const FieldProcess& process, const std::vector<ReadingWeights>& weights, const Eigen::MatrixXd& held,
             int iterations);

  /// The information of the log, without priors of the parameters, about the parameters of the magnetometers with
  /// readings, in their order, at the last solution; all else is marginalized. The spurious information from gyroscope
  /// noise is subtracted: without it, noise would seem to tilt a robot that never tilts.
  Eigen::MatrixXd information(const FieldProcess& process, const std::vector<ReadingWeights>& weights);

  /// The information of log and priors about the change of the map (4, see MapChange); all else is marginalized.
  Eigen::Matrix4d map_change_information(const FieldProcess& process, const std::vector<ReadingWeights>& weights);

  /// Prior sigmas of all these parameters.
  Eigen::VectorXd prior_sigma() const;

  /// Indices of the magnetometers with readings.
  const std::vector<int>& active() const { return active_; }

  /// Parameters of each magnetometer against the field, to first order in the distortions; zero without readings.
  std::vector<CalibrationParameters> parameters() const;

  /// Exact D and b of a magnetometer.
  MagnetometerCalibration calibration(std::size_t magnetometer) const;

  /// The array's readings, or the map's error; see the class.
  const FieldStates& states() const { return states_; }

  /// The field at a reading's position: without a map from the array's states, with a map its field with the estimated
  /// change. Magnetometer axes, µT.
  Vector3 reference(std::size_t moment, const MomentReading& reading) const;

  /// Residual of a reading in units of its white noise.
  Vector3 residual(std::size_t moment, const MomentReading& reading) const;

  /// The distortion that all magnetometers share, imu axes; identity with a map.
  Matrix3 common_distortion() const { return distortion_matrix(common_); }

  const Vector3& gyroscope_bias() const { return gyroscope_bias_; }

  /// Change of the field against the map, the same everywhere; zero without a map or with a single magnetometer.
  const MapChange& map_change() const { return map_change_; }

  /// Whether a change of the map can be distinguished from errors of magnetometers: with a map and several
  /// magnetometers.
  bool with_map_change() const { return log_.mapped && active_.size() > 1; }

  /// With a map: its error along the log at unchanged places, rms per component, µT.
  double map_error_ut(const FieldProcess& process) const;

  /// With a map: its mean field along the log, map axes.
  const Vector3& mean_field_ut() const { return mean_field_ut_; }

  /// Prior sigma of the map's change, in its own units: map_change_ut for the offset, and for the scale times the usual
  /// field.
  MapChange map_change_sigma(const FieldProcess& process) const;

 private:
  /// Information of all but the priors about the own parameters, then the common distortion (without a map) or the
  /// map's change (with a map).
  Eigen::MatrixXd information_of_own(const FieldProcess& process, const std::vector<ReadingWeights>& weights);
  void start();
  void find_anomalies();
  void add_readings(ceres::Problem& problem, const FieldProcess& process, const std::vector<ReadingWeights>& weights,
                    std::vector<std::unique_ptr<ceres::LossFunction>>& losses);
  void add_steps(ceres::Problem& problem, const FieldProcess& process);
  void add_priors(ceres::Problem& problem, const FieldProcess& process, const Eigen::MatrixXd& held);
  void subtract_turn_noise(const FieldProcess& process, int state_size, Eigen::SparseMatrix<double>& information) const;
  Eigen::MatrixXd total_by_own() const;
  Eigen::MatrixXd own_by_total() const;
  /// Sum of the map's change and its errors' share of its variation at a reading's position. Magnetometer axes, µT.
  Vector3 field_change(std::size_t moment, const MomentReading& reading) const;
  double variation_sigma(const FieldProcess& process) const;
  double reading_sigma(std::size_t moment, const MomentReading& reading) const;
  std::optional<Matrix3> last_distortion(std::size_t magnetometer) const;
  Vector3 field_of(std::size_t moment, const MomentReading& reading, const Matrix3& common_inverse) const;

  const CalibrationLog& log_;
  const CalibrationOptions& options_;
  bool with_slope_ = false;
  std::vector<int> active_;
  std::vector<CalibrationParameters> own_;  ///< of each magnetometer, against the array's reading
  Eigen::Matrix<double, 5, 3, Eigen::RowMajor> coupling_ = Eigen::Matrix<double, 5, 3, Eigen::RowMajor>::Zero();  ///< K
  std::vector<Vector3> anomalies_ut_;       ///< a of each moment, see CalibratedReadingFactor
  Distortion common_ = Distortion::Zero();  ///< A, imu axes
  Vector3 gyroscope_bias_ = Vector3::Zero();
  MapChange map_change_ = MapChange::Zero();
  std::vector<Matrix3> last_distortions_;  ///< D₀ of CalibratedReadingFactor, from before the last solution
  std::vector<double> place_excess_;       ///< with a map: each place's sigma above the usual one, at the last solution
  double variation_ = 0.0;                 ///< v of CalibratedReadingFactor
  Vector3 mean_field_ut_ = Vector3::Zero();  ///< with a map: mean of its field along the log, map axes
  double map_variance_ut2_ = 0.0;            ///< variance of that field, per component
  double usual_field_ut_ = 1.0;              ///< with a map: rms of its field along the log
  FieldStates states_;
};

}  // namespace lodestone
