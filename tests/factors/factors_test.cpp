#include <gtest/gtest.h>

#include <random>

#include "factors/condensed_lidar_factor.h"
#include "factors/gauss_markov_factor.h"
#include "factors/manifolds.h"
#include "factors/point_plane_factor.h"
#include "factors/pose_factor.h"
#include "factors/preintegration_factor.h"
#include "factors/random_walk_factor.h"
#include "tests/factors/bend.h"
#include "tests/factors/corridor.h"
#include "tests/factors/gradients.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

struct LidarScene {
  std::vector<Plane> planes;
  std::vector<Correspondence> matches;
  Pose pose;
};

LidarScene lidar_scene(std::uint64_t seed) {
  Random random(seed);
  LidarScene scene;
  scene.pose = random.pose(10.0);
  scene.planes.resize(200);
  for (Plane& plane : scene.planes) {
    const Vector3 point = random.vector(8.0);
    plane.normal = random.vector().normalized().cast<float>();
    plane.major = Eigen::Vector3f(plane.normal.unitOrthogonal());
    plane.center = (scene.pose * point + random.vector(0.03)).cast<float>();
    scene.matches.push_back({point.cast<float>(), &plane, 1e-2F});
  }
  return scene;
}

TEST(Manifolds, PoseKeepsTheInvariants) {
  Random random(1);
  const PoseManifold manifold;
  for (int i = 0; i < 50; ++i) {
    const PoseBlock x = block_of(random.pose());
    Vector6 delta;
    delta << random.vector(0.5), random.vector();
    PoseBlock y;
    ASSERT_TRUE(manifold.Plus(x.data(), delta.data(), y.data()));
    EXPECT_NEAR(Eigen::Map<Eigen::Vector4d>(y.data()).norm(), 1.0, 1e-14);
    Vector6 back;
    manifold.Minus(y.data(), x.data(), back.data());
    EXPECT_LT((back - delta).norm(), 1e-12);
    const Vector6 zero = Vector6::Zero();
    PoseBlock same;
    manifold.Plus(x.data(), zero.data(), same.data());
    EXPECT_LT(
        (Eigen::Map<Eigen::Matrix<double, 7, 1>>(same.data()) - Eigen::Map<const Eigen::Matrix<double, 7, 1>>(x.data()))
            .norm(),
        1e-15);
    Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
    Eigen::Matrix<double, 6, 7, Eigen::RowMajor> minus;
    manifold.PlusJacobian(x.data(), plus.data());
    manifold.MinusJacobian(x.data(), minus.data());
    EXPECT_LT((minus * plus - Matrix6::Identity()).norm(), 1e-12);
    for (int k = 0; k < 6; ++k) {
      const double step = 1e-6;
      PoseBlock up;
      PoseBlock down;
      const Vector6 forward = step * Vector6::Unit(k);
      const Vector6 backward = -forward;
      manifold.Plus(x.data(), forward.data(), up.data());
      manifold.Plus(x.data(), backward.data(), down.data());
      for (int row = 0; row < 7; ++row) EXPECT_NEAR((up[row] - down[row]) / (2 * step), plus(row, k), 1e-8);
    }
  }
}

TEST(Manifolds, GravityKeepsTheInvariants) {
  Random random(2);
  const GravityManifold manifold;
  for (int i = 0; i < 50; ++i) {
    const Vector3 x = 9.8 * random.vector().normalized();
    const Vector2 delta(0.4 * random.normal(), 0.4 * random.normal());
    Vector3 y;
    manifold.Plus(x.data(), delta.data(), y.data());
    EXPECT_NEAR(y.norm(), x.norm(), 1e-12);
    Vector2 back;
    manifold.Minus(y.data(), x.data(), back.data());
    EXPECT_LT((back - delta).norm(), 1e-10);
    Eigen::Matrix<double, 3, 2, Eigen::RowMajor> plus;
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> minus;
    manifold.PlusJacobian(x.data(), plus.data());
    manifold.MinusJacobian(x.data(), minus.data());
    EXPECT_LT((minus * plus - Eigen::Matrix2d::Identity()).norm(), 1e-12);
  }
}

