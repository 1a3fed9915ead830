#include "core/evaluation/paired_ratio.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

namespace lodestone {
namespace {

TEST(PairedRatio, StudentsQuantilesAreThoseOfTheTables) {
  EXPECT_NEAR(student_t_quantile(1, 0.975), 12.7062, 5e-5);
  EXPECT_NEAR(student_t_quantile(2, 0.975), 4.3027, 5e-5);
  EXPECT_NEAR(student_t_quantile(5, 0.975), 2.5706, 5e-5);
  EXPECT_NEAR(student_t_quantile(17, 0.95), 1.7396, 5e-5);
  EXPECT_NEAR(student_t_quantile(53, 0.975), 2.0057, 5e-5);
  EXPECT_NEAR(student_t_quantile(1000000, 0.975), 1.95996, 5e-5);
  EXPECT_NEAR(student_t_quantile(9, 0.5), 0.0, 1e-12);
  EXPECT_THROW(student_t_quantile(0, 0.9), std::invalid_argument);
  EXPECT_THROW(student_t_quantile(3, 1.0), std::invalid_argument);
}

/// With one degree of freedom Student's distribution is Cauchy's, whose quantile is tan(π (p − 1/2)).
TEST(PairedRatio, OfTwoPairsTheIntervalHasAClosedForm) {
  const RatioEstimate estimate = estimate_ratio({0.5, 0.8});
  EXPECT_EQ(estimate.pairs, 2U);
  EXPECT_NEAR(estimate.ratio, std::sqrt(0.4), 1e-12);
  const double half = std::tan(M_PI * 0.475) * 0.5 * std::log(0.8 / 0.5);
  EXPECT_NEAR(*estimate.low, std::sqrt(0.4) * std::exp(-half), 1e-9);
  EXPECT_NEAR(*estimate.high, std::sqrt(0.4) * std::exp(half), 1e-6);
}

TEST(PairedRatio, OnePairHasNoInterval) {
  const RatioEstimate estimate = estimate_ratio({1.25});
  EXPECT_DOUBLE_EQ(estimate.ratio, 1.25);
  EXPECT_FALSE(estimate.low.has_value());
  EXPECT_FALSE(estimate.high.has_value());
}

TEST(PairedRatio, EqualPairsLeaveNoDoubtAndInvertedOnesInvertIt) {
  const RatioEstimate same = estimate_ratio({1.0, 1.0, 1.0});
  EXPECT_DOUBLE_EQ(*same.low, 1.0);
  EXPECT_DOUBLE_EQ(*same.high, 1.0);
  const RatioEstimate there = estimate_ratio({0.7, 0.9, 1.3, 0.6});
  const RatioEstimate back = estimate_ratio({1.0 / 0.7, 1.0 / 0.9, 1.0 / 1.3, 1.0 / 0.6});
  EXPECT_NEAR(there.ratio * back.ratio, 1.0, 1e-12);
  EXPECT_NEAR(*there.low * *back.high, 1.0, 1e-12);
  EXPECT_NEAR(*there.high * *back.low, 1.0, 1e-12);
}

TEST(PairedRatio, RefusesWhatHasNoLogarithm) {
  EXPECT_THROW(estimate_ratio({}), std::invalid_argument);
  EXPECT_THROW(estimate_ratio({1.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(estimate_ratio({1.0, -2.0}), std::invalid_argument);
  EXPECT_THROW(estimate_ratio({1.0, HUGE_VAL}), std::invalid_argument);
}

/// Coverage: of many experiments with six pairs, 95 % of the intervals contain the true ratio.
TEST(PairedRatio, TheIntervalHoldsTheTruthAsOftenAsItSays) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal(std::log(0.8), 0.3);
  constexpr int kExperiments = 20000;
  int held = 0;
  for (int i = 0; i < kExperiments; ++i) {
    std::vector<double> ratios;
    for (int k = 0; k < 6; ++k) ratios.push_back(std::exp(normal(generator)));
    const RatioEstimate estimate = estimate_ratio(ratios);
    if (*estimate.low <= 0.8 && 0.8 <= *estimate.high) ++held;
  }
  EXPECT_NEAR(static_cast<double>(held) / kExperiments, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / kExperiments));
}

}  // namespace
}  // namespace lodestone
