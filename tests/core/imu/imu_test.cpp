#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/imu/preintegration.h"
#include "core/imu/propagation.h"
#include "core/imu/scan_motion.h"

namespace lodestone {
namespace {

constexpr double kGravity = 9.80665;

std::vector<ImuSample> random_samples(std::uint64_t seed, int count, Time period = 5'000'000) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<ImuSample> samples(static_cast<std::size_t>(count));
  const Vector3 phase(normal(generator), normal(generator), normal(generator));
  for (int i = 0; i < count; ++i) {
    const double t = 0.005 * i;
    auto& sample = samples[static_cast<std::size_t>(i)];
    sample.time = i * period;
    for (int k = 0; k < 3; ++k) {
      sample.angular_velocity[k] = 0.8 * std::sin(3.0 * t + phase[k]);
      sample.linear_acceleration[k] = (k == 2 ? kGravity : 0.0) + 1.5 * std::cos(2.0 * t + 2.0 * phase[k]);
    }
  }
  return samples;
}

NavState random_state(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  Vector17 delta;
  for (int i = 0; i < 17; ++i) delta[i] = normal(generator);
  delta.segment<6>(tangent::gyroscope_bias) *= 0.02;
  delta.segment<2>(tangent::gravity) *= 0.02;
  return NavState{}.boxplus(delta);
}

TEST(Preintegration, PredictsTheSameStateAsForwardPropagation) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto samples = random_samples(seed, 41);
    const NavState start = random_state(seed + 100);
    const Preintegration preintegration(samples, start.gyroscope_bias, start.accelerometer_bias, ImuNoise{});
    const NavState direct = propagate(start, samples, ImuNoise{}, nullptr);
    EXPECT_LT(preintegration.predict(start).boxminus(direct).norm(), 1e-12);
  }
}

TEST(Preintegration, BiasJacobiansAreTheDerivativesOfAFreshIntegration) {
  const auto samples = random_samples(3, 21);
  const Vector3 gyroscope_bias(0.01, -0.02, 0.005);
  const Vector3 accelerometer_bias(0.1, 0.05, -0.08);
  const Preintegration base(samples, gyroscope_bias, accelerometer_bias, ImuNoise{});
  for (int axis = 0; axis < 6; ++axis) {
    const double step = 1e-5;
    Vector6 delta = step * Vector6::Unit(axis);
    const Vector3 moved_gyroscope = gyroscope_bias + delta.head<3>();
    const Vector3 moved_accelerometer = accelerometer_bias + delta.tail<3>();
    const Preintegration moved(samples, moved_gyroscope, moved_accelerometer, ImuNoise{});
    const auto fresh = moved.corrected(moved_gyroscope, moved_accelerometer, ImuAxes::Zero());
    const auto corrected = base.corrected(moved_gyroscope, moved_accelerometer, ImuAxes::Zero());
    EXPECT_LT(so3::log(fresh.rotation.conjugate() * corrected.rotation).norm(), 1e-10);
    // First order is exact up to the midpoint rule's own half-step linearization, of order dt * step.
    EXPECT_LT((fresh.position - corrected.position).norm(), 1e-5 * step);
    EXPECT_LT((fresh.velocity - corrected.velocity).norm(), 1e-4 * step);
  }
}

TEST(Preintegration, JacobiansByTheAxesAreTheDerivativesOfAFreshIntegration) {
  const auto samples = random_samples(3, 21);
  ImuAxes axes;
  for (int i = 0; i < axes.size(); ++i) axes[i] = 0.01 * std::sin(i + 1.0);
  const Vector3 gyroscope_bias(0.01, -0.02, 0.03);
  const Vector3 accelerometer_bias(0.1, 0.05, -0.1);
  const auto integrated = [&](const ImuAxes& at) {
    const Preintegration fresh(samples, gyroscope_bias, accelerometer_bias, ImuNoise{}, at);
    return fresh.corrected(gyroscope_bias, accelerometer_bias, at);
  };
  const Preintegration base(samples, gyroscope_bias, accelerometer_bias, ImuNoise{}, axes);
  const Preintegration::Increment center = integrated(axes);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < axes.size(); ++i) {
    const auto difference = [&](double step) {
      ImuAxes moved = axes;
      moved[i] += step;
      const Preintegration::Increment increment = integrated(moved);
      Vector9 result;
      result << so3::log(center.rotation.conjugate() * increment.rotation), increment.position - center.position,
          increment.velocity - center.velocity;
      return result;
    };
    const Vector9 numeric = (difference(kStep) - difference(-kStep)) / (2.0 * kStep);
    EXPECT_LT((base.by_axes().col(i) - numeric).norm(), 1e-5 * std::max(1.0, numeric.norm())) << "entry " << i;
  }
}

