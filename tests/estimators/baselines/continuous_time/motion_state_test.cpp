#include "estimators/baselines/continuous_time/motion_state.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>
#include <vector>

#include "estimators/baselines/continuous_time/motion_update.h"

namespace lodestone {
namespace {

constexpr MotionNoise no_motion_noise{0.0, 0.0};

class MotionStateTest : public ::testing::Test {
 protected:
  Vector3 random_vector(double scale) {
    const double x = normal_(generator_);
    const double y = normal_(generator_);
    return scale * Vector3(x, y, normal_(generator_));
  }

  MotionState random_state() {
    MotionState state;
    state.T_map_imu = {so3::exp(random_vector(1.0)), random_vector(3.0)};
    state.velocity = random_vector(1.0);
    state.angular_velocity = random_vector(0.7);
    state.acceleration = random_vector(1.0);
    return state;
  }

  /// A sample of N(0, L Lᵀ).
  Vector15 sample(const Matrix15& lower) {
    Vector15 white;
    for (int i = 0; i < 15; ++i) white[i] = normal_(generator_);
    return lower * white;
  }

  std::mt19937_64 generator_{5};
  std::normal_distribution<double> normal_;
};

TEST_F(MotionStateTest, BoxminusInvertsBoxplus) {
  const MotionState state = random_state();
  Vector15 delta;
  for (int i = 0; i < 5; ++i) delta.segment<3>(3 * i) = random_vector(0.3);
  EXPECT_LT((state.boxplus(delta).boxminus(state) - delta).norm(), 1e-12);
}

TEST_F(MotionStateTest, ThePoseBeforeIsWhereTheStateCameFrom) {
  MotionState before = random_state();
  Matrix15 covariance = Matrix15::Zero();
  const MotionState turned = propagate_motion(before, 0.1, no_motion_noise, covariance);
  const Quaternion back = turned.T_map_imu.rotation * turned.relative_pose(0.1).rotation;
  EXPECT_LT(so3::log(before.T_map_imu.rotation.conjugate() * back).norm(), 1e-12);
  before.angular_velocity.setZero();
  const MotionState after = propagate_motion(before, 0.1, no_motion_noise, covariance);
  EXPECT_LT((after.T_map_imu * after.relative_pose(0.1)).boxminus(before.T_map_imu).norm(), 1e-12);
}

TEST_F(MotionStateTest, TheJacobianOfAPointIsItsNumericalDerivative) {
  for (int trial = 0; trial < 20; ++trial) {
    const MotionState state = random_state();
    const Vector3 measured = random_vector(5.0);
    const Vector3 normal = random_vector(1.0).normalized();
    const double age_s = 0.02 * trial;
    const auto height = [&](const MotionState& at) {
      return normal.dot(at.T_map_imu * (at.relative_pose(age_s) * measured));
    };
    const Vector15 jacobian = state.point_jacobian(state.relative_pose(age_s) * measured, normal, age_s);
    for (int i = 0; i < 15; ++i) {
      const Vector15 step = 1e-6 * Vector15::Unit(i);
      const double slope = (height(state.boxplus(step)) - height(state.boxplus(-step))) / 2e-6;
      EXPECT_NEAR(jacobian[i], slope, 1e-7) << trial << " " << i;
    }
  }
}

TEST_F(MotionStateTest, TheCovarianceIsTransportedByTheNumericalDerivative) {
  const MotionState state = random_state();
  constexpr double step_s = 0.2;
  Matrix15 unused = Matrix15::Zero();
  const MotionState after = propagate_motion(state, step_s, no_motion_noise, unused);
  Matrix15 transition;
  for (int i = 0; i < 15; ++i) {
    const Vector15 delta = 1e-6 * Vector15::Unit(i);
    const auto moved = [&](const Vector15& by) {
      return propagate_motion(state.boxplus(by), step_s, no_motion_noise, unused).boxminus(after);
    };
    transition.col(i) = (moved(delta) - moved(-delta)) / 2e-6;
  }
  Matrix15 covariance = Matrix15::Identity();
  propagate_motion(state, step_s, no_motion_noise, covariance);
  EXPECT_LT((covariance - transition * transition.transpose()).cwiseAbs().maxCoeff(), 1e-7);
}

TEST_F(MotionStateTest, TwoStepsAddTheNoiseOfOne) {
  MotionState state = random_state();
  state.angular_velocity.setZero();
  state.acceleration.setZero();  // an uncertain attitude turns an acceleration
  const MotionNoise noise{0.3, 0.7};
  Matrix15 once = Matrix15::Identity();
  Matrix15 twice = once;
  const MotionState at_once = propagate_motion(state, 0.5, noise, once);
  const MotionState halfway = propagate_motion(state, 0.2, noise, twice);
  const MotionState at_end = propagate_motion(halfway, 0.3, noise, twice);
  EXPECT_LT(at_end.boxminus(at_once).norm(), 1e-12);
  EXPECT_LT((once - twice).cwiseAbs().maxCoeff(), 1e-12);
}

// Points are measured on planes within each window, at poses of a path with noise in steps of a millisecond.
TEST_F(MotionStateTest, TheCovarianceOfTheFilterIsThatOfItsErrors) {
  constexpr int trials = 60;
  constexpr int windows = 12;
  constexpr int steps = 10;
  constexpr double step_s = 0.001;
  constexpr double sigma_m = 0.01;
  const MotionNoise noise{1.0, 1.0};
  Vector15 sigma;
  sigma << Vector3::Constant(0.02), Vector3::Constant(0.1), Vector3::Constant(0.3), Vector3::Constant(0.1),
      Vector3::Constant(0.1);
  struct Measured {
    Vector3 point;  // imu frame at its own time
    Vector3 normal;
    Vector3 center;
    double age_s;
  };
  double nees = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    MotionState state = random_state();
    Matrix15 covariance = sigma.cwiseAbs2().asDiagonal();
    MotionState truth = state.boxplus(sample(sigma.asDiagonal()));
    for (int window = 0; window < windows; ++window) {
      std::vector<Measured> points;
      for (int step = 0; step < steps; ++step) {
        Matrix15 added = Matrix15::Zero();
        truth = propagate_motion(truth, step_s, noise, added);
        truth = truth.boxplus(sample(added.llt().matrixL()));
        for (int i = 0; i < 3; ++i) {
          const Vector3 point = random_vector(5.0);
          const Vector3 normal = random_vector(1.0).normalized();
          points.push_back({point, normal, truth.T_map_imu * point + sigma_m * normal_(generator_) * normal,
                            step_s * (steps - 1 - step)});
        }
      }
      state = propagate_motion(state, steps * step_s, noise, covariance);
      const auto evidence = [&](const MotionState& at) {
        MotionEvidence result;
        for (const Measured& measured : points) {
          const Vector3 point = at.relative_pose(measured.age_s) * measured.point;
          const double residual_m = measured.normal.dot(at.T_map_imu * point - measured.center);
          const Vector15 jacobian = at.point_jacobian(point, measured.normal, measured.age_s);
          result.information += jacobian * jacobian.transpose() / (sigma_m * sigma_m);
          result.gradient += jacobian * residual_m / (sigma_m * sigma_m);
        }
        return result;
      };
      const MotionUpdate updated = update_motion(state, covariance, evidence, 5);
      state = updated.state;
      covariance = updated.covariance;
    }
    const Vector15 error = truth.boxminus(state);
    nees += error.dot(covariance.llt().solve(error)) / (15.0 * trials);
  }
  EXPECT_GT(nees, 0.85);  // one sigma of the mean: 0.05
  EXPECT_LT(nees, 1.15);
}

}  // namespace
}  // namespace lodestone
