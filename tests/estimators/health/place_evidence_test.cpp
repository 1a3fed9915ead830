// Whether a place that a search found says more than an estimate that is in doubt.
#include "estimators/health/place_evidence.h"

#include <gtest/gtest.h>

namespace lodestone {
namespace {

PlaceEvidence evidence(double scan_share, double decoy_share, double field_odds) {
  PlaceEvidence result;
  result.scan_share = scan_share;
  result.decoy_share = decoy_share;
  result.field_odds = field_odds;
  return result;
}

TEST(PlaceEvidence, FitIsOneOnTheMapAndZeroByChance) {
  EXPECT_DOUBLE_EQ(fit_of(evidence(1.0, 0.3, 0.0)), 1.0);
  EXPECT_DOUBLE_EQ(fit_of(evidence(0.3, 0.3, 0.0)), 0.0);
  EXPECT_DOUBLE_EQ(fit_of(evidence(0.5, 0.0, 0.0)), 0.5);
}

// On an apron, a quarter of the scan fits at the right place; a search was sure of a place 130 m away, where less does.
TEST(PlaceEvidence, APlaceOutweighsTheEstimateIfScanAndReadingsFitThere) {
  const PlaceEvidence estimate = evidence(0.25, 0.03, 1.8);
  EXPECT_FALSE(outweighs(evidence(0.13, 0.03, 0.0), estimate));
  EXPECT_FALSE(outweighs(evidence(0.60, 0.03, 0.0), estimate));   // its readings are off the magnetic map
  EXPECT_FALSE(outweighs(evidence(0.60, 0.03, -1.5), estimate));  // or contradict it
  EXPECT_TRUE(outweighs(evidence(0.60, 0.03, 1.0), estimate));
  EXPECT_TRUE(outweighs(evidence(0.60, 0.03, 0.0), evidence(0.25, 0.03, 0.0)));  // without magnetic map
  EXPECT_TRUE(outweighs(evidence(0.60, 0.03, -1.5), evidence(0.25, 0.03, -1.5)));
  EXPECT_FALSE(outweighs(estimate, estimate));
}

}  // namespace
}  // namespace lodestone
