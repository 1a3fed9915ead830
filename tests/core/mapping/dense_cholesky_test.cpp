#include "core/mapping/dense_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <random>

namespace lodestone {
namespace {

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&]() { return normal(generator); });
}

Eigen::MatrixXd positive_definite(Eigen::Index size) {
  const Eigen::MatrixXd root = random_matrix(size, size);
  return root * root.transpose() + static_cast<double>(size) * Eigen::MatrixXd::Identity(size, size);
}

class DenseCholeskyOfSize : public ::testing::TestWithParam<int> {};

TEST_P(DenseCholeskyOfSize, SolvesWhatItFactorizes) {
  const Eigen::Index size = GetParam();
  const Eigen::MatrixXd matrix = positive_definite(size);
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
  const DenseCholesky cholesky(matrix);
  ASSERT_TRUE(cholesky.is_positive_definite());

  Eigen::MatrixXd half = matrix;
  cholesky.solve_lower(half);  // L⁻¹ A = Lᵀ
  EXPECT_LT((half.transpose() * half - matrix).norm(), 1e-12 * matrix.norm());
  const Eigen::VectorXd right = random_matrix(size, 1);
  EXPECT_LT((matrix * cholesky.solve(right) - right).norm(), 1e-12 * right.norm());
  const Eigen::MatrixXd inverse = cholesky.inverse();
  EXPECT_LT((inverse * matrix - identity).norm(), 1e-12 * static_cast<double>(size));
  EXPECT_EQ(inverse, inverse.transpose());
  const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix).eigenvalues();
  EXPECT_NEAR(cholesky.log_determinant(), eigenvalues.array().log().sum(), 1e-10 * static_cast<double>(size));
}

INSTANTIATE_TEST_SUITE_P(Sizes, DenseCholeskyOfSize, ::testing::Values(1, 3, 64, 301));

TEST(DenseCholesky, ReadsTheLowerTriangleOnly) {
  Eigen::MatrixXd matrix = positive_definite(40);
  const Eigen::VectorXd right = random_matrix(40, 1);
  const Eigen::VectorXd expected = DenseCholesky(matrix).solve(right);
  matrix.triangularView<Eigen::StrictlyUpper>().setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(DenseCholesky(matrix).solve(right), expected);
}

TEST(DenseCholesky, SaysThatAMatrixIsNotPositiveDefinite) {
  Eigen::MatrixXd matrix = positive_definite(40);
  matrix(17, 17) = -1.0;
  EXPECT_FALSE(DenseCholesky(matrix).is_positive_definite());
  matrix(17, 17) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(DenseCholesky(matrix).is_positive_definite());
}

}  // namespace
}  // namespace lodestone
