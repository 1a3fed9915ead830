#include "factors/marginalization.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "tests/factors/factor_chain.h"

namespace lodestone {
namespace {

/// H_rr − H_re H_ee⁺ H_er and the same for the gradient; the pseudo-inverse by eigenvalues of the scaled block.
NormalEquations schur(const NormalEquations& full, Eigen::Index gone) {
  const Eigen::Index kept = full.gradient.size() - gone;
  const Eigen::VectorXd scale = full.hessian.diagonal().head(gone).cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * full.hessian.topLeftCorner(gone, gone) * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled);
  const Eigen::VectorXd inverse =
      (solver.eigenvalues().array() > 1e-11).select(solver.eigenvalues().cwiseInverse(), 0.0);
  const Eigen::MatrixXd pseudo = scale.asDiagonal() * solver.eigenvectors() * inverse.asDiagonal() *
                                 solver.eigenvectors().transpose() * scale.asDiagonal();
  const Eigen::MatrixXd coupling = full.hessian.bottomLeftCorner(kept, gone) * pseudo;
  return {full.hessian.bottomRightCorner(kept, kept) - coupling * full.hessian.topRightCorner(gone, kept),
          full.gradient.tail(kept) - coupling * full.gradient.head(gone)};
}

/// The prior's quadratic cost at the current values against the Schur complement's, each variable in its own sigmas.
void expect_schur(const std::vector<WindowFactor>& factors, const std::vector<WindowBlock*>& eliminated,
                  double tolerance = 1e-7) {
  std::vector<WindowBlock*> blocks = eliminated;
  for (const WindowFactor& factor : factors) {
    for (WindowBlock* block : factor.blocks) {
      if (std::find(blocks.begin(), blocks.end(), block) == blocks.end()) blocks.push_back(block);
    }
  }
  Eigen::Index gone = 0;
  for (const WindowBlock* block : eliminated) gone += block->tangent_size();
  const NormalEquations expected = schur(assemble(factors, blocks), gone);
  const MarginalPrior prior = marginalize(factors, eliminated);
  ASSERT_EQ(std::vector<WindowBlock*>(blocks.begin() + static_cast<std::ptrdiff_t>(eliminated.size()), blocks.end()),
            prior.blocks);
  const Eigen::VectorXd scale = expected.hessian.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd hessian_error = prior.root.transpose() * prior.root - expected.hessian;
  EXPECT_LT((scale.asDiagonal() * hessian_error * scale.asDiagonal()).cwiseAbs().maxCoeff(), tolerance);
  const Eigen::VectorXd gradient_error = prior.root.transpose() * prior.offset - expected.gradient;
  EXPECT_LT(gradient_error.cwiseProduct(scale).norm(), tolerance * expected.gradient.cwiseProduct(scale).norm());
  EXPECT_LE(prior.root.rows(), prior.root.cols());
}

TEST(Marginalization, EqualsTheSchurComplementOfTheDenseNormalEquations) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Chain chain(seed);
    expect_schur(chain.factors, {&chain.poses[0], &chain.motions[0]});
    Chain other(seed);
    expect_schur(other.factors, {&other.poses[1], &other.motions[1], &other.biases});
  }
}

TEST(Marginalization, KeepsWhatARankDeficientVariableSaysOfOthers) {
  // A uniform field observes neither position nor the rotation about itself: two of six rows are used up by the pose,
  // the other four relate the biases.
  FieldGrid grid;
  grid.columns = grid.rows = 2;
  grid.resolution_m = 10.0;
  grid.heights_m = {0.0};
  const auto uniform =
      std::make_shared<MagneticMap>(grid, std::vector<Eigen::Vector4f>(4, {20.0F, 5.0F, -40.0F, 0.5F}), 5.0);
  Random random(8);
  WindowBlock pose{BlockKind::pose, std::vector<double>(7)};
  from_pose({so3::exp(random.vector(0.3)), Vector3(5.0, 5.0, 0.0)}, pose.values.data());
  WindowBlock biases{BlockKind::euclidean, std::vector<double>(6, 0.1)};
  const FieldFactor factor(uniform, FieldInterpolation::bicubic, 2,
                           field_readings({Quaternion::Identity(), Vector3(5.0, 5.0, 0.0)}, *uniform,
                                          std::vector<Vector3>(2, Vector3::Zero()), 1.0, random),
                           {});
  expect_schur({{nullptr, &factor, {&pose, &biases}}}, {&pose});
  const MarginalPrior prior =
      marginalize(std::vector<WindowFactor>{{nullptr, &factor, {&pose, &biases}}}, std::vector<WindowBlock*>{&pose});
  EXPECT_EQ(prior.root.fullPivHouseholderQr().rank(), 4);
}

}  // namespace
}  // namespace lodestone