TEST(Preintegration, AxesUndoWhatTheyDidToTheSamples) {
  const auto samples = random_samples(3, 21);
  ImuAxes axes;
  for (int i = 0; i < axes.size(); ++i) axes[i] = 0.02 * std::cos(2.0 * i);
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Matrix3 gyroscope = Matrix3::Identity() + Eigen::Map<const Rows>(axes.data());
  const Matrix3 accelerometer = Matrix3::Identity() + Eigen::Map<const Rows>(axes.data() + 9);
  const Vector3 gyroscope_bias(0.01, -0.02, 0.03);
  const Vector3 accelerometer_bias(0.1, 0.05, -0.1);
  std::vector<ImuSample> read = samples;
  for (ImuSample& sample : read) {
    sample.angular_velocity = gyroscope * sample.angular_velocity + gyroscope_bias;
    sample.linear_acceleration = accelerometer * sample.linear_acceleration + accelerometer_bias;
  }
  const auto wanted = Preintegration(samples, Vector3::Zero(), Vector3::Zero(), ImuNoise{})
                          .corrected(Vector3::Zero(), Vector3::Zero(), ImuAxes::Zero());
  const auto found = Preintegration(read, gyroscope_bias, accelerometer_bias, ImuNoise{}, axes)
                         .corrected(gyroscope_bias, accelerometer_bias, axes);
  EXPECT_LT(so3::log(wanted.rotation.conjugate() * found.rotation).norm(), 1e-12);
  EXPECT_LT((wanted.position - found.position).norm(), 1e-12);
  EXPECT_LT((wanted.velocity - found.velocity).norm(), 1e-12);
}

TEST(Preintegration, CovarianceMatchesAMonteCarloRun) {
  const auto samples = random_samples(4, 21);
  ImuNoise noise;
  noise.gyroscope_noise_density = 2e-3;
  noise.accelerometer_noise_density = 2e-2;
  const Preintegration clean(samples, Vector3::Zero(), Vector3::Zero(), noise);
  const auto reference = clean.corrected(Vector3::Zero(), Vector3::Zero(), ImuAxes::Zero());
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  Matrix9 sum = Matrix9::Zero();
  const int runs = 4000;
  for (int run = 0; run < runs; ++run) {
    // White noise constant over each interval, so that the mean of its ends has exactly one draw.
    auto noisy = samples;
    double rate = 1.0 / std::sqrt(0.005);
    std::vector<ImuSample> pair(2);
    NavState state;
    state.gravity.setZero();
    for (std::size_t i = 1; i < noisy.size(); ++i) {
      Vector3 gyroscope;
      Vector3 accelerometer;
      for (int k = 0; k < 3; ++k) gyroscope[k] = rate * noise.gyroscope_noise_density * normal(generator);
      for (int k = 0; k < 3; ++k) accelerometer[k] = rate * noise.accelerometer_noise_density * normal(generator);
      pair[0] = samples[i - 1];
      pair[1] = samples[i];
      for (auto& sample : pair) {
        sample.angular_velocity += gyroscope;
        sample.linear_acceleration += accelerometer;
      }
      state = propagate(state, pair, noise, nullptr);
    }
    Vector9 error;
    error.head<3>() = so3::log(reference.rotation.conjugate() * state.T_map_imu.rotation);
    error.segment<3>(3) = state.T_map_imu.position - reference.position;
    error.tail<3>() = state.velocity - reference.velocity;
    sum += error * error.transpose();
  }
  sum /= runs;
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(sum(i, i) / clean.covariance()(i, i), 1.0, 0.1) << i;
  }
}

TEST(Propagation, CovarianceTransitionMatchesDifferencesOfTheState) {
  const auto samples = random_samples(5, 21);
  const NavState start = random_state(6);
  ImuNoise noise;
  noise.gyroscope_noise_density = noise.accelerometer_noise_density = 0.0;
  noise.gyroscope_bias_random_walk = noise.accelerometer_bias_random_walk = 0.0;
  const NavState end = propagate(start, samples, noise, nullptr);
  Matrix17 numeric;
  const double step = 1e-5;
  for (int i = 0; i < 17; ++i) {
    const Vector17 delta = step * Vector17::Unit(i);
    numeric.col(i) = (propagate(start.boxplus(delta), samples, noise, nullptr).boxminus(end) -
                      propagate(start.boxplus(-delta), samples, noise, nullptr).boxminus(end)) /
                     (2.0 * step);
  }
  for (int i = 0; i < 17; ++i) {
    Matrix17 covariance = Matrix17::Zero();
    covariance(i, i) = 1.0;
    propagate(start, samples, noise, &covariance);
    const Matrix17 expected = numeric.col(i) * numeric.col(i).transpose();
    EXPECT_LT((covariance - expected).norm(), 2e-4 * (1.0 + expected.norm())) << i;
  }
}

TEST(ScanMotion, RunsForwardPropagationBackwards) {
  const auto samples = random_samples(8, 21);
  const NavState start = random_state(9);
  const NavState end = propagate(start, samples, ImuNoise{}, nullptr);
  const ScanMotion motion(end, samples);
  EXPECT_LT(motion.pose(samples.front().time).boxminus(start.T_map_imu).norm(), 1e-10);
  EXPECT_LT(motion.relative_pose(samples.back().time).boxminus(Pose{}).norm(), 1e-12);
  // Between the samples the motion is continuous and agrees with a propagation that stops there.
  const Time between = samples[7].time + 2'000'000;
  std::vector<ImuSample> head(samples.begin(), samples.begin() + 8);
  const NavState at_sample = propagate(start, head, ImuNoise{}, nullptr);
  EXPECT_LT((motion.pose(between).position - at_sample.T_map_imu.position - 0.002 * at_sample.velocity).norm(), 1e-4);
}

}  // namespace
}  // namespace lodestone