/// A deskewing with much larger errors than a real gyroscope's, so that numerical differences resolve their effect.
Deskewing wrong_deskewing(Random& random) {
  Deskewing result;
  result.turn = so3::exp(random.vector(0.3));
  result.velocity = random.vector();
  result.before_position = random.vector(0.1);
  result.before_velocity = random.vector();
  result.step_s = 0.1;
  result.gyroscope_density = 0.1;
  result.accelerometer_density = 10.0;
  return result;
}

TEST(CondensedLidarFactor, PassesTheGradientCheckerWithAndWithoutMask) {
  const PoseManifold pose_manifold;
  const ceres::EuclideanManifold<9> motion_manifold;
  const ceres::EuclideanManifold<18> axes_manifold;
  Random random(14);
  LidarScene scene = lidar_scene(4);
  for (std::size_t i = 0; i < scene.matches.size(); ++i) scene.matches[i].age_s = 5e-4F * static_cast<float>(i);
  const Deskewing deskewing = wrong_deskewing(random);
  CondensedScan scan = condense_scan(scene.matches, scene.pose, deskewing);
  for (const PoseMask& mask : {PoseMask{}, PoseMask(corridor_projector(), scene.pose), bend_mask(scene.pose)}) {
    scan.by_lidar = false;
    Vector6 away;
    away << 0.05, -0.02, 0.1, 0.3, -0.2, 0.1;
    const Pose end = scene.pose.boxplus(away);
    const PoseBlock block = block_of(end);
    const PoseBlock before =
        block_of({end.rotation * (deskewing.turn * so3::exp(random.vector(0.05))).conjugate(), random.vector()});
    Eigen::Matrix<double, 9, 1> motion;
    motion << random.vector(), random.vector(), random.vector();
    expect_gradients(CondensedLidarFactor(scan, mask, {}), {&pose_manifold, &motion_manifold},
                     {block.data(), motion.data()});
    Eigen::Matrix<double, 9, 1> motion_before;
    motion_before << random.vector(), random.vector(), random.vector();
    expect_gradients(CondensedLidarFactor(scan, mask, {.before = true}),
                     {&pose_manifold, &motion_manifold, &pose_manifold, &motion_manifold},
                     {block.data(), motion.data(), before.data(), motion_before.data()});
    scan.by_lidar = true;
    scan.correction = {random.vector(0.1), random.vector(0.1), 0.02};
    scan.beam_origin_m = random.vector(0.5);
    Eigen::Matrix<double, 7, 1> calibration;
    calibration << random.vector(0.2), random.vector(0.2), 0.05;
    Vector6 map_error;
    map_error << random.vector(0.1), random.vector(0.1);
    const ceres::EuclideanManifold<7> calibration_manifold;
    const ceres::EuclideanManifold<6> map_error_manifold;
    CondensedLidarFactor calibrating(scan, mask, {.before = true, .calibration = true, .map_error = true});
    calibrating.set_rates({random.vector(0.5), random.vector()}, {random.vector(0.5), random.vector()});
    expect_gradients(
        calibrating,
        {&pose_manifold, &motion_manifold, &pose_manifold, &motion_manifold, &calibration_manifold,
         &map_error_manifold},
        {block.data(), motion.data(), before.data(), motion_before.data(), calibration.data(), map_error.data()}, 1e-5);
    expect_gradients(CondensedLidarFactor(scan, mask, {.map_error = true}),
                     {&pose_manifold, &motion_manifold, &map_error_manifold},
                     {block.data(), motion.data(), map_error.data()}, 1e-5);
  }
}

