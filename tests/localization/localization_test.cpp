// Localization as a library: a log, measurements in memory and bundles give the same estimates.
#include "localization/localization.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/error.h"
#include "frontends/configuration/platform.h"
#include "frontends/maps/point_cloud_writer.h"
#include "localization/measurement_list.h"
#include "tests/tools/program_runner.h"
#include "tools/simulate/bag_recorder.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

constexpr Time kBegin = 1'700'000'000'000'000'000;
const Vector3 kHalfRoom{4.0, 3.0, 1.5};  // metres; the robot stands in the middle

LidarScan room_scan(Time start) {
  LidarScan scan;
  scan.start = start;
  for (int column = 0; column < 256; ++column) {
    for (int row = 0; row < 16; ++row) {
      const double azimuth = 2.0 * 3.14159265358979 * column / 256.0 + 1e-3;
      const double elevation = 0.05 * (row - 7.5);
      const Vector3 ray{std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                        std::sin(elevation)};
      LidarPoint point;
      point.position = (ray * (kHalfRoom.array() / ray.array().abs()).minCoeff()).cast<float>();
      point.ring = static_cast<std::uint16_t>(row);
      point.offset_ns = column * 380'000;
      scan.points.push_back(point);
    }
  }
  scan.end = start + 255 * 380'000;
  return scan;
}

std::vector<Eigen::Vector3f> walls() {
  std::vector<Eigen::Vector3f> cloud;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (double a = -kHalfRoom(u); a <= kHalfRoom(u); a += 0.07) {
      for (double b = -kHalfRoom(v); b <= kHalfRoom(v); b += 0.07) {
        for (const double side : {-1.0, 1.0}) {
          Vector3 point;
          point(axis) = side * kHalfRoom(axis);
          point(u) = a;
          point(v) = b;
          cloud.push_back(point.cast<float>());
        }
      }
    }
  }
  return cloud;
}

/// A robot that stands for two seconds, as a log and in memory.
class Localize : public testing::Test {
 protected:
  void SetUp() override {
    Platform platform;
    platform.name = "standing";
    save_platform(platform, path("platform.yaml"));
    write_point_cloud(path("cloud.pcd"), walls());
    simulation::BagRecorder recorder(path("log.bag"), {platform.lidar.topic, platform.imu.topic, {}});
    Time next_scan = kBegin + from_seconds(0.05);
    for (Time time = kBegin; time <= kBegin + from_seconds(2.0); time += from_seconds(0.005)) {
      const ImuSample sample{time, Vector3::Zero(), {0.0, 0.0, platform.suite.gravity_m_s2}};
      recorder.write(sample);
      measurements_.emplace_back(sample);
      if (time < next_scan + from_seconds(0.1)) continue;
      recorder.write(room_scan(next_scan));
      measurements_.emplace_back(room_scan(next_scan));
      next_scan += from_seconds(0.1);
    }
    recorder.close();
    site_ = load_site(path("platform.yaml"), RunOptions{}, {path("cloud.pcd"), ""});
    task_.initial_pose = Pose{Quaternion::Identity(), {0.05, 0.0, 0.0}};
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  TemporaryFolder folder_;
  std::vector<Measurement> measurements_;
  Site site_;
  LocalizationTask task_;
};

void expect_same_bits(const std::vector<Estimate>& a, const std::vector<Estimate>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].time, b[i].time);
    EXPECT_EQ(a[i].state.T_map_imu.position, b[i].state.T_map_imu.position);
    EXPECT_EQ(a[i].state.T_map_imu.rotation.coeffs(), b[i].state.T_map_imu.rotation.coeffs());
    EXPECT_EQ(a[i].covariance, b[i].covariance);
  }
}

TEST_F(Localize, OfALogMeasurementsAndBundlesGivesTheSameBits) {
  EstimateCollector of_log;
  const LocalizationResult result = localize(path("log.bag"), site_, task_, of_log);
  EXPECT_GT(result.scans, 15);
  EXPECT_EQ(of_log.causal_estimates.size(), static_cast<std::size_t>(result.scans));
  EXPECT_EQ(of_log.best_estimates.size(), of_log.causal_estimates.size());
  EXPECT_EQ(result.end, of_log.best_estimates.back().time);
  EXPECT_THAT(result.solver, HasSubstr("ceres"));
  EXPECT_FALSE(result.failure);
  EXPECT_LT(of_log.best_estimates.back().state.T_map_imu.position.norm(), 0.01);

  MeasurementList list(measurements_, site_.platform.suite);
  EstimateCollector of_list;
  localize(list, site_, task_, of_list);
  expect_same_bits(of_log.best_estimates, of_list.best_estimates);

  std::vector<ScanBundle> bundles;
  WarningLog warnings;
  const OpenedLog log = open_bundles(path("log.bag"), site_, warnings);
  for (ScanBundle bundle; log.next(bundle);) bundles.push_back(bundle);
  EstimateCollector of_bundles;
  const auto next = [&, i = std::size_t{0}](ScanBundle& bundle) mutable {
    if (i == bundles.size()) return false;
    bundle = bundles[i++];
    return true;
  };
  localize(next, site_, task_, of_bundles);
  expect_same_bits(of_log.causal_estimates, of_bundles.causal_estimates);
}

TEST_F(Localize, EveryEstimatorOfLidarHoldsThePoseInARoom) {
  for (const char* name : {"ieskf", "lidar-inertial", "continuous-time", "ndt"}) {
    task_.estimator = name;
    EstimateCollector estimates;
    EXPECT_GT(localize(path("log.bag"), site_, task_, estimates).scans, 15) << name;
    ASSERT_FALSE(estimates.best_estimates.empty()) << name;
    EXPECT_LT(estimates.best_estimates.back().state.T_map_imu.position.norm(), 0.1) << name;
  }
}

