#include "tools/run/calibration_consistency.h"

#include <gmock/gmock.h>

#include <fstream>
#include <numbers>

#include "core/error.h"
#include "tests/tools/program_runner.h"
#include "tools/run/calibration_file.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

/// A LiDAR that is rotated by 90° about z in the platform file, and one magnetometer that is rotated by 180°.
SensorSuite suite_of_two() {
  SensorSuite suite;
  suite.lidar.T_imu_lidar = {so3::exp({0.0, 0.0, 90.0 * kDegree}), {0.1, 0.2, 0.3}};
  suite.magnetometers.resize(1);
  suite.magnetometers[0].name = "rear";
  suite.magnetometers[0].T_imu_mag = {so3::exp({0.0, 0.0, 180.0 * kDegree}), {-0.3, 0.0, 0.0}};
  return suite;
}

/// As written by `simulate`: the LiDAR rotated by further 2° about the x axis of the imu, 1 cm in front, 3 ms late; the
/// magnetometer rotated by further 1° about its own y axis, with 2 % more along x, and 5 ms early.
constexpr const char* kReality = R"(
seed: 1
imu:
  gyroscope_matrix: [1.004, 0.001, 0, 0, 1, 0, 0, 0, 0.998]
  accelerometer_matrix: [1, 0, 0, 0, 1, 0, 0.002, 0, 1]
lidar:
  T_imu_lidar: {translation_m: [0.11, 0.2, 0.3], quaternion_xyzw: [0.012340715, -0.012340715, 0.706999074, 0.706999074]}
  clock_offset_s: 0.003
magnetometer_clock_offset_s: -0.005
magnetometers:
  - name: rear
    T_imu_mag: {translation_m: [-0.3, 0.0, 0.0], quaternion_xyzw: [-0.008726535, 0.0, 0.999961923, 0.0]}
    matrix: [1.02, 0, 0, 0, 1, 0, 0, 0, 1]
    offset_ut: [0, 0, 0]
)";

class CalibrationConsistencyTest : public testing::Test {
 protected:
  CalibrationEstimate truth(const std::string& text = kReality) {
    std::ofstream(folder_ / "reality.yaml") << text;
    return read_true_calibration((folder_ / "reality.yaml").string(), suite_);
  }

  TemporaryFolder folder_;
  SensorSuite suite_ = suite_of_two();
};

TEST_F(CalibrationConsistencyTest, TrueWheelsAreDeparturesFromThePlatformFile) {
  suite_.wheels.emplace().T_imu_wheels.rotation = so3::exp({0.0, 0.0, 90.0 * kDegree});
  const std::string wheels =
      "wheels:\n  T_imu_wheels: {translation_m: [0, 0, 0], quaternion_xyzw: [0.012340715, 0.012340715, 0.706999074, "
      "0.706999074]}\n  scale: 1.02\n";
  const CalibrationEstimate calibration = truth(kReality + wheels);
  EXPECT_NEAR(calibration.wheels.correction.scale, 0.02, 1e-12);
  EXPECT_LT((calibration.wheels.correction.turn_rad - Vector3(2.0 * kDegree, 0.0, 0.0)).norm(), 1e-6);
}

TEST_F(CalibrationConsistencyTest, TrueValuesAreDeparturesFromThePlatformFile) {
  const CalibrationEstimate calibration = truth();
  // Exp(turn) R₀ with turn about the imu's x axis: (sin 1°, 0, 0, cos 1°) ⊗ (0, 0, sin 45°, cos 45°).
  EXPECT_NEAR((calibration.lidar.correction.turn_rad - Vector3(2.0 * kDegree, 0.0, 0.0)).norm(), 0.0, 1e-6);
  EXPECT_NEAR((calibration.lidar.correction.shift_m - Vector3(0.01, 0.0, 0.0)).norm(), 0.0, 1e-12);
  EXPECT_EQ(calibration.lidar.correction.clock_s, 0.003);
  ImuAxes axes = ImuAxes::Zero();
  axes[0] = 0.004;
  axes[1] = 0.001;
  axes[8] = -0.002;
  axes[9 + 6] = 0.002;
  EXPECT_LT((calibration.imu.axes - axes).norm(), 1e-12);
  EXPECT_EQ(calibration.magnetometer_clock_s, -0.005);
  ASSERT_EQ(calibration.magnetometers.size(), 1U);
  // Second order in the angle: 1.5e-4, and half the distortion times the angle.
  const auto& magnetometer = calibration.magnetometers[0];
  EXPECT_NEAR((magnetometer.turn_rad - Vector3(0.0, 1.0 * kDegree, 0.0)).norm(), 0.0, 2e-4);
  EXPECT_NEAR(magnetometer.distortion[0], 0.02, 2e-4);
  EXPECT_LT(magnetometer.distortion.tail<5>().norm(), 3e-4);
}

