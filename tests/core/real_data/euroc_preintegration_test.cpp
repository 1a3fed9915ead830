// Preintegration on EuRoC V1_01 (200 Hz IMU, 20 Hz ground truth with velocity and biases): no worse than the median
// errors of GTSAM 4.3's combined preintegration on the same windows.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "core/angles.h"
#include "core/imu/preintegration.h"
#include "tests/core/real_data/euroc.h"

namespace lodestone {
namespace {

using euroc::imu_folder;
using euroc::load;
using euroc::samples_between;

struct Truth {
  Time time = 0;
  NavState state;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class EurocPreintegration : public ::testing::Test {
 protected:
  struct Errors {
    double position_m = 0.0;
    double velocity_m_s = 0.0;
    double rotation_deg = 0.0;
    std::size_t windows = 0;
  };

  void SetUp() override {
    const std::filesystem::path imu = imu_folder() / "euroc_V1_01_imu.csv";
    const std::filesystem::path truth = imu_folder() / "euroc_V1_01_truth.csv";
    if (!std::filesystem::exists(imu) || !std::filesystem::exists(truth)) {
      GTEST_SKIP() << imu << " or its truth is absent; set LODESTONE_DATA to the real data";
    }
    for (const auto& row : load<6>(imu)) samples_.push_back({row.time, row.vector(0), row.vector(3)});
    for (const auto& row : load<16>(truth)) {
      Truth entry{row.time, {}};
      entry.state.T_map_imu.position = row.vector(0);
      entry.state.T_map_imu.rotation =
          Quaternion(row.values[3], row.values[4], row.values[5], row.values[6]).normalized();
      entry.state.velocity = row.vector(7);
      entry.state.gyroscope_bias = row.vector(10);
      entry.state.accelerometer_bias = row.vector(13);
      entry.state.gravity = Vector3(0.0, 0.0, -9.81);
      truth_.push_back(entry);
    }
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
    return {median(position), median(velocity), median(rotation), position.size()};
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
