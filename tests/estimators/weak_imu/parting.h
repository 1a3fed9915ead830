#pragma once

#include <vector>

#include "estimators/estimate.h"
#include "tests/estimators/drive.h"

namespace lodestone::weak_imu {

constexpr double tracked_m = 1.0;           ///< a run with a larger error at any scan is lost
constexpr double false_alarm_rate = 0.001;  ///< of a whole run

/// The errors of one estimator against the ground truth.
struct Tracking {
  bool tracked = false;
  double rms_m = 0.0;
  double largest_m = 0.0;
  double nees = 0.0;          ///< of the pose, per degree of freedom
  double largest_nees = 0.0;  ///< eᵀ P⁻¹ e of the pose over its limit, largest of all scans; above 1: P is too small
};

/// Difference of two estimates of the same poses: d, with D² = dᵀ (P_f + P_s)⁻¹ d. Both use the same scans, so their
/// errors are positively correlated and Cov(d) ≤ P_f + P_s if both covariances are right: D² is then at most χ² with
/// six degrees of freedom.
struct Parting {
  double mean = 0.0;                ///< of D², per degree of freedom
  double largest = 0.0;             ///< D² over its limit, largest of all scans; above 1: the estimates disagree
  double share_above_95 = 0.0;      ///< of the scans beyond the 95 % quantile
  double share_above_999 = 0.0;     ///< of the scans beyond the 99.9 % quantile
  double hausman = 0.0;             ///< mean of z² / var z over the directions in which P_f exceeds P_s
  double hausman_directions = 0.0;  ///< share of these directions
};

struct Comparison {
  int scans = 0;
  Tracking filter;
  Tracking causal;
  Tracking smoothed;
  Parting causal_parting;    ///< of filter and causal estimate of the smoother
  Parting smoothed_parting;  ///< of filter and smoothed estimate

  bool tracked() const { return filter.tracked && causal.tracked && smoothed.tracked; }
};

Tracking tracking(const std::vector<Estimate>& estimates, const Trajectory& truth, std::size_t scans);

/// The limit of D² is χ²₆'s quantile for a false alarm rate of `false_alarm_rate` over all scans (Bonferroni).
Parting parting(const std::vector<Estimate>& filter, const std::vector<Estimate>& smoother);

/// Runs `lidar-inertial` against the smoother without a field; `ieskf` against the smoother if the drive has a field.
Comparison compare(const testing::Drive& drive, const RunOptions& options = {});

}  // namespace lodestone::weak_imu
