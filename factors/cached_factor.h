#pragma once

#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>

#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace lodestone {

struct WindowFactor;

/// A factor that keeps its residual and Jacobians where they were last evaluated: Ceres, the covariances and the
/// marginalization need them at the same values. Each evaluation gives the same bits with and without this memory.
class CachedFactor final : public ceres::CostFunction {
 public:
  explicit CachedFactor(std::unique_ptr<ceres::CostFunction> factor);

  /// From memory at the values of the last `keep_at`; at other values it is computed. Safe beside other calls of it,
  /// but not beside `keep_at`.
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  /// Evaluates at these values, unless it has done so already.
  void keep_at(double const* const* parameters);

  /// Must be called when the factor itself changes.
  void forget() { kept_ = false; }

 private:
  bool is_kept(double const* const* parameters) const;

  std::unique_ptr<ceres::CostFunction> factor_;
  bool kept_ = false;
  std::vector<double> values_;     // of all parameter blocks, in order
  std::vector<double> residuals_;  // Jacobians follow, row-major, one for each block
};

/// Evaluates the window's factors on all cores before Ceres asks for their Jacobians one by one. Ceres' own threads add
/// residuals in the order in which they end, so that results would not be bit-identical.
class ParallelEvaluation final : public ceres::EvaluationCallback {
 public:
  /// `factors`: those of the problem, at the time of the call.
  explicit ParallelEvaluation(std::function<std::vector<const WindowFactor*>()> factors)
      : factors_(std::move(factors)) {}

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;

 private:
  std::function<std::vector<const WindowFactor*>()> factors_;
};

}  // namespace lodestone
