// Calibration against a map: of a robot that drives level through a field with steel, with a map that errs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>

#include "estimators/calibration/magnetometer_calibrator.h"
#include "tests/estimators/calibration/simulated_array.h"

namespace lodestone {
namespace {

using testing::SimulatedArray;

constexpr double kMapSigma_ut = 0.5;
constexpr double kMapCorrelation_m = 0.3;

/// A drive in loops, nose ahead.
Pose loops(double t) {
  const auto place = [](double s) { return Vector3(1.6 * std::sin(0.25 * s), 1.1 * std::sin(0.4 * s + 0.5), 0.2); };
  const Vector3 ahead = place(t + 0.01) - place(t - 0.01);
  return {so3::exp(Vector3(0.0, 0.0, std::atan2(ahead.y(), ahead.x()))), place(t)};
}

/// The field with an error that is alike over the correlation length.
MagneticMap erring_map(unsigned seed) {
  constexpr int kWaves = 60;
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  struct Wave {
    Eigen::Vector2d number;
    double phase;
  };
  std::vector<Wave> waves(3 * kWaves);
  for (Wave& wave : waves)
    wave = {Eigen::Vector2d(normal(generator), normal(generator)) / kMapCorrelation_m, phase(generator)};
  FieldGrid grid;
  grid.resolution_m = 0.1;
  grid.origin = Eigen::Vector2d(-2.5, -2.0);
  grid.columns = 51;
  grid.rows = 41;
  grid.heights_m = {0.2};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d at = grid.origin + grid.resolution_m * Eigen::Vector2d(column, row);
      Vector3 field = testing::field_with_steel({at.x(), at.y(), 0.2});
      for (int i = 0; i < 3 * kWaves; ++i) {
        const Wave& wave = waves[static_cast<std::size_t>(i)];
        field[i % 3] += kMapSigma_ut * std::sqrt(2.0 / kWaves) * std::cos(wave.number.dot(at) + wave.phase);
      }
      nodes.emplace_back(field.x(), field.y(), field.z(), kMapSigma_ut);
    }
  }
  return MagneticMap(grid, nodes, 10.0);
}

SimulatedArray drive(unsigned seed) {
  SimulatedArray array(3);
  for (MagnetometerModel& model : array.suite.magnetometers) model.T_imu_mag.position.z() = 0.0;
  array.seed = seed;
  array.motion = loops;
  array.field = testing::field_with_steel;
  return array;
}

MagnetometerCalibrationResult calibrate_in_map(const SimulatedArray& array, const MagneticMap& map,
                                               CalibrationOptions options = {}) {
  options.max_moments = 300;  // each costs time
  return calibrate_magnetometers(mapped_log(array.readings, array.trajectory, map, array.suite, options), options);
}

class LevelDriveWithAMap : public ::testing::Test {
 protected:
  LevelDriveWithAMap() : array_(drive(5)) {
    for (std::size_t j = 0; j < 3; ++j) {
      const auto share = static_cast<double>(j);
      array_.truth[j].hard_iron_ut = Vector3(10.0 - 8.0 * share, 5.0 * share, 6.0 - 4.0 * share);
    }
    array_.run();
  }

  Vector3 error(const MagnetometerCalibrationResult& result, std::size_t j) const {
    return result.magnetometers[j].calibration.hard_iron_ut - array_.truth[j].hard_iron_ut;
  }

  SimulatedArray array_;
};

