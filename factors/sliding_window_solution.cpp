// What the window solves and what its solution tells.
#include <ceres/solver.h>

#include <cmath>

#include <Eigen/Cholesky>

#include "factors/block_solver.h"
#include "factors/chain_solver.h"
#include "factors/preintegration_factor.h"
#include "factors/prior_factor.h"
#include "factors/random_walk_factor.h"
#include "factors/sliding_window_parts.h"

namespace lodestone {

int SlidingWindow::solve() {
  for (std::size_t k = 1; k < keyframes_.size(); ++k) {
    const double* bias = keyframes_[k - 1]->motion.values.data() + 3;
    auto* factor =
        static_cast<PreintegrationFactor*>(const_cast<ceres::CostFunction*>(keyframes_[k]->imu.function));
    if (!factor->preintegration().within_linear_range(Vector3(bias), Vector3(bias + 3))) {
      factor->set(Preintegration(keyframes_[k]->samples, Vector3(bias), Vector3(bias + 3), noise_), noise_);
    }
  }
  if (options_.magnetometer_bias_jumps) {
    for (const auto& epoch : epochs_) {
      if (!epoch->walk) continue;
      const auto& blocks = epoch->walk.blocks;
      static_cast<RandomWalkFactor*>(const_cast<ceres::CostFunction*>(epoch->walk.function))
          ->renew(blocks.size() == 1 ? nullptr : blocks[0]->values.data(), blocks.back()->values.data());
    }
  }
  if (options_.solver == WindowSolver::chain) {
    ChainSolver chain(chain_variables(), factors());
    return minimize(chain, options_.max_iterations);
  }
  if (options_.solver == WindowSolver::blocks) {
    BlockSolver blocks(variables_in_order(), factors());
    return minimize(blocks, options_.max_iterations);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.max_num_iterations = options_.max_iterations;
  options.num_threads = 1;
  options.function_tolerance = 1e-5;
  options.parameter_tolerance = 1e-9;
  options.jacobi_scaling = true;
  // All but Gauss-Newton from the first step: the usual damping, 1e-4 of the diagonal, holds back whatever is known much
  // less well jointly than alone, such as the window's place along a tunnel, and leaves it a fifth of a sigma off.
  options.initial_trust_region_radius = 1e10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem_.get(), &summary);
  return static_cast<int>(summary.iterations.size()) - 1;
}

ChainVariables SlidingWindow::chain_variables() const {
  ChainVariables result;
  for (const auto& keyframe : keyframes_) {
    result.poses.push_back(&keyframe->pose);
    result.motions.push_back(&keyframe->motion);
  }
  result.shared.push_back(const_cast<WindowBlock*>(&gravity_));
  if (clock_prior_) result.shared.push_back(const_cast<WindowBlock*>(&clock_));
  if (options_.magnetometer_bias_states) {
    for (const auto& epoch : epochs_) result.shared.push_back(&epoch->biases);
  }
  return result;
}

std::vector<WindowBlock*> SlidingWindow::variables_in_order() const {
  // An epoch's biases come after the last keyframe that uses them: then an elimination in this order fills nothing up.
  std::vector<WindowBlock*> result;
  std::size_t epoch = 0;
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    result.push_back(&keyframes_[k]->pose);
    result.push_back(&keyframes_[k]->motion);
    if (!options_.magnetometer_bias_states || keyframes_[k]->epoch == nullptr) continue;
    while (epoch + 1 < epochs_.size() && epochs_[epoch].get() != keyframes_[k]->epoch) {
      result.insert(result.end() - 2, &epochs_[epoch]->biases);
      ++epoch;
    }
  }
  for (; options_.magnetometer_bias_states && epoch < epochs_.size(); ++epoch) result.push_back(&epochs_[epoch]->biases);
  if (clock_prior_) result.push_back(const_cast<WindowBlock*>(&clock_));
  result.push_back(const_cast<WindowBlock*>(&gravity_));
  return result;
}

