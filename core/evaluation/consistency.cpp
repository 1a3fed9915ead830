#include "core/evaluation/consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "core/evaluation/paired_ratio.h"
#include "core/evaluation/statistics.h"

namespace lodestone {

namespace {

constexpr double kChiSquared95With6 = 12.591587243743977;

/// δᵀ P⁻¹ δ, or nothing if P is not positive definite.
template <int size>
std::optional<double> squared_mahalanobis(const Eigen::Matrix<double, size, 1>& delta,
                                          const Eigen::Matrix<double, size, size>& covariance) {
  // Scaled to unit diagonal, so that the test for singularity does not depend on the units.
  const Eigen::Matrix<double, size, 1> variances = covariance.diagonal();
  if (!covariance.allFinite() || (variances.array() <= 0.0).any()) return std::nullopt;
  const Eigen::Matrix<double, size, 1> inverse_sigma = variances.array().rsqrt();
  const Eigen::Matrix<double, size, size> correlation =
      inverse_sigma.asDiagonal() * covariance * inverse_sigma.asDiagonal();
  const Eigen::LLT<Eigen::Matrix<double, size, size>> cholesky(correlation);
  if (cholesky.info() != Eigen::Success) return std::nullopt;
  const Eigen::Matrix<double, size, 1> whitened =
      cholesky.matrixL().solve(Eigen::Matrix<double, size, 1>(inverse_sigma.cwiseProduct(delta)));
  return whitened.squaredNorm();
}

/// Mean ± Student's 97.5 % quantile × the standard error of the means of 20 segments.
void bound_mean(const std::vector<double>& values, double& low, double& high) {
  constexpr std::size_t segments = 20;
  if (values.size() < 2 * segments) return;
  std::vector<double> means;
  for (std::size_t k = 0; k < segments; ++k) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(k * values.size() / segments);
    const auto end = values.begin() + static_cast<std::ptrdiff_t>((k + 1) * values.size() / segments);
    means.push_back(std::accumulate(begin, end, 0.0) / static_cast<double>(end - begin));
  }
  const ErrorStatistics found = summarize(means);
  const double half = student_t_quantile(segments - 1, 0.975) * found.standard_deviation / std::sqrt(segments - 1.0);
  low = std::max(0.0, found.mean - half);
  high = found.mean + half;
}

}  // namespace

Consistency evaluate_consistency(const PosePairs& pairs, const std::vector<Matrix6>& covariances) {
  if (pairs.size() != covariances.size())
    throw std::invalid_argument("evaluate_consistency: expected one covariance per pair");
  Consistency result;
  std::size_t within = 0;
  std::vector<double> values;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vector6 delta = pairs[i].truth.boxminus(pairs[i].estimate);
    const auto whole = squared_mahalanobis<6>(delta, covariances[i]);
    if (!whole) {
      ++result.singular;
      continue;
    }
    ++result.count;
    result.nees += *whole;
    values.push_back(*whole / 6.0);
    if (*whole <= kChiSquared95With6) ++within;
    result.nees_axis += (delta.array().square() / covariances[i].diagonal().array()).matrix();
    // Blocks of a positive definite matrix are positive definite. If rounding breaks this, the pose adds nothing.
    result.nees_rotation += squared_mahalanobis<3>(delta.head<3>(), covariances[i].topLeftCorner<3, 3>()).value_or(0.0);
    result.nees_position +=
        squared_mahalanobis<3>(delta.tail<3>(), covariances[i].bottomRightCorner<3, 3>()).value_or(0.0);
  }
  if (result.count == 0) return result;
  const double count = static_cast<double>(result.count);
  result.nees /= 6.0 * count;
  result.nees_rotation /= 3.0 * count;
  result.nees_position /= 3.0 * count;
  result.nees_axis /= count;
  bound_mean(values, result.nees_low, result.nees_high);
  result.share_within_95 = static_cast<double>(within) / count;
  return result;
}

}  // namespace lodestone
