#include "factors/block_solver.h"

#include <algorithm>
#include <stdexcept>
#include <unordered_map>

#include "core/parallel.h"

namespace lodestone {

namespace {

/// Factors are linearized by so many at a time: what they give until it is added up fits in memory.
constexpr std::size_t kBatch = 1024;

std::vector<int> sizes_of(const std::vector<WindowBlock*>& variables) {
  std::vector<int> result;
  for (const WindowBlock* block : variables) result.push_back(block->tangent_size());
  return result;
}

/// A factor's normal equations over its variables.
struct Share {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
  double cost = 0.0;
};

}  // namespace

std::vector<BlockSolver::Place> BlockSolver::places(const std::vector<WindowBlock*>& variables,
                                                    std::span<const WindowFactor* const> factors) {
  std::unordered_map<const WindowBlock*, int> index;  // looked up, never gone through: addresses decide nothing
  for (std::size_t i = 0; i < variables.size(); ++i) index.emplace(variables[i], static_cast<int>(i));
  std::vector<Place> result;
  for (const WindowFactor* factor : factors) {
    Place place{factor, {}, {}};
    for (const WindowBlock* block : factor->blocks) {
      const auto found = index.find(block);
      place.constant.push_back(found == index.end());
      if (found != index.end()) place.clique.push_back(found->second);
    }
    result.push_back(std::move(place));
  }
  return result;
}

std::vector<BlockSystem::Clique> BlockSolver::cliques(const std::vector<Place>& places) {
  std::vector<BlockSystem::Clique> result;
  for (const Place& place : places) result.push_back(place.clique);
  return result;
}

BlockSolver::BlockSolver(std::vector<WindowBlock*> variables, std::span<const WindowFactor* const> factors)
    : variables_(std::move(variables)), places_(places(variables_, factors)), system_(sizes_of(variables_), cliques(places_)) {}

double BlockSolver::linearize() {
  system_.clear();
  double cost = 0.0;
  std::vector<Share> shares(std::min(kBatch, places_.size()));
  for (std::size_t first = 0; first < places_.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, places_.size() - first);
    parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      const Place& place = places_[first + i];
      LinearizedFactor linear = lodestone::linearize(*place.factor);
      Eigen::Index from = 0;
      Eigen::Index to = 0;
      for (std::size_t b = 0; b < place.constant.size(); ++b) {
        const Eigen::Index size = place.factor->blocks[b]->tangent_size();
        if (!place.constant[b]) {
          if (from != to) linear.jacobian.middleCols(to, size) = linear.jacobian.middleCols(from, size).eval();
          to += size;
        }
        from += size;
      }
      const auto jacobian = linear.jacobian.leftCols(to);
      shares[i].hessian.noalias() = jacobian.transpose() * jacobian;
      shares[i].gradient.noalias() = jacobian.transpose() * linear.residual;
      shares[i].cost = linear.residual.squaredNorm();
    });
    for (std::size_t i = 0; i < count; ++i) {
      system_.add(places_[first + i].clique, shares[i].hessian, shares[i].gradient);
      cost += shares[i].cost;
    }
  }
  return 0.5 * cost;
}

double BlockSolver::residual_cost() {
  std::vector<double> costs(places_.size());
  parallel_for(std::size_t{0}, places_.size(), [&](std::size_t i) {
    const WindowFactor& factor = *places_[i].factor;
    std::vector<const double*> parameters;
    for (const WindowBlock* block : factor.blocks) parameters.push_back(block->values.data());
    Eigen::VectorXd residual(factor.function->num_residuals());
    factor.function->Evaluate(parameters.data(), residual.data(), nullptr);
    costs[i] = residual.squaredNorm();
  });
  double sum = 0.0;
  for (const double cost : costs) sum += cost;
  return 0.5 * sum;
}

std::vector<Matrix6> BlockSolver::pose_covariances() {
  linearize();
  if (!factorize(0.0)) throw std::runtime_error("the log's information is not positive");
  const std::vector<Eigen::MatrixXd> all = system_.covariances();
  std::vector<Matrix6> result;
  for (std::size_t i = 0; i < variables_.size(); ++i) {
    if (variables_[i]->kind == BlockKind::pose) result.push_back(all[i]);
  }
  return result;
}

}  // namespace lodestone
