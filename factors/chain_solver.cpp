#include "factors/chain_solver.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "factors/manifolds.h"

namespace lodestone {

namespace {

int shared_size(const ChainVariables& variables) {
  int size = 0;
  for (const WindowBlock* block : variables.shared) size += block->tangent_size();
  return size;
}

/// Ambient Jacobian (row-major) to the tangent one, into the columns of the system's rows.
void place_jacobian(const WindowBlock& block, const double* ambient, int count, double* to, int stride) {
  const int ambient_size = static_cast<int>(block.values.size());
  if (is_linear(block.kind)) {
    for (int row = 0; row < count; ++row) std::copy_n(ambient + row * ambient_size, ambient_size, to + row * stride);
  } else if (block.kind == BlockKind::pose) {
    Eigen::Matrix<double, 7, 6, Eigen::RowMajor> step;
    PoseManifold().PlusJacobian(block.values.data(), step.data());
    for (int row = 0; row < count; ++row) {
      const double* from = ambient + row * 7;
      for (int column = 0; column < 3; ++column) {
        double sum = 0.0;
        for (int i = 0; i < 4; ++i) sum += from[i] * step(i, column);
        to[row * stride + column] = sum;
        to[row * stride + 3 + column] = from[4 + column];
      }
    }
  } else {
    Eigen::Matrix<double, 3, 2, Eigen::RowMajor> step;
    GravityManifold().PlusJacobian(block.values.data(), step.data());
    for (int row = 0; row < count; ++row) {
      Eigen::Map<Eigen::RowVector2d>(to + row * stride) =
          Eigen::Map<const Eigen::RowVector3d>(ambient + row * 3) * step;
    }
  }
}

}  // namespace

ChainSolver::ChainSolver(ChainVariables variables, std::span<const WindowFactor* const> factors)
    : variables_(std::move(variables)), system_(variables_.poses.size(), shared_size(variables_)) {
  for (std::size_t k = 0; k < variables_.poses.size(); ++k) {
    all_.push_back(variables_.poses[k]);
    all_.push_back(variables_.motions[k]);
  }
  all_.insert(all_.end(), variables_.shared.begin(), variables_.shared.end());
  const auto index_in = [](const std::vector<WindowBlock*>& blocks, const WindowBlock* block) {
    return static_cast<std::size_t>(std::find(blocks.begin(), blocks.end(), block) - blocks.begin());
  };
  std::size_t rows = 0;
  std::size_t ambient = 0;
  for (const WindowFactor* factor : factors) {
    Place place{factor, {}, 0, false, ChainSystem::kResidual + 4};
    std::vector<std::size_t> keyframes;
    std::vector<int> offsets;
    std::size_t width = 0;
    for (const WindowBlock* block : factor->blocks) {
      width += block->values.size();
      const bool is_pose = block->kind == BlockKind::pose;
      std::size_t keyframe = variables_.poses.size();
      if (is_pose || block->values.size() == 9)
        keyframe = index_in(is_pose ? variables_.poses : variables_.motions, block);
      if (keyframe < variables_.poses.size()) {
        keyframes.push_back(keyframe);
        offsets.push_back(is_pose ? 0 : 6);
        place.columns.push_back(-2);  // known once the first keyframe is
        continue;
      }
      int column = ChainSystem::kShared;
      const std::size_t shared = index_in(variables_.shared, block);
      for (std::size_t i = 0; i < shared && shared < variables_.shared.size(); ++i)
        column += variables_.shared[i]->tangent_size();
      place.columns.push_back(shared < variables_.shared.size() ? column : -1);
      if (place.columns.back() >= 0) place.used = std::max(place.used, (column + block->tangent_size() + 3) / 4 * 4);
    }
    if (!keyframes.empty()) place.keyframe = *std::min_element(keyframes.begin(), keyframes.end());
    for (std::size_t i = 0, j = 0; i < place.columns.size(); ++i) {
      if (place.columns[i] != -2) continue;
      if (keyframes[j] > place.keyframe + 1)
        throw std::logic_error("ChainSolver: a factor joins keyframes that are not neighbours");
      place.second |= keyframes[j] != place.keyframe;
      place.columns[i] = offsets[j] + (keyframes[j] != place.keyframe ? ChainSystem::kSecond : 0);
      ++j;
    }
    rows = std::max(rows, static_cast<std::size_t>(factor->function->num_residuals()));
    ambient = std::max(ambient, width * static_cast<std::size_t>(factor->function->num_residuals()));
    places_.push_back(std::move(place));
  }
  rows_.resize(rows * static_cast<std::size_t>(system_.stride()));
  residual_.resize(rows);
  ambient_.resize(ambient);
}

double ChainSolver::residual_cost() {
  double sum = 0.0;
  const double* parameters[16];
  for (const Place& place : places_) {
    for (std::size_t i = 0; i < place.factor->blocks.size(); ++i)
      parameters[i] = place.factor->blocks[i]->values.data();
    place.factor->function->Evaluate(parameters, residual_.data(), nullptr);
    const int count = place.factor->function->num_residuals();
    for (int i = 0; i < count; ++i)
      sum += residual_[static_cast<std::size_t>(i)] * residual_[static_cast<std::size_t>(i)];
  }
  return 0.5 * sum;
}

double ChainSolver::linearize() {
  system_.clear();
  double sum = 0.0;
  const int stride = system_.stride();
  const double* parameters[16];
  double* jacobians[16];
  for (const Place& place : places_) {
    const auto& blocks = place.factor->blocks;
    const int count = place.factor->function->num_residuals();
    double* next = ambient_.data();
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      parameters[i] = blocks[i]->values.data();
      jacobians[i] = place.columns[i] < 0 ? nullptr : next;
      next += blocks[i]->values.size() * static_cast<std::size_t>(count);
    }
    place.factor->function->Evaluate(parameters, residual_.data(), jacobians);
    std::fill_n(rows_.begin(), count * stride, 0.0);
    for (int i = 0; i < count; ++i) {
      const double value = residual_[static_cast<std::size_t>(i)];
      rows_[static_cast<std::size_t>(i * stride + ChainSystem::kResidual)] = value;
      sum += value * value;
    }
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (jacobians[i] != nullptr)
        place_jacobian(*blocks[i], jacobians[i], count, rows_.data() + place.columns[i], stride);
    }
    system_.add(rows_.data(), count, place.keyframe, place.second, place.used);
  }
  return 0.5 * sum;
}

std::vector<Matrix6> ChainSolver::pose_covariances(std::span<const std::size_t> keyframes) {
  linearize();
  if (!system_.factorize(0.0)) throw std::runtime_error("the window's information is not positive");
  std::vector<Matrix6> result;
  for (const std::size_t keyframe : keyframes) result.push_back(system_.covariance(keyframe));
  return result;
}

}  // namespace lodestone
