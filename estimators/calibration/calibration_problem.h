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

/// How each magnetometer's readings are weighed.
struct ReadingWeights {
  double sigma_scale = 1.0;  ///< over the sigma of its white noise
  double huber = 3.5;        ///< in units of what comes out
};

/// Readings, the field's steps and priors as one problem of least squares, solved by Ceres.
///
/// Without a map the field is known up to what all magnetometers distort alike, and a distortion that makes every
/// reading larger must not make the field's steps smaller. So the field's state is what the array as a whole reads;
/// each magnetometer is calibrated against that (their mean distortion is held at none), and the common distortion
/// enters the steps alone (FieldStepFactor). Outside, parameters are those of each magnetometer against the field.
///
/// With a map the field may have changed since the survey: by a scale and an offset in map axes (MapChange), and at
/// each moment by an error that all magnetometers share. An offset of the map's axes turns against the robot, which an
/// offset of all magnetometers does not. A scale of all magnetometers looks like one of the field; priors divide it.
class CalibrationProblem {
 public:
  CalibrationProblem(const CalibrationLog& log, const CalibrationOptions& options);
  ~CalibrationProblem();
  CalibrationProblem(const CalibrationProblem&) = delete;
  CalibrationProblem& operator=(const CalibrationProblem&) = delete;

  /// Back to where it began: no calibration, no slope, the readings' mean for the field.
  void reset();

  /// Solves from where the last solution was. `held`: rows × 12 a magnetometer with readings, in their order; what
  /// these rows make of the parameters is held at zero. May be empty. At most `iterations` steps: few will do before
  /// weights change.
  void solve(const FieldProcess& process, const std::vector<ReadingWeights>& weights, const Eigen::MatrixXd& held,
             int iterations);

  /// The information that all but the priors of the parameters gives about the parameters of the magnetometers with
  /// readings, in their order, at the last solution; everything else is marginalized. What the gyroscope's noise
  /// pretends to show is taken off: were the robot never tilted, noise would tilt it a little with every step.
  Eigen::MatrixXd information(const FieldProcess& process, const std::vector<ReadingWeights>& weights);

  /// The information of log and priors about the change of the map (4, see MapChange); all else is marginalized.
  Eigen::Matrix4d map_change_information(const FieldProcess& process, const std::vector<ReadingWeights>& weights);

  /// Sigma of the prior of all these parameters.
  Eigen::VectorXd prior_sigma() const;

  /// Indices of the magnetometers with readings.
  const std::vector<int>& active() const { return active_; }

  /// Parameters of each magnetometer of the suite against the field, to first order in the distortions; zero without
  /// readings.
  std::vector<CalibrationParameters> parameters() const;

  /// D and b of each in full.
  MagnetometerCalibration calibration(std::size_t magnetometer) const;

  /// What the array reads, or the map's error; see the class.
  const FieldStates& states() const { return states_; }

  /// The field at a reading's place by the array's own states, without a map; with one the map's with its change.
  /// Magnetometer axes, µT.
  Vector3 reference(std::size_t moment, const MomentReading& reading) const;

  /// A reading less what the problem makes of it, in units of its white noise.
  Vector3 residual(std::size_t moment, const MomentReading& reading) const;

  /// The distortion that all magnetometers share, imu axes; none with a map.
  Matrix3 common_distortion() const { return distortion_matrix(common_); }

  const Vector3& gyroscope_bias() const { return gyroscope_bias_; }

  /// How the field differs from the map everywhere; none without a map or with a single magnetometer.
  const MapChange& map_change() const { return map_change_; }

  /// Whether the log can tell a change of the map from errors of magnetometers: against a map, with several of them.
  bool with_map_change() const { return log_.mapped && active_.size() > 1; }

  /// With a map: its error along the log where nothing has changed, root mean square of a component.
  double map_error_ut(const FieldProcess& process) const;

  /// With a map: its mean field along the log, map axes.
  const Vector3& mean_field_ut() const { return mean_field_ut_; }

  /// Prior sigma of the map's change, in its own units: map_change_ut for the offset and for the scale's share of the
  /// field that is usual here.
  MapChange map_change_sigma(const FieldProcess& process) const;

 private:
  /// Of all but the priors, by own parameters, then the common distortion (without a map) or the map's change (with
  /// one).
  Eigen::MatrixXd information_of_own(const FieldProcess& process, const std::vector<ReadingWeights>& weights);
  void start();
  void find_anomalies();
  void add_readings(ceres::Problem& problem, const FieldProcess& process, const std::vector<ReadingWeights>& weights,
                    std::vector<std::unique_ptr<ceres::LossFunction>>& losses);
  void add_steps(ceres::Problem& problem, const FieldProcess& process);
  void add_priors(ceres::Problem& problem, const FieldProcess& process, const Eigen::MatrixXd& held);
  void take_off_turn_noise(const FieldProcess& process, int state_size, Eigen::SparseMatrix<double>& information) const;
  Eigen::MatrixXd total_by_own() const;
  Eigen::MatrixXd own_by_total() const;
  /// What the change of the map, and its errors' share of its variation, add to the field at a reading's place.
  /// Magnetometer axes, µT.
  Vector3 field_change(std::size_t moment, const MomentReading& reading) const;
  double variation_sigma(const FieldProcess& process) const;
  double reading_sigma(std::size_t moment, const MomentReading& reading) const;
  std::optional<Matrix3> last_distortion(std::size_t magnetometer) const;
  Vector3 field_of(std::size_t moment, const MomentReading& reading, const Matrix3& common_inverse) const;

  const CalibrationLog& log_;
  const CalibrationOptions& options_;
  bool with_slope_ = false;
  std::vector<int> active_;
  std::vector<CalibrationParameters> own_;  ///< of each magnetometer, against what the array reads
  Eigen::Matrix<double, 5, 3, Eigen::RowMajor> coupling_ = Eigen::Matrix<double, 5, 3, Eigen::RowMajor>::Zero();  ///< K
  std::vector<Vector3> anomalies_ut_;       ///< a of each moment, see CalibratedReadingFactor
  Distortion common_ = Distortion::Zero();  ///< A, imu axes
  Vector3 gyroscope_bias_ = Vector3::Zero();
  MapChange map_change_ = MapChange::Zero();
  std::vector<Matrix3> last_distortions_;    ///< D₀ of CalibratedReadingFactor, where the last solution began
  std::vector<double> place_excess_;         ///< with a map: of each place's sigma over the usual one, last solution
  double variation_ = 0.0;                   ///< v of CalibratedReadingFactor
  Vector3 mean_field_ut_ = Vector3::Zero();  ///< with a map: of its field along the log, map axes
  double map_variance_ut2_ = 0.0;            ///< about it, a component
  double usual_field_ut_ = 1.0;              ///< with a map: root mean square of its field along the log
  FieldStates states_;
};

}  // namespace lodestone
