#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/nav_state.h"
#include "core/imu/preintegration.h"
#include "core/lidar/lidar_correction.h"
#include "core/observability/window_information.h"
#include "core/time.h"
#include "core/wheels/wheel_reading.h"
#include "factors/calibration_estimate.h"
#include "factors/condensed_lidar_factor.h"
#include "factors/field_factor.h"
#include "factors/marginalization.h"
#include "factors/pose_factor.h"
#include "factors/pose_mask.h"
#include "factors/window_options.h"

namespace lodestone {

class SparseInformation;

/// The factor graph over the last keyframes and the Ceres problem that solves it. The problem persists; blocks and
/// factors are added and removed. Results do not depend on addresses or threads. All keyframes share one gravity and
/// one calibration; the calibration's parts with a nonzero sigma are estimated. Magnetometer biases are constant over
/// epochs that a random walk connects. The map error that scans share is constant over stretches of the path that a
/// Gauss-Markov process connects.
class SlidingWindow {
 public:
  /// Starts with one keyframe whose state has the `covariance` (tangent order φ, p, v, b_g, b_a, g). `calibration`:
  /// uncertainty of the platform file.
  SlidingWindow(Time time, const NavState& state, const Matrix17& covariance, int magnetometers, const ImuNoise& noise,
                const SlidingWindowOptions& options, const CalibrationSigmas& calibration = exact_calibration());
  ~SlidingWindow();
  SlidingWindow(const SlidingWindow&) = delete;
  SlidingWindow& operator=(const SlidingWindow&) = delete;

  /// Sets the IMU noise for keyframes that are added afterwards.
  void set_imu_noise(const ImuNoise& noise) { noise_ = noise; }

  /// Adds a keyframe and its IMU factor to the newest one.
  void add_keyframe(Time time, const NavState& state, std::span<const ImuSample> samples);

  /// Sets or replaces keyframe k's LiDAR factor; without correspondences the factor is removed. `correspondences` are
  /// used only with one residual per point; these factors depend on the pose alone. If the scan depends on a keyframe
  /// that has left the window, its factor is part of the prior and the call has no effect.
  void set_lidar(std::size_t k, const CondensedScan& scan, const std::vector<Correspondence>& correspondences,
                 const PoseMask& mask);

  /// Replaces the mask of keyframe k's LiDAR factor, if it has one.
  void set_lidar_mask(std::size_t k, const PoseMask& mask);

  /// Sets the slide of the prior (PriorFactor::follow).
  void follow_slide(const Slide& slide);

  /// Sets or replaces keyframe k's field factor; without readings the factor is removed.
  void set_field(std::size_t k, std::shared_ptr<const MagneticMap> map, FieldInterpolation interpolation,
                 const std::vector<FieldReading>& readings, const PoseMask& mask);

  /// Sets or replaces the pose measured by the field at keyframe k, instead of a field factor.
  void set_field_pose(std::size_t k, const MeasuredPose& measured, const PoseMask& mask);

  /// Sets or replaces keyframe k's wheel factor. `slip_jump`: sigma by which the slip may have jumped at this keyframe,
  /// relative to the velocity; 0: no jump. A replaced factor keeps its jump.
  void set_wheels(std::size_t k, const WheelReading& reading, double slip_jump);

  /// Minimizes the cost by Ceres; returns the number of iterations. Ends with a step that lowers ½ Σ r² by less than
  /// 0.005. Integrates IMU factors again if their biases have left the linear range.
  int solve();

  /// The variables that a partial solve changes.
  enum class Part {
    states,        ///< all but the magnetometers' calibration
    magnetometers  ///< the biases and matrices of the magnetometers
  };

  /// As `solve`, with the other variables constant: one step of an alternating minimization.
  int solve_part(Part part);

  /// ½ Σ r² over all factors, with their present weights.
  double cost() const;

  /// Names of the solver, the linear solver and its libraries: "ceres 2.1.0, SPARSE_NORMAL_CHOLESKY (SUITE_SPARSE;
  /// OpenBLAS 0.3.21, Zen)".
  static std::string solver_description();

  /// Pose covariances (φ, p) of the given keyframes, from one factorization of the whole window (SparseInformation),
  /// including the effect of map errors over tens of metres. Never throws: an unobservable direction has a very large
  /// variance.
  std::vector<Matrix6> pose_covariances(std::span<const std::size_t> keyframes) const;

