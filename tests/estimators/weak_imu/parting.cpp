#include "tests/estimators/weak_imu/parting.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/robust_weight.h"

namespace lodestone::weak_imu {

namespace {

double chi_squared_quantile(double probability) {
  const double distance = mahalanobis_quantile(6, probability);
  return distance * distance;
}

/// With a probability of `false_alarm_rate`, the largest of `scans` values of χ²₆ exceeds this limit (Bonferroni).
double limit_over(std::size_t scans) {
  return chi_squared_quantile(1.0 - false_alarm_rate / static_cast<double>(scans));
}

/// Keeps the largest value. Comparisons with NaN are false, so a value that is not finite counts as the largest.
void keep_largest(double value, double& largest) {
  if (!(value <= largest)) largest = value;
}

}  // namespace

Tracking tracking(const std::vector<Estimate>& estimates, const Trajectory& truth, std::size_t scans) {
  Tracking result;
  double squared = 0.0;
  int count = 0;
  for (const Estimate& estimate : estimates) {
    const auto pose = interpolate(truth, estimate.time, 20'000'000);
    if (!pose) continue;
    const Vector6 error = estimate.state.T_map_imu.boxminus(*pose);
    const double distance_m = error.tail<3>().norm();
    squared += distance_m * distance_m;
    keep_largest(distance_m, result.largest_m);
    const double squared_distance = error.dot(estimate.covariance.ldlt().solve(error));
    result.nees += squared_distance / 6.0;
    keep_largest(squared_distance / limit_over(scans), result.largest_nees);
    ++count;
  }
  result.rms_m = std::sqrt(squared / count);
  result.nees /= count;
  result.tracked = estimates.size() == scans && result.largest_m <= tracked_m;
  return result;
}

Parting parting(const std::vector<Estimate>& filter, const std::vector<Estimate>& smoother) {
  if (filter.size() != smoother.size() || filter.empty()) {
    throw std::invalid_argument("filter and smoother must have estimates of the same scans");
  }
  const auto scans = static_cast<double>(filter.size());
  const double limit = limit_over(filter.size());
  const double limit_95 = chi_squared_quantile(0.95);
  const double limit_999 = chi_squared_quantile(0.999);
  Parting result;
  int larger = 0;
  for (std::size_t k = 0; k < filter.size(); ++k) {
    if (filter[k].time != smoother[k].time) throw std::invalid_argument("estimates of different times");
    const Vector6 difference = smoother[k].state.T_map_imu.boxminus(filter[k].state.T_map_imu);
    // In the coordinates z, P_f is the identity and P_s diagonal.
    const Eigen::LLT<Matrix6> root(filter[k].covariance);
    const Matrix6 half = root.matrixL().solve(smoother[k].covariance);
    const Matrix6 ratio = root.matrixL().solve(half.transpose());
    const Eigen::SelfAdjointEigenSolver<Matrix6> axes(0.5 * (ratio + ratio.transpose()));
    const Vector6 z = axes.eigenvectors().transpose() * root.matrixL().solve(difference);
    double squared = 0.0;
    for (int i = 0; i < 6; ++i) {
      const double share = axes.eigenvalues()[i];
      squared += z[i] * z[i] / (1.0 + share);
      // Hausman 1978: an efficient estimate is uncorrelated with its difference from another, Cov(d) = P_f − P_s.
      if (share > 0.9) continue;
      result.hausman += z[i] * z[i] / (1.0 - share);
      ++larger;
    }
    result.mean += squared / (6.0 * scans);
    keep_largest(squared / limit, result.largest);
    result.share_above_95 += squared > limit_95 ? 1.0 / scans : 0.0;
    result.share_above_999 += squared > limit_999 ? 1.0 / scans : 0.0;
  }
  if (larger > 0) result.hausman /= larger;
  result.hausman_directions = larger / (6.0 * scans);
  return result;
}

Comparison compare(const testing::Drive& drive, const RunOptions& options) {
  EstimatorInput input = drive.input();
  input.options = options;
  const testing::Collector filter =
      testing::run(drive.field == nullptr ? "lidar-inertial" : "ieskf", input, drive.bundles);
  const testing::Collector smoother = testing::run("smoother", input, drive.bundles);
  Comparison result;
  const std::size_t scans = drive.bundles.size();
  result.scans = static_cast<int>(scans);
  result.filter = tracking(filter.causal_estimates, drive.truth, scans);
  result.causal = tracking(smoother.causal_estimates, drive.truth, scans);
  result.smoothed = tracking(smoother.best_estimates, drive.truth, scans);
  result.causal_parting = parting(filter.causal_estimates, smoother.causal_estimates);
  result.smoothed_parting = parting(filter.causal_estimates, smoother.best_estimates);
  return result;
}

}  // namespace lodestone::weak_imu
