#include "estimators/baselines/ndt/ndt_localization.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "frontends/maps/ndt_map.h"
#include "tests/estimators/drive.h"
#include "tests/estimators/room.h"

namespace lodestone::testing {
namespace {

constexpr double kDrive_s = 6.0;

/// Half of a loop through the room, and the room's NDT map.
class NdtInARoom : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { drive_ = std::make_unique<RoomDrive>(drive_through_room(3, kDrive_s)); }
  static void TearDownTestSuite() { drive_.reset(); }

  static std::shared_ptr<ScanMatcher> make_matcher() {
    const NdtOptions options;
    VoxelMeans cloud(options.thinning_m);
    for (const Eigen::Vector3f& point : drive_->room.cloud) cloud.add(point);
    return std::make_shared<NdtMap>(cloud, options, 30.0);
  }

  static Collector estimate(Estimator& estimator, std::span<const ScanBundle> bundles) {
    Collector collector;
    for (const ScanBundle& bundle : bundles) estimator.process(bundle, collector);
    estimator.finish(collector);
    return collector;
  }

  static inline std::unique_ptr<RoomDrive> drive_;
};

/// The MIL-LC paper has 0.038 m in its warehouse; this room, whose scans have fewer points, gives 0.037 to 0.046 m.
/// Where NDT's iterations end hangs on roundings: drives that begin a millimetre apart differ as much (largest error
/// 0.07 to 0.12 m). The bounds are for all of them.
TEST_F(NdtInARoom, IsAsAccurateAsPublishedWhereNoDirectionIsDegenerate) {
  constexpr std::array kMoved_m{-0.002, -0.001, 0.0, 0.001, 0.002};
  double mean_ate_m = 0.0;
  std::vector<double> errors_m;
  const auto matcher = make_matcher();
  for (const double moved_m : kMoved_m) {
    EstimatorInput input = drive_->room.input;
    input.initial_pose.position.x() += moved_m;
    NdtLocalization estimator(input, matcher, {});
    const Collector result = estimate(estimator, drive_->bundles);
    ASSERT_EQ(result.best_estimates.size(), drive_->bundles.size());
    ASSERT_EQ(result.causal_estimates.size(), drive_->bundles.size());
    mean_ate_m += accuracy(result.best_estimates, drive_->truth).ate_m / kMoved_m.size();
    for (std::size_t i = 0; i < drive_->bundles.size(); ++i) {
      const Estimate& best = result.best_estimates[i];
      EXPECT_EQ(best.time, drive_->bundles[i].scan.end);
      EXPECT_GT(best.diagnostics.inlier_share, 0.9);
      errors_m.push_back(accuracy({best}, drive_->truth).max_m);
    }
  }
  std::sort(errors_m.begin(), errors_m.end());
  EXPECT_LT(mean_ate_m, 0.045);
  EXPECT_LT(errors_m[errors_m.size() * 95 / 100], 0.08);
  EXPECT_LT(errors_m.back(), 3.0 * 0.045);
}

TEST_F(NdtInARoom, SameBundlesSameBitsWithAFreshMatcherAndAUsedOne) {
  const std::span<const ScanBundle> bundles(drive_->bundles.data(), 10);
  const auto used = make_matcher();
  NdtLocalization first(drive_->room.input, used, {});
  const Collector once = estimate(first, bundles);
  NdtLocalization second(drive_->room.input, used, {});
  const Collector again = estimate(second, bundles);
  NdtLocalization third(drive_->room.input, make_matcher(), {});
  const Collector fresh = estimate(third, bundles);
  for (std::size_t i = 0; i < bundles.size(); ++i) {
    for (const Collector* other : {&again, &fresh}) {
      const Estimate& a = once.best_estimates[i];
      const Estimate& b = other->best_estimates[i];
      ASSERT_EQ(a.state.T_map_imu.position, b.state.T_map_imu.position) << i;
      ASSERT_EQ(a.state.T_map_imu.rotation.coeffs(), b.state.T_map_imu.rotation.coeffs()) << i;
      ASSERT_EQ(a.covariance, b.covariance) << i;
    }
  }
}

TEST_F(NdtInARoom, WithoutScansTheImuPredictsAndTheCovarianceGrows) {
  std::vector<ScanBundle> bundles(drive_->bundles.begin(), drive_->bundles.begin() + 15);
  for (std::size_t i = 10; i < bundles.size(); ++i) bundles[i].scan.points.clear();
  NdtLocalization estimator(drive_->room.input, make_matcher(), {});
  const Collector result = estimate(estimator, bundles);
  for (std::size_t i = 11; i < bundles.size(); ++i) {
    const Estimate& estimate = result.causal_estimates[i];
    EXPECT_GT(estimate.covariance(3, 3), result.causal_estimates[i - 1].covariance(3, 3)) << i;
    EXPECT_EQ(estimate.diagnostics.points, 0);
  }
  EXPECT_LT(accuracy(result.causal_estimates, drive_->truth).max_m, 0.3);
}

TEST_F(NdtInARoom, UsesNoMagnetometers) {
  std::vector<ScanBundle> bundles(drive_->bundles.begin(), drive_->bundles.begin() + 3);
  NdtLocalization first(drive_->room.input, make_matcher(), {});
  const Collector with = estimate(first, bundles);
  for (ScanBundle& bundle : bundles) bundle.magnetic.clear();
  EstimatorInput input = drive_->room.input;
  input.field = nullptr;
  NdtLocalization second(input, make_matcher(), {});
  const Collector without = estimate(second, bundles);
  EXPECT_EQ(with.best_estimates.back().state.T_map_imu.position,
            without.best_estimates.back().state.T_map_imu.position);
}

/// The pose of a scan without deskewing is that of its middle, if the scan is registered perfectly.
class PerfectMatcher final : public ScanMatcher {
 public:
  explicit PerfectMatcher(std::vector<Pose> poses) : poses_(std::move(poses)) {}
  std::optional<ScanMatch> match(std::span<const Eigen::Vector3f> points, const Pose&) override {
    ScanMatch match;
    match.T_map_imu = poses_.at(next_++);
    match.points = match.matched = static_cast<int>(points.size());
    return match;
  }

