#include "estimators/baselines/field_matching.h"

#include <gtest/gtest.h>

#include "tests/estimators/baselines/striped_field.h"

namespace lodestone {
namespace {

using testing::StripedField;

NavState true_state(Time time) {
  NavState state;
  state.T_map_imu = StripedField::truth(time);
  state.velocity.x() = StripedField::kSpeed_m_s;
  return state;
}

double difference(const FieldMatching& matching, const MatchedScan& scan, const Pose& pose, const Vector6& step) {
  return matching.log_likelihood(scan, pose) - matching.log_likelihood(scan, pose.boxplus(step));
}

TEST(FieldMatching, TheTruePoseIsMoreLikelyThanItsNeighbours) {
  const StripedField stripes;
  const FieldMatching matching(stripes.input);
  for (const ScanBundle& bundle : stripes.drive(1.0, 1)) {
    const NavState state = true_state(bundle.scan.end);
    const MatchedScan scan = matching.match(bundle, state);
    ASSERT_EQ(scan.arrays.size(), 1U);
    ASSERT_EQ(scan.arrays.front().readings.size(), 4U);
    for (const int axis : {2, 3, 4}) {
      for (const double side : {-0.2, 0.2}) {
        EXPECT_GT(difference(matching, scan, state.T_map_imu, side * Vector6::Unit(axis)), 0.5) << axis << ' ' << side;
      }
    }
    EXPECT_GT(difference(matching, scan, state.T_map_imu, Vector6::Unit(3) * 20.0), 1.0) << "off the map";
    Diagnostics diagnostics;
    matching.report(scan, state.T_map_imu, diagnostics);
    EXPECT_EQ(diagnostics.magnetic_samples, 1);
    EXPECT_EQ(diagnostics.magnetic_off_map, 0);
    EXPECT_GT(diagnostics.magnetic_weight, 0.95);
    EXPECT_LT(diagnostics.magnetic_residual_ut, 1.0);
  }
}

TEST(FieldMatching, ADisturbedMagnetometerHasBoundedInfluence) {
  const StripedField stripes;
  const FieldMatching matching(stripes.input);
  ScanBundle bundle = stripes.drive(0.1, 2).front();
  const NavState state = true_state(bundle.scan.end);
  const MatchedScan clean = matching.match(bundle, state);
  const auto disturbed_by = [&](double disturbance_ut) {
    ScanBundle disturbed = bundle;
    for (MagneticArraySample& sample : disturbed.magnetic) sample.field_ut[0]->x() += disturbance_ut;
    return matching.match(disturbed, state);
  };
  // The position that explains the disturbance best gains little from a disturbance that is ten times larger.
  const Vector6 step = 0.1 * Vector6::Unit(3);
  const double by_clean = difference(matching, clean, state.T_map_imu, step);
  const double by_large = difference(matching, disturbed_by(100.0), state.T_map_imu, step);
  const double by_huge = difference(matching, disturbed_by(1000.0), state.T_map_imu, step);
  EXPECT_GT(by_large, 0.5 * by_clean);
  EXPECT_NEAR(by_huge, by_large, 0.1 * by_clean);
  Diagnostics diagnostics;
  matching.report(disturbed_by(100.0), state.T_map_imu, diagnostics);
  EXPECT_NEAR(diagnostics.magnetic_weight, 0.75, 0.06);
}

TEST(FieldMatching, RepeatedErrorsOfTheMapLimitTheInformationOfARobotAtRest) {
  const StripedField stripes;
  const FieldMatching matching(stripes.input);
  const ScanBundle bundle = stripes.drive(0.1, 3).front();
  NavState state = true_state(bundle.scan.end);
  const double driving = matching.match(bundle, state).arrays.front().information_share;
  state.velocity.setZero();
  const double at_rest = matching.match(bundle, state).arrays.front().information_share;
  EXPECT_LT(at_rest, 0.1 * driving);
  EXPECT_LE(driving, 1.0);
}

}  // namespace
}  // namespace lodestone
