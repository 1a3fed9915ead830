#include "tools/simulate/wheel_simulator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/tools/simulate/reality_world.h"

namespace lodestone::simulation {
namespace {

using ::testing::HasSubstr;

class SimulatedWheels : public RealityHall {};

TEST_F(SimulatedWheels, ReadTheVelocityOfTheirFrameTimesScaleAndSlip) {
  const std::vector<std::string> settings{"sensors.wheels={velocity_noise_m_s: 1e-9, position_m: [-0.3, 0.1, -0.2]}"};
  const World world = load("{wheel_scale_sigma: 0.02, wheel_rotation_sigma_deg: 2, wheel_slip_sigma: 0.02}", settings);
  EXPECT_TRUE(all<WheelSample>(source_of(load("exact"))).empty());
  EXPECT_TRUE(all<WheelSample>(source_of(world, 7, Drive::survey)).empty());
  SimulationSource source = source_of(world, 7, Drive::sequence, 6.0);
  const WheelErrors& errors = source.reality().wheels;
  const Pose mounted = with_error(world.wheels->T_imu_wheels(), errors.mounting);
  int moving = 0, resting = 0;
  for (Measurement measurement; source.next(measurement);) {
    const auto* sample = std::get_if<WheelSample>(&measurement);
    if (sample == nullptr) continue;
    const double seconds = to_seconds(sample->time - source.begin_time());
    const MotionSample motion = source.motion().at(seconds);
    const Vector3 velocity = mounted.rotation.conjugate() * (motion.T_map_imu.rotation.conjugate() * motion.velocity +
                                                             motion.angular_velocity.cross(mounted.position));
    const double factor = errors.scale + errors.slip.at({seconds, 0.0, 0.0}).x();
    EXPECT_NEAR(sample->forward_velocity_m_s, factor * velocity.x(), 2e-4) << seconds;
    ++(sample->forward_velocity_m_s == 0.0 ? resting : moving);
  }
  EXPECT_GT(moving, 60);
  EXPECT_GT(resting, 20);
}

TEST_F(SimulatedWheels, ReportMoreWhileTheySlip) {
  const auto samples = [&](std::vector<std::string> settings) {
    settings.push_back("sensors.wheels.rate_hz=20");
    return all<WheelSample>(source_of(load("exact", settings)));
  };
  const auto rolling = samples({});
  const auto slipping = samples({"faults=[{kind: slip, begin_s: 3, end_s: 3.5, fraction: 0.2}]"});
  ASSERT_GT(rolling.size(), 70U);
  ASSERT_EQ(slipping.size(), rolling.size());
  int changed = 0;
  for (std::size_t i = 0; i < rolling.size(); ++i) {
    const double seconds = to_seconds(rolling[i].time - rolling[0].time);
    const double factor = seconds >= 3.0 && seconds < 3.5 ? 1.2 : 1.0;
    EXPECT_EQ(slipping[i].forward_velocity_m_s, factor * rolling[i].forward_velocity_m_s) << seconds;
    changed += slipping[i].forward_velocity_m_s != rolling[i].forward_velocity_m_s;
  }
  EXPECT_GE(changed, 9);
}

TEST_F(SimulatedWheels, WrongSlipsAreOneLineThatNamesTheRemedy) {
  const auto error_of = [&](const std::vector<std::string>& settings) {
    return lodestone::testing::message_of<InputError>([&] { load("exact", settings); });
  };
  EXPECT_THAT(error_of({"faults=[{kind: slip, fraction: 0.2}]"}), HasSubstr("sensors.wheels"));
  EXPECT_THAT(error_of({"sensors.wheels.rate_hz=20", "faults=[{kind: slip, fraction: -2}]"}), HasSubstr("blocked"));
  EXPECT_THAT(error_of({"sensors.wheels.velocity_noise_m_s=0"}), HasSubstr("velocity_noise_m_s"));
}

}  // namespace
}  // namespace lodestone::simulation
