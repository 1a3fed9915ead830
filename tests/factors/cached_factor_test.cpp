// A factor that keeps its evaluations gives the bits of a factor that does not.
#include "factors/cached_factor.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "factors/window_block.h"

namespace lodestone {
namespace {

/// r = x³ y, with the number of its evaluations.
class CountingFactor final : public ceres::CostFunction {
 public:
  explicit CountingFactor(int* count) : count_(count) {
    set_num_residuals(1);
    *mutable_parameter_block_sizes() = {1, 1};
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    ++*count_;
    const double x = parameters[0][0];
    const double y = parameters[1][0];
    residuals[0] = scale * x * x * x * y;
    if (jacobians != nullptr && jacobians[0] != nullptr) jacobians[0][0] = scale * 3.0 * x * x * y;
    if (jacobians != nullptr && jacobians[1] != nullptr) jacobians[1][0] = scale * x * x * x;
    return std::isfinite(residuals[0]);
  }

  double scale = 1.0;

 private:
  int* count_;
};

struct Evaluated {
  double residual = 0.0;
  std::array<double, 2> jacobian{};
};

Evaluated evaluate(const ceres::CostFunction& factor, double x, double y) {
  Evaluated result;
  const double* parameters[] = {&x, &y};
  double* jacobians[] = {&result.jacobian[0], &result.jacobian[1]};
  factor.Evaluate(parameters, &result.residual, jacobians);
  return result;
}

void keep_at(CachedFactor& factor, double x, double y) {
  const double* parameters[] = {&x, &y};
  factor.keep_at(parameters);
}

TEST(CachedFactor, IsEvaluatedOnceForTheSameValues) {
  int count = 0;
  CachedFactor factor(std::make_unique<CountingFactor>(&count));
  keep_at(factor, 1.7, -0.3);
  keep_at(factor, 1.7, -0.3);
  const Evaluated kept = evaluate(factor, 1.7, -0.3);
  EXPECT_EQ(count, 1);
  int alone = 0;
  const Evaluated wanted = evaluate(CountingFactor(&alone), 1.7, -0.3);
  EXPECT_EQ(kept.residual, wanted.residual);
  EXPECT_EQ(kept.jacobian, wanted.jacobian);
}

TEST(CachedFactor, OtherValuesAreEvaluatedAndNotKept) {
  int count = 0;
  CachedFactor factor(std::make_unique<CountingFactor>(&count));
  keep_at(factor, 1.7, -0.3);
  EXPECT_EQ(evaluate(factor, 2.0, 1.0).residual, 8.0);
  EXPECT_EQ(evaluate(factor, 2.0, 1.0).jacobian, (std::array{12.0, 8.0}));
  EXPECT_EQ(count, 3);
  evaluate(factor, 1.7, -0.3);
  EXPECT_EQ(count, 3);
}

TEST(CachedFactor, JacobiansThatAreNotWantedAreLeftOut) {
  int count = 0;
  CachedFactor factor(std::make_unique<CountingFactor>(&count));
  keep_at(factor, 2.0, 1.0);
  const double x = 2.0;
  const double y = 1.0;
  const double* parameters[] = {&x, &y};
  double residual = 0.0;
  double by_second = 0.0;
  double* jacobians[] = {nullptr, &by_second};
  EXPECT_TRUE(factor.Evaluate(parameters, &residual, jacobians));
  EXPECT_EQ(by_second, 8.0);
  EXPECT_TRUE(factor.Evaluate(parameters, &residual, nullptr));
  EXPECT_EQ(residual, 8.0);
  EXPECT_EQ(count, 1);
}

TEST(CachedFactor, AFailedEvaluationIsNotKept) {
  int count = 0;
  CachedFactor factor(std::make_unique<CountingFactor>(&count));
  keep_at(factor, 1e200, 1.0);
  const double x = 1e200;
  const double y = 1.0;
  const double* parameters[] = {&x, &y};
  double residual = 0.0;
  EXPECT_FALSE(factor.Evaluate(parameters, &residual, nullptr));
}

TEST(CachedFactor, AChangeOfTheContentForgetsWhatWasKept) {
  int count = 0;
  auto function = std::make_unique<CountingFactor>(&count);
  CountingFactor* content = function.get();
  CachedFactor cached(std::move(function));
  RenewableFactor<CountingFactor> factor(WindowFactor{nullptr, &cached, {}, &cached}, content);
  keep_at(cached, 2.0, 1.0);
  factor.change().scale = 2.0;
  EXPECT_EQ(evaluate(cached, 2.0, 1.0).residual, 16.0);
  keep_at(cached, 2.0, 1.0);
  EXPECT_EQ(evaluate(cached, 2.0, 1.0).residual, 16.0);
}

TEST(ParallelEvaluation, EvaluatesBeforeJacobiansAreWanted) {
  std::array<int, 100> counts{};
  std::vector<std::unique_ptr<CachedFactor>> cached;
  std::array<WindowBlock, 101> blocks;
  std::vector<WindowFactor> factors;
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i].values = {0.5 + 0.01 * static_cast<double>(i)};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    cached.push_back(std::make_unique<CachedFactor>(std::make_unique<CountingFactor>(&counts[i])));
    factors.push_back({nullptr, cached.back().get(), {&blocks[i], &blocks[i + 1]}, cached.back().get()});
  }
  ParallelEvaluation evaluation([&] {
    std::vector<const WindowFactor*> result;
    result.reserve(factors.size());
    for (const WindowFactor& factor : factors) result.push_back(&factor);
    return result;
  });
  evaluation.PrepareForEvaluation(false, true);
  for (const int count : counts) EXPECT_EQ(count, 0);
  evaluation.PrepareForEvaluation(true, false);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    evaluate(*cached[i], blocks[i].values[0], blocks[i + 1].values[0]);
    EXPECT_EQ(counts[i], 1);
  }
}

}  // namespace
}  // namespace lodestone
