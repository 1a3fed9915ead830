#include "estimators/calibration/magnetometer_calibrator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>

#include "core/error.h"
#include "tests/estimators/calibration/simulated_array.h"

namespace lodestone {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::SimulatedArray;

constexpr double kMisalignment = 2.0 * std::numbers::pi / 180.0;

Vector3 some_offset(std::size_t j) {
  const auto share = static_cast<double>(j);
  return {10.0 - 8.0 * share, 5.0 * share, 6.0 - 4.0 * share};
}

MagnetometerCalibrationResult calibrate(const SimulatedArray& array, int moments = 400) {
  CalibrationOptions options;
  options.max_moments = moments;  // limits the duration
  return calibrate_magnetometers(turning_log(array.readings, array.imu, array.suite, options), options);
}

double hard_iron_error(const SimulatedArray& array, const MagnetometerCalibrationResult& result, std::size_t j,
                       int axis) {
  return result.magnetometers[j].calibration.hard_iron_ut[axis] - array.truth[j].hard_iron_ut[axis];
}

/// Errors of all parameters over their predicted sigma.
std::vector<double> normalized_errors(const SimulatedArray& array, const MagnetometerCalibrationResult& result) {
  std::vector<double> normalized;
  for (std::size_t j = 0; j < array.truth.size(); ++j) {
    const CalibratedMagnetometer& found = result.magnetometers[j];
    CalibrationParameters error;
    error << found.calibration.hard_iron_ut - array.truth[j].hard_iron_ut,
        distortion_of(found.calibration.distortion) - distortion_of(array.truth[j].distortion);
    for (int i = 0; i < 12; ++i) normalized.push_back(error[i] / found.sigma[i]);
  }
  return normalized;
}

double mean_square(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return sum / static_cast<double>(values.size());
}

void print(const char* what, const SimulatedArray& array, const MagnetometerCalibrationResult& result) {
  std::printf("%s: walk %.3f, slope %.2f, step %.2f, %d rounds, hidden %d, NEES %.2f\n", what,
              result.process.step_ut_sqrt_s, result.process.slope_ut_m, result.process.slope_step_ut_m_sqrt_s,
              result.rounds, static_cast<int>(result.gain.hidden), mean_square(normalized_errors(array, result)));
  for (std::size_t j = 0; j < array.truth.size(); ++j) {
    const CalibratedMagnetometer& one = result.magnetometers[j];
    std::printf("  %zu: before %.2f after %.2f scale %.2f; hard iron error", j, one.before_ut, one.after_ut,
                one.sigma_scale);
    for (int axis = 0; axis < 3; ++axis)
      std::printf(" %.3f (%.3f)", hard_iron_error(array, result, j, axis), one.sigma[axis]);
    std::printf("\n");
  }
  for (const std::string& line : result.held) std::printf("  %s\n", line.c_str());
}

TEST(CalibrateMagnetometers, TumblingShowsHardAndSoftIronWithoutAMap) {
  SimulatedArray array(3);
  array.motion = testing::tumbling;
  array.field = testing::field_with_steel;
  array.draw_truth(20.0, 0.05, kMisalignment);
  array.run();
  const MagnetometerCalibrationResult result = calibrate(array);
  print("tumbling", array, result);
  for (std::size_t j = 0; j < array.truth.size(); ++j) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_LT(std::abs(hard_iron_error(array, result, j, axis)), 0.3);
    EXPECT_LT(result.magnetometers[j].after_ut, 0.2 * result.magnetometers[j].before_ut);
  }
  // The log does not distinguish a strong field from a large scale.
  ASSERT_EQ(result.held.size(), 1U);
  EXPECT_THAT(result.held[0],
              HasSubstr("all magnetometers alike: scale along all axes together: not determined by this motion"));
}

TEST(CalibrateMagnetometers, OneMagnetometerAloneTumbles) {
  SimulatedArray array(1);
  array.motion = testing::tumbling;
  array.field = testing::uniform_field;
  array.draw_truth(20.0, 0.05, kMisalignment);
  array.run();
  const MagnetometerCalibrationResult result = calibrate(array);
  print("one tumbling", array, result);
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(std::abs(hard_iron_error(array, result, 0, axis)), 0.3);
}

