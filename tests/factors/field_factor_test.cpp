#include "factors/field_factor.h"

#include <gtest/gtest.h>

#include "factors/manifolds.h"
#include "tests/factors/corridor.h"
#include "tests/factors/gradients.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

TEST(FieldFactor, PassesTheGradientCheckerWithAndWithoutMask) {
  Random random(8);
  const PoseManifold pose_manifold;
  const ceres::EuclideanManifold<ceres::DYNAMIC> bias_manifold(6);
  for (int i = 0; i < 5; ++i) {
    const Pose pose{so3::exp(random.vector(0.5)), random.vector(0.5)};
    std::vector<FieldReading> readings;
    for (int k = 0; k < 4; ++k) {
      readings.push_back({{so3::exp(random.vector(0.3)), random.vector(0.3)},
                          Vector3(20, 0, -40) + random.vector(5.0),
                          k % 2,
                          1.5,
                          0.7});
    }
    std::vector<double> biases(6);
    for (double& bias : biases) bias = random.normal();
    for (const PoseMask& mask : {PoseMask{}, PoseMask(Matrix6::Identity() - corridor_projector(), pose)}) {
      // Bicubic is smooth; bilinear has kinks within the steps of numerical differences.
      const FieldFactor factor(wavy_map(3.0, 0.2), FieldInterpolation::bicubic, 2, readings, mask);
      const PoseBlock block = block_of(pose.boxplus(0.02 * Vector6::Ones()));
      expect_gradients(factor, {&pose_manifold, &bias_manifold}, {block.data(), biases.data()}, 1e-5);
    }
  }
}

TEST(FieldFactor, OffTheMapItSaysNothing) {
  const FieldFactor factor(wavy_map(3.0, 0.2), FieldInterpolation::bicubic, 1,
                           {{Pose{}, Vector3(1, 2, 3), 0, 1.0, 1.0}}, {});
  const PoseBlock block = block_of({Quaternion::Identity(), Vector3(50, 0, 0)});
  const Vector3 bias = Vector3::Zero();
  const double* parameters[] = {block.data(), bias.data()};
  Vector3 residual = Vector3::Ones();
  Eigen::Matrix<double, 3, 7, Eigen::RowMajor> by_pose = Eigen::Matrix<double, 3, 7>::Ones();
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> by_bias = Matrix3::Ones();
  double* jacobians[] = {by_pose.data(), by_bias.data()};
  factor.Evaluate(parameters, residual.data(), jacobians);
  EXPECT_EQ(residual.norm() + by_pose.norm() + by_bias.norm(), 0.0);
}

// A robot near the map's edge whose reading fits the map badly: leaving the map must not lower the cost.
TEST(FieldFactor, GoesOnBeyondTheMapsEdge) {
  const auto map = wavy_map(3.0, 0.2);
  const FieldGrid& grid = map->grid();
  const double edge_m = grid.origin.x() + grid.resolution_m * (grid.columns - 1);
  const double y = grid.origin.y() + 0.5 * grid.resolution_m * (grid.rows - 1);
  FieldReading reading{Pose{}, Vector3(60.0, 0.0, -40.0), 0, 1.0, 1.0};
  reading.place = Vector3(edge_m - 0.05, y, 0.0);
  reading.field = map->query(reading.place, FieldInterpolation::bicubic);
  ASSERT_TRUE(reading.field.has_value());
  const FieldFactor factor(map, FieldInterpolation::bicubic, 1, {reading}, {});
  const auto cost = [&](double x) {
    const PoseBlock block = block_of({Quaternion::Identity(), Vector3(x, y, 0.0)});
    const Vector3 bias = Vector3::Zero();
    const double* parameters[] = {block.data(), bias.data()};
    Vector3 residual;
    factor.Evaluate(parameters, residual.data(), nullptr);
    return residual.squaredNorm();
  };
  const double inside = cost(edge_m - 1e-6);
  EXPECT_GT(inside, 100.0);
  EXPECT_NEAR(cost(edge_m + 1e-6), inside, 0.01 * inside);
  EXPECT_GT(cost(edge_m + 0.3), 0.5 * inside);
  reading.T_end_mag = {so3::exp({0.2, 0.1, -0.3}), {0.05, 0.1, -0.2}};
  const FieldFactor aside(map, FieldInterpolation::bicubic, 1, {reading}, {});
  const PoseManifold pose_manifold;
  const ceres::EuclideanManifold<3> bias_manifold;
  const PoseBlock block = block_of({so3::exp({0.1, -0.2, 0.3}), Vector3(edge_m + 0.5, y, 0.1)});
  const Vector3 bias(1.0, -2.0, 0.5);
  expect_gradients(aside, {&pose_manifold, &bias_manifold}, {block.data(), bias.data()}, 1e-5);
}

}  // namespace
}  // namespace lodestone
