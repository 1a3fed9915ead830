#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/sensor_suite.h"
#include "estimators/options.h"
#include "estimators/smoother/field_weighting.h"
#include "factors/sliding_window.h"

namespace lodestone {

/// Poses of a sliding window and the calibration of each magnetometer, estimated in alternation. A reading is modelled
/// as bias + (1 + E) field: hard iron and soft iron. The joint cost is ½ Σ ρ(|r|/σ) over readings, ρ Huber's, plus the
/// costs of the IMU, of the window's prior and of the calibration's prior, which is the platform file's calibration.
/// Both steps minimize this cost with Huber weights as of their begin (iteratively reweighted least squares).
class CalibratingWindow {
 public:
  /// Starts with one keyframe whose state has the `covariance` (tangent order φ, p, v, b_g, b_a, g). `suite` must
  /// outlive this.
  CalibratingWindow(Time time, const NavState& state, const Matrix17& covariance, const SensorSuite& suite,
                    std::shared_ptr<const MagneticMap> map, const MagneticOptions& options);

  /// Adds a keyframe at the predicted state, and its IMU factor.
  void add_keyframe(Time time, const NavState& predicted, std::span<const ImuSample> samples);

  /// Sets the readings of the newest keyframe, placed relative to its time. `spacing_m`: distance between consecutive
  /// array readings, over which the map's error is correlated. Statistics of readings on and off the map.
  FieldStatistics set_readings(std::span<const ArrayReading> arrays, double spacing_m);

  /// One Gauss-Newton minimization over states with the calibration constant. Returns the joint cost.
  double localize() { return minimize(SlidingWindow::Part::states); }

  /// Linear least squares over the calibrations with all states constant. Returns the joint cost.
  double calibrate() { return minimize(SlidingWindow::Part::magnetometers); }

  /// Alternates both steps until a round no longer lowers the cost, at most `most_rounds` times. Returns the number of
  /// the solver's iterations.
  int alternate(int most_rounds);

  double joint_cost() const { return window_.cost() + beyond_huber_; }

  /// Mean Huber weight of the newest keyframe's readings, and the rms of their residuals (µT, per component).
  struct Fit {
    double weight = 0.0;
    double residual_rms_ut = 0.0;
  };
  Fit newest_fit() const;

  /// Replaces the oldest keyframe by a prior on the next one and on the calibration.
  void marginalize_oldest();

  const SlidingWindow& window() const { return window_; }

 private:
  double minimize(SlidingWindow::Part part);
  void renew_weights();
  void hold_height(const Pose& T_map_imu);
  Vector3 residual_ut(std::size_t k, const FieldReading& reading) const;

  const SensorSuite& suite_;
  std::shared_ptr<const MagneticMap> map_;
  MagneticOptions options_;       // without the weights of whole array samples
  std::vector<double> crowding_;  // of the magnetometers
  double huber_threshold_;        // of |r|/σ
  SlidingWindow window_;
  std::deque<std::vector<FieldReading>> readings_;  // of each keyframe, with their present weights
  double beyond_huber_ = 0.0;  // ½ Σ (ρ(s) − w s²), by which the joint cost exceeds that of weighted squares
  int iterations_ = 0;
};

}  // namespace lodestone
