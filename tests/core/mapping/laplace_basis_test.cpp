#include "core/mapping/laplace_basis.h"

#include <gtest/gtest.h>

#include <random>

namespace lodestone {
namespace {

std::vector<Vector3> places(int count, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  const auto uniform = [&] { return 2.0 * static_cast<double>(generator() >> 11) * 0x1.0p-53 - 1.0; };
  std::vector<Vector3> points;
  for (int i = 0; i < count; ++i) points.emplace_back(3.0 + 1.5 * uniform(), -2.0 + uniform(), 0.4 + 0.6 * uniform());
  return points;
}

const LaplaceBasis& basis() {
  static const LaplaceBasis basis({3.0, -2.0, 0.4}, {1.6, 1.1, 0.7}, {0.5, 0.5, 0.4}, 5.0);
  return basis;
}

TEST(LaplaceBasisTest, GradientsAreThoseOfTheValues) {
  const double step = 1e-5;
  for (const Vector3& point : places(20, 1)) {
    const Eigen::MatrixXd gradient = basis().gradients({point});
    for (int d = 0; d < 3; ++d) {
      const Vector3 offset = step * Vector3::Unit(d);
      const Eigen::VectorXd difference =
          (basis().values(point + offset) - basis().values(point - offset)) / (2.0 * step);
      EXPECT_LT((difference - gradient.col(d)).cwiseAbs().maxCoeff(), 1e-6 * gradient.cwiseAbs().maxCoeff());
    }
  }
}

TEST(LaplaceBasisTest, VanishesOnTheFacesAndHasAsManyFunctionsAsCounted) {
  EXPECT_EQ(basis().size(), static_cast<Eigen::Index>(LaplaceBasis::count({1.6, 1.1, 0.7}, {0.5, 0.5, 0.4}, 5.0)));
  for (const Vector3& face : {Vector3(4.6, -2.3, 0.5), Vector3(2.0, -3.1, 0.5), Vector3(2.0, -2.3, 1.1)}) {
    EXPECT_LT(basis().values(face).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(LaplaceBasisTest, SumsOfProductsEqualThoseOfTheirRows) {
  const std::vector<Vector3> points = places(300, 2);  // more than one piece
  Eigen::VectorXd weights(300);
  Eigen::MatrixX3d vectors(300, 3);
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 300; ++i) {
    weights[i] = std::abs(normal(generator));
    vectors.row(i) << normal(generator), normal(generator), normal(generator);
  }
  const Eigen::MatrixXd rows = basis().gradients(points);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(basis().size(), basis().size());
  Eigen::MatrixX3d sums = Eigen::MatrixX3d::Zero(basis().size(), 3);
  for (int i = 0; i < 300; ++i) {
    products += weights[i] * rows.middleCols<3>(3 * i) * rows.middleCols<3>(3 * i).transpose();
    for (int d = 0; d < 3; ++d) sums.col(d) += vectors(i, d) * rows.col(3 * i + d);
  }
  const Eigen::MatrixXd found = basis().gradient_products(points, weights);
  const Eigen::MatrixXd expected = products.triangularView<Eigen::Lower>();
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-11 * products.cwiseAbs().maxCoeff());
  EXPECT_LT((basis().gradient_sums(points, vectors) - sums).cwiseAbs().maxCoeff(), 1e-11 * sums.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace lodestone
