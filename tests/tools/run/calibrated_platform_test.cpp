// A run's estimated calibration, written to a platform file: the new file without corrections gives the same
// predictions as the old file with corrections.
#include "tools/run/calibrated_platform.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "core/angles.h"
#include "core/lidar/swept_cost.h"
#include "factors/field_factor.h"
#include "factors/seen_pose.h"
#include "frontends/configuration/text_file.h"
#include "frontends/messages/stream_decoder.h"
#include "tests/tools/program_runner.h"
#include "tools/run/calibration_file.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

class CalibratedPlatformTest : public testing::Test {
 protected:
  CalibratedPlatformTest() {
    platform_ = load_platform(std::string(LODESTONE_SOURCE_DIR) + "/config/platforms/scout_os32.yaml");
    platform_.suite.lidar.T_imu_lidar = {so3::exp({0.3, -0.2, 1.1}), {0.4, -0.1, 0.3}};
    platform_.further_lidars.push_back(platform_.lidar);
    platform_.further_lidars[0].clock_offset_s = 0.001;
    platform_.suite.further_lidars.push_back(platform_.suite.lidar);
    platform_.suite.further_lidars[0].T_imu_lidar = {so3::exp({-0.1, 0.7, 0.2}), {-0.4, 0.2, 0.1}};
    platform_.lidar.clock_offset_s = 0.004;
    platform_.magnetometer_clock_offset_s = -0.002;
    platform_.magnetometers[3].hard_iron_ut = {4.0, -3.0, 7.0};
    platform_.magnetometers[3].soft_iron_correction << 1.02, 0.01, 0.0, 0.02, 0.97, 0.01, -0.01, 0.03, 1.01;
    // Much larger than usual, to reveal formulas that hold to first order only.
    estimate_.lidar = {{{0.05, -0.04, 0.06}, {0.02, -0.03, 0.01}, 0.003}, {1e-4, 2e-4, 5e-5}, {1e-3, 2e-3, 3e-3}, 4e-4};
    for (std::size_t k = 0; k < platform_.suite.magnetometers.size(); ++k) {
      const double size = 0.01 * static_cast<double>(k + 1);
      CalibrationEstimate::Magnetometer one;
      one.turn_rad = size * Vector3(1.0, -0.5, 0.7);
      one.turn_sigma_rad = Vector3(0.001, 0.002, 0.001 * static_cast<double>(k));
      one.distortion << size, -0.3 * size, 0.2 * size, -size, 0.4 * size, 0.5 * size;
      one.distortion_sigma.setConstant(1e-4 * static_cast<double>(k + 1));
      estimate_.magnetometers.push_back(one);
    }
    estimate_.magnetometer_clock_s = 0.006;
    estimate_.magnetometer_clock_sigma_s = 0.0005;
  }

  Platform calibrated() const { return calibrated_platform(platform_, platform_.suite, estimate_); }

  Platform platform_;
  CalibrationEstimate estimate_;
};

/// A LiDAR point has the same position in the map with the corrected mounting, for both ways to apply the correction.
TEST_F(CalibratedPlatformTest, APointOfTheLidarIsSeenWhereTheCorrectionSeesIt) {
  const Platform result = calibrated();
  const Pose T_map_imu{so3::exp({0.2, 0.3, -2.0}), {12.0, -7.0, 1.5}};
  const LidarCorrection& correction = estimate_.lidar.correction;
  std::array<double, 6> mounting{};
  Eigen::Map<Vector6>(mounting.data()) << correction.turn_rad, correction.shift_m;
  CondensedScan scan;
  scan.by_lidar = true;
  scan.beam_origin_m = platform_.suite.lidar.T_imu_lidar.position;
  const Pose seen = see(scan, T_map_imu, mounting.data()).pose;
  const Vector3 point(5.0, -20.0, 3.0);
  EXPECT_LT((seen * (platform_.suite.lidar.T_imu_lidar * point) - T_map_imu * (result.suite.lidar.T_imu_lidar * point))
                .norm(),
            1e-12);
}

