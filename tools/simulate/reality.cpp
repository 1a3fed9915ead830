#include "tools/simulate/reality.h"

#include <cmath>

#include "core/angles.h"
#include "core/random_stream.h"
#include "tools/simulate/beam_pattern.h"

namespace lodestone::simulation {
namespace {

constexpr double reference_acceleration = 0.5;  // m/s²: typical command when a drive starts or stops
constexpr double reference_yaw_rate = 0.5;      // rad/s: a typical curve
constexpr double slip_correlation_s = 20.0;     // of the wheels: a stretch of one kind of floor

Vector6 draw_mounting(double rotation_sigma_deg, double translation_sigma_m, RandomStream random) {
  Vector6 error;
  error.head<3>() = rotation_sigma_deg * degree * random.normal3();
  error.tail<3>() = translation_sigma_m * random.normal3();
  return error;
}

/// Identity + scale errors on the diagonal + misalignments off the diagonal.
Matrix3 draw_axes(const RealityOptions& options, RandomStream random) {
  Matrix3 matrix = Matrix3::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double sigma = row == column ? options.imu_scale_sigma : options.imu_misalignment_sigma_deg * degree;
      matrix(row, column) += sigma * random.normal();
    }
  }
  return matrix;
}

/// Identity + a symmetric matrix: the antisymmetric part is a rotation and belongs to the mounting.
Matrix3 draw_soft_iron(double sigma, RandomStream random) {
  Matrix3 matrix = Matrix3::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) {
      const double entry = sigma * random.normal();
      matrix(row, column) += entry;
      if (column != row) matrix(column, row) += entry;
    }
  }
  return matrix;
}

LidarErrors draw_lidar(const RealityOptions& options, int rings, std::uint64_t seed) {
  LidarErrors errors;
  errors.mounting = draw_mounting(options.lidar_extrinsic_rotation_sigma_deg,
                                  options.lidar_extrinsic_translation_sigma_m, {seed, "reality lidar mounting"});
  errors.clock_offset_s = options.lidar_clock_offset_sigma_s * RandomStream(seed, "reality lidar clock").normal();
  errors.stamp_jitter_sigma_s = options.lidar_stamp_jitter_sigma_s;
  for (int ring = 0; ring < rings && options.range_bias_a_ring_sigma_m > 0.0; ++ring) {
    RandomStream random(seed, "reality ring", static_cast<std::uint64_t>(ring));
    errors.ring_bias_m.push_back(options.range_bias_a_ring_sigma_m * random.normal());
  }
  errors.incidence_bias_m =
      options.range_bias_at_80deg_incidence_sigma_m * RandomStream(seed, "reality incidence").normal();
  errors.mixed_points = options.mixed_points;
  return errors;
}

MagnetometerErrors draw_magnetometer(const RealityOptions& options, std::uint64_t seed, std::uint64_t index) {
  MagnetometerErrors errors;
  errors.mounting =
      draw_mounting(options.magnetometer_extrinsic_rotation_sigma_deg,
                    options.magnetometer_extrinsic_translation_sigma_m, {seed, "reality magnetometer mounting", index});
  RandomStream motors(seed, "reality platform field", index);
  errors.acceleration_field = options.platform_field_sigma_ut / reference_acceleration * motors.normal3();
  errors.turning_field = options.platform_field_sigma_ut / reference_yaw_rate * motors.normal3();
  return errors;
}

WheelErrors draw_wheels(const RealityOptions& options, std::uint64_t seed) {
  WheelErrors errors;
  errors.scale += options.wheel_scale_sigma * RandomStream(seed, "reality wheel scale").normal();
  errors.mounting = draw_mounting(options.wheel_rotation_sigma_deg, 0.0, {seed, "reality wheel mounting"});
  errors.slip = DisplacementField(options.wheel_slip_sigma, slip_correlation_s, seed, "reality wheel slip");
  return errors;
}

double draw_factor(double most, RandomStream random) {
  return std::exp(std::log(most) * random.uniform(-1.0, 1.0));
}

}  // namespace

Reality draw_reality(const World& world, std::uint64_t seed) {
  const RealityOptions& options = world.reality;
  Reality reality;
  reality.options = options;
  reality.seed = seed;
  reality.lidar = draw_lidar(options, BeamPattern(world.lidar).lines(), seed);
  reality.imu.gyroscope = draw_axes(options, {seed, "reality gyroscope"});
  reality.imu.accelerometer = draw_axes(options, {seed, "reality accelerometer"});
  for (std::uint64_t j = 0; j < world.magnetometers.mounts.size(); ++j) {
    MagnetometerErrors errors = draw_magnetometer(options, seed, j);
    const auto draw_residual = [&](const char* matrix, const char* offset) {
      errors.matrix = draw_soft_iron(options.magnetometer_matrix_sigma, {seed, matrix, j});
      errors.offset_ut = options.magnetometer_offset_sigma_ut * RandomStream(seed, offset, j).normal3();
    };
    draw_residual("reality magnetometer matrix", "reality magnetometer offset");
    reality.magnetometers.push_back(errors);
    draw_residual("reality survey matrix", "reality survey offset");
    reality.survey_magnetometers.push_back(errors);
  }
  reality.magnetometer_clock_offset_s =
      options.magnetometer_clock_offset_sigma_s * RandomStream(seed, "reality magnetometer clock").normal();
  reality.wheels = draw_wheels(options, seed);
  const double most = options.noise_density_factor_max;
  reality.densities = {draw_factor(most, {seed, "reality density", 0}), draw_factor(most, {seed, "reality density", 1}),
                       draw_factor(most, {seed, "reality density", 2}),
                       draw_factor(most, {seed, "reality density", 3})};
  reality.displacement = DisplacementField(options.cloud_displacement_rms_m, options.cloud_displacement_length_m, seed,
                                           "reality displacement");
  return reality;
}

Pose with_error(const Pose& believed, const Vector6& error) {
  return error.isZero(0.0) ? believed : believed.boxplus(error);
}

SensorSuite believed_suite(const World& world, const Reality& reality) {
  SensorSuite suite = sensor_suite(world);
  suite.imu.gyroscope_noise_density *= reality.densities.gyroscope_noise;
  suite.imu.accelerometer_noise_density *= reality.densities.accelerometer_noise;
  suite.imu.gyroscope_bias_random_walk *= reality.densities.gyroscope_bias_walk;
  suite.imu.accelerometer_bias_random_walk *= reality.densities.accelerometer_bias_walk;
  return suite;
}

}  // namespace lodestone::simulation
