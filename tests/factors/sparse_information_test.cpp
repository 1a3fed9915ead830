// Covariances from the sparse information matrix: against dense inverses, and with almost singular information.
#include "factors/sparse_information.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <limits>
#include <random>

#include "tests/factors/factor_chain.h"

namespace lodestone {
namespace {

/// Random whitened rows over variables of 1 to 5 components: neighbours, some further apart, and a last one that is
/// connected to all.
struct RandomRows {
  explicit RandomRows(std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    Eigen::Index size = 0;
    for (int i = 0; i < 12; ++i) {
      variables.push_back({size, 1 + static_cast<Eigen::Index>(generator() % 5)});
      size += variables.back().size;
    }
    std::vector<std::vector<std::size_t>> cliques{{7, 2}, {5}};
    for (std::size_t i = 0; i < 11; ++i) cliques.push_back({i, i + 1 < 11 ? i + 1 : 0, 11});
    dense = Eigen::MatrixXd::Zero(0, size);
    for (const auto& clique : cliques) {
      const Eigen::Index first = dense.rows();
      dense.conservativeResize(first + 12, size);
      dense.bottomRows(12).setZero();
      for (const std::size_t variable : clique) {
        dense.block(first, variables[variable].begin, 12, variables[variable].size) =
            Eigen::MatrixXd::NullaryExpr(12, variables[variable].size, [&]() { return normal(generator); });
      }
    }
    const Eigen::MatrixXd lower = (dense.transpose() * dense).triangularView<Eigen::Lower>();
    information = lower.sparseView();
    rows = dense.sparseView();
  }

  std::vector<IndexRange> variables;
  Eigen::MatrixXd dense;
  SparseMatrix rows;
  SparseMatrix information;
};

TEST(SparseTriangle, CholeskyAndQrGiveTheCovariancesOfTheDenseInverse) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const RandomRows random(seed);
    const Eigen::MatrixXd inverse = Eigen::MatrixXd(random.dense.transpose() * random.dense).inverse();
    const auto cholesky = SparseTriangle::by_cholesky(random.information);
    ASSERT_TRUE(cholesky);
    EXPECT_GT(cholesky->least_pivot_share(random.information), 1e-6);
    for (const SparseTriangle& triangle : {*cholesky, SparseTriangle::by_qr(random.rows, random.information)}) {
      const std::vector<Eigen::MatrixXd> blocks = triangle.diagonal_covariances(random.variables);
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        const IndexRange& own = random.variables[i];
        const Eigen::MatrixXd wanted = inverse.block(own.begin, own.begin, own.size, own.size);
        EXPECT_LT((blocks[i] - wanted).norm(), 1e-9 * wanted.norm()) << "variable " << i;
      }
      const IndexRange& first = random.variables[8];
      const IndexRange& second = random.variables[3];
      const Eigen::MatrixXd joint = triangle.covariance(std::array{first, second});
      const Eigen::MatrixXd cross = inverse.block(first.begin, second.begin, first.size, second.size);
      EXPECT_LT((joint.topRightCorner(first.size, second.size) - cross).norm(), 1e-9 * joint.norm());
    }
  }
}

TEST(SparseTriangle, SolvesForAnyNumberOfColumns) {
  const RandomRows random(3);
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(random.dense.transpose() * random.dense).inverse();
  const SparseTriangle triangle = SparseTriangle::by_cholesky(random.information).value();
  const Eigen::Index size = inverse.rows();
  for (const Eigen::Index columns : {0, 1, 7, 8, 9, 16, 17, 33}) {
    Eigen::MatrixXd right = Eigen::MatrixXd::Random(size, columns);
    right.topRows(size / 2).setZero();
    const Eigen::MatrixXd solution = triangle.solve(right);
    ASSERT_EQ(solution.cols(), columns);
    EXPECT_LT((solution - inverse * right).norm(), 1e-9 * (1.0 + solution.norm())) << columns;
  }
}

TEST(SparseTriangle, CholeskyRefusesWhatIsNotPositive) {
  Eigen::Matrix3d lower;
  lower << 1.0, 0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0;
  EXPECT_FALSE(SparseTriangle::by_cholesky(lower.sparseView()));
}

/// A chain of keyframes with all kinds of factors and a prior on the first, in order of time.
struct KnownChain {
  explicit KnownChain(std::uint64_t seed) : chain(seed) {
    chain.add_prior_of_start();
    for (std::size_t k = 0; k < Chain::kKeyframes; ++k) {
      variables.push_back(&chain.poses[k]);
      variables.push_back(&chain.motions[k]);
      if (k == 1) variables.push_back(&chain.biases);
    }
    variables.push_back(&chain.next_biases);
    variables.push_back(&chain.gravity);
    for (const WindowFactor& factor : chain.factors) factors.push_back(&factor);
  }

