#include "tools/plotting/forest_plot.h"

#include <gmock/gmock.h>

#include "tests/tools/program_runner.h"

namespace lodestone::figures {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

ForestRow row(const std::string& label, const std::vector<double>& ratios) {
  return {label, ratios, estimate_ratio(ratios), ""};
}

class ForestPlots : public testing::Test {
 protected:
  std::string drawn(const ForestPlot& plot) const {
    draw_forest_plot(folder_ / "plot", plot);
    for (const char* ending : {".png", ".pdf"})
      EXPECT_GT(content_of(folder_ / ("plot" + std::string(ending))).size(), 500U);
    return content_of(folder_ / "plot.svg");
  }
  TemporaryFolder folder_;
};

TEST_F(ForestPlots, ShowLabelsNumbersAndTheLineAtOne) {
  const std::string svg = drawn({"ATE", {row("soft & slow", {0.9, 0.95, 1.02}), row("none", {1.5, 1.1, 1.8, 1.2})}});
  EXPECT_THAT(svg, HasSubstr(">soft &amp; slow</text>"));
  EXPECT_THAT(svg, HasSubstr(">better</text>"));
  EXPECT_THAT(svg, HasSubstr(">1</text>"));
  EXPECT_THAT(svg, HasSubstr(">0.955  [0.817, 1.117]</text>"));
}

TEST_F(ForestPlots, OneIsAlwaysInSightAndNothingIsNoError) {
  EXPECT_THAT(drawn({"ATE", {row("far", {30.0, 40.0})}}), HasSubstr(">1</text>"));
  EXPECT_THAT(drawn({"ATE", {row("near", {1.0001, 1.0002, 1.0001})}}), HasSubstr(">1</text>"));
  EXPECT_THAT(drawn({"ATE", {row("beyond", {4000.0, 1e-5})}}), HasSubstr(">1</text>"));
  const std::string lost = drawn({"ATE", {{"lost", {}, std::nullopt, "3 lost"}}});
  EXPECT_THAT(lost, HasSubstr(">3 lost</text>"));
  EXPECT_THAT(drawn({"ATE", {}}), HasSubstr(">worse</text>"));
  EXPECT_THAT(drawn({"ATE", {row("one", {1.3})}}), HasSubstr(">1.300</text>"));
}

TEST(RatioTicks, AreRoundWithinTheRangeAndHoldOne) {
  EXPECT_THAT(ratio_ticks(0.09, 11.0),
              ElementsAre(testing::DoubleEq(0.1), testing::DoubleEq(0.2), testing::DoubleEq(0.5), 1.0, 2.0, 5.0, 10.0));
  for (const auto& [low, high] :
       {std::pair{0.97, 1.04}, {0.8, 1.2}, {0.7, 2.0}, {0.3, 3.1}, {0.1, 50.0}, {0.001, 1000.0}}) {
    const std::vector<double> ticks = ratio_ticks(low, high);
    EXPECT_GE(ticks.size(), 3U) << low;
    EXPECT_LE(ticks.size(), 12U) << low;
    double nearest = 10.0;
    for (const double tick : ticks) {
      EXPECT_TRUE(tick >= low - 1e-9 && tick <= high + 1e-9) << tick;
      nearest = std::min(nearest, std::abs(tick - 1.0));
    }
    EXPECT_LT(nearest, 1e-9) << low;
  }
}

}  // namespace
}  // namespace lodestone::figures
