#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

#include "core/lidar/condensed_cost.h"
#include "core/lidar/plane_map.h"
#include "core/observability/degeneracy.h"
#include "core/observability/window_information.h"
#include "core/robust_weight.h"

namespace lodestone {
namespace {

/// Information of LiDAR at the origin from the given surfaces: normals at points, noise of two centimetres.
Matrix6 information_of(const std::vector<std::pair<Vector3, Vector3>>& surface) {
  Matrix6 sum = Matrix6::Zero();
  for (const auto& [point, normal] : surface) {
    Vector6 jacobian;
    jacobian << point.cross(normal), normal;
    sum += jacobian * jacobian.transpose() / 4e-4;
  }
  return sum;
}

std::vector<std::pair<Vector3, Vector3>> wall(int axis, double offset, double extent) {
  std::vector<std::pair<Vector3, Vector3>> surface;
  for (int i = -10; i <= 10; ++i) {
    for (int j = -10; j <= 10; ++j) {
      Vector3 point;
      point[axis] = offset;
      point[(axis + 1) % 3] = 0.1 * i * extent;
      point[(axis + 2) % 3] = 0.1 * j * extent;
      surface.emplace_back(point, Vector3::Unit(axis));
    }
  }
  return surface;
}

void append(std::vector<std::pair<Vector3, Vector3>>& surface, const std::vector<std::pair<Vector3, Vector3>>& more) {
  surface.insert(surface.end(), more.begin(), more.end());
}

TEST(Degeneracy, ACorridorLosesExactlyItsAxis) {
  auto surface = wall(1, 2.0, 5.0);
  append(surface, wall(1, -2.0, 5.0));
  append(surface, wall(2, -1.0, 5.0));
  const Degeneracy degeneracy = analyse_by_sigma(information_of(surface), 5.0, {});
  EXPECT_EQ(degeneracy.degenerate_directions, 1);
  EXPECT_GT(std::abs(degeneracy.directions(3, 5)), 1.0 - 1e-9);
  Vector6 axis = Vector6::Unit(3);
  EXPECT_LT((degeneracy.lidar_projector() * axis).norm(), 1e-9);
  EXPECT_LT((degeneracy.magnetic_projector() * axis - axis).norm(), 1e-9);
}

TEST(Degeneracy, ASinglePlaneLosesThreeABoxNoneACylinderTwo) {
  EXPECT_EQ(analyse_by_sigma(information_of(wall(2, -0.5, 5.0)), 5.0, {}).degenerate_directions, 3);
  auto box = wall(0, 4.0, 3.0);
  append(box, wall(1, -3.0, 3.0));
  append(box, wall(2, -1.0, 3.0));
  append(box, wall(0, -4.0, 3.0));
  EXPECT_EQ(analyse_by_sigma(information_of(box), 5.0, {}).degenerate_directions, 0);
  std::vector<std::pair<Vector3, Vector3>> cylinder;
  for (int i = 0; i < 60; ++i) {
    for (int j = -10; j <= 10; ++j) {
      const double angle = 2.0 * M_PI * i / 60.0;
      const Vector3 normal(0.0, std::cos(angle), std::sin(angle));
      cylinder.emplace_back(3.0 * normal + 0.5 * j * Vector3::UnitX(), normal);
    }
  }
  EXPECT_EQ(analyse_by_sigma(information_of(cylinder), 5.0, {}).degenerate_directions, 2);
}

TEST(Degeneracy, DoesNotChangeWithTheNumberOfPointsWhereItHasUnits) {
  auto surface = wall(2, -0.5, 5.0);
  append(surface, wall(1, 2.0, 5.0));
  Matrix6 information = information_of(surface);
  EXPECT_EQ(analyse_by_sigma(information, 5.0, {}).degenerate_directions, 1);
  EXPECT_EQ(analyse_by_sigma(100.0 * information, 5.0, {}).degenerate_directions, 1);
}

TEST(Degeneracy, PaperRuleCountsUnitWeightEigenvalues) {
  Vector6 eigenvalues;
  eigenvalues << 1e4, 20.0, 16.0, 14.0, 1.0, 0.0;
  DegeneracyOptions options;
  options.rule = DegeneracyRule::paper;
  const Degeneracy degeneracy = analyse_by_eigenvalue(Matrix6(eigenvalues.asDiagonal()), options);
  EXPECT_EQ(degeneracy.degenerate_directions, 3);
}

TEST(Degeneracy, SoftMaskFadesMonotonically) {
  Vector6 eigenvalues;
  eigenvalues << 1e8, 4e3, 1.5e3, 1.1e3, 4e2, 0.0;
  DegeneracyOptions options;
  options.mask = MaskKind::soft;
  const Degeneracy degeneracy = analyse_by_sigma(Matrix6(eigenvalues.asDiagonal()), 1.0, options);
  for (int i = 1; i < 6; ++i) EXPECT_LT(degeneracy.kept[i], degeneracy.kept[i - 1]);
  EXPECT_GT(degeneracy.kept[0], 0.999);
  EXPECT_EQ(degeneracy.kept[5], 0.0);
}

TEST(Degeneracy, ProjectorIsIdempotentAndBothPartsAddUp) {
  auto surface = wall(2, -0.5, 5.0);
  append(surface, wall(1, 2.0, 5.0));
  const Degeneracy degeneracy = analyse_by_sigma(information_of(surface), 7.0, {});
  const Matrix6 projector = degeneracy.lidar_projector();
  EXPECT_LT((projector * projector - projector).norm(), 1e-12);
  EXPECT_LT((projector + degeneracy.magnetic_projector() - Matrix6::Identity()).norm(), 1e-14);
}

TEST(RobustWeight, ThePapersThresholdIsTheQuantileOfSixDegrees) {
  EXPECT_NEAR(mahalanobis_quantile(6, 0.95), 3.55, 0.005);
  EXPECT_EQ(huber_weight(3.0, 3.55), 1.0);
  EXPECT_NEAR(huber_weight(7.1, 3.55), 0.5, 1e-12);
}

// A chain with random links, against brute-force marginalization of the dense information matrix.
struct Chain {
  std::vector<Matrix6> poses;
  std::vector<ChainLink> links;
  Eigen::MatrixXd dense;
};

Chain random_chain(int count, bool axis_unseen) {
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal;
  Chain chain;
  const int size = 15 * count + 2;
  chain.dense = Eigen::MatrixXd::Zero(size, size);
  for (int k = 0; k < count; ++k) {
    Eigen::Matrix<double, 8, 6> rows;
    for (auto& value : rows.reshaped()) value = 30.0 * normal(generator);
    if (axis_unseen) rows.col(3).setZero();
    chain.poses.emplace_back(rows.transpose() * rows);
    chain.dense.block<6, 6>(15 * k, 15 * k) += chain.poses.back();
  }
  for (int k = 0; k + 1 < count; ++k) {
    // Constant-velocity motion with weak couplings, as in an IMU factor: position differences only.
    ChainLink link;
    Matrix15 step = Matrix15::Identity();
    for (int axis = 0; axis < 3; ++axis) {
      step(3 + axis, 6 + axis) = 0.1;
      step(axis, 9 + axis) = -0.1;
      step(6 + axis, 12 + axis) = -0.1;
    }
    step.block<3, 3>(6, 0) = -0.1 * so3::hat(Vector3(0.3, 0.1, 9.8));
    Vector15 weight;
    for (auto& value : weight) value = 50.0 * (1.0 + 0.3 * std::abs(normal(generator)));
    link.by_first = -(weight.asDiagonal() * step);
    link.by_second = weight.asDiagonal() * Matrix15::Identity();
    for (int row = 6; row < 9; ++row) link.by_gravity(row, row % 2) = 0.1 * weight[row];
    chain.links.push_back(link);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(15, size);
    rows.block<15, 15>(0, 15 * k) = link.by_first;
    rows.block<15, 15>(0, 15 * k + 15) = link.by_second;
    rows.rightCols<2>() = link.by_gravity;
    chain.dense += rows.transpose() * rows;
  }
  return chain;
}

TEST(WindowInformation, EqualsTheSchurComplementOfTheDenseMatrix) {
  const int count = 6;
  const Chain chain = random_chain(count, false);
  const Eigen::MatrixXd covariance =
      chain.dense.ldlt().solve(Eigen::MatrixXd::Identity(chain.dense.rows(), chain.dense.cols()));
  for (int k = 0; k < count; ++k) {
    const Matrix6 expected = covariance.block<6, 6>(15 * k, 15 * k).inverse();
    const Matrix6 marginal = marginal_pose_information(chain.poses, chain.links, static_cast<std::size_t>(k));
    EXPECT_LT((marginal - expected).norm(), 1e-6 * expected.norm()) << k;
  }
}

TEST(WindowInformation, WhereTheWholeWindowIsBlindNothingIsInvented) {
  const Chain chain = random_chain(8, true);
  for (std::size_t k = 0; k < chain.poses.size(); ++k) {
    const Degeneracy degeneracy = analyse_by_sigma(marginal_pose_information(chain.poses, chain.links, k), 5.0, {});
    EXPECT_GT(degeneracy.sigma_m[5], 1e3);
    EXPECT_GT(std::abs(degeneracy.directions(3, 5)), 0.999);
    EXPECT_LT(degeneracy.sigma_m[4], 1.0);
  }
}

}  // namespace
}  // namespace lodestone
