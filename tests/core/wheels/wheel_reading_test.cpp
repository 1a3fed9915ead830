#include "core/wheels/wheel_reading.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/wheels/wheel_residual.h"

namespace lodestone {
namespace {

/// A robot in a curve of constant yaw rate that accelerates, with an IMU without errors.
struct Curve {
  double yaw_rate_rad_s = 0.4;
  double acceleration_m_s2 = 0.6;
  double begin_velocity_m_s = 1.0;
  double duration_s = 0.1;

  double velocity_at(double seconds) const { return begin_velocity_m_s + acceleration_m_s2 * seconds; }

  NavState end() const {
    NavState state;
    state.T_map_imu.rotation = so3::exp(Vector3(0.0, 0.0, yaw_rate_rad_s * duration_s));
    state.velocity = state.T_map_imu.rotation * Vector3(velocity_at(duration_s), 0.0, 0.0);
    return state;
  }

  std::vector<ImuSample> imu(const Vector3& gyroscope_bias = Vector3::Zero()) const {
    std::vector<ImuSample> result;
    for (int i = 0; i <= 20; ++i) {
      const double seconds = duration_s * i / 20.0;
      result.push_back({from_seconds(seconds), Vector3(0.0, 0.0, yaw_rate_rad_s) + gyroscope_bias,
                        Vector3(acceleration_m_s2, yaw_rate_rad_s * velocity_at(seconds), 9.80665)});
    }
    return result;
  }