TEST_F(Localize, SearchesThePoseAndLosesNoBundle) {
  task_.estimator = "ieskf";
  EstimateCollector given;
  localize(path("log.bag"), site_, task_, given);
  site_.options.search.min_probability = 0.0;  // the room is the same when turned by 180°
  task_.initial_pose = SearchedPose{};
  EstimateCollector searched;
  localize(path("log.bag"), site_, task_, searched);
  ASSERT_EQ(searched.best_estimates.size(), given.best_estimates.size());
  EXPECT_LT(searched.best_estimates.back().state.T_map_imu.position.norm(), 0.02);
}

TEST_F(Localize, StopsWhereTheCallerSaysSo) {
  task_.processed = [count = 0](const ScanBundle&) mutable { return ++count < 5; };
  EstimateCollector estimates;
  const LocalizationResult result = localize(path("log.bag"), site_, task_, estimates);
  EXPECT_TRUE(result.stopped);
  EXPECT_EQ(result.scans, 5);
  EXPECT_EQ(estimates.best_estimates.size(), 5U);
}

TEST_F(Localize, KeepsTheEstimatesBeforeAnErrorOfTheLog) {
  WarningLog warnings;
  const OpenedLog log = open_bundles(path("log.bag"), site_, warnings);
  const auto next = [&, count = 0](ScanBundle& bundle) mutable {
    if (++count > 7) throw InputError("chunk 7 is cut off");
    return log.next(bundle);
  };
  EstimateCollector estimates;
  const LocalizationResult result = localize(next, site_, task_, estimates);
  ASSERT_TRUE(result.failure);
  EXPECT_STREQ(result.failure->what(), "chunk 7 is cut off");
  EXPECT_EQ(estimates.best_estimates.size(), 7U);
}

TEST_F(Localize, RefusesWrongInputBeforeTheFirstEstimate) {
  EstimateCollector estimates;
  task_.initial_pose = Pose{Quaternion::Identity(), {500.0, 0.0, 0.0}};
  EXPECT_THROW(localize(path("log.bag"), site_, task_, estimates), InputError);
  write_point_cloud(path("thin.pcd"), {{0.1F, 0.1F, 0.1F}, {3.1F, 0.1F, 0.1F}});
  const Site thin = load_site(path("platform.yaml"), RunOptions{}, {path("thin.pcd"), ""});
  try {
    localize(path("log.bag"), thin, task_, estimates);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no voxel of 0.25 m of this map holds a plane; expected metres"));
  }
  task_.initial_pose = MapOrigin{};
  task_.estimator = "smother";
  EXPECT_THROW(localize(path("log.bag"), site_, task_, estimates), InputError);
  task_.estimator = "smoother";
  EXPECT_THROW(localize([](ScanBundle&) { return false; }, site_, task_, estimates), InputError);
  EXPECT_THROW(localize(path("none.bag"), site_, task_, estimates), InputError);
  EXPECT_THROW(site_without_maps(Platform{}, RunOptions{}, {}), InputError);
  EXPECT_TRUE(estimates.causal_estimates.empty());
}

TEST_F(Localize, WarnsOfAMissingInitialPose) {
  task_.initial_pose = MapOrigin{};
  EstimateCollector estimates;
  EXPECT_EQ(localize(path("log.bag"), site_, task_, estimates).warnings.count("run.initial_pose"), 1);
}

TEST(MeasurementListTest, SortsByCompletion) {
  SensorSuite suite;
  LidarScan scan;
  scan.start = 0;
  scan.end = 100;
  MeasurementList list({scan, ImuSample{.time = 100}, ImuSample{.time = 50}}, suite);
  EXPECT_EQ(list.begin_time(), 50);
  EXPECT_EQ(list.end_time(), 100);
  Measurement measurement;
  ASSERT_TRUE(list.next(measurement));
  EXPECT_EQ(completion_time(measurement), 50);
  ASSERT_TRUE(list.next(measurement));
  EXPECT_TRUE(std::holds_alternative<LidarScan>(measurement)) << "equal times: the caller's order";
  ASSERT_TRUE(list.next(measurement));
  EXPECT_FALSE(list.next(measurement));
}

TEST(MeasurementListTest, RefusesWhatEstimatorsCannotUse) {
  SensorSuite suite;
  suite.magnetometers.resize(2);
  const auto refused = [&](std::vector<Measurement> measurements, const std::string& part) {
    try {
      MeasurementList(std::move(measurements), suite);
      ADD_FAILURE() << part;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(part));
    }
  };
  refused({ImuSample{0, {std::nan(""), 0.0, 0.0}, {}}}, "imu at 0.000000000 s: a value is not finite");
  refused({MagneticSample{0, 2, {}}}, "magnetometer 2");
  refused({MagneticSample{0, -1, {}}}, "magnetometer -1");
  refused({ImuSample{.time = 7}, ImuSample{.time = 7}}, "two samples have this stamp");
  refused({ImuSample{.time = -1}}, "expected a stamp from 0");
  refused({LidarScan{.start = -1, .end = 7, .points = {}}}, "expected a stamp from 0");
  refused({ImuSample{.time = farthest_time + 1}}, "expected a stamp from 0");
  LidarScan scan;
  scan.end = 100;
  scan.points.resize(1);
  scan.points[0].offset_ns = 101;
  refused({scan}, "offset_ns 101; expected 0 to 100");
  scan.points[0] = {.lidar = 1};
  refused({scan}, "of LiDAR 1; the platform has 1");
  scan.points.clear();
  scan.end = -1;
  refused({scan}, "ends before its start");
}

}  // namespace
}  // namespace lodestone
