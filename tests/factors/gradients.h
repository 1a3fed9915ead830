#pragma once

#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include <vector>

#include "factors/manifolds.h"

namespace lodestone {

inline PoseBlock block_of(const Pose& pose) {
  PoseBlock block;
  from_pose(pose, block.data());
  return block;
}

/// Ceres' gradient checker, in the tangent spaces: analytic derivatives against Ridders' differences.
inline void expect_gradients(const ceres::CostFunction& factor, const std::vector<const ceres::Manifold*>& manifolds,
                             const std::vector<const double*>& parameters, double tolerance = 1e-6) {
  ceres::NumericDiffOptions options;
  // Small enough to stay within one cell of an interpolated map, in which it is smooth.
  options.ridders_relative_initial_step_size = 1e-5;
  const ceres::GradientChecker checker(&factor, &manifolds, options);
  ceres::GradientChecker::ProbeResults results;
  EXPECT_TRUE(checker.Probe(parameters.data(), tolerance, &results)) << results.error_log;
}

}  // namespace lodestone