/// The drawn mounting and matrix determine a magnetometer's readings; the departures must give the same readings.
TEST_F(CalibrationConsistencyTest, DeparturesOfAMagnetometerGiveItsReadings) {
  const auto magnetometer = truth().magnetometers[0];
  double parameters[CalibrationEstimate::kMatrixParameters];
  Eigen::Map<Vector3>(parameters, 3) = magnetometer.turn_rad;
  Eigen::Map<Vector6>(parameters + 3, 6) = magnetometer.distortion;
  const Vector3 field_imu(12.0, -7.0, 43.0);
  const Quaternion true_rotation = suite_.magnetometers[0].T_imu_mag.rotation * so3::exp({0.0, kDegree, 0.0});
  const Vector3 reading = Vector3(1.02, 1.0, 1.0).asDiagonal() * (true_rotation.conjugate() * field_imu);
  const Vector3 believed = suite_.magnetometers[0].T_imu_mag.rotation.conjugate() * field_imu;
  const Vector3 predicted = believed + CalibrationEstimate::matrix_of(parameters) * believed;
  EXPECT_LT((predicted - reading).norm(), 1e-4);
  EXPECT_GT((believed - reading).norm(), 0.1);
}

TEST_F(CalibrationConsistencyTest, ErrorsOverSigmasOfWhatWasEstimated) {
  CalibrationEstimate estimate;
  estimate.lidar.correction.shift_m = {0.006, 0.0, 0.001};  // errors −4 mm, 0, 1 mm
  estimate.lidar.shift_sigma_m = {0.002, 0.0, 0.002};       // y was not estimated
  estimate.lidar.correction.clock_s = 0.004;                // 1 ms more
  estimate.lidar.clock_sigma_s = 0.001;
  estimate.magnetometer_clock_s = -0.002;  // 3 ms more
  estimate.magnetometer_clock_sigma_s = 0.006;
  const auto result = compare_calibration(suite_, estimate, truth());
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->parameters, 4);
  EXPECT_NEAR(result->nees, (4.0 + 0.25 + 1.0 + 0.25) / 4.0, 1e-9);
  EXPECT_NEAR(result->nees_lidar.value(), (4.0 + 0.25 + 1.0) / 3.0, 1e-9);
  // The platform file's sigmas are 10 mm, 3 ms, 10 ms; its errors are (10 mm, 0 mm), 3 ms and 5 ms.
  EXPECT_NEAR(result->prior_nees, (1.0 + 0.0 + 1.0 + 0.25) / 4.0, 1e-9);

  write_calibration(folder_ / "calibration.csv", suite_, estimate);
  const std::string text = content_of(folder_ / "calibration.csv");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + result->parameters);
  EXPECT_THAT(text, HasSubstr("lidar,shift_x,m,0.006,0.002,0.01\n"));
}

TEST_F(CalibrationConsistencyTest, NothingWhereNothingIsEstimated) {
  EXPECT_FALSE(compare_calibration(suite_, CalibrationEstimate{}, truth()).has_value());
}

TEST_F(CalibrationConsistencyTest, AnotherSimulationsFileIsNamed) {
  suite_.magnetometers[0].name = "front";
  try {
    truth();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("reality.yaml"));
    EXPECT_THAT(error.what(), HasSubstr("no magnetometer 'front'"));
    EXPECT_THAT(error.what(), HasSubstr("rear"));
  }
}

}  // namespace
}  // namespace lodestone