// An offset and a tilt in a field that hardly changes do the same. What they do together is shown, each alone is not,
// and the sigmas say so.
TEST_F(LevelDriveWithAMap, ShowsWhatEachReadsBesideTheField) {
  const MagnetometerCalibrationResult result = calibrate_in_map(array_, erring_map(7));
  for (std::size_t j = 0; j < 3; ++j) {
    const CalibratedMagnetometer& one = result.magnetometers[j];
    std::printf(
        "%zu: before %.2f after %.2f; hard iron error %.3f (%.3f) %.3f (%.3f) %.3f (%.3f); beside the usual field "
        "(%.3f %.3f %.3f)\n",
        j, one.before_ut, one.after_ut, error(result, j).x(), one.sigma[0], error(result, j).y(), one.sigma[1],
        error(result, j).z(), one.sigma[2], one.usual_error_sigma_ut.x(), one.usual_error_sigma_ut.y(),
        one.usual_error_sigma_ut.z());
    EXPECT_LT((one.usual_error_ut - array_.truth[j].hard_iron_ut).cwiseAbs().maxCoeff(), 0.3);
    EXPECT_LT(one.usual_error_sigma_ut.maxCoeff(), 0.3);
    EXPECT_LT(error(result, j).cwiseQuotient(one.sigma.head<3>()).cwiseAbs().maxCoeff(), 3.0);
    EXPECT_LT(one.after_ut, 1.2 * std::hypot(kMapSigma_ut, 0.56));
  }
}

TEST_F(LevelDriveWithAMap, ShowsAllOfTheHardIronWhereThereIsNothingElse) {
  CalibrationOptions options;
  options.soft_iron_sigma = 1e-3;
  options.misalignment_sigma_deg = 0.05;
  const MagnetometerCalibrationResult result = calibrate_in_map(array_, erring_map(7), options);
  for (std::size_t j = 0; j < 3; ++j) EXPECT_LT(error(result, j).cwiseAbs().maxCoeff(), 0.3);
  for (const std::string& line : result.held) EXPECT_THAT(line, ::testing::Not(::testing::HasSubstr("offset")));
}

TEST(CalibrateAgainstAMap, ErrorsAreWhatTheirSigmasSay) {
  double squares = 0.0, usual = 0.0;
  int count = 0, usual_count = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SimulatedArray array = drive(seed);
    array.draw_truth(20.0, 0.05, 2.0 * std::numbers::pi / 180.0);
    array.run();
    const MagnetometerCalibrationResult result = calibrate_in_map(array, erring_map(100 + seed));
    for (std::size_t j = 0; j < 3; ++j) {
      const CalibratedMagnetometer& one = result.magnetometers[j];
      CalibrationParameters error;
      error << one.calibration.hard_iron_ut - array.truth[j].hard_iron_ut,
          distortion_of(one.calibration.distortion) - distortion_of(array.truth[j].distortion);
      squares += error.cwiseQuotient(one.sigma).squaredNorm();
      count += 12;
      const Vector3 beside = one.calibration.distortion * one.usual_field_ut + one.calibration.hard_iron_ut -
                             array.truth[j].distortion * one.usual_field_ut - array.truth[j].hard_iron_ut;
      usual += beside.cwiseQuotient(one.usual_error_sigma_ut).squaredNorm();
      usual_count += 3;
    }
  }
  std::printf("mean square of %d errors over their sigmas %.2f; of what is read beside the usual field %.2f\n", count,
              squares / count, usual / usual_count);
  EXPECT_LT(squares / count, 1.5);
  EXPECT_GT(squares / count, 0.4);
  EXPECT_LT(usual / usual_count, 2.0);
  EXPECT_GT(usual / usual_count, 0.2);
}

TEST(CalibrateAgainstAMap, ReadingsOffTheMapOrTheTrajectoryAreLeftOut) {
  SimulatedArray array = drive(3);
  array.run();
  array.trajectory.erase(array.trajectory.begin() + 4000, array.trajectory.begin() + 8000);
  const CalibrationOptions options;
  MagneticMap map = erring_map(7);
  const CalibrationLog log = mapped_log(array.readings, array.trajectory, map, array.suite, options);
  EXPECT_NEAR(static_cast<double>(log.without_motion), 400.0, 10.0);
  EXPECT_EQ(log.off_map, 0U);
  for (MagnetometerModel& model : array.suite.magnetometers) model.T_imu_mag.position.x() += 100.0;
  const CalibrationLog off = mapped_log(array.readings, array.trajectory, map, array.suite, options);
  EXPECT_TRUE(off.moments.empty());
  EXPECT_NEAR(static_cast<double>(off.off_map), 3.0 * 800.0, 30.0);
}

}  // namespace
}  // namespace lodestone