  /// What wheels at `T_imu_wheels` measure, exactly.
  std::vector<WheelSample> wheels(const Pose& T_imu_wheels) const {
    std::vector<WheelSample> result;
    for (const double seconds : {0.02, 0.04, 0.06, 0.08, 0.1}) {
      const Vector3 velocity =
          Vector3(velocity_at(seconds), 0.0, 0.0) + Vector3(0.0, 0.0, yaw_rate_rad_s).cross(T_imu_wheels.position);
      const Vector3 seen = T_imu_wheels.rotation.conjugate() * velocity;
      result.push_back({from_seconds(seconds), seen.x(), seen.y(), yaw_rate_rad_s});
    }
    return result;
  }
};

WheelModel mounted_askew() {
  WheelModel model;
  model.T_imu_wheels = {so3::exp(Vector3(0.0, 0.0, 0.5)), Vector3(-0.4, 0.2, -0.3)};
  model.lateral_motion = LateralMotion::measured;
  return model;
}

TEST(WheelReading, OfAnExactDriveIsItsMeanVelocityInWheelAxes) {
  const Curve curve;
  const WheelModel model = mounted_askew();
  const auto reading = average_wheels(curve.wheels(model.T_imu_wheels), curve.end(), curve.imu(), model);
  ASSERT_TRUE(reading);
  EXPECT_EQ(reading->samples, 5);
  EXPECT_FALSE(reading->standstill);
  const NavState state = curve.end();
  const Vector3 expected = reading->expected_m_s(state.T_map_imu.rotation, state.velocity, state.gyroscope_bias);
  EXPECT_LT((expected - reading->measured_m_s).norm(), 1e-4);
}

TEST(WheelReading, AGyroscopeBiasMovesTheWheelsOnTheirLever) {
  const Curve curve;
  const WheelModel model = mounted_askew();
  const Vector3 bias(0.01, -0.02, 0.03);
  NavState state = curve.end();
  state.gyroscope_bias = bias;
  const auto reading = average_wheels(curve.wheels(model.T_imu_wheels), state, curve.imu(bias), model);
  ASSERT_TRUE(reading);
  EXPECT_LT((reading->expected_m_s(state.T_map_imu.rotation, state.velocity, bias) - reading->measured_m_s).norm(),
            1e-4);
}

TEST(WheelReading, WheelsThatStandStillMeasureAllDirections) {
  Curve curve;
  curve.begin_velocity_m_s = curve.acceleration_m_s2 = curve.yaw_rate_rad_s = 0.0;
  WheelModel model;
  const auto still = average_wheels(curve.wheels({}), curve.end(), curve.imu(), model);
  ASSERT_TRUE(still);
  EXPECT_TRUE(still->standstill);
  EXPECT_GT(still->inverse_sigma_s_m.minCoeff(), 100.0);
  const auto moving = average_wheels(Curve{}.wheels({}), Curve{}.end(), Curve{}.imu(), model);
  ASSERT_TRUE(moving);
  EXPECT_NEAR(1.0 / moving->inverse_sigma_s_m.x(), model.velocity_sigma_m_s / std::sqrt(5.0), 1e-12);
  EXPECT_EQ(moving->inverse_sigma_s_m.y(), 0.0);
  EXPECT_EQ(moving->inverse_sigma_s_m.z(), 0.0);
  model.lateral_motion = LateralMotion::none;
  const auto on_rails = average_wheels(Curve{}.wheels({}), Curve{}.end(), Curve{}.imu(), model);
  ASSERT_TRUE(on_rails);
  EXPECT_NEAR(1.0 / on_rails->inverse_sigma_s_m.y(), model.lateral_sigma_m_s, 1e-12);
  EXPECT_NEAR(1.0 / on_rails->inverse_sigma_s_m.z(), model.lateral_sigma_m_s, 1e-12);
}

TEST(WheelReading, RequiresSamplesOfBothSensors) {
  const Curve curve;
  EXPECT_FALSE(average_wheels({}, curve.end(), curve.imu(), {}));
  const std::vector<ImuSample> imu = curve.imu();
  EXPECT_FALSE(average_wheels(curve.wheels({}), curve.end(), std::span(imu).first(1), {}));
}

TEST(WheelResidual, IsZeroForTheScaleAndTheMountingThatMadeTheReading) {
  const Curve curve;
  const WheelModel model = mounted_askew();
  const WheelCorrection correction{0.04, Vector3(0.01, -0.03, 0.05)};
  std::vector<WheelSample> samples = curve.wheels(correction.corrected(model.T_imu_wheels));
  for (WheelSample& sample : samples) {
    sample.forward_velocity_m_s *= 1.0 + correction.scale;
    sample.lateral_velocity_m_s *= 1.0 + correction.scale;
  }
  const NavState state = curve.end();
  const auto reading = average_wheels(samples, state, curve.imu(), model);
  ASSERT_TRUE(reading);
  const auto right = wheel_residual(*reading, state.T_map_imu.rotation, state.velocity, Vector3::Zero(), correction);
  const auto wrong = wheel_residual(*reading, state.T_map_imu.rotation, state.velocity, Vector3::Zero(), {});
  EXPECT_LT(right.value.norm(), 0.02);
  EXPECT_GT(wrong.value.norm(), 3.0);
}

TEST(WheelResidual, SpinningWheelsGetLittleWeightAndGoodOnesKeepTheirs) {
  const Curve curve;
  WheelModel model;
  model.lateral_motion = LateralMotion::none;
  const NavState state = curve.end();
  Matrix17 covariance = 1e-6 * Matrix17::Identity();
  covariance.diagonal().segment<3>(tangent::velocity).setConstant(1e-4);
  std::vector<WheelSample> samples = curve.wheels({});
  WheelReading good = *average_wheels(samples, state, curve.imu(), model);
  const Vector3 full = good.inverse_sigma_s_m;
  EXPECT_EQ(weigh_wheels(state, covariance, {}, {}, 0.95, good), 1.0);
  EXPECT_EQ(good.inverse_sigma_s_m, full);
  for (WheelSample& sample : samples) sample.forward_velocity_m_s += 1.0;
  WheelReading spinning = *average_wheels(samples, state, curve.imu(), model);
  EXPECT_LT(weigh_wheels(state, covariance, {}, {}, 0.95, spinning), 0.01);
  EXPECT_LT(spinning.inverse_sigma_s_m.x(), 0.1 * full.x());
  EXPECT_EQ(spinning.inverse_sigma_s_m.tail<2>(), full.tail<2>());  // sideways there is still no motion
}

TEST(SlipJump, IsTheSizeOfASlipAndNoneForNoiseStandstillAndSpinningWheels) {
  const Curve curve;
  const NavState state = curve.end();
  Matrix17 covariance = 1e-6 * Matrix17::Identity();
  covariance.diagonal().segment<3>(tangent::velocity).setConstant(1e-4);
  const WheelCalibrationSigmas sigmas{0.005, 0.1, 0.005};
  const auto jump_of = [&](double factor) {
    std::vector<WheelSample> samples = curve.wheels({});
    for (WheelSample& sample : samples) sample.forward_velocity_m_s *= factor;
    if (factor == 0.0) {
      for (WheelSample& sample : samples) sample.yaw_rate_rad_s = 0.0;
    }
    return slip_jump(state, covariance, {}, sigmas, *average_wheels(samples, state, curve.imu(), WheelModel{}));
  };
  EXPECT_EQ(jump_of(1.0), 0.0);
  EXPECT_EQ(jump_of(1.02), 0.0);
  EXPECT_NEAR(jump_of(1.1), 0.1, 1e-3);
  EXPECT_NEAR(jump_of(0.8), 0.2, 1e-3);
  EXPECT_EQ(jump_of(3.0), 0.0);
  EXPECT_EQ(jump_of(0.0), 0.0);
  // A jump of this size leaves the reading its weight.
  std::vector<WheelSample> samples = curve.wheels({});
  for (WheelSample& sample : samples) sample.forward_velocity_m_s *= 1.1;
  WheelReading reading = *average_wheels(samples, state, curve.imu(), WheelModel{});
  WheelCalibrationSigmas with_jump = sigmas;
  with_jump.slip_sigma = jump_of(1.1);
  EXPECT_EQ(weigh_wheels(state, covariance, {}, with_jump, kWheelProbability, reading), 1.0);
}

}  // namespace
}  // namespace lodestone
