#include "tests/estimators/weak_imu/parting.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace lodestone::weak_imu {
namespace {

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : generator_(seed) {}

  Vector6 normal() {
    Vector6 result;
    for (int i = 0; i < 6; ++i) result[i] = normal_(generator_);
    return result;
  }

  Vector6 error_of(const Matrix6& covariance) { return covariance.llt().matrixL() * normal(); }

  Matrix6 covariance() {
    Matrix6 root;
    for (int i = 0; i < 6; ++i) root.col(i) = 1e-3 * normal();
    return root * root.transpose() + 1e-6 * Matrix6::Identity();
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

Estimate estimate_of(Time time, const Vector6& error, const Matrix6& covariance) {
  Estimate result;
  result.time = time;
  result.state.T_map_imu = Pose{}.boxplus(error);
  result.covariance = covariance;
  return result;
}

constexpr int draws_count = 4000;

TEST(WeakImuParting, OfIndependentEstimatesIsChiSquared) {
  Draws draws(1);
  std::vector<Estimate> filter, smoother;
  for (int k = 0; k < draws_count; ++k) {
    const Matrix6 wide = draws.covariance();
    const Matrix6 narrow = draws.covariance();
    filter.push_back(estimate_of(k, draws.error_of(wide), wide));
    smoother.push_back(estimate_of(k, draws.error_of(narrow), narrow));
  }
  const Parting found = parting(filter, smoother);
  EXPECT_NEAR(found.mean, 1.0, 0.04);
  EXPECT_NEAR(found.share_above_95, 0.05, 0.015);
  EXPECT_NEAR(found.share_above_999, 0.001, 0.002);
  EXPECT_LT(found.largest, 1.0);
  EXPECT_GT(found.largest, 0.5);
}

TEST(WeakImuParting, OfAnEfficientEstimateFromAnotherIsTheDifferenceOfBothCovariances) {
  Draws draws(2);
  std::vector<Estimate> filter, smoother;
  for (int k = 0; k < draws_count; ++k) {
    const Matrix6 narrow = draws.covariance();
    const Matrix6 more = draws.covariance();
    const Vector6 error = draws.error_of(narrow);
    smoother.push_back(estimate_of(k, error, narrow));
    filter.push_back(estimate_of(k, error + draws.error_of(more), narrow + more));
  }
  const Parting found = parting(filter, smoother);
  EXPECT_NEAR(found.hausman, 1.0, 0.04);
  EXPECT_GT(found.hausman_directions, 0.5);
  EXPECT_LT(found.mean, 1.0);  // shared errors cancel
  EXPECT_LT(found.largest, 1.0);
}

TEST(WeakImuParting, ShowsACovarianceThatIsTooSmall) {
  Draws draws(3);
  std::vector<Estimate> filter, smoother;
  Trajectory truth;
  for (int k = 0; k < 100; ++k) {
    const Matrix6 covariance = draws.covariance();
    filter.push_back(estimate_of(k, 5.0 * draws.error_of(covariance), covariance));
    smoother.push_back(estimate_of(k, draws.error_of(covariance), covariance));
    truth.push_back({k, Pose{}});
  }
  EXPECT_GT(parting(filter, smoother).largest, 1.0);
  EXPECT_GT(tracking(filter, truth, 100).largest_nees, 1.0);
  const Tracking consistent = tracking(smoother, truth, 100);
  EXPECT_LT(consistent.largest_nees, 1.0);
  EXPECT_NEAR(consistent.nees, 1.0, 0.2);
  EXPECT_TRUE(consistent.tracked);
  EXPECT_FALSE(tracking(smoother, truth, 101).tracked);
}

}  // namespace
}  // namespace lodestone::weak_imu
