#include "tools/plotting/window_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tools/plotting/error_scale.h"
#include "tools/plotting/method_style.h"

namespace lodestone::figures {
namespace {

TEST(WindowStatistics, AreThoseOfAllValuesWithinHalfAWindow) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> step(0.02, 0.3);
  std::vector<double> time{0.0};
  std::vector<double> value{0.1};
  while (time.size() < 400) {
    time.push_back(time.back() + step(random));
    value.push_back(time.size() % 37 == 0 ? std::nan("") : step(random) + 5.0 * std::sin(time.back()));
  }
  const WindowStatistics statistics = window_statistics(time, value, 1.0);
  ASSERT_EQ(statistics.time_s, time);
  for (std::size_t i = 0; i < time.size(); ++i) {
    std::vector<double> inside;
    for (std::size_t k = 0; k < time.size(); ++k) {
      if (std::abs(time[k] - time[i]) <= 0.5 && std::isfinite(value[k])) inside.push_back(value[k]);
    }
    double mean = 0.0;
    for (const double one : inside) mean += one / static_cast<double>(inside.size());
    double variance = 0.0;
    for (const double one : inside) variance += (one - mean) * (one - mean) / static_cast<double>(inside.size());
    EXPECT_NEAR(statistics.mean[i], mean, 1e-12);
    EXPECT_NEAR(statistics.standard_deviation[i], std::sqrt(variance), 1e-12);
  }
}

TEST(WindowStatistics, OfAConstantAreThatConstant) {
  const WindowStatistics statistics = window_statistics({0.0, 0.1, 0.2}, {4.0, 4.0, 4.0}, 1.0);
  EXPECT_EQ(statistics.mean, (std::vector<double>{4.0, 4.0, 4.0}));
  EXPECT_EQ(statistics.standard_deviation, (std::vector<double>{0.0, 0.0, 0.0}));
}

TEST(WindowStatistics, BreakWhereNothingWasMeasuredForAWindow) {
  const WindowStatistics statistics = window_statistics({0.0, 0.1, 2.0, 2.1}, {1.0, 1.0, 3.0, 3.0}, 1.0);
  ASSERT_EQ(statistics.time_s.size(), 5U);
  EXPECT_TRUE(std::isnan(statistics.mean[2]));
  EXPECT_DOUBLE_EQ(statistics.mean[1], 1.0);
  EXPECT_DOUBLE_EQ(statistics.mean[3], 3.0);
}

TEST(WindowStatistics, RefuseWhatIsNoSeries) {
  EXPECT_THROW(window_statistics({0.0}, {}, 1.0), std::invalid_argument);
  EXPECT_THROW(window_statistics({1.0, 0.0}, {1.0, 1.0}, 1.0), std::invalid_argument);
  EXPECT_THROW(window_statistics({0.0}, {1.0}, 0.0), std::invalid_argument);
  EXPECT_TRUE(window_statistics({}, {}, 1.0).time_s.empty());
}

TEST(ErrorScale, IsLinearForOneSizeAndLogarithmicForSeveral) {
  const Scale linear = error_scale({{0.02, 0.03, 0.04}, {0.05, 0.09}});
  EXPECT_FALSE(linear.logarithmic);
  EXPECT_EQ(linear.low, 0.0);
  EXPECT_DOUBLE_EQ(linear.high, 0.1);
  const Scale logarithmic = error_scale({{0.02, 0.03, 0.04}, {0.05, 31.0}});
  EXPECT_TRUE(logarithmic.logarithmic);
  EXPECT_DOUBLE_EQ(logarithmic.low, 0.02);
  EXPECT_DOUBLE_EQ(logarithmic.high, 50.0);
}

TEST(ErrorScale, EndsAtAHundredMetresAndStandsWithoutErrors) {
  EXPECT_DOUBLE_EQ(error_scale({{0.02}, {1e7}}).high, 100.0);
  EXPECT_GT(error_scale({}).high, error_scale({}).low);
  EXPECT_GT(logarithmic_error_scale({{}}).low, 0.0);
  const Scale exact = logarithmic_error_scale({{0.0, 0.0}});
  EXPECT_GT(exact.low, 0.0);
  EXPECT_GE(exact.high, 10.0 * exact.low);
}

TEST(MethodStyle, IsTheSameWhoeverElseIsThere) {
  const auto all = method_styles(legend_order({"other", "magnetic", "smoother", "ieskf", "smoother"}));
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all.front().label, "smoother");
  EXPECT_EQ(all.back().label, "other");
  const auto alone = method_styles({"ieskf"});
  EXPECT_EQ(alone[0].color.blue, all[1].color.blue);
  EXPECT_EQ(alone[0].stroke, all[1].stroke);
  for (std::size_t i = 0; i + 1 < all.size(); ++i) EXPECT_NE(all[i].color.red, all.back().color.red);
}

}  // namespace
}  // namespace lodestone::figures