TEST_F(CalibratedPlatformTest, FurtherLidarsMoveWithTheFirst) {
  const Platform result = calibrated();
  const Pose before = platform_.suite.lidar.T_imu_lidar.inverse() * platform_.suite.further_lidars[0].T_imu_lidar;
  const Pose after = result.suite.lidar.T_imu_lidar.inverse() * result.suite.further_lidars[0].T_imu_lidar;
  EXPECT_LT(after.boxminus(before).norm(), 1e-12);
  EXPECT_NEAR(result.lidar.clock_offset_s, 0.007, 1e-15);
  EXPECT_NEAR(result.further_lidars[0].clock_offset_s, 0.004, 1e-15);
}

std::shared_ptr<const MagneticMap> uniform_map(const Eigen::Vector3f& field_ut) {
  FieldGrid grid;
  grid.origin = {-50.0, -50.0};
  grid.resolution_m = 100.0;
  grid.columns = grid.rows = 2;
  grid.heights_m = {0.0};
  const Eigen::Vector4f node(field_ut.x(), field_ut.y(), field_ut.z(), 0.5F);
  return std::make_shared<MagneticMap>(grid, std::vector<Eigen::Vector4f>(4, node), 5.0);
}

/// The residual of a raw reading, calibrated by `platform`, with `parameters` as states of the matrices.
Vector3 residual_of(const Platform& platform, std::size_t k, const Vector3& raw_ut, const std::vector<double>& matrices,
                    const std::shared_ptr<const MagneticMap>& map, const Pose& T_map_imu) {
  FieldReading reading;
  reading.T_end_mag = platform.suite.magnetometers[k].T_imu_mag;
  reading.measured_ut = calibrated(platform.magnetometers[k], raw_ut);
  reading.magnetometer = static_cast<int>(k);
  const int count = static_cast<int>(platform.suite.magnetometers.size());
  const FieldFactor factor(map, FieldInterpolation::bilinear, count, {reading}, {}, {.matrices = true});
  const Quaternion& q = T_map_imu.rotation;
  const Vector3& p = T_map_imu.position;
  const std::array<double, 7> pose{q.x(), q.y(), q.z(), q.w(), p.x(), p.y(), p.z()};
  const std::vector<double> biases(3 * static_cast<std::size_t>(count), 0.0);
  const std::array<const double*, 3> parameters{pose.data(), biases.data(), matrices.data()};
  Vector3 residual;
  factor.Evaluate(parameters.data(), residual.data(), nullptr);
  return residual;
}

TEST_F(CalibratedPlatformTest, AReadingThatTheCorrectionExplainsIsExplainedByTheNewFile) {
  const Platform result = calibrated();
  const auto map = uniform_map({18.0, 4.0, -42.0});
  const Pose T_map_imu{so3::exp({0.2, 0.3, -2.0}), {1.0, -2.0, 0.0}};
  std::vector<double> states, none;
  for (const CalibrationEstimate::Magnetometer& one : estimate_.magnetometers) {
    for (int i = 0; i < 3; ++i) states.push_back(one.turn_rad[i]);
    for (int i = 0; i < 6; ++i) states.push_back(one.distortion[i]);
  }
  none.assign(states.size(), 0.0);
  for (std::size_t k = 0; k < platform_.magnetometers.size(); ++k) {
    // The reading that has no residual with the old file and the corrections.
    const Vector3 expected =
        -residual_of(platform_, k, platform_.magnetometers[k].hard_iron_ut, states, map, T_map_imu);
    const Vector3 raw =
        platform_.magnetometers[k].soft_iron_correction.inverse() * expected + platform_.magnetometers[k].hard_iron_ut;
    ASSERT_LT(residual_of(platform_, k, raw, states, map, T_map_imu).norm(), 1e-10) << k;
    EXPECT_GT(residual_of(platform_, k, raw, none, map, T_map_imu).norm(), 0.1) << k;
    EXPECT_LT(residual_of(result, k, raw, none, map, T_map_imu).norm(), 1e-10) << k;
  }
}

