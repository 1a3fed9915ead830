// What speaks for an error of the IMU's scale and axes: Monte Carlo of the likelihood's gradient at the truth.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/geometry/so3.h"
#include "factors/manifolds.h"
#include "factors/preintegration_factor.h"
#include "tests/factors/gradients.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

constexpr double kRate_hz = 200.0;
constexpr int kDraws = 4000;

ImuNoise imu_noise() {
  ImuNoise noise;
  noise.gyroscope_noise_density = 1e-3;
  noise.accelerometer_noise_density = 2e-2;
  noise.gyroscope_bias_random_walk = noise.accelerometer_bias_random_walk = 1e-4;
  return noise;
}

/// Samples of 0.1 s.
std::vector<ImuSample> motion(const Vector3& angular_velocity, const Vector3& acceleration) {
  std::vector<ImuSample> samples(21);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] = {static_cast<Time>(i) * 5'000'000, angular_velocity, acceleration};
  }
  return samples;
}

std::vector<ImuSample> with_noise(std::vector<ImuSample> samples, Random& random) {
  const ImuNoise noise = imu_noise();
  for (ImuSample& sample : samples) {
    sample.angular_velocity += random.vector(noise.gyroscope_noise_density * std::sqrt(kRate_hz));
    sample.linear_acceleration += random.vector(noise.accelerometer_noise_density * std::sqrt(kRate_hz));
  }
  return samples;
}

Preintegration integrated(const std::vector<ImuSample>& samples) {
  return {samples, Vector3::Zero(), Vector3::Zero(), imu_noise()};
}

using Array18 = Eigen::Array<double, 18, 1>;

/// Of the gradient of the negative log likelihood with respect to E at the true E and states, whose second rotation
/// scatters: mean, and sigma of the mean.
struct Gradient {
  Array18 mean = Array18::Zero();
  Array18 sigma = Array18::Zero();
};

Gradient gradient_at_truth(const Vector3& angular_velocity, double scatter_rad, bool by_motion_before) {
  Random random(31);
  const std::vector<ImuSample> exact = motion(angular_velocity, {0.1, 0.0, 9.81});
  NavState first;
  first.gravity = Vector3(0.0, 0.0, -9.81);
  const NavState second = integrated(exact).predict(first);
  const PoseBlock pose_first = block_of(first.T_map_imu);
  MotionBlock motion_first{};
  MotionBlock motion_second{};
  std::copy_n(second.velocity.data(), 3, motion_second.begin());
  const ImuAxes axes = ImuAxes::Zero();
  Array18 sum = Array18::Zero();
  Array18 squares = Array18::Zero();
  for (int draw = 0; draw < kDraws; ++draw) {
    const Vector6 shown =
        by_motion_before ? axes_shown_after(integrated(with_noise(exact, random))) : Vector6(Vector6::Ones());
    const PreintegrationFactor factor(integrated(with_noise(exact, random)), imu_noise(), true, shown);
    Pose scattered = second.T_map_imu;
    scattered.rotation = scattered.rotation * so3::exp(random.vector(scatter_rad));
    const PoseBlock pose_second = block_of(scattered);
    const double* parameters[] = {pose_first.data(),    motion_first.data(),  pose_second.data(),
                                  motion_second.data(), first.gravity.data(), axes.data()};
    Vector15 residuals;
    Eigen::Matrix<double, 15, 18, Eigen::RowMajor> by_axes;
    double* jacobians[] = {nullptr, nullptr, nullptr, nullptr, nullptr, by_axes.data()};
    if (!factor.Evaluate(parameters, residuals.data(), jacobians)) ADD_FAILURE();
    const Array18 score = (by_axes.transpose() * residuals).array();
    sum += score;
    squares += score.square();
  }
  return {sum / kDraws, squares.sqrt() / kDraws};
}

/// At the true states the gradient has the mean zero. If noisy readings were divided by 1 + E without regard to their
/// noise, a smaller noise would speak for each scale: one sigma² of it in each factor.
TEST(ImuAxes, NoiseOfTheReadingsSpeaksForNone) {
  for (const bool by_motion_before : {false, true}) {
    const Gradient gradient = gradient_at_truth({0.01, -0.02, 0.05}, 0.0, by_motion_before);
    for (int i = 0; i < 18; ++i) {
      EXPECT_LT(std::abs(gradient.mean[i]), 4.0 * gradient.sigma[i]) << i << ": mean " << gradient.mean[i];
    }
  }
}

/// States that scatter by more than their covariance says speak for a smaller scale. Where the robot does not turn, the
/// motion of the scan before says so.
TEST(ImuAxes, ScatterOfTheStatesSpeaksForNoneWhereTheRobotDoesNotTurn) {
  constexpr double kScatter_rad = 1e-3;
  const Gradient always = gradient_at_truth(Vector3::Zero(), kScatter_rad, false);
  const Gradient shown = gradient_at_truth(Vector3::Zero(), kScatter_rad, true);
  for (const int scale : {0, 4, 8}) {
    EXPECT_GT(always.mean[scale], 5.0);
    EXPECT_LT(std::abs(shown.mean[scale]), 0.01 * always.mean[scale]) << scale;
  }
}

TEST(ImuAxes, ColumnsCountByTheMotionBefore) {
  Random random(5);
  const Vector6 still = axes_shown_after(integrated(with_noise(motion(Vector3::Zero(), {0, 0, 9.81}), random)));
  EXPECT_LT(still.head<5>().maxCoeff(), 0.1);
  EXPECT_GT(still[5], 0.99);  // gravity
  const Vector6 turns = axes_shown_after(integrated(with_noise(motion({0, 0, 0.5}, {0, 0, 9.81}), random)));
  EXPECT_LT(turns.head<2>().maxCoeff(), 0.1);
  EXPECT_GT(turns[2], 0.99);
}

}  // namespace
}  // namespace lodestone
