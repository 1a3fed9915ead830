#include "factors/cached_factor.h"

#include <algorithm>
#include <cstring>

#include "core/parallel.h"
#include "factors/window_block.h"

namespace lodestone {

namespace {

/// Windows with more factors, as those of most batches, keep nothing: it would take as much memory as all else.
constexpr std::size_t kMostFactors = 4096;

/// Factors that are worth a piece of work for a thread.
constexpr std::size_t kGrain = 8;

}  // namespace

CachedFactor::CachedFactor(std::unique_ptr<ceres::CostFunction> factor) : factor_(std::move(factor)) {
  set_num_residuals(factor_->num_residuals());
  *mutable_parameter_block_sizes() = factor_->parameter_block_sizes();
}

bool CachedFactor::is_kept(double const* const* parameters) const {
  if (!kept_) return false;
  const double* values = values_.data();
  for (std::size_t i = 0; i < parameter_block_sizes().size(); ++i) {
    const auto size = static_cast<std::size_t>(parameter_block_sizes()[i]);
    if (std::memcmp(parameters[i], values, size * sizeof(double)) != 0) return false;
    values += size;
  }
  return true;
}

bool CachedFactor::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  if (!is_kept(parameters)) return factor_->Evaluate(parameters, residuals, jacobians);
  const auto rows = static_cast<std::size_t>(num_residuals());
  const double* from = residuals_.data();
  std::copy_n(from, rows, residuals);
  from += rows;
  for (std::size_t i = 0; jacobians != nullptr && i < parameter_block_sizes().size(); ++i) {
    const std::size_t count = rows * static_cast<std::size_t>(parameter_block_sizes()[i]);
    if (jacobians[i] != nullptr) std::copy_n(from, count, jacobians[i]);
    from += count;
  }
  return true;
}

void CachedFactor::keep_at(double const* const* parameters) {
  if (is_kept(parameters)) return;
  forget();
  const auto rows = static_cast<std::size_t>(num_residuals());
  values_.clear();
  std::size_t columns = 0;
  for (std::size_t i = 0; i < parameter_block_sizes().size(); ++i) {
    const auto size = static_cast<std::size_t>(parameter_block_sizes()[i]);
    values_.insert(values_.end(), parameters[i], parameters[i] + size);
    columns += size;
  }
  residuals_.resize(rows * (1 + columns));
  std::vector<double*> jacobians;
  double* to = residuals_.data() + rows;
  for (const int size : parameter_block_sizes()) {
    jacobians.push_back(to);
    to += rows * static_cast<std::size_t>(size);
  }
  kept_ = factor_->Evaluate(parameters, residuals_.data(), jacobians.data());
}

void ParallelEvaluation::PrepareForEvaluation(bool evaluate_jacobians, bool) {
  if (!evaluate_jacobians) return;
  const std::vector<const WindowFactor*> factors = factors_();
  if (factors.size() > kMostFactors) return;
  parallel_for(
      std::size_t{0}, factors.size(),
      [&](std::size_t i) {
        if (factors[i]->cached == nullptr) return;
        std::vector<const double*> parameters;
        for (const WindowBlock* block : factors[i]->blocks) parameters.push_back(block->values.data());
        factors[i]->cached->keep_at(parameters.data());
      },
      kGrain);
}

}  // namespace lodestone
