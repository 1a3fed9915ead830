#include "factors/block_solver.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

#include "tests/factors/factor_chain.h"

namespace lodestone {
namespace {

/// Random factors over variables of different sizes: neighbours, some further apart, and a last one that touches all.
struct RandomSystem {
  explicit RandomSystem(std::uint64_t seed) : generator(seed) {
    for (int i = 0; i < 12; ++i) sizes.push_back(1 + static_cast<int>(generator() % 5));
    for (int i = 0; i < 11; ++i) cliques.push_back({i, i + 1 < 11 ? i + 1 : 0, 11});
    cliques.push_back({7, 2});
    cliques.push_back({5});
  }

  std::pair<Eigen::MatrixXd, Eigen::VectorXd> fill(BlockSystem& system) {
    std::vector<int> begin{0};
    for (const int size : sizes) begin.push_back(begin.back() + size);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(begin.back(), begin.back());
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(begin.back());
    std::normal_distribution<double> normal;
    for (const BlockSystem::Clique& clique : cliques) {
      std::vector<int> columns;
      for (const int variable : clique) {
        for (int i = 0; i < sizes[static_cast<std::size_t>(variable)]; ++i) columns.push_back(begin[static_cast<std::size_t>(variable)] + i);
      }
      const auto count = static_cast<Eigen::Index>(columns.size());
      const Eigen::MatrixXd jacobian = Eigen::MatrixXd::NullaryExpr(count + 2, count, [&]() { return normal(generator); });
      const Eigen::MatrixXd hessian = jacobian.transpose() * jacobian;
      const Eigen::VectorXd share = Eigen::VectorXd::NullaryExpr(count, [&]() { return normal(generator); });
      system.add(clique, hessian, share);
      for (Eigen::Index i = 0; i < count; ++i) {
        gradient(columns[static_cast<std::size_t>(i)]) += share(i);
        for (Eigen::Index j = 0; j < count; ++j)
          dense(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]) += hessian(i, j);
      }
    }
    return {dense, gradient};
  }

  std::mt19937_64 generator;
  std::vector<int> sizes;
  std::vector<BlockSystem::Clique> cliques;
};

TEST(BlockSystem, StepAndCovariancesAreThoseOfTheDenseSystem) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomSystem random(seed);
    BlockSystem system(random.sizes, random.cliques);
    const auto [dense, gradient] = random.fill(system);
    ASSERT_TRUE(system.factorize(0.0));
    std::vector<double> step;
    system.step(step);
    const Eigen::VectorXd expected = -dense.llt().solve(gradient);
    ASSERT_EQ(static_cast<Eigen::Index>(step.size()), expected.size());
    EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(step.data(), expected.size()) - expected).norm(), 1e-9 * expected.norm());
    const Eigen::MatrixXd inverse = dense.inverse();
    const std::vector<Eigen::MatrixXd> covariances = system.covariances();
    Eigen::Index at = 0;
    for (std::size_t i = 0; i < random.sizes.size(); ++i) {
      const Eigen::Index size = random.sizes[i];
      const Eigen::MatrixXd wanted = inverse.block(at, at, size, size);
      EXPECT_LT((covariances[i] - wanted).norm(), 1e-8 * wanted.norm()) << "variable " << i;
      at += size;
    }
  }
}

TEST(BlockSystem, DampingRaisesTheDiagonalAlone) {
  RandomSystem random(3);
  BlockSystem system(random.sizes, random.cliques);
  auto [dense, gradient] = random.fill(system);
  ASSERT_TRUE(system.factorize(0.5));
  dense.diagonal() *= 1.5;
  std::vector<double> step;
  system.step(step);
  const Eigen::VectorXd expected = -dense.llt().solve(gradient);
  EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(step.data(), expected.size()) - expected).norm(), 1e-9 * expected.norm());
}

TEST(BlockSystem, TellsWhatIsNotPositive) {
  BlockSystem system({2, 1}, std::vector<BlockSystem::Clique>{{0, 1}});
  system.add({0, 1}, Eigen::MatrixXd::Identity(3, 3) - 2.0 * Eigen::MatrixXd::Ones(3, 3) / 3.0, Eigen::VectorXd::Zero(3));
  EXPECT_FALSE(system.factorize(0.0));
}

TEST(BlockSystem, RefusesAFactorThatItWasNotTold) {
  BlockSystem system({1, 1, 1}, std::vector<BlockSystem::Clique>{{0, 1}});
  EXPECT_THROW(system.add({0, 2}, Eigen::MatrixXd::Identity(2, 2), Eigen::VectorXd::Zero(2)), std::logic_error);
}

/// A chain of keyframes with every kind of factor and a known start.
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

  Chain chain;
  std::vector<WindowBlock*> variables;
  std::vector<const WindowFactor*> factors;
};

TEST(BlockSolver, CovariancesAreThoseOfTheDenseInverse) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    KnownChain problem(seed);
    const Eigen::MatrixXd inverse = scaled_inverse(assemble(problem.chain.factors, problem.variables).hessian);
    const std::vector<Matrix6> found = BlockSolver(problem.variables, problem.factors).pose_covariances();
    ASSERT_EQ(found.size(), Chain::kKeyframes);
    Eigen::Index at = 0;
    std::size_t pose = 0;
    for (const WindowBlock* block : problem.variables) {
      if (block->kind == BlockKind::pose) {
        const Matrix6 expected = inverse.block<6, 6>(at, at);
        EXPECT_LT((found[pose++] - expected).norm(), 1e-8 * expected.norm());
      }
      at += block->tangent_size();
    }
  }
}

TEST(BlockSolver, EndsWhereTheGradientVanishesOnAnyNumberOfThreads) {
  const auto solve = [](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    KnownChain problem(4);
    BlockSolver solver(problem.variables, problem.factors);
    EXPECT_LT(minimize(solver, 20), 10);
    EXPECT_LT(newton_decrement(assemble(problem.chain.factors, problem.variables)), 1e-4);
    std::vector<double> values;
    for (const WindowBlock* block : problem.variables) values.insert(values.end(), block->values.begin(), block->values.end());
    return values;
  };
  EXPECT_EQ(solve(1), solve(2));
}

TEST(BlockSolver, HoldsConstantWhatIsNoVariable) {
  KnownChain problem(6);
  std::erase(problem.variables, &problem.chain.biases);
  const std::vector<double> before = problem.chain.biases.values;
  BlockSolver solver(problem.variables, problem.factors);
  minimize(solver, 20);
  EXPECT_EQ(problem.chain.biases.values, before);
}

}  // namespace
}  // namespace lodestone
