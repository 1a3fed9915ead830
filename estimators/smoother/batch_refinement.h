#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "estimators/initial_state.h"
#include "estimators/smoother/keyframe_measurements.h"

namespace lodestone {

/// Solves the whole log as one problem after the window has processed it: condensed LiDAR factors, IMU and field
/// factors of all keyframes, and the initial prior. Scans are deskewed and associated again at the refined states, and
/// weights, masks and IMU integrals are recomputed, until no keyframe moves. Time and memory are linear in the length
/// of the log: the sampled points of each scan are kept (docs/design/029-batch-by-cholmod.md).
class BatchRefinement {
 public:
  /// Called with the finished share of the work (0 to 1); false stops the refinement.
  using Progress = std::function<bool(double share)>;

  /// `start`: prior of the first keyframe, without its measurements. `input` and `measurements` must outlive this.
  BatchRefinement(const EstimatorInput& input, const KeyframeMeasurements& measurements, const InitialState& start);

  /// Adds the next keyframe as it leaves the window; `keyframe->estimate` is the window's, `biases_ut` the
  /// magnetometers'.
  void add(std::unique_ptr<Keyframe> keyframe, std::vector<Vector3> biases_ut);

  /// Sets the initial calibration: the window's final estimate.
  void set_calibration(const CalibrationEstimate& calibration) { calibration_ = calibration; }

  /// The calibration estimated by the last refinement.
  const CalibrationEstimate& calibration() const { return calibration_; }

  /// Refines, and returns the estimates of all keyframes in order of time, with covariances from one factorization.
  /// Returns the window's estimates if `progress` stops the refinement or if the refined poses contradict them.
  std::vector<Estimate> refine(const Progress& progress);

 private:
  std::vector<Estimate> estimates() const;
  void build(SlidingWindow& window) const;

  /// In the first metres of a log, the window assumes a typical error of the cloud map and none of the field map.
  /// There, the batch takes what the log told later.
  void use_later_map_errors();
  bool register_scans(const std::vector<std::size_t>& which, const SlidingWindow& window, const Progress& progress);
  void renew_factors(SlidingWindow& window);
  /// Keyframes that moved or turned further than this since they were associated.
  std::vector<std::size_t> moved(const SlidingWindow& window, double further_m, double further_deg) const;
  void warn_if_unsettled(const SlidingWindow& window) const;
  /// Whether the refined poses are further from the window's than the window's covariances allow; warns if so
  /// (docs/design/029-batch-by-cholmod.md).
  bool contradicts(const SlidingWindow& window) const;

  const EstimatorInput& input_;
  const KeyframeMeasurements& measurements_;
  InitialState start_;
  std::vector<std::unique_ptr<Keyframe>> keyframes_;
  std::vector<std::vector<Vector3>> biases_;
  CalibrationEstimate calibration_;
  int rounds_ = 0;
};

}  // namespace lodestone
