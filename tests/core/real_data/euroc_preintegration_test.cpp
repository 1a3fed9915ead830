// Preintegration on EuRoC V1_01 (200 Hz IMU, 20 Hz ground truth with velocity and biases): no worse than the median
// errors of GTSAM 4.3's combined preintegration on the same windows.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/angles.h"
#include "core/imu/preintegration.h"
#include "core/middle_value.h"
#include "tests/core/real_data/euroc.h"

namespace lodestone {
namespace {

using euroc::samples_between;
using euroc::Truth;

class EurocPreintegration : public ::testing::Test {
 protected:
  struct Errors {
    double position_m = 0.0;
    double velocity_m_s = 0.0;
    double rotation_deg = 0.0;
    std::size_t windows = 0;
  };

  void SetUp() override {
    if (const std::string absent = euroc::absent(); !absent.empty()) GTEST_SKIP() << absent;
    samples_ = euroc::load_imu();
    truth_ = euroc::load_truth();
  }

  /// Median errors of a prediction relative to the ground truth, over windows of `steps` of its rows.
  Errors median_errors(std::size_t steps) const {
    std::vector<double> position;
    std::vector<double> velocity;
    std::vector<double> rotation;
    for (std::size_t i = 0; i + steps < truth_.size(); ++i) {
      const Truth& start = truth_[i];
      const Truth& end = truth_[i + steps];
      if (std::abs(to_seconds(end.time - start.time) - 0.05 * static_cast<double>(steps)) > 1e-3) continue;
      const std::vector<ImuSample> samples = samples_between(samples_, start.time, end.time);
      if (samples.empty()) continue;
      const Preintegration preintegration(samples, start.state.gyroscope_bias, start.state.accelerometer_bias, {});
      const NavState predicted = preintegration.predict(start.state);
      const Vector17 error = predicted.boxminus(end.state);
      rotation.push_back(degrees_per_radian * error.segment<3>(tangent::rotation).norm());
      position.push_back(error.segment<3>(tangent::position).norm());
      velocity.push_back(error.segment<3>(tangent::velocity).norm());
    }
    if (position.empty()) return {};
    return {middle_value(position), middle_value(velocity), middle_value(rotation), position.size()};
  }

  std::vector<ImuSample> samples_;
  std::vector<Truth> truth_;
};

TEST_F(EurocPreintegration, IsNoWorseThanGtsamOverATenthOfASecond) {
  const Errors errors = median_errors(2);
  RecordProperty("windows", static_cast<int>(errors.windows));
  std::printf("0.1 s, %zu windows: %.3f mm, %.2f mm/s, %.4f deg\n", errors.windows, 1e3 * errors.position_m,
              1e3 * errors.velocity_m_s, errors.rotation_deg);
  EXPECT_GT(errors.windows, truth_.size() / 2);
  EXPECT_LE(errors.position_m, 0.3e-3);
  EXPECT_LE(errors.velocity_m_s, 5.5e-3);
  EXPECT_LE(errors.rotation_deg, 0.015);
}

TEST_F(EurocPreintegration, IsNoWorseThanGtsamOverASecond) {
  const Errors errors = median_errors(20);
  std::printf("1 s, %zu windows: %.2f mm, %.2f mm/s, %.4f deg\n", errors.windows, 1e3 * errors.position_m,
              1e3 * errors.velocity_m_s, errors.rotation_deg);
  EXPECT_GT(errors.windows, truth_.size() / 2);
  EXPECT_LE(errors.position_m, 24e-3);
  EXPECT_LE(errors.velocity_m_s, 47e-3);
  EXPECT_LE(errors.rotation_deg, 0.125);
}

}  // namespace
}  // namespace lodestone