  SparseInformation information() const { return {{variables.begin(), variables.end()}, factors}; }

  Chain chain;
  std::vector<WindowBlock*> variables;
  std::vector<const WindowFactor*> factors;
};

TEST(SparseInformation, CovariancesAreThoseOfTheDenseInverse) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const KnownChain problem(seed);
    const Eigen::MatrixXd inverse = scaled_inverse(assemble(problem.chain.factors, problem.variables).hessian);
    const SparseInformation information = problem.information();
    const std::vector<Eigen::MatrixXd> found = information.covariances();
    Eigen::Index at = 0;
    for (std::size_t i = 0; i < problem.variables.size(); ++i) {
      const Eigen::Index size = problem.variables[i]->tangent_size();
      const Eigen::MatrixXd expected = inverse.block(at, at, size, size);
      EXPECT_LT((found[i] - expected).norm(), 1e-7 * expected.norm()) << "variable " << i;
      const Eigen::MatrixXd alone = information.covariance(std::array<const WindowBlock*, 1>{problem.variables[i]});
      EXPECT_LT((alone - expected).norm(), 1e-7 * expected.norm()) << "variable " << i;
      at += size;
    }
  }
}

TEST(SparseInformation, HoldsConstantWhatIsNoVariable) {
  KnownChain problem(6);
  const auto with = problem.information().covariance(std::array<const WindowBlock*, 1>{&problem.chain.poses[2]});
  std::erase(problem.variables, &problem.chain.biases);
  const auto without = problem.information().covariance(std::array<const WindowBlock*, 1>{&problem.chain.poses[2]});
  EXPECT_LT(without.trace(), with.trace());
}

TEST(SparseInformation, GivesTheSameBitsOnAnyNumberOfThreads) {
  const KnownChain problem(4);
  const auto bits = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return problem.information().covariances();
  };
  EXPECT_EQ(bits(1), bits(2));
}

/// Two vectors of which only the difference is observable.
struct Difference {
  WindowBlock first{BlockKind::euclidean, std::vector<double>(3)};
  WindowBlock second{BlockKind::euclidean, std::vector<double>(3)};
  RandomWalkFactor walk{3, 0.5};
  WindowFactor factor{nullptr, &walk, {&first, &second}};
  std::vector<const WindowFactor*> factors{&factor};
};

TEST(SparseInformation, ADirectionThatNoFactorSeesHasAVeryLargeVariance) {
  const Difference difference;
  const WindowBlock lonely{BlockKind::euclidean, std::vector<double>(2)};
  const SparseInformation information({&difference.first, &difference.second, &lonely}, difference.factors);
  EXPECT_TRUE(information.by_qr());
  for (const Eigen::MatrixXd& covariance : information.covariances()) {
    EXPECT_TRUE(covariance.allFinite());
    EXPECT_GT(covariance.diagonal().minCoeff(), 1e11);
    EXPECT_LT(covariance.diagonal().maxCoeff(), 1.01e12);
  }
}

TEST(SparseInformation, AWeakPriorBesideStrongFactorsKeepsItsVariance) {
  // A chain of steps with a sigma of 1e-10 and a prior with a sigma of 1: information of 1e20 and 1, too far apart for
  // Cholesky.
  constexpr std::size_t kSteps = 5;
  std::vector<WindowBlock> blocks(kSteps + 1, {BlockKind::euclidean, std::vector<double>(3)});
  const RandomWalkFactor start(3, 1.0, true);
  const RandomWalkFactor step(3, 1e-10);
  std::vector<WindowFactor> factors{{nullptr, &start, {&blocks[0]}}};
  for (std::size_t i = 0; i < kSteps; ++i) factors.push_back({nullptr, &step, {&blocks[i], &blocks[i + 1]}});
  std::vector<const WindowBlock*> variables;
  std::vector<const WindowFactor*> all;
  for (const WindowBlock& block : blocks) variables.push_back(&block);
  for (const WindowFactor& factor : factors) all.push_back(&factor);
  const SparseInformation information(variables, all);
  EXPECT_TRUE(information.by_qr());
  for (const Eigen::MatrixXd& covariance : information.covariances()) {
    EXPECT_LT((covariance - Eigen::Matrix3d::Identity()).norm(), 1e-4);
  }
}

TEST(SparseInformation, AnswersWhereAJacobianIsNotFinite) {
  Difference difference;
  const RandomWalkFactor broken(3, std::numeric_limits<double>::quiet_NaN());
  const WindowFactor factor{nullptr, &broken, {&difference.first, &difference.second}};
  const SparseInformation information({&difference.first, &difference.second},
                                      std::vector<const WindowFactor*>{&factor});
  for (const Eigen::MatrixXd& covariance : information.covariances())
    EXPECT_EQ(covariance, 1e12 * Eigen::Matrix3d::Identity());
}

}  // namespace
}  // namespace lodestone
