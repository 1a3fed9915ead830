#include "estimators/smoother/field_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lodestone {
namespace {

Vector3 rich(const Vector3& p) {
  return {18.0 + 8.0 * std::sin(1.9 * p.x() + 0.3) + 5.0 * std::cos(2.3 * p.y()),
          -3.0 + 7.0 * std::cos(1.4 * p.x() - 1.1 * p.y()), -42.0 + 6.0 * std::sin(2.1 * p.y() + 0.7 * p.x())};
}

/// A field that changes along y alone.
Vector3 striped(const Vector3& p) {
  return {18.0, -3.0 + 8.0 * std::sin(2.0 * p.y()), -42.0 + 6.0 * std::cos(2.0 * p.y())};
}

MagneticMap make_map(Vector3 (*field)(const Vector3&)) {
  const FieldGrid grid{0.05, {-2.0, -2.0}, 81, 81, {0.1}};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Vector3 b = field(Vector3(-2.0 + 0.05 * column, -2.0 + 0.05 * row, 0.1));
      nodes.emplace_back(static_cast<float>(b.x()), static_cast<float>(b.y()), static_cast<float>(b.z()), 0.1F);
    }
  }
  return {grid, nodes, 1.0};
}

const Pose truth{so3::exp(Vector3(0.0, 0.0, 0.3)), Vector3(0.2, -0.3, 0.2)};

/// `count` array samples of eight magnetometers at the true pose.
std::vector<std::vector<FieldReading>> measure(Vector3 (*field)(const Vector3&), int count, double noise,
                                               unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0.0, noise);
  std::vector<std::vector<FieldReading>> arrays(static_cast<std::size_t>(count));
  for (auto& array : arrays) {
    for (int j = 0; j < 8; ++j) {
      FieldReading reading;
      reading.T_end_mag = {Quaternion::Identity(), Vector3(j < 4 ? 0.3 : -0.3, 0.25 - 0.1667 * (j % 4), -0.1)};
      const Pose T_map_mag = truth * reading.T_end_mag;
      reading.measured_ut = T_map_mag.rotation.conjugate() * field(T_map_mag.position) +
                            Vector3(normal(generator), normal(generator), normal(generator));
      reading.magnetometer = j;
      reading.sigma_ut = noise;
      array.push_back(reading);
    }
  }
  return arrays;
}

Matrix6 covariance(double degrees, double metres) {
  Vector6 sigma;
  sigma << Vector3::Constant(degrees * M_PI / 180.0), Vector3::Constant(metres);
  return sigma.cwiseAbs2().asDiagonal();
}

TEST(FieldPose, ErrsAsItsInformationSays) {
  const MagneticMap map = make_map(rich);
  double nees = 0.0;
  int degrees = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const auto arrays = measure(rich, 4, 0.5, seed);
    std::mt19937_64 generator(1000 + seed);
    std::normal_distribution<double> normal;
    Vector6 offset;
    for (int i = 0; i < 6; ++i) offset[i] = normal(generator) * (i < 3 ? 0.02 : 0.05);
    offset[5] = 0.0;  // a map of one layer does not observe the height
    const MeasuredPose found =
        field_pose(arrays, truth.boxplus(offset), covariance(1.2, 0.05), map, FieldInterpolation::bicubic, 1e-3);
    nees += (found.root * truth.boxminus(found.T_map_imu)).squaredNorm();
    degrees += static_cast<int>((found.root.rowwise().norm().array() > 0.0).count());
  }
  EXPECT_EQ(degrees, 500);
  EXPECT_NEAR(nees / degrees, 1.0, 0.2);
}

TEST(FieldPose, DoesNotCountThePrediction) {
  const MagneticMap map = make_map(rich);
  const auto arrays = measure(rich, 4, 0.5, 3);
  Vector6 offset;
  offset << 0.002, -0.001, 0.003, 0.004, -0.003, 0.0;
  const Pose predicted = truth.boxplus(offset);
  const MeasuredPose tight =
      field_pose(arrays, predicted, covariance(0.3, 0.01), map, FieldInterpolation::bicubic, 1e-6);
  const MeasuredPose loose =
      field_pose(arrays, predicted, covariance(3.0, 0.1), map, FieldInterpolation::bicubic, 1e-6);
  const Matrix6 a = tight.root.transpose() * tight.root;
  const Matrix6 b = loose.root.transpose() * loose.root;
  EXPECT_LT((a - b).norm(), 0.1 * b.norm());
  // In sigmas of the field alone.
  EXPECT_LT((loose.root * tight.T_map_imu.boxminus(loose.T_map_imu)).norm(), 0.3);
}

TEST(FieldPose, WhatTheFieldDoesNotSeeHasNoInformationInsteadOfNoise) {
  const MagneticMap map = make_map(striped);
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const MeasuredPose found = field_pose(measure(striped, 4, 0.5, seed), truth, covariance(1.0, 0.05), map,
                                          FieldInterpolation::bicubic, 1e-3);
    const Matrix6 information = found.root.transpose() * found.root;
    const Vector6 along = Vector6::Unit(3);
    EXPECT_LT(along.dot(information * along), 1e-3 / (0.05 * 0.05));
    EXPECT_LT(std::abs(found.T_map_imu.position.x() - truth.position.x()), 1e-3);
    EXPECT_GT(information(4, 4), 100.0);
  }
}

TEST(FieldPose, OffTheMapNothingIsKnown) {
  const MagneticMap map = make_map(rich);
  const Pose outside{truth.rotation, Vector3(20.0, 0.0, 0.2)};
  const MeasuredPose found =
      field_pose(measure(rich, 4, 0.5, 1), outside, covariance(1.0, 0.05), map, FieldInterpolation::bicubic, 1e-3);
  EXPECT_TRUE(found.root.isZero(0.0));
  EXPECT_EQ(found.T_map_imu.position, outside.position);
}

}  // namespace
}  // namespace lodestone
