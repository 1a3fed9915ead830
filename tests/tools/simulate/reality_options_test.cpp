#include "tools/simulate/reality_options.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "core/angles.h"
#include "core/error.h"
#include "tests/tools/simulate/reality_world.h"

namespace lodestone::simulation {
namespace {

using ::testing::HasSubstr;

class RealityOptionsOfAWorld : public RealityHall {
 protected:
  std::string error_of(const std::string& reality) const {
    try {
      load(reality);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(RealityOptionsOfAWorld, AGradeIsANameOrTheBaseOfOtherKeys) {
  EXPECT_EQ(load("field").reality.lidar_extrinsic_translation_sigma_m, 0.010);
  EXPECT_EQ(load("rough").reality.magnetometer_offset_sigma_ut, 5.0);
  EXPECT_EQ(load("calibrated").reality.doubled_walls_share, 0.0);
  const RealityOptions own = load("{grade: field, lidar_clock_offset_sigma_s: 0.001}").reality;
  EXPECT_EQ(own.lidar_clock_offset_sigma_s, 0.001);
  EXPECT_EQ(own.magnetometer_clock_offset_sigma_s, 0.010);
  const RealityOptions alone = load("{people: 3}").reality;
  EXPECT_EQ(alone.grade, RealityGrade::exact);
  EXPECT_EQ(alone.people, 3.0);
  EXPECT_EQ(alone.imu_scale_sigma, 0.0);
}

TEST_F(RealityOptionsOfAWorld, TheGradeOfTheCommandLineReplacesThatOfTheWorld) {
  const World named = load_world(file_, {"reality=rough", "reality.grade=calibrated"});
  EXPECT_EQ(named.reality.imu_scale_sigma, 0.001);
  const World keyed = load_world(file_, {"reality={grade: rough, people: 9}", "reality.grade=calibrated"});
  EXPECT_EQ(keyed.reality.imu_scale_sigma, 0.001);
  EXPECT_EQ(keyed.reality.people, 9.0);
}

TEST_F(RealityOptionsOfAWorld, MistakesAreOneLineThatNamesTheRightKey) {
  EXPECT_THAT(error_of("feild"), HasSubstr("field"));
  EXPECT_THAT(error_of("{grade: feild}"), HasSubstr("field"));
  EXPECT_THAT(error_of("{lidar_clock_ofset_sigma_s: 1}"), HasSubstr("lidar_clock_offset_sigma_s"));
  for (const char* value : {"-1", ".nan", ".inf", "1e300", "[1, 2]", "many", "{}"}) {
    for (const char* key : {"lidar_extrinsic_translation_sigma_m",
                            "lidar_extrinsic_rotation_sigma_deg",
                            "magnetometer_extrinsic_translation_sigma_m",
                            "magnetometer_extrinsic_rotation_sigma_deg",
                            "lidar_clock_offset_sigma_s",
                            "lidar_stamp_jitter_sigma_s",
                            "magnetometer_clock_offset_sigma_s",
                            "range_bias_a_ring_sigma_m",
                            "range_bias_at_80deg_incidence_sigma_m",
                            "mixed_points",
                            "imu_scale_sigma",
                            "imu_misalignment_sigma_deg",
                            "magnetometer_offset_sigma_ut",
                            "magnetometer_matrix_sigma",
                            "platform_field_sigma_ut",
                            "cloud_displacement_rms_m",
                            "cloud_displacement_length_m",
                            "cloud_noise_m",
                            "doubled_walls_share",
                            "doubled_walls_distance_m",
                            "survey_pose_sigma_m",
                            "moved_objects_share",
                            "people",
                            "vehicles",
                            "noise_density_factor_max",
                            "wheel_scale_sigma",
                            "wheel_rotation_sigma_deg",
                            "wheel_slip_sigma"}) {
      const std::string message = error_of("{" + std::string(key) + ": " + value + "}");
      EXPECT_THAT(message, HasSubstr(key)) << value;
      EXPECT_EQ(message.find('\n'), std::string::npos);
    }
  }
  EXPECT_THAT(error_of("{cloud_displacement_rms_m: 1, cloud_displacement_length_m: 5}"), HasSubstr("a tenth"));
  EXPECT_THAT(error_of("{noise_density_factor_max: 0.5}"), HasSubstr("1 to 100"));
}

/// Root mean square of what `value` returns for the draws of many seeds.
double rms_over_seeds(const World& world, const std::function<Vector3(const Reality&)>& value) {
  constexpr int seeds = 200;
  double squares = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) squares += value(draw_reality(world, seed)).squaredNorm() / 3.0;
  return std::sqrt(squares / seeds);
}

TEST_F(RealityOptionsOfAWorld, DrawsHaveTheSigmasOfTheirKeys) {
  const World world = load("field");
  const RealityOptions& options = world.reality;
  // Of 600 normal numbers, the rms is within 10 % of sigma at 3.5 standard deviations; of 200, within 18 %.
  const auto expect = [&](double sigma, double tolerance, const std::function<Vector3(const Reality&)>& value) {
    EXPECT_NEAR(rms_over_seeds(world, value) / sigma, 1.0, tolerance);
  };
  expect(options.lidar_extrinsic_translation_sigma_m, 0.1, [](const Reality& r) { return r.lidar.mounting.tail<3>(); });
  expect(options.lidar_extrinsic_rotation_sigma_deg * degree, 0.1,
         [](const Reality& r) { return r.lidar.mounting.head<3>(); });
  expect(options.magnetometer_extrinsic_translation_sigma_m, 0.1,
         [](const Reality& r) { return r.magnetometers[1].mounting.tail<3>(); });
  expect(options.magnetometer_extrinsic_rotation_sigma_deg * degree, 0.1,
         [](const Reality& r) { return r.magnetometers[0].mounting.head<3>(); });
  const auto same_three = [](double value) { return Vector3::Constant(value); };
  expect(options.lidar_clock_offset_sigma_s, 0.18,
         [&](const Reality& r) { return same_three(r.lidar.clock_offset_s); });
  expect(options.magnetometer_clock_offset_sigma_s, 0.18,
         [&](const Reality& r) { return same_three(r.magnetometer_clock_offset_s); });
  expect(options.range_bias_a_ring_sigma_m, 0.1, [](const Reality& r) {
    return Vector3(r.lidar.ring_bias_m[0], r.lidar.ring_bias_m[3], r.lidar.ring_bias_m[7]);
  });
  expect(options.range_bias_at_80deg_incidence_sigma_m, 0.18,
         [&](const Reality& r) { return same_three(r.lidar.incidence_bias_m); });
  expect(options.imu_scale_sigma, 0.1,
         [](const Reality& r) { return Vector3(r.imu.gyroscope.diagonal() - Vector3::Ones()); });
  expect(options.imu_misalignment_sigma_deg * degree, 0.1, [](const Reality& r) {
    return Vector3(r.imu.accelerometer(0, 1), r.imu.accelerometer(2, 0), r.imu.accelerometer(1, 2));
  });
  expect(options.magnetometer_offset_sigma_ut, 0.1, [](const Reality& r) { return r.magnetometers[0].offset_ut; });
  expect(options.magnetometer_matrix_sigma, 0.1, [](const Reality& r) {
    const Matrix3& m = r.magnetometers[1].matrix;
    return Vector3(m(0, 0) - 1.0, m(0, 2), m(1, 2));
  });
  expect(options.wheel_scale_sigma, 0.18, [&](const Reality& r) { return same_three(r.wheels.scale - 1.0); });
  expect(options.wheel_rotation_sigma_deg * degree, 0.1, [](const Reality& r) { return r.wheels.mounting.head<3>(); });
  expect(options.wheel_slip_sigma, 0.1, [](const Reality& r) { return r.wheels.slip.at({30.0, 0.0, 0.0}); });
  expect(0.5 * options.platform_field_sigma_ut, 0.1,
         [](const Reality& r) { return 0.25 * r.magnetometers[0].acceleration_field; });
}

TEST_F(RealityOptionsOfAWorld, DensitiesOfThePlatformAreOffByAFactorThatIsLogUniform) {
  const World world = load("{noise_density_factor_max: 2}");
  double least = 10.0, most = 0.0, mean_log = 0.0;
  for (int seed = 1; seed <= 200; ++seed) {
    const DensityFactors factors = draw_reality(world, seed).densities;
    least = std::min(least, factors.accelerometer_noise);
    most = std::max(most, factors.accelerometer_noise);
    mean_log += std::log(factors.accelerometer_noise) / 200.0;
  }
  EXPECT_GE(least, 0.5);
  EXPECT_LT(least, 0.55);
  EXPECT_LE(most, 2.0);
  EXPECT_GT(most, 1.85);
  EXPECT_NEAR(mean_log, 0.0, 0.1);
  const World noisy = load("field", {"sensors.imu.gyroscope_noise_density_rad_s_sqrt_hz=0.001"});
  const Reality reality = draw_reality(noisy, 5);
  EXPECT_EQ(believed_suite(noisy, reality).imu.gyroscope_noise_density, 0.001 * reality.densities.gyroscope_noise);
}

TEST_F(RealityOptionsOfAWorld, ThePlatformStatesTheSigmasOfTheGrade) {
  const CalibrationSigmas usual;  // of a platform file without sigmas
  const CalibrationSigmas field = sensor_suite(load("field")).calibration;
  EXPECT_EQ(field.lidar.translation_sigma_m, usual.lidar.translation_sigma_m);
  EXPECT_EQ(field.lidar.rotation_sigma_deg, usual.lidar.rotation_sigma_deg);
  EXPECT_EQ(field.lidar.clock_sigma_s, usual.lidar.clock_sigma_s);
  EXPECT_EQ(field.lidar.map_displacement_sigma_m, usual.lidar.map_displacement_sigma_m);
  EXPECT_EQ(field.magnetometers.translation_sigma_m, usual.magnetometers.translation_sigma_m);
  EXPECT_EQ(field.magnetometers.rotation_sigma_deg, usual.magnetometers.rotation_sigma_deg);
  EXPECT_EQ(field.magnetometers.clock_sigma_s, usual.magnetometers.clock_sigma_s);
  EXPECT_EQ(field.magnetometers.offset_sigma_ut, usual.magnetometers.offset_sigma_ut);
  EXPECT_EQ(field.magnetometers.matrix_sigma, usual.magnetometers.matrix_sigma);
  EXPECT_EQ(field.magnetometers.survey_pose_sigma_m, usual.magnetometers.survey_pose_sigma_m);
  EXPECT_EQ(field.imu.scale_sigma, usual.imu.scale_sigma);
  EXPECT_EQ(field.imu.misalignment_sigma_deg, usual.imu.misalignment_sigma_deg);
  EXPECT_EQ(field.wheels.scale_sigma, usual.wheels.scale_sigma);
  EXPECT_EQ(field.wheels.rotation_sigma_deg, usual.wheels.rotation_sigma_deg);
  EXPECT_EQ(field.wheels.slip_sigma, usual.wheels.slip_sigma);
  const CalibrationSigmas exact = sensor_suite(load("exact")).calibration;
  EXPECT_EQ(exact.lidar.translation_sigma_m, 0.0);
  EXPECT_EQ(exact.lidar.map_displacement_sigma_m, 0.0);
  EXPECT_EQ(exact.magnetometers.offset_sigma_ut, 0.0);
  EXPECT_EQ(exact.magnetometers.survey_pose_sigma_m, 0.0);
  EXPECT_EQ(exact.imu.scale_sigma, 0.0);
}

}  // namespace
}  // namespace lodestone::simulation
