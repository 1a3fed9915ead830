#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <memory>
#include <vector>

#include "factors/condensed_lidar_factor.h"
#include "factors/manifolds.h"
#include "factors/preintegration_factor.h"
#include "factors/random_walk_factor.h"
#include "factors/window_block.h"
#include "tests/factors/window_scene.h"

namespace lodestone {

/// A chain of keyframes with all kinds of factors, outside of a window.
class Chain {
 public:
  explicit Chain(std::uint64_t seed) {
    Random random(seed);
    DriveOptions options;
    options.keyframes = kKeyframes;
    const Drive truth = drive(options, random);
    const std::shared_ptr<const MagneticMap> map = wavy_map();
    gravity = {BlockKind::gravity, {0.0, 0.0, -9.80665}};
    biases = {BlockKind::euclidean, std::vector<double>(6, 0.1)};
    next_biases = {BlockKind::euclidean, std::vector<double>(6, 0.2)};
    for (std::size_t k = 0; k < kKeyframes; ++k) {
      // Not at the minimum, so that the gradient is not zero.
      const NavState state = truth.truth[k].boxplus(random.draw(start_covariance(0.3)));
      poses[k] = {BlockKind::pose, std::vector<double>(7)};
      from_pose(state.T_map_imu, poses[k].values.data());
      motions[k] = {BlockKind::motion, std::vector<double>(9)};
      Eigen::Map<Vector9>(motions[k].values.data()) << state.velocity, state.gyroscope_bias, state.accelerometer_bias;
      std::vector<WindowBlock*> lidar_blocks{&poses[k], &motions[k]};
      if (k > 0) lidar_blocks.insert(lidar_blocks.end(), {&poses[k - 1], &motions[k - 1]});
      Scan points = scan(truth.truth[k].T_map_imu, room_normals(random), 200, 0.02, 5.0, 0.0, random);
      for (std::size_t i = 0; i < points.matches.size(); ++i) points.matches[i].age_s = 5e-4F * static_cast<float>(i);
      Deskewing deskewing;
      if (k > 0) deskewing = Deskewing(state, ScanMotion(state, truth.samples[k]), options.noise);
      add(new CondensedLidarFactor(condense_scan(points.matches, state.T_map_imu, deskewing),
                                   lidar_mask(state.T_map_imu, k), {.before = k > 0}),
          lidar_blocks);
      add(new FieldFactor(
              map, FieldInterpolation::bicubic, 2,
              field_readings(truth.truth[k].T_map_imu, *map, std::vector<Vector3>(2, Vector3::Zero()), 1.0, random),
              {}),
          {&poses[k], k < 2 ? &biases : &next_biases});
      if (k > 0) {
        const Preintegration increment(truth.samples[k], Vector3::Zero(), Vector3::Zero(), options.noise);
        add(new PreintegrationFactor(increment, options.noise),
            {&poses[k - 1], &motions[k - 1], &poses[k], &motions[k], &gravity});
      }
    }
    add(new RandomWalkFactor(6, 0.5), {&biases, &next_biases});
  }

  /// Adds a prior on the first keyframe, so that every variable is observable.
  void add_prior_of_start() {
    std::vector<PriorBlock> known;
    for (const WindowBlock* block : {&poses[0], &motions[0], &gravity, &biases})
      known.push_back({block->kind, block->values});
    Eigen::VectorXd sigma(23);
    sigma << start_covariance().diagonal().cwiseSqrt(), Eigen::VectorXd::Constant(6, 0.5);
    add(new PriorFactor(known, sigma.cwiseInverse().asDiagonal(), Eigen::VectorXd::Zero(23)),
        {&poses[0], &motions[0], &gravity, &biases});
  }

  static constexpr std::size_t kKeyframes = 4;
  WindowBlock poses[kKeyframes];
  WindowBlock motions[kKeyframes];
  WindowBlock gravity;
  WindowBlock biases;
  WindowBlock next_biases;
  std::vector<WindowFactor> factors;

  /// A factor that the chain owns.
  void add(ceres::CostFunction* function, std::vector<WindowBlock*> blocks) {
    functions_.emplace_back(function);
    factors.push_back({nullptr, function, std::move(blocks)});
  }

 private:
  static PoseMask lidar_mask(const Pose& reference, std::size_t k) {
    Vector6 kept = Vector6::Ones();
    if (k == 1) kept[3] = 0.0;
    return {Matrix6(kept.asDiagonal()), reference};
  }

  std::vector<std::unique_ptr<ceres::CostFunction>> functions_;
};

/// The normal equations of some factors, with variables in the order of `blocks`.
struct NormalEquations {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
};

inline NormalEquations assemble(const std::vector<WindowFactor>& factors, const std::vector<WindowBlock*>& blocks) {
  std::vector<Eigen::Index> starts;
  Eigen::Index size = 0;
  for (const WindowBlock* block : blocks) {
    starts.push_back(size);
    size += block->tangent_size();
  }
  NormalEquations result{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  for (const WindowFactor& factor : factors) {
    const LinearizedFactor part = linearize(factor);
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(part.residual.size(), size);
    Eigen::Index column = 0;
    for (const WindowBlock* block : factor.blocks) {
      const auto place = std::find(blocks.begin(), blocks.end(), block) - blocks.begin();
      jacobian.middleCols(starts[static_cast<std::size_t>(place)], block->tangent_size()) =
          part.jacobian.middleCols(column, block->tangent_size());
      column += block->tangent_size();
    }
    result.hessian += jacobian.transpose() * jacobian;
    result.gradient += jacobian.transpose() * part.residual;
  }
  return result;
}

/// The inverse of a Hessian whose variables have very different scales.
inline Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& hessian) {
  const Eigen::VectorXd scale = hessian.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * hessian * scale.asDiagonal();
  return scale.asDiagonal() * scaled.llt().solve(Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols())) *
         scale.asDiagonal();
}

/// Decrease of the cost of some factors by one more Newton step: 0 at their minimum.
inline double newton_decrement(const NormalEquations& equations) {
  return 0.5 * equations.gradient.dot(scaled_inverse(equations.hessian) * equations.gradient);
}

}  // namespace lodestone
