// A place beside an estimate where its scan is more likely, in a room with four pillars.
#include "estimators/health/nearby_place.h"

#include <gtest/gtest.h>

#include "tests/estimators/room.h"
#include "tests/estimators/wrong_estimators.h"

namespace lodestone {
namespace {

class NearbyPlaceInARoom : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { drive_ = std::make_unique<testing::RoomDrive>(testing::drive_through_room(3, 4.0)); }
  static void TearDownTestSuite() { drive_.reset(); }

  /// Of the scan at `k`, moved from the truth.
  static Estimate estimate_at(std::size_t k, const Vector3& way) {
    const ScanBundle& bundle = drive_->bundles[k];
    Estimate result;
    result.time = bundle.scan.end;
    result.state = testing::state_on(drive_->truth, bundle.scan.end);
    result.state.T_map_imu.position += way;
    return result;
  }

  static std::optional<NearbyPlace> find(std::size_t k, const Estimate& estimate,
                                         const std::function<double(const Pose&)>& readings = {}) {
    const EstimatorInput& input = drive_->room.input;
    const JudgedScan scan = judged_scan(drive_->bundles[k], estimate, input.suite);
    return find_nearby(scan, estimate.state, *input.planes->around(scan.T_map_imu.position), input.suite,
                       input.options.lidar.association, readings);
  }

  static std::unique_ptr<testing::RoomDrive> drive_;
};
std::unique_ptr<testing::RoomDrive> NearbyPlaceInARoom::drive_;

TEST_F(NearbyPlaceInARoom, IsNotFoundWhereTheEstimateIsRight) {
  for (std::size_t k = 5; k < drive_->bundles.size(); k += 5) {
    for (const Vector3& way : {Vector3(0.0, 0.0, 0.0), Vector3(0.1, 0.0, 0.0), Vector3(0.0, -0.1, 0.0)}) {
      const auto found = find(k, estimate_at(k, way));
      EXPECT_FALSE(found) << k << ": " << (found ? found->log_odds : 0.0);
    }
  }
}

TEST_F(NearbyPlaceInARoom, IsTheTruthWhereTheEstimateIsWrong) {
  for (std::size_t k = 5; k < drive_->bundles.size(); k += 10) {
    for (const Vector3& way : {Vector3(0.4, 0.0, 0.0), Vector3(-0.5, 0.6, 0.0), Vector3(0.0, 1.1, 0.0)}) {
      const auto found = find(k, estimate_at(k, way));
      ASSERT_TRUE(found) << k << ": " << way.transpose();
      const Vector6 error = found->T_map_imu.boxminus(estimate_at(k, Vector3::Zero()).state.T_map_imu);
      EXPECT_LT(error.tail<3>().norm(), 0.05) << way.transpose();
      EXPECT_LT(error.head<3>().norm(), 0.01);
      EXPECT_GT(found->log_odds, 4.6);
    }
  }
}

TEST_F(NearbyPlaceInARoom, IsThatOfTheStateNotOfTheScan) {
  Estimate estimate = estimate_at(20, {0.4, 0.0, 0.0});
  const Pose beside{so3::exp({0.0, 0.0, 0.02}), {0.1, 0.0, 0.05}};  // as a calibration moves it
  estimate.scan_pose = estimate.state.T_map_imu;
  estimate.state.T_map_imu = *estimate.scan_pose * beside;
  const auto found = find(20, estimate);
  ASSERT_TRUE(found);
  const Pose scan = found->T_map_imu * beside.inverse();
  EXPECT_LT((scan.position - estimate_at(20, Vector3::Zero()).state.T_map_imu.position).norm(), 0.05);
}

TEST_F(NearbyPlaceInARoom, HasToAgreeWithTheReadings) {
  const Estimate wrong = estimate_at(20, {0.4, 0.0, 0.0});
  const Vector3 there = wrong.state.T_map_imu.position;
  const auto here = [&](const Pose& pose) { return (pose.position - there).norm() < 0.2 ? 0.0 : -100.0; };
  EXPECT_FALSE(find(20, wrong, here));
}

Estimate at(double seconds, double x_m) {
  Estimate result;
  result.time = from_seconds(seconds);
  result.state.T_map_imu.position.x() = x_m;
  return result;
}

NearbyPlace beside(double x_m, double log_odds) {
  NearbyPlace result;
  result.T_map_imu.position.x() = x_m;
  result.log_odds = log_odds;
  return result;
}

TEST(NearbyCheck, ScansHalfAMetreApartCountAsNew) {
  NearbyCheck check(4.6);
  EXPECT_TRUE(check.is_due(at(1.0, 2.0)));
  check.add(at(1.0, 2.0), std::nullopt);
  EXPECT_FALSE(check.is_due(at(1.2, 2.6)));  // 5 m/s: too soon
  EXPECT_FALSE(check.is_due(at(9.0, 2.4)));  // the robot stands
  EXPECT_TRUE(check.is_due(at(1.6, 2.6)));
}

TEST(NearbyCheck, TwoScansMustAgreeOnTheWay) {
  NearbyCheck check(4.6);
  check.add(at(1.0, 2.0), beside(2.5, 9.0));
  EXPECT_TRUE(check.contradicts());
  EXPECT_FALSE(check.better());
  check.add(at(2.0, 3.0), beside(2.4, 9.0));  // to the other side
  EXPECT_FALSE(check.better());
  check.add(at(3.0, 4.0), beside(3.3, 1.0));
  ASSERT_TRUE(check.better());
  EXPECT_DOUBLE_EQ(check.better()->position.x(), 3.3);
  check.add(at(4.0, 5.0), std::nullopt);
  EXPECT_FALSE(check.contradicts());
  EXPECT_FALSE(check.better());
}

TEST(NearbyCheck, AddsUpWhatScansSay) {
  NearbyCheck check(4.6);
  for (int i = 0; i < 2; ++i) check.add(at(1.0 + i, 2.0 + i), beside(2.4 + i, 2.0));
  EXPECT_FALSE(check.contradicts());
  EXPECT_FALSE(check.better());
  check.add(at(3.0, 4.0), beside(4.4, 2.0));
  EXPECT_TRUE(check.contradicts());
  EXPECT_TRUE(check.better());
  check.restart();
  EXPECT_FALSE(check.contradicts());
}

}  // namespace
}  // namespace lodestone