  /// Joint covariance of the newest keyframe's pose and motion and of gravity, in tangent order φ, p, v, b_g, b_a, g;
  /// and the same with the pose of its scan in the map instead of its pose. Without map errors over tens of metres,
  /// which the next scan shares.
  struct NewestCovariance {
    Matrix17 state;
    Matrix17 seen;
    /// Of the wheels' calibration at the next keyframe: scale_sigma with slip, slip_sigma of the slip's step.
    WheelCalibrationSigmas wheels;
  };
  NewestCovariance newest_covariance() const;

  /// Pose of keyframe k's scan in the map: its pose, moved by calibration and map error.
  Pose seen_pose(std::size_t k) const;

  /// Covariance of seen_pose(k), φ, p.
  Matrix6 seen_covariance(std::size_t k) const;

  /// The map's error at keyframe k (φ in map axes, p); for a keyframe without LiDAR factor, the last one.
  Vector6 map_error(std::size_t k) const;

  /// Sets a keyframe's state, and the gravity of all keyframes: initial values of a batch.
  void set_state(std::size_t k, const NavState& state);

  /// Sets the biases of keyframe k's epoch, µT, one per magnetometer. No effect without a field factor or bias states.
  void set_magnetometer_biases(std::size_t k, std::span<const Vector3> biases_ut);

  /// Removes the oldest keyframe and replaces its factors by a square-root prior.
  void marginalize_oldest();

  std::size_t size() const { return keyframes_.size(); }
  Time time(std::size_t k) const;
  NavState state(std::size_t k) const;
  Vector3 magnetometer_bias(std::size_t k, int magnetometer) const;

  /// Delay of the magnetometers' stamps, and its sigma (as of the last pose_covariances). Zeros if not estimated.
  struct ClockOffset {
    double offset_s = 0.0;
    double sigma_s = 0.0;
  };
  ClockOffset clock_offset() const;

  /// The estimated correction of the LiDAR's calibration; zeros if not estimated.
  LidarCorrection lidar_correction() const;

  /// The estimated slip of the wheels at keyframe k, relative to the velocity; for a keyframe without wheel factor, the
  /// last one. 0: no wheels.
  double wheel_slip(std::size_t k) const;

  /// The estimated correction of the wheels' calibration; the scale includes the slip at keyframe k. Zeros if not
  /// estimated.
  WheelCorrection wheel_correction(std::size_t k) const;

  /// The estimated matrix E of a magnetometer: reading = bias + (1 + E) field.
  Matrix3 magnetometer_matrix(int magnetometer) const;

  /// All estimated calibration, with its joint covariance.
  CalibrationEstimate calibration_estimate() const;

  /// Sets the calibration: initial values of a batch.
  void set_calibration(const CalibrationEstimate& estimate);

  /// Moves all keyframes by a rigid motion of the map, after another place was found to fit.
  void move(const Pose& T_new_old);

  /// The same with the prior: what the window says of its place was wrong, but not what it says of its motion.
  void move_with_prior(const Pose& T_new_old);

  /// The IMU factor between keyframes k and k + 1, linearized at their states.
  ChainLink link(std::size_t k) const;

  /// Information of the prior about the oldest keyframe's pose and motion and gravity, with all else constant: 17×17,
  /// tangent order φ, p, v, b_g, b_a, g. Along an unobservable direction it must never increase.
  Matrix17 prior_information() const;