std::vector<const WindowFactor*> SlidingWindow::factors() const {
  std::vector<const WindowFactor*> result{&prior_};
  if (clock_prior_) result.push_back(&clock_prior_);
  for (const auto& keyframe : keyframes_) {
    for (const WindowFactor* factor : {&keyframe->imu, &keyframe->lidar, &keyframe->field}) {
      if (*factor) result.push_back(factor);
    }
  }
  for (const auto& epoch : epochs_) {
    if (epoch->walk) result.push_back(&epoch->walk);
  }
  return result;
}

std::vector<Matrix6> SlidingWindow::pose_covariances(std::span<const std::size_t> keyframes) const {
  if (options_.solver == WindowSolver::blocks) {
    const std::vector<Matrix6> all = BlockSolver(variables_in_order(), factors()).pose_covariances();
    std::vector<Matrix6> result;
    for (const std::size_t k : keyframes) result.push_back(all[k]);
    return result;
  }
  ChainSolver solver(chain_variables(), factors());
  std::vector<Matrix6> result = solver.pose_covariances(keyframes);
  if (clock_prior_) clock_sigma_s_ = std::sqrt(solver.shared_variance(gravity_.tangent_size()));
  return result;
}

Matrix17 SlidingWindow::newest_covariance() const {
  const std::vector<WindowBlock*> variables = variables_in_order();
  std::vector<int> starts;
  int size = 0;
  for (const WindowBlock* block : variables) {
    starts.push_back(size);
    size += block->tangent_size();
  }
  const auto start_of = [&](const WindowBlock* block) {
    const auto found = std::find(variables.begin(), variables.end(), block);
    return found == variables.end() ? -1 : starts[static_cast<std::size_t>(found - variables.begin())];
  };
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  for (const WindowFactor* factor : factors()) {
    const LinearizedFactor linear = linearize(*factor);
    int row = 0;
    for (const WindowBlock* a : factor->blocks) {
      int column = 0;
      for (const WindowBlock* b : factor->blocks) {
        if (start_of(a) >= 0 && start_of(b) >= 0) {
          information.block(start_of(a), start_of(b), a->tangent_size(), b->tangent_size()) +=
              linear.jacobian.middleCols(row, a->tangent_size()).transpose() *
              linear.jacobian.middleCols(column, b->tangent_size());
        }
        column += b->tangent_size();
      }
      row += a->tangent_size();
    }
  }
  Eigen::MatrixXd wanted = Eigen::MatrixXd::Zero(size, tangent::size);
  const WindowBlock* order[] = {&keyframes_.back()->pose, &keyframes_.back()->motion, &gravity_};
  std::vector<int> rows;
  for (const WindowBlock* block : order) {
    for (int i = 0; i < block->tangent_size(); ++i) rows.push_back(start_of(block) + i);
  }
  for (int i = 0; i < tangent::size; ++i) wanted(rows[static_cast<std::size_t>(i)], i) = 1.0;
  const Eigen::MatrixXd solved = information.ldlt().solve(wanted);
  Matrix17 result;
  for (int i = 0; i < tangent::size; ++i) result.row(i) = solved.row(rows[static_cast<std::size_t>(i)]);
  return 0.5 * (result + result.transpose());
}

ChainLink SlidingWindow::link(std::size_t k) const {
  return static_cast<const PreintegrationFactor*>(keyframes_[k + 1]->imu.function)->link(state(k), state(k + 1));
}

Matrix17 SlidingWindow::prior_information() const {
  const auto* prior = static_cast<const PriorFactor*>(prior_.function);
  // The prior names its blocks in the order in which the factors it came from did.
  const WindowBlock* order[] = {&keyframes_.front()->pose, &keyframes_.front()->motion, &gravity_};
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(prior->root().rows(), tangent::size);
  Eigen::Index to = 0;
  for (const WindowBlock* block : order) {
    Eigen::Index from = 0;
    for (const WindowBlock* candidate : prior_.blocks) {
      if (candidate == block) root.middleCols(to, block->tangent_size()) = prior->root().middleCols(from, block->tangent_size());
      from += candidate->tangent_size();
    }
    to += block->tangent_size();
  }
  return root.transpose() * root;
}

}  // namespace lodestone
