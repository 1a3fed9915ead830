#include "estimators/smoother/batch_refinement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/evaluation/consistency.h"
#include "core/parallel.h"
#include "estimators/smoother/field_error.h"

namespace lodestone {

namespace {

/// Number of scans that are registered at the same time: neighbours in time use the same tiles of the map.
constexpr std::size_t kScans = 64;

/// Gauss-Newton converges in fewer.
constexpr int kIterations = 20;

/// Most rounds of association and solution (docs/design/029-batch-by-cholmod.md).
constexpr int kMostRounds = 6;

// A keyframe that a round moved or turned further is associated again in the next.
constexpr double kMoved_m = 0.001;
constexpr double kTurned_deg = 0.01;

// A keyframe that the last round still moved or turned further has no settled pose.
constexpr double kUnsettled_m = 0.01;
constexpr double kUnsettled_deg = 0.1;

// NEES of the window's poses with the batch's as truth. Exact poses would give 1; a batch beyond this contradicts them.
constexpr double kContradicts = 2.0;

/// Errors of the maps are known after this way.
constexpr double kErrorsKnown_m = FieldError::kMetres;

void release(Keyframe& keyframe) {
  std::vector<Correspondence>().swap(keyframe.correspondences);
  keyframe.planes.reset();
}

}  // namespace

BatchRefinement::BatchRefinement(const EstimatorInput& input, const KeyframeMeasurements& measurements,
                                 const InitialState& start)
    : input_(input), measurements_(measurements), start_(start) {}

void BatchRefinement::add(std::unique_ptr<Keyframe> keyframe, std::vector<Vector3> biases_ut) {
  release(*keyframe);
  // Readings are weighted at the refined state, with the covariance from the window.
  keyframe->predicted_covariance = keyframe->estimate.covariance;
  keyframe->gate_covariance = keyframe->estimate.covariance;
  keyframes_.push_back(std::move(keyframe));
  biases_.push_back(std::move(biases_ut));
}

std::vector<Estimate> BatchRefinement::estimates() const {
  std::vector<Estimate> result;
  for (const auto& keyframe : keyframes_) result.push_back(keyframe->estimate);
  return result;
}

void BatchRefinement::build(SlidingWindow& window) const {
  for (std::size_t k = 1; k < keyframes_.size(); ++k) {
    window.set_imu_noise(keyframes_[k]->imu_noise);
    window.add_keyframe(keyframes_[k]->estimate.time, keyframes_[k]->estimate.state, keyframes_[k]->imu);
  }
  // The initial pose's prior stays at the initial pose; the states begin at the window's estimates.
  window.set_state(0, keyframes_.front()->estimate.state);
  window.set_state(keyframes_.size() - 1, keyframes_.back()->estimate.state);
}

void BatchRefinement::use_later_map_errors() {
  double way_m = 0.0;
  std::size_t known = 0;
  while (known + 1 < keyframes_.size() && way_m < kErrorsKnown_m) {
    const Vector3 from = keyframes_[known]->estimate.state.T_map_imu.position;
    way_m += (keyframes_[++known]->estimate.state.T_map_imu.position - from).norm();
  }
  for (std::size_t k = 0; k < known; ++k) {
    keyframes_[k]->map_error_variance_m2 = keyframes_[known]->map_error_variance_m2;
    keyframes_[k]->field_variance_ut2 = keyframes_[known]->field_variance_ut2;
  }
}

bool BatchRefinement::register_scans(const std::vector<std::size_t>& which, const SlidingWindow& window,
                                     const Progress& progress) {
  for (std::size_t first = 0; first < which.size(); first += kScans) {
    const std::size_t last = std::min(first + kScans, which.size());
    parallel_for(first, last, [&](std::size_t i) {
      const std::size_t k = which[i];
      const NavState before = window.state(k > 0 ? k - 1 : 0);
      keyframes_[k]->lidar_correction = window.lidar_correction();
      if (rounds_ > 0) keyframes_[k]->map_error = window.map_error(k);
      measurements_.register_scan(*keyframes_[k], window.state(k), k > 0 ? &before : nullptr);
    });
    for (std::size_t i = first; i < last && input_.options.smoother.solver.condensed; ++i)
      release(*keyframes_[which[i]]);
    const double share =
        (rounds_ + static_cast<double>(last) / static_cast<double>(which.size())) / static_cast<double>(kMostRounds);
    if (progress && !progress(share)) return false;
  }
  return true;
}

void BatchRefinement::renew_factors(SlidingWindow& window) {
  std::vector<KeyframeField> fields(keyframes_.size());
  parallel_for(std::size_t{0}, keyframes_.size(), [&](std::size_t k) {
    Keyframe& keyframe = *keyframes_[k];
    const NavState state = window.state(k);
    // The window's masks are kept: over a whole log, IMU factors carry the little that LiDAR knows of a masked
    // direction from keyframe to keyframe until the direction seems known (docs/design/009-degeneracy-rule.md).
    const Degeneracy seen = keyframe.degeneracy;
    measurements_.decide(keyframe, seen, nullptr, {});
    keyframe.predicted = state.T_map_imu;
    const auto bias = [&](int magnetometer) {
      return rounds_ == 0 ? biases_[k][static_cast<std::size_t>(magnetometer)]
                          : window.magnetometer_bias(k, magnetometer);
    };
    const auto matrix = [&](int magnetometer) { return window.magnetometer_matrix(magnetometer); };
    fields[k] = measurements_.weigh(keyframe, state, bias, matrix, window.clock_offset());
  });
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    measurements_.set_lidar(*keyframes_[k], k, window);
    measurements_.set_wheels(*keyframes_[k], window.state(k), k, window);
    if (input_.field == nullptr) continue;
    measurements_.set_field(fields[k], k, window);
    if (rounds_ == 0) window.set_magnetometer_biases(k, biases_[k]);
  }
}