 private:
  struct KeyframeFactors;
  struct BiasEpoch;
  struct MapErrorEpoch;
  struct SlipEpoch;
  WindowFactor add_residual(std::unique_ptr<ceres::CostFunction> function, std::vector<WindowBlock*> blocks);
  RenewableFactor<FieldFactor> field_factor(KeyframeFactors& keyframe, std::size_t magnetometer,
                                            std::shared_ptr<const MagneticMap> map, FieldInterpolation interpolation,
                                            std::vector<FieldReading> readings, const PoseMask& mask);
  template <class Function>
  RenewableFactor<Function> add_factor(std::unique_ptr<Function> function, std::vector<WindowBlock*> blocks) {
    Function* content = function.get();
    return {add_residual(std::move(function), std::move(blocks)), content};
  }
  template <class Function>
  void remove_factor(RenewableFactor<Function>& factor) {
    if (factor) problem_->RemoveResidualBlock(factor.id);
    factor = {};
  }
  void add_block(WindowBlock& block);
  void remove_block(WindowBlock& block);
  void set_prior(MarginalPrior prior, const Slide& slide);
  BiasEpoch* epoch_at(Time time);
  MapErrorEpoch* map_error_epoch_at(const Vector3& position, const CondensedScan& scan);
  /// Recomputes the rates of motion at a keyframe, for the scans that begin or end there.
  void renew_rates(std::size_t k);
  SlipEpoch* slip_epoch_at(Time time, double jump);
  double slip_step_sigma() const;
  /// The first slip epoch if `oldest` is its last keyframe. Adds its factors and variable to those that are eliminated.
  SlipEpoch* leaving_slip(const KeyframeFactors& oldest, std::vector<WindowFactor>& involved,
                          std::vector<WindowBlock*>& eliminated);
  void remove_slip(SlipEpoch* leaving);
  void remove_lidar(KeyframeFactors& keyframe);
  bool add_imu_axes();  // false: they are not estimated
  ImuAxes imu_axes() const;
  const double* lidar_values() const;                                      // null: not estimated
  static const double* map_error_values(const KeyframeFactors& keyframe);  // the same
  Eigen::MatrixXd seen_jacobian(std::size_t k, std::vector<const WindowBlock*>& blocks) const;
  void add_calibration(WindowBlock& block, WindowFactor& prior, const std::vector<double>& sigmas);
  std::vector<const WindowFactor*> factors() const;
  std::vector<const WindowBlock*> variables_in_order() const;
  /// Of the window as it is now; computed once and valid until the next change.
  const SparseInformation& information() const;
  void changed();

  struct LongErrors;
  LongErrors long_errors() const;
  Eigen::MatrixXd prior_disturbance(const LongErrors& errors) const;
  std::vector<const WindowFactor*> disturbed(const KeyframeFactors& keyframe) const;
  Eigen::MatrixXd disturbance(const KeyframeFactors& keyframe, const WindowFactor& factor,
                              const LinearizedFactor& part) const;
  std::vector<const Eigen::VectorXd*> source_weights(const LongErrors& errors) const;
  std::vector<Eigen::MatrixXd> disturbances(std::span<const WindowFactor> involved, const LongErrors& errors) const;
  MarginalPrior marginalize_disturbed(std::span<const WindowFactor> involved, std::span<WindowBlock* const> eliminated,
                                      bool first_stretch_leaves);
  Eigen::MatrixXd covariance(const SparseInformation& known, std::span<const WindowBlock* const> variables) const;
  void add_long_errors(const SparseInformation& known, std::vector<Matrix6>& poses) const;

  SlidingWindowOptions options_;
  ImuNoise noise_;
  int magnetometers_;
  std::unique_ptr<ceres::Manifold> pose_manifold_;
  std::unique_ptr<ceres::Manifold> gravity_manifold_;
  std::unique_ptr<ceres::EvaluationCallback> evaluation_;  // before the problem, which calls it
  std::unique_ptr<ceres::Problem> problem_;
  WindowBlock gravity_;
  RenewableFactor<PriorFactor> prior_;
  CalibrationSigmas calibration_;
  WindowBlock clock_;  // delay of the magnetometers' stamps, s
  WindowBlock imu_axes_;
  WindowBlock lidar_calibration_;
  std::vector<WindowBlock> matrices_;  // of each magnetometer
  WindowBlock wheel_calibration_;
  // Empty: not estimated, or no measurement yet.
  WindowFactor imu_axes_prior_;
  WindowFactor clock_prior_;
  WindowFactor lidar_calibration_prior_;
  std::vector<WindowFactor> matrices_priors_;
  WindowFactor wheel_calibration_prior_;
  mutable double clock_sigma_s_ = 0.0;
  mutable std::unique_ptr<SparseInformation> known_;
  std::deque<std::unique_ptr<KeyframeFactors>> keyframes_;
  std::deque<std::unique_ptr<BiasEpoch>> epochs_;
  std::deque<std::unique_ptr<MapErrorEpoch>> map_errors_;
  std::deque<std::unique_ptr<SlipEpoch>> slips_;
  // Derivative of the prior's residual by map errors over tens of metres: columns of the sources of the first stretches
  // (LongErrors), six each, then independent ones.
  Eigen::MatrixXd prior_disturbance_;
  Eigen::Index prior_sources_ = 0;
};

}  // namespace lodestone
