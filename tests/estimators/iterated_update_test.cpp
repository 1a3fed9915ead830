#include "estimators/ieskf/iterated_update.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace lodestone {
namespace {

Matrix17 random_covariance(std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  Matrix17 root;
  for (auto& value : root.reshaped()) value = 0.01 * normal(generator);
  return root * root.transpose() + 1e-6 * Matrix17::Identity();
}

TEST(IteratedUpdate, EqualsTheKalmanGainFormForASmallStep) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  const NavState prior;
  const Matrix17 covariance = random_covariance(generator);
  Matrix6 root;
  for (auto& value : root.reshaped()) value = 100.0 * normal(generator);
  const Matrix6 information = root * root.transpose();
  Vector6 offset;
  for (auto& value : offset) value = 1e-4 * normal(generator);
  const Pose measured = prior.T_map_imu.boxplus(offset);
  const UpdatedState updated =
      iterated_update(prior, covariance,
                      [&](const NavState& state) {
                        return PoseEvidence{information, information * state.T_map_imu.boxminus(measured)};
                      },
                      {});
  // K = P Hᵀ (H P Hᵀ + R)⁻¹ with H = [I 0].
  const Eigen::Matrix<double, 17, 6> by_pose = covariance.leftCols<6>();
  const Eigen::Matrix<double, 17, 6> gain =
      by_pose * (covariance.topLeftCorner<6, 6>() + information.inverse()).inverse();
  EXPECT_LT((updated.state.boxminus(prior) - gain * offset).norm(), 1e-6 * offset.norm() + 1e-9);
  EXPECT_LT((updated.covariance - (covariance - gain * by_pose.transpose())).norm(), 1e-5 * covariance.norm());
}

TEST(IteratedUpdate, WithoutEvidenceNothingChanges) {
  std::mt19937_64 generator(2);
  const Matrix17 covariance = random_covariance(generator);
  const UpdatedState updated =
      iterated_update(NavState{}, covariance, [](const NavState&) { return PoseEvidence{}; }, {});
  EXPECT_LT(updated.state.boxminus(NavState{}).norm(), 1e-12);
  EXPECT_LT((updated.covariance - covariance).norm(), 1e-8 * covariance.norm());
}

}  // namespace
}  // namespace lodestone