TEST(CondensedLidarFactor, EqualsOneResidualAPointWithAndWithoutMask) {
  const PoseManifold manifold;
  const LidarScene scene = lidar_scene(5);
  const CondensedScan scan = condense_scan(scene.matches, scene.pose);
  for (const PoseMask& mask : {PoseMask{}, PoseMask(corridor_projector(), scene.pose)}) {
    const CondensedLidarFactor condensed(scan, mask, {});
    const PointPlaneFactor points(scene.matches, mask);
    for (double share : {0.0, 0.1, 1.0}) {
      Vector6 away;
      away << 0.2, -0.1, 0.3, 1.0, -2.0, 0.5;
      const PoseBlock block = block_of(scene.pose.boxplus(share * away));
      const Eigen::Matrix<double, 9, 1> motion = Eigen::Matrix<double, 9, 1>::Zero();
      const auto normal_equations = [&](const ceres::CostFunction& factor) {
        Eigen::VectorXd residual(factor.num_residuals());
        Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor> ambient(factor.num_residuals(), 7);
        const double* parameters[] = {block.data(), motion.data()};
        double* jacobians[] = {ambient.data(), nullptr};
        factor.Evaluate(parameters, residual.data(), jacobians);
        Eigen::Matrix<double, 7, 6, Eigen::RowMajor> plus;
        manifold.PlusJacobian(block.data(), plus.data());
        const Eigen::MatrixXd jacobian = ambient * plus;
        return std::tuple<double, Vector6, Matrix6>(residual.squaredNorm(), jacobian.transpose() * residual,
                                                    jacobian.transpose() * jacobian);
      };
      const auto [cost_a, gradient_a, hessian_a] = normal_equations(condensed);
      const auto [cost_b, gradient_b, hessian_b] = normal_equations(points);
      EXPECT_NEAR(cost_a / cost_b, 1.0, 1e-9);
      EXPECT_LT((gradient_a - gradient_b).norm(), 1e-9 * gradient_b.norm());
      EXPECT_LT((hessian_a - hessian_b).norm(), 1e-9 * hessian_b.norm());
    }
  }
}

TEST(PointPlaneFactor, PassesTheGradientChecker) {
  const PoseManifold manifold;
  const LidarScene scene = lidar_scene(6);
  for (const PoseMask& mask : {PoseMask{}, PoseMask(corridor_projector(), scene.pose)}) {
    const PointPlaneFactor factor(scene.matches, mask);
    const PoseBlock block = block_of(scene.pose.boxplus(Vector6::Constant(0.05)));
    expect_gradients(factor, {&manifold}, {block.data()});
  }
}

TEST(PreintegrationFactor, PassesTheGradientChecker) {
  Random random(7);
  const PoseManifold pose_manifold;
  const GravityManifold gravity_manifold;
  const ceres::EuclideanManifold<9> motion_manifold;
  const ceres::EuclideanManifold<18> axes_manifold;
  std::vector<ImuSample> samples(21);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    // A long and fast motion: numerical differences resolve all derivatives.
    samples[i] = {static_cast<Time>(i) * 25'000'000, random.vector(2.0), Vector3(0, 0, 9.8) + random.vector(3.0)};
  }
  ImuNoise noise;
  noise.gyroscope_noise_density = 0.05;  // numerical differences resolve the residuals
  noise.accelerometer_noise_density = 0.5;
  noise.gyroscope_bias_random_walk = noise.accelerometer_bias_random_walk = 0.1;
  ImuAxes axes;
  for (double& entry : axes) entry = 0.02 * random.normal();
  const PreintegrationFactor factor(Preintegration(samples, random.vector(0.01), random.vector(0.1), noise, axes),
                                    noise, true, (Vector6() << 0.3, 1.0, 0.7, 0.0, 0.5, 1.0).finished());
  for (int i = 0; i < 10; ++i) {
    ImuAxes other_axes = axes;
    for (double& entry : other_axes) entry += 0.5 * random.normal();
    const PoseBlock first = block_of(random.pose());
    Pose moved = to_pose(first.data());
    moved = moved.boxplus(0.1 * Vector6::Random());
    const PoseBlock second = block_of(moved);
    MotionBlock motion_first;
    MotionBlock motion_second;
    for (int k = 0; k < 9; ++k) {
      motion_first[static_cast<std::size_t>(k)] = (k < 3 ? 1.0 : 0.05) * random.normal();
      motion_second[static_cast<std::size_t>(k)] = (k < 3 ? 1.0 : 0.05) * random.normal();
    }
    const Vector3 gravity = s2::boxplus(Vector3(0, 0, -9.8), Vector2(0.05, -0.02));
    expect_gradients(
        factor, {&pose_manifold, &motion_manifold, &pose_manifold, &motion_manifold, &gravity_manifold, &axes_manifold},
        {first.data(), motion_first.data(), second.data(), motion_second.data(), gravity.data(), other_axes.data()});
  }
}