TEST_F(CalibratedPlatformTest, WheelsThatTheCorrectionExplainsAreExplainedByTheNewFile) {
  EXPECT_FALSE(calibrated().suite.wheels);
  platform_.suite.wheels.emplace().T_imu_wheels = {so3::exp({0.1, -0.2, 0.4}), {0.2, 0.1, -0.3}};
  platform_.wheels.scale = 1.5;
  EXPECT_EQ(calibrated().wheels.scale, 1.5);  // not estimated
  estimate_.wheels.correction = {0.04, Vector3(0.01, 0.02, -0.03)};
  estimate_.wheels.scale_sigma = 0.003;
  estimate_.wheels.turn_sigma_rad = Vector3(0.001, 0.002, 0.003);
  const Platform result = calibrated();
  const Vector3 velocity(1.0, 0.2, -0.1);
  const Pose& before = platform_.suite.wheels->T_imu_wheels;
  const Vector3 reported = 1.5 * 1.04 * (estimate_.wheels.correction.corrected(before).rotation.conjugate() * velocity);
  const Vector3 read = reported / result.wheels.scale;
  EXPECT_LT((read - result.suite.wheels->T_imu_wheels.rotation.conjugate() * velocity).norm(), 1e-12);
  EXPECT_EQ(result.suite.wheels->T_imu_wheels.position, before.position);
  EXPECT_EQ(result.suite.calibration.wheels.scale_sigma, 0.003);
  EXPECT_NEAR(result.suite.calibration.wheels.rotation_sigma_deg, degrees_per_radian * 0.003, 1e-12);
  EXPECT_EQ(result.suite.calibration.wheels.slip_sigma, platform_.suite.calibration.wheels.slip_sigma);
}

TEST_F(CalibratedPlatformTest, SigmasAreTheLargestThatAreLeftAndNeverGrow) {
  const CalibrationSigmas sigmas = calibrated().suite.calibration;
  EXPECT_NEAR(sigmas.lidar.rotation_sigma_deg, degrees_per_radian * 2e-4, 1e-15);
  EXPECT_EQ(sigmas.lidar.translation_sigma_m, 3e-3);
  EXPECT_EQ(sigmas.lidar.clock_sigma_s, 4e-4);
  EXPECT_NEAR(sigmas.magnetometers.rotation_sigma_deg, degrees_per_radian * 0.007, 1e-15);
  EXPECT_NEAR(sigmas.magnetometers.matrix_sigma, 8e-4, 1e-15);
  EXPECT_EQ(sigmas.magnetometers.clock_sigma_s, 0.0005);
  EXPECT_EQ(sigmas.magnetometers.offset_sigma_ut, platform_.suite.calibration.magnetometers.offset_sigma_ut);
  estimate_.lidar.shift_sigma_m.x() = 0.5;
  EXPECT_EQ(calibrated().suite.calibration.lidar.translation_sigma_m,
            platform_.suite.calibration.lidar.translation_sigma_m);
}

TEST_F(CalibratedPlatformTest, WhatWasNotEstimatedKeepsValueAndSigma) {
  const TemporaryFolder folder;
  save_platform(platform_, (folder / "before.yaml").string());
  estimate_ = {};
  estimate_.magnetometers.resize(platform_.magnetometers.size());
  save_platform(calibrated(), (folder / "after.yaml").string());
  EXPECT_EQ(read_text_file((folder / "after.yaml").string()), read_text_file((folder / "before.yaml").string()));
}

TEST_F(CalibratedPlatformTest, MagnetometersThatTheRunDidNotUseStayAndSoDoTheSigmasOfAll) {
  SensorSuite used = platform_.suite;
  used.magnetometers = {platform_.suite.magnetometers[5]};
  estimate_.magnetometers.resize(1);
  const Platform result = calibrated_platform(platform_, used, estimate_);
  EXPECT_EQ(result.magnetometers[4].soft_iron_correction, platform_.magnetometers[4].soft_iron_correction);
  EXPECT_NE(result.magnetometers[5].soft_iron_correction, platform_.magnetometers[5].soft_iron_correction);
  EXPECT_EQ(result.suite.magnetometers.size(), platform_.suite.magnetometers.size());
  EXPECT_EQ(result.suite.calibration.magnetometers.rotation_sigma_deg,
            platform_.suite.calibration.magnetometers.rotation_sigma_deg);
}

