#include "estimators/baselines/magnetic_calibrating/magnetic_calibrating.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstdio>

#include "core/error.h"
#include "tests/estimators/drive.h"

namespace lodestone::testing {
namespace {

constexpr const char* kName = "magnetic-calibrating";

std::vector<ScanBundle> with_hard_iron(std::vector<ScanBundle> bundles, std::size_t magnetometer,
                                       const Vector3& offset_ut) {
  for (ScanBundle& bundle : bundles) {
    for (MagneticArraySample& sample : bundle.magnetic) {
      if (sample.field_ut[magnetometer]) *sample.field_ut[magnetometer] += offset_ut;
    }
  }
  return bundles;
}

TEST(MagneticCalibratingEstimator, RequiresAFieldMap) {
  EstimatorInput input = shared_drive().input();
  input.field = nullptr;
  try {
    make_estimator(kName, input);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--magnetic"), std::string::npos);
  }
}

// The paper states 0.11 to 0.22 m for this system.
TEST(MagneticCalibratingEstimator, LocalizesInARichFieldAtLeastAsWellAsItsPaperStates) {
  const Drive& drive = shared_drive();
  const Collector result = run(kName, drive.input(), drive.bundles);
  ASSERT_EQ(result.causal_estimates.size(), drive.bundles.size());
  ASSERT_EQ(result.best_estimates.size(), drive.bundles.size());
  EXPECT_LT(accuracy(result.causal_estimates, drive.truth).ate_m, 0.05);
  EXPECT_LT(accuracy(result.best_estimates, drive.truth).ate_m, 0.05);
  EXPECT_LT(accuracy(result.best_estimates, drive.truth).nees, 2.0);
  for (const Estimate& estimate : result.causal_estimates) EXPECT_EQ(estimate.health, Health::good);
}

TEST(MagneticCalibratingEstimator, AHardIronOfOneMagnetometerHarmsLittle) {
  const Drive& drive = shared_drive();
  const auto bundles = with_hard_iron(drive.bundles, 2, {3.0, -4.0, 0.0});
  const Accuracy healthy = accuracy(run(kName, drive.input(), drive.bundles).best_estimates, drive.truth);
  const Accuracy distorted = accuracy(run(kName, drive.input(), bundles).best_estimates, drive.truth);
  std::printf("ATE %.4f m, %.4f m with the hard iron\n", healthy.ate_m, distorted.ate_m);
  EXPECT_LT(distorted.ate_m, healthy.ate_m + 0.01);
  EXPECT_LT(distorted.max_m, 0.1);
}

TEST(MagneticCalibratingEstimator, WithAnExactCalibrationItIsAsGoodAsWithoutCalibrating) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  const Accuracy calibrating = accuracy(run(kName, input, drive.bundles).best_estimates, drive.truth);
  const Accuracy fixed = accuracy(run("magnetic", input, drive.bundles).best_estimates, drive.truth);
  std::printf("ATE %.4f m, %.4f m without calibrating\n", calibrating.ate_m, fixed.ate_m);
  EXPECT_LT(calibrating.ate_m, fixed.ate_m + 0.01);
}

TEST(MagneticCalibratingEstimator, UsesNeitherScansNorWheels) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  input.suite.wheels.emplace();
  std::vector<ScanBundle> bundles = drive.bundles;
  for (ScanBundle& bundle : bundles) bundle.wheels.push_back({bundle.scan.end, 5.0, 0.0, 0.0});
  const Collector with = run(kName, input, bundles, 40);
  input.planes = nullptr;
  input.suite.wheels.reset();
  for (ScanBundle& bundle : bundles) {
    bundle.scan.points.clear();
    bundle.wheels.clear();
  }
  const Collector without = run(kName, input, bundles, 40);
  ASSERT_EQ(with.causal_estimates.size(), without.causal_estimates.size());
  for (std::size_t i = 0; i < with.causal_estimates.size(); ++i) {
    EXPECT_EQ(with.causal_estimates[i].state.T_map_imu.position, without.causal_estimates[i].state.T_map_imu.position);
  }
}

TEST(MagneticCalibratingEstimator, GivesTheSameBitsOnOneThread) {
  const Drive& drive = shared_drive();
  const Collector many = run(kName, drive.input(), drive.bundles, 50);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Collector single = run(kName, drive.input(), drive.bundles, 50);
  ASSERT_EQ(many.best_estimates.size(), single.best_estimates.size());
  for (std::size_t i = 0; i < many.best_estimates.size(); ++i) {
    EXPECT_EQ(many.best_estimates[i].state.T_map_imu.position, single.best_estimates[i].state.T_map_imu.position);
    EXPECT_EQ(many.best_estimates[i].state.T_map_imu.rotation.coeffs(),
              single.best_estimates[i].state.T_map_imu.rotation.coeffs());
    EXPECT_EQ(many.best_estimates[i].covariance, single.best_estimates[i].covariance);
  }
}

// An outage of the magnetometers leaves the prediction of the IMU, and says so.
TEST(MagneticCalibratingEstimator, WithoutReadingsItsCovarianceGrows) {
  const Drive& drive = shared_drive();
  std::vector<ScanBundle> bundles(drive.bundles.begin(), drive.bundles.begin() + 60);
  for (std::size_t i = 30; i < bundles.size(); ++i) bundles[i].magnetic.clear();
  const Collector result = run(kName, drive.input(), bundles);
  const auto sigma_m = [&](std::size_t i) {
    return std::sqrt(result.causal_estimates[i].covariance.diagonal().tail<3>().maxCoeff());
  };
  EXPECT_GT(sigma_m(59), 3.0 * sigma_m(29));
  EXPECT_EQ(result.causal_estimates[59].diagnostics.magnetic_samples, 0);
}

}  // namespace
}  // namespace lodestone::testing