TEST(RandomWalkFactor, PassesTheGradientChecker) {
  const ceres::EuclideanManifold<3> manifold;
  const RandomWalkFactor factor(3, 0.5);
  const Vector3 first(1, 2, 3);
  const Vector3 second(0, 1, 5);
  expect_gradients(factor, {&manifold, &manifold}, {first.data(), second.data()});
}

TEST(GaussMarkovFactor, PassesTheGradientCheckerAndKeepsItsCovariance) {
  const ceres::EuclideanManifold<6> manifold;
  Random random(41);
  Matrix6 root = 2.0 * Matrix6::Identity();
  for (int row = 1; row < 6; ++row) {
    for (int column = 0; column < row; ++column) root(row, column) = random.normal();
  }
  Vector6 first, second;
  first << random.vector(), random.vector();
  second << random.vector(), random.vector();
  expect_gradients(GaussMarkovFactor(root, 0.0), {&manifold}, {second.data()});
  const GaussMarkovFactor factor(root, 0.8);
  expect_gradients(factor, {&manifold, &manifold}, {first.data(), second.data()});
  // Cov second = decay² Σ + (1 − decay²) Σ = Σ: the residual is (second − 0.8 first) whitened by 0.6 L.
  const double* parameters[] = {first.data(), second.data()};
  Vector6 residual;
  factor.Evaluate(parameters, residual.data(), nullptr);
  EXPECT_LT((0.6 * root * residual - (second - 0.8 * first)).norm(), 1e-12);
}

TEST(PoseFactor, GradientsWithAndWithoutMaskAndNothingAlongWhatWasNotSeen) {
  Random random(31);
  const PoseManifold manifold;
  for (int i = 0; i < 20; ++i) {
    const Pose truth = random.pose(10.0);
    Vector6 step;
    step << random.vector(0.2), random.vector(0.3);
    const PoseBlock block = block_of(truth.boxplus(step));
    MeasuredPose measured{truth, Matrix6::Random()};
    measured.root.row(2).setZero();
    for (const PoseMask& mask : {PoseMask(), PoseMask(corridor_projector(), truth.boxplus(-step))}) {
      expect_gradients(PoseFactor(measured, mask), {&manifold}, {block.data()});
    }
    // Along the null space of the root the cost is constant.
    measured.root.col(4).setZero();
    const PoseBlock here = block_of(truth);
    const PoseBlock there = block_of(truth.boxplus(5.0 * Vector6::Unit(4)));
    Vector6 at_here, at_there;
    const double* parameters[] = {here.data()};
    const PoseFactor factor(measured, PoseMask());
    factor.Evaluate(parameters, at_here.data(), nullptr);
    parameters[0] = there.data();
    factor.Evaluate(parameters, at_there.data(), nullptr);
    EXPECT_LT(at_here.norm(), 1e-12);
    EXPECT_LT(at_there.norm(), 1e-12);
  }
}

}  // namespace
}  // namespace lodestone