std::vector<std::size_t> BatchRefinement::moved(const SlidingWindow& window, double further_m,
                                                double further_deg) const {
  std::vector<std::size_t> result;
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    if (keyframes_[k]->moved(window.seen_pose(k), further_m, further_deg)) result.push_back(k);
  }
  return result;
}

void BatchRefinement::warn_if_unsettled(const SlidingWindow& window) const {
  const std::vector<std::size_t> unsettled = moved(window, kUnsettled_m, kUnsettled_deg);
  if (unsettled.empty() || input_.warnings == nullptr) return;
  const Time first = keyframes_[unsettled.front()]->estimate.time;
  input_.warnings->add("batch.unsettled",
                       fmt::format("after {} rounds, {} of {} poses still move by more than {} cm or {} deg, "
                                   "from {:.3f} s: compare with smoothed.tum there",
                                   rounds_, unsettled.size(), keyframes_.size(), 100.0 * kUnsettled_m, kUnsettled_deg,
                                   to_seconds(first)),
                       first);
}

bool BatchRefinement::contradicts(const SlidingWindow& window) const {
  PosePairs pairs;
  std::vector<Matrix6> covariances;
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    const Estimate& before = keyframes_[k]->estimate;
    pairs.push_back({before.time, before.state.T_map_imu, window.state(k).T_map_imu, k});
    covariances.push_back(before.covariance);
  }
  const double nees = evaluate_consistency(pairs, covariances).nees;
  if (nees <= kContradicts) return false;
  if (input_.warnings != nullptr) {
    const Time first = keyframes_.front()->estimate.time;
    const Time last = keyframes_.back()->estimate.time;
    input_.warnings->add(
        "batch.refused",
        fmt::format("from {:.3f} to {:.3f} s, the batch's poses are {:.1f} sigmas of the window from the window's "
                    "(at most {:.1f}): the window's are kept",
                    to_seconds(first), to_seconds(last), std::sqrt(nees), std::sqrt(kContradicts)),
        first);
  }
  return true;
}

std::vector<Estimate> BatchRefinement::refine(const Progress& progress) {
  if (keyframes_.empty()) return {};
  SlidingWindowOptions solver = input_.options.smoother.solver;
  solver.max_iterations = kIterations;
  SlidingWindow window(keyframes_.front()->estimate.time, start_.state, start_.covariance,
                       static_cast<int>(input_.suite.magnetometers.size()), input_.suite.imu, solver,
                       input_.suite.calibration);
  window.set_calibration(calibration_);
  build(window);
  use_later_map_errors();
  std::vector<std::size_t> renewed(keyframes_.size());
  std::iota(renewed.begin(), renewed.end(), std::size_t{0});
  for (rounds_ = 0; rounds_ < kMostRounds && !renewed.empty(); ++rounds_) {
    if (!register_scans(renewed, window, progress)) return estimates();
    renew_factors(window);
    if (input_.linearize_at != nullptr) break;
    window.solve();
    renewed = moved(window, kMoved_m, kTurned_deg);
  }
  if (input_.linearize_at == nullptr) {
    if (contradicts(window)) return estimates();
    warn_if_unsettled(window);
  }
  std::vector<std::size_t> all(keyframes_.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const std::vector<Matrix6> covariances = window.pose_covariances(all);
  std::vector<Estimate> result = estimates();
  calibration_ = window.calibration_estimate();
  for (std::size_t k = 0; k < result.size(); ++k) {
    result[k].state = window.state(k);
    result[k].covariance = covariances[k];
  }
  return result;
}

}  // namespace lodestone