TEST(CalibrateMagnetometers, LevelTurnsShowWhatIsLevel) {
  SimulatedArray array(3);
  array.motion = testing::turning;
  array.field = testing::field_with_steel;
  for (std::size_t j = 0; j < 3; ++j) array.truth[j].hard_iron_ut = some_offset(j);
  array.run();
  const MagnetometerCalibrationResult result = calibrate(array);
  print("turning", array, result);
  Vector3 mean_truth = Vector3::Zero();
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_LT(std::abs(hard_iron_error(array, result, j, 0)), 0.3);
    EXPECT_LT(std::abs(hard_iron_error(array, result, j, 1)), 0.3);
    mean_truth += array.truth[j].hard_iron_ut / 3.0;
  }
  EXPECT_THAT(result.held,
              Contains(HasSubstr("offset along z of the robot: not determined by this motion; kept as given ± 20 µT")));
  EXPECT_THAT(result.held, Not(Contains(HasSubstr("offset along x"))));
  EXPECT_THAT(result.held, Not(Contains(HasSubstr("offset along y"))));
  // Parameters with an undetermined common value may still have determined differences.
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_NEAR(result.magnetometers[j].calibration.hard_iron_ut.z(), array.truth[j].hard_iron_ut.z() - mean_truth.z(),
                0.3);
    EXPECT_GT(result.magnetometers[j].sigma[2], 10.0);
  }
}

TEST(CalibrateMagnetometers, AStraightLineShowsDifferencesAlone) {
  SimulatedArray array(3);
  array.motion = testing::straight;
  array.field = testing::field_with_steel;
  for (std::size_t j = 0; j < 3; ++j) array.truth[j].hard_iron_ut = some_offset(j);
  array.run();
  const MagnetometerCalibrationResult result = calibrate(array);
  print("straight", array, result);
  for (const char axis : {'x', 'y', 'z'}) {
    EXPECT_THAT(result.held, Contains(HasSubstr(std::string("offset along ") + axis +
                                                " of the robot: not determined by this motion")));
  }
  // The common part is unknown, and its sigma is large.
  for (std::size_t j = 0; j < 3; ++j) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GT(result.magnetometers[j].sigma[axis], 10.0);
      EXPECT_LT(std::abs(hard_iron_error(array, result, j, axis)), 3.0 * result.magnetometers[j].sigma[axis]);
    }
  }
}

TEST(CalibrateMagnetometers, AMagnetometerWithoutReadingsIsNamed) {
  SimulatedArray array(3);
  array.motion = testing::tumbling;
  array.field = testing::uniform_field;
  array.duration_s = 20.0;
  array.run();
  CalibrationOptions options;
  CalibrationLog log = turning_log(array.readings, array.imu, array.suite, options);
  for (CalibrationMoment& moment : log.moments)
    std::erase_if(moment.readings, [](const MomentReading& one) { return one.magnetometer == 1; });
  const MagnetometerCalibrationResult result = calibrate_magnetometers(log, options);
  EXPECT_EQ(result.magnetometers[1].readings, 0U);
  EXPECT_EQ(result.magnetometers[1].calibration.distortion, Matrix3::Identity());
  EXPECT_THAT(result.held, Contains("magnetometer_1: no readings; all parameters kept as given"));
  log.moments.resize(5);
  EXPECT_THROW(calibrate_magnetometers(log, options), InputError);
}

// Errors over predicted sigma of all parameters, determined or kept, with true values drawn from the priors.
TEST(CalibrateMagnetometers, ErrorsAreWhatTheirSigmasSay) {
  struct Case {
    const char* name;
    Pose (*motion)(double);
  };
  for (const Case& one :
       {Case{"tumbling", testing::tumbling}, Case{"turning", testing::turning}, Case{"straight", testing::straight}}) {
    std::vector<double> all;
    for (unsigned seed = 1; seed <= 4; ++seed) {
      SimulatedArray array(3);
      array.seed = seed;
      array.duration_s = 25.0;
      array.motion = one.motion;
      array.field = testing::field_with_steel;
      array.draw_truth(20.0, 0.05, kMisalignment);
      array.run();
      const std::vector<double> errors = normalized_errors(array, calibrate(array, 200));
      all.insert(all.end(), errors.begin(), errors.end());
    }
    std::printf("%s: mean square of %zu errors over their sigmas %.2f\n", one.name, all.size(), mean_square(all));
    EXPECT_LT(mean_square(all), 1.5) << one.name;
    EXPECT_GT(mean_square(all), 0.5) << one.name;
  }
}

}  // namespace
}  // namespace lodestone
