#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/lidar/scan_sampling.h"
#include "estimators/initialization/scan_registration.h"
#include "estimators/initialization/start_scan.h"
#include "tests/estimators/drive.h"

namespace lodestone::testing {
namespace {

/// A drive on which every other point is from a second LiDAR, 3 m behind the first and with ten times its noise.
struct DriveOfTwoLidars {
  DriveOfTwoLidars() : drive(world_drive("warehouse", "1", 3.0, 4)) {
    LidarModel second = drive.suite.lidar;
    const Pose T_first_second{so3::exp(Vector3(0.0, 0.1, 3.0)), Vector3(-3.0, 0.0, 0.0)};
    second.T_imu_lidar = drive.suite.lidar.T_imu_lidar * T_first_second;
    second.range_noise_m *= 10.0;
    drive.suite.further_lidars = {second};
    const Eigen::Vector3f origin = T_first_second.position.cast<float>();
    std::mt19937_64 random(5);
    std::normal_distribution<float> noise(0.0F, static_cast<float>(second.range_noise_m));
    for (ScanBundle& bundle : drive.bundles) {
      for (std::size_t i = 0; i < bundle.scan.points.size(); i += 2) {
        LidarPoint& point = bundle.scan.points[i];
        point.lidar = 1;
        point.position += noise(random) * (point.position - origin).normalized();
      }
    }
  }

  /// All points attributed to the first LiDAR.
  Drive taken_for_the_first() const {
    Drive result = drive;
    result.suite.further_lidars.clear();
    for (ScanBundle& bundle : result.bundles) {
      for (LidarPoint& point : bundle.scan.points) point.lidar = 0;
    }
    return result;
  }

  Drive drive;
};

const DriveOfTwoLidars& two_lidars_drive() {
  static const DriveOfTwoLidars drive;
  return drive;
}

class SeveralLidars : public ::testing::TestWithParam<const char*> {};

TEST_P(SeveralLidars, ANoisyOneSpoilsNothingIfItsNoiseIsItsOwn) {
  const Drive& own = two_lidars_drive().drive;
  const Drive shared = two_lidars_drive().taken_for_the_first();
  const Collector with_own = run(GetParam(), own.input(), own.bundles);
  const Collector with_shared = run(GetParam(), shared.input(), shared.bundles);
  const Accuracy a = accuracy(with_own.best_estimates, own.truth);
  const Accuracy b = accuracy(with_shared.best_estimates, own.truth);
  const auto mean_nis = [](const Collector& result) {
    double sum = 0.0;
    for (const Estimate& estimate : result.best_estimates) sum += estimate.diagnostics.lidar_nis;
    return sum / static_cast<double>(result.best_estimates.size());
  };
  std::printf("%s: ATE %.2f mm, NEES %.2f, NIS %.2f; as one LiDAR %.2f mm, %.2f, %.2f\n", GetParam(), 1e3 * a.ate_m,
              a.nees, mean_nis(with_own), 1e3 * b.ate_m, b.nees, mean_nis(with_shared));
  EXPECT_LT(a.ate_m, 0.8 * b.ate_m);
  EXPECT_NEAR(mean_nis(with_own), 1.0, 0.5);
  EXPECT_GT(mean_nis(with_shared), 2.0);
}

/// Near points first, then far ones: each stage uses the noise of each point's LiDAR.
TEST(SeveralLidarsStart, AScanIsRegisteredWithEachPointsNoise) {
  const Drive& drive = two_lidars_drive().drive;
  ScanBundle bundle = drive.bundles[5];
  bundle.scan.points = sample_scan(bundle.scan, drive.suite.lidars(), {0.3, 20000});
  const Pose truth = *interpolate(drive.truth, bundle.scan.end, 20'000'000);
  const Quaternion to_imu = truth.rotation.conjugate();
  const StartScan scan = prepare_start(bundle, to_imu * Vector3::UnitZ(), Vector3::Zero(), drive.suite);
  ASSERT_EQ(scan.lidars.of_points.size(), scan.points.size());
  ASSERT_EQ(scan.lidars.models.size(), 2U);
  Pose start = truth;
  start.position += Vector3(0.1, -0.1, 0.05);
  const auto registered = [&](const ScanLidars& lidars) {
    return register_scan(scan.points, start, *drive.planes, lidars, drive.input().options.lidar.association);
  };
  const RegisteredScan own = registered(scan.lidars);
  EXPECT_LT(own.T_map_imu.boxminus(truth).tail<3>().norm(), 0.12);  // not deskewed: a tenth of a second at 1 m/s
  // Noisy points have less information than precise ones.
  const RegisteredScan shared = registered(drive.suite.lidar);
  const auto share = [&](int i) { return own.information(i, i) / shared.information(i, i); };
  for (int i = 0; i < 6; ++i) {
    EXPECT_LT(share(i), 0.85) << i;
    EXPECT_GT(share(i), 0.2) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Estimators, SeveralLidars, ::testing::Values("smoother", "ieskf"));

}  // namespace
}  // namespace lodestone::testing