TEST_F(CalibratedPlatformTest, TheFileReadsBackToTheSameBits) {
  const TemporaryFolder folder;
  const Platform result = calibrated();
  save_platform(result, (folder / "platform.yaml").string(), "a comment");
  const Platform back = load_platform((folder / "platform.yaml").string());
  EXPECT_EQ(back.suite.lidar.T_imu_lidar.rotation.coeffs(), result.suite.lidar.T_imu_lidar.rotation.coeffs());
  EXPECT_EQ(back.suite.lidar.T_imu_lidar.position, result.suite.lidar.T_imu_lidar.position);
  EXPECT_EQ(back.lidar.clock_offset_s, result.lidar.clock_offset_s);
  EXPECT_EQ(back.magnetometer_clock_offset_s, result.magnetometer_clock_offset_s);
  for (std::size_t k = 0; k < result.magnetometers.size(); ++k) {
    EXPECT_EQ(back.magnetometers[k].soft_iron_correction, result.magnetometers[k].soft_iron_correction);
    EXPECT_EQ(back.magnetometers[k].hard_iron_ut, result.magnetometers[k].hard_iron_ut);
    EXPECT_EQ(back.suite.magnetometers[k].T_imu_mag.rotation.coeffs(),
              result.suite.magnetometers[k].T_imu_mag.rotation.coeffs());
  }
  EXPECT_EQ(back.suite.calibration.lidar.rotation_sigma_deg, result.suite.calibration.lidar.rotation_sigma_deg);
}

TEST_F(CalibratedPlatformTest, AParameterBeyondThreeSigmasIsWarnedOfWithItsKey) {
  estimate_.lidar.correction = {{0.001, 0.002, 0.003}, {0.02, -0.03, -0.031}, 0.003};
  estimate_.magnetometer_clock_s = -0.029;
  WarningLog warnings;
  warn_of_calibration(platform_.suite, estimate_, 7, warnings);
  EXPECT_EQ(warnings.count("calibration.lidar.translation"), 1);
  EXPECT_EQ(warnings.count("calibration.lidar.rotation"), 0);
  EXPECT_EQ(warnings.count("calibration.lidar.clock"), 0);
  EXPECT_EQ(warnings.count("calibration.magnetometers.clock"), 0);
  // Beyond 0.03: ±size from 0.04 on (5 each), 0.4 size at 0.08, 0.5 size at 0.07 and 0.08.
  EXPECT_EQ(warnings.count("calibration.magnetometers.matrix"), 13);
  const std::string text = warnings.entries().at("calibration.lidar.translation").first_detail;
  EXPECT_THAT(text, HasSubstr("lidar.T_imu_lidar: shift_z differs by -0.031 m from the platform file, 3.1 times "
                              "lidar.calibration.translation_sigma_m (0.01)"));
  EXPECT_THAT(warnings.entries().at("calibration.magnetometers.matrix").first_detail,
              HasSubstr("soft_iron_correction of " + platform_.suite.magnetometers[7].name));
}

TEST_F(CalibratedPlatformTest, AWheelScaleBeyondThreeSigmasIsWarnedOfWithItsKey) {
  platform_.suite.wheels.emplace();
  estimate_.wheels.correction.scale = 0.05;
  estimate_.wheels.scale_sigma = 0.002;
  WarningLog warnings;
  warn_of_calibration(platform_.suite, estimate_, 7, warnings);
  EXPECT_EQ(warnings.count("calibration.wheels.scale"), 1);
  EXPECT_EQ(warnings.count("calibration.wheels.rotation"), 0);
  EXPECT_THAT(warnings.entries().at("calibration.wheels.scale").first_detail,
              HasSubstr("wheels.scale: scale differs by 0.05 from the platform file"));
}

}  // namespace
}  // namespace lodestone
