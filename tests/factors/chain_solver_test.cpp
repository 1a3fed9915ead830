#include "factors/chain_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>

#include "core/imu/propagation.h"
#include "factors/chain_kernels.h"
#include "factors/sliding_window.h"
#include "tests/factors/factor_chain.h"

namespace lodestone {
namespace {

/// A chain with every kind of factor and a start that is known, the solver's view of it, and all blocks in its order.
struct Problem {
  explicit Problem(std::uint64_t seed) : chain(seed) {
    chain.add_prior_of_start();
    for (std::size_t k = 0; k < Chain::kKeyframes; ++k) {
      variables.poses.push_back(&chain.poses[k]);
      variables.motions.push_back(&chain.motions[k]);
      blocks.push_back(&chain.poses[k]);
      blocks.push_back(&chain.motions[k]);
    }
    variables.shared = {&chain.gravity, &chain.biases, &chain.next_biases};
    blocks.insert(blocks.end(), variables.shared.begin(), variables.shared.end());
    for (const WindowFactor& factor : chain.factors) factors.push_back(&factor);
  }

  Chain chain;
  ChainVariables variables;
  std::vector<const WindowFactor*> factors;
  std::vector<WindowBlock*> blocks;
};

TEST(ChainSolver, CovariancesAreThoseOfTheDenseInverse) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Problem problem(seed);
    const Eigen::MatrixXd inverse = scaled_inverse(assemble(problem.chain.factors, problem.blocks).hessian);
    const std::vector<std::size_t> keyframes{3, 0, 1};
    const std::vector<Matrix6> found = ChainSolver(problem.variables, problem.factors).pose_covariances(keyframes);
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      const Matrix6 expected = inverse.block<6, 6>(15 * static_cast<Eigen::Index>(keyframes[i]),
                                                   15 * static_cast<Eigen::Index>(keyframes[i]));
      EXPECT_LT((found[i] - expected).norm(), 1e-8 * expected.norm());
    }
  }
}

TEST(ChainSolver, EndsWhereTheGradientVanishes) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Problem problem(seed);
    ChainSolver solver(problem.variables, problem.factors);
    const int steps = minimize(solver, 20);
    EXPECT_LT(steps, 10);
    EXPECT_LT(newton_decrement(assemble(problem.chain.factors, problem.blocks)), 1e-4);  // hundredths of a sigma
  }
}

TEST(ChainSolver, HoldsConstantWhatIsNoVariable) {
  Problem problem(6);
  problem.variables.shared = {&problem.chain.gravity};
  const std::vector<double> before = problem.chain.biases.values;
  ChainSolver problem_solver(problem.variables, problem.factors);
  minimize(problem_solver, 10);
  EXPECT_EQ(problem.chain.biases.values, before);
}

TEST(ChainSolver, RefusesAFactorOverMoreThanTwoNeighbours) {
  Problem problem(7);
  const RandomWalkFactor leap(9, 1.0);
  const WindowFactor factor{nullptr, &leap, {&problem.chain.motions[0], &problem.chain.motions[2]}};
  EXPECT_THROW(ChainSolver(problem.variables, std::vector<const WindowFactor*>{&factor}), std::logic_error);
}

TEST(ChainSolver, DampsAStepThatWouldFail) {
  // Started a radian and metres off, where Gauss-Newton alone may overshoot: the cost still falls to the same minimum.
  Problem near(8);
  Problem far(8);
  ChainSolver near_solver(near.variables, near.factors);
  minimize(near_solver, 50);
  Random random(9);
  for (WindowBlock* pose : far.variables.poses) {
    from_pose(to_pose(pose->values.data()).boxplus((Vector6() << random.vector(0.4), random.vector(1.0)).finished()),
              pose->values.data());
  }
  ChainSolver far_solver(far.variables, far.factors);
  minimize(far_solver, 100);
  for (std::size_t k = 0; k < Chain::kKeyframes; ++k) {
    EXPECT_LT(to_pose(near.chain.poses[k].values.data()).boxminus(to_pose(far.chain.poses[k].values.data())).norm(),
              1e-3);
  }
}

TEST(ChainSolver, FindsTheMinimumThatCeresFinds) {
  const auto run = [](WindowSolver solver) {
    Random random(10);
    const DriveOptions options;
    const Drive truth = drive(options, random);
    const std::vector<Vector3> normals = room_normals(random);
    const std::shared_ptr<const MagneticMap> map = wavy_map();
    SlidingWindowOptions window_options;
    window_options.solver = solver;
    window_options.max_iterations = 20;
    window_options.magnetometer_bias_epoch_s = 0.7;
    SlidingWindow window(0, truth.truth[0].boxplus(random.draw(start_covariance())), start_covariance(), 3,
                         options.noise, window_options);
    for (std::size_t k = 1; k < truth.truth.size(); ++k) {
      window.add_keyframe(truth.times[k],
                          propagate(window.state(window.size() - 1), truth.samples[k], options.noise, nullptr),
                          truth.samples[k]);
      const std::size_t newest = window.size() - 1;
      const Scan points = scan(truth.truth[k].T_map_imu, normals, 100, 0.02, 5.0, 0.0, random);
      // Condensed where it does not depend on the solver.
      window.set_lidar(newest, condense_scan(points.matches, truth.truth[k].T_map_imu), points.matches, {});
      window.set_field(
          newest, map, FieldInterpolation::bicubic,
          field_readings(truth.truth[k].T_map_imu, *map, std::vector<Vector3>(3, Vector3::Zero()), 1.0, random), {});
      window.solve();
      if (window.size() > 25) window.marginalize_oldest();
    }
    return window.state(window.size() - 1);
  };
  const NavState expected = run(WindowSolver::ceres);
  for (const WindowSolver solver : {WindowSolver::chain, WindowSolver::blocks}) {
    const Vector17 difference = run(solver).boxminus(expected);
    EXPECT_LT(difference.segment<3>(tangent::rotation).norm(), 1e-6);
    EXPECT_LT(difference.segment<3>(tangent::position).norm(), 1e-5);
    EXPECT_LT(difference.segment<3>(tangent::velocity).norm(), 1e-4);
  }
}

TEST(ChainKernels, AreTheProductsAndTheFactorizationTheyClaim) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Random random(11);
  const auto draw = [&](int rows, int columns) {
    return RowMajor(RowMajor::NullaryExpr(rows, columns, [&] { return random.normal(); }));
  };
  const RowMajor a = draw(7, 5);
  const RowMajor b = draw(7, 24);
  RowMajor c = draw(5, 24);
  const RowMajor expected = c - 2.0 * a.transpose() * b;
  add_transposed_product(a.data(), 5, 5, b.data(), 24, 24, 7, -2.0, c.data(), 24);
  EXPECT_LT((c - expected).norm(), 1e-12);

  RowMajor system(5, 12);
  system << a.transpose() * a + RowMajor::Identity(5, 5), draw(5, 7);
  const RowMajor original = system;
  ASSERT_TRUE(eliminate_rows(system.data(), 12, 5, 12));
  const RowMajor upper = system.leftCols<5>().triangularView<Eigen::Upper>();
  EXPECT_LT((upper.transpose() * upper - original.leftCols<5>()).norm(), 1e-12);
  EXPECT_LT((upper.transpose() * system.rightCols<7>() - original.rightCols<7>()).norm(), 1e-12);
  system = -original;
  EXPECT_FALSE(eliminate_rows(system.data(), 12, 5, 12));
}

}  // namespace
}  // namespace lodestone
