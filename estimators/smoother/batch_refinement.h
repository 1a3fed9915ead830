#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "estimators/initialization/initialization.h"
#include "estimators/smoother/keyframe_measurements.h"

namespace lodestone {

/// The whole log as one problem, once the window has passed over it: every keyframe's condensed LiDAR factor, IMU and
/// field factors, and the start, with scans deskewed and associated anew, weights, masks and IMU integrals renewed at
/// the refined states, until nothing moves. Linear in the log's length in time and memory: it keeps the sampled points
/// of each scan.
class BatchRefinement {
 public:
  /// Told how much of the work is done (0 to 1); false ends it.
  using Progress = std::function<bool(double share)>;

  /// `start`: what was known at the first keyframe before its measurements. `input` and `measurements` must outlive
  /// this.
  BatchRefinement(const EstimatorInput& input, const KeyframeMeasurements& measurements, const InitialState& start);

  /// The next keyframe as it leaves the window; `keyframe->estimate` is the window's, `biases_ut` the magnetometers'.
  void add(std::unique_ptr<Keyframe> keyframe, std::vector<Vector3> biases_ut);

  /// Where the calibration begins: the window's last word.
  void set_calibration(const CalibrationEstimate& calibration) { calibration_ = calibration; }

  /// What the last refinement found.
  const CalibrationEstimate& calibration() const { return calibration_; }

  /// Estimates of all keyframes in order of time, with covariances from one factorization. The window's where
  /// `progress` ended it.
  std::vector<Estimate> refine(const Progress& progress);

  /// Rounds that the last refinement took, and the largest move of its last one, metres.
  int rounds() const { return rounds_; }
  double last_move_m() const { return last_move_m_; }

 private:
  std::vector<Estimate> estimates() const;
  void build(SlidingWindow& window) const;
  bool register_scans(const std::vector<std::size_t>& which, const SlidingWindow& window, const Progress& progress);
  void renew_factors(SlidingWindow& window);
  std::vector<std::size_t> moved(const SlidingWindow& window);

  const EstimatorInput& input_;
  const KeyframeMeasurements& measurements_;
  InitialState start_;
  std::vector<std::unique_ptr<Keyframe>> keyframes_;
  std::vector<std::vector<Vector3>> biases_;
  CalibrationEstimate calibration_;
  int rounds_ = 0;
  double last_move_m_ = 0.0;
};

}  // namespace lodestone