 private:
  std::vector<Pose> poses_;
  std::size_t next_ = 0;
};

TEST_F(NdtInARoom, ARegisteredPoseIsThatOfTheScansMiddleAndTheEstimateThatOfItsEnd) {
  std::vector<Pose> middles;
  for (const ScanBundle& bundle : drive_->bundles) {
    middles.push_back(
        *interpolate(drive_->truth, bundle.scan.start + (bundle.scan.end - bundle.scan.start) / 2, 20'000'000));
  }
  std::vector<double> errors_m;
  for (const double pose_time : {0.0, 0.5, 1.0}) {
    NdtFilterOptions options;
    options.pose_time = pose_time;
    NdtLocalization estimator(drive_->room.input, std::make_shared<PerfectMatcher>(middles), options);
    errors_m.push_back(accuracy(estimate(estimator, drive_->bundles).best_estimates, drive_->truth).ate_m);
  }
  // The wide sigma points bias the filter's velocity downwards.
  EXPECT_LT(errors_m[1], 0.025);
  // Half a scan at 1 m/s.
  EXPECT_GT(errors_m[0], 0.03);
  EXPECT_GT(errors_m[2], 0.03);
}

TEST_F(NdtInARoom, ByNameItRequiresTheCloudMapAndIsJudgedAsGood) {
  EstimatorInput input = drive_->room.input;
  try {
    make_estimator("ndt", input);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("ndt requires a cloud map: pass --cloud"), std::string::npos);
  }
  input.matcher = make_matcher();
  const auto estimator = make_estimator("ndt", input);
  const Collector result = estimate(*estimator, std::span<const ScanBundle>(drive_->bundles.data(), 20));
  for (const Estimate& estimate : result.best_estimates) EXPECT_NE(estimate.health, Health::lost);
}

}  // namespace
}  // namespace lodestone::testing
