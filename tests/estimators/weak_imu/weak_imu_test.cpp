// Filter and smoother with IMUs from tactical grade to wrong specifications, and fast and slow scans. The whole grid:
// docs/results/weak-imu.md.
#include <gtest/gtest.h>

#include "tests/estimators/weak_imu/parting.h"
#include "tests/estimators/weak_imu/site.h"

namespace lodestone::weak_imu {
namespace {

struct Case {
  std::string grade;
  double scan_period_s = 0.0;

  friend void PrintTo(const Case& one, std::ostream* stream) {
    *stream << one.grade << ", scans of " << one.scan_period_s << " s";
  }
};

class Drives {
 protected:
  /// The filter with deskewing errors. The paper's filter disagrees with the smoother, see WeakImuDefects.
  static RunOptions consistent_filter() {
    RunOptions options;
    options.ieskf.deskewing_errors = true;
    return options;
  }

  static const Site& site() {
    static const Site shared("exact", 1);
    return shared;
  }

  static const ImuGrade& grade(const std::string& name) {
    for (const ImuGrade& one : imu_grades()) {
      if (one.name == name) return one;
    }
    throw std::invalid_argument("no such grade: " + name);
  }
};

class WeakImu : public Drives, public ::testing::TestWithParam<Case> {};
class WeakImuDefects : public Drives, public ::testing::Test {};

// All bounds have a false alarm rate of one in a thousand runs, over all scans of a run together.
TEST_P(WeakImu, FilterAndSmootherNeverPartByMoreThanTheirCovariances) {
  DriveChoice choice{grade(GetParam().grade), GetParam().scan_period_s};
  choice.duration_s = 12.0;
  const Comparison found = compare(site().drive(choice), consistent_filter());
  std::printf("rms %.1f, %.1f, %.1f mm; NEES %.2f, %.2f, %.2f; largest %.2f, %.2f, %.2f; parting %.2f, %.2f\n",
              1e3 * found.filter.rms_m, 1e3 * found.causal.rms_m, 1e3 * found.smoothed.rms_m, found.filter.nees,
              found.causal.nees, found.smoothed.nees, found.filter.largest_nees, found.causal.largest_nees,
              found.smoothed.largest_nees, found.causal_parting.largest, found.smoothed_parting.largest);
  EXPECT_TRUE(found.tracked());
  EXPECT_LT(found.causal.largest_nees, 1.0);
  EXPECT_LT(found.smoothed.largest_nees, 1.0);
  // If the IMU adds little information to a scan, both have the same errors of millimetres.
  EXPECT_LE(found.smoothed.rms_m, 1.05 * found.filter.rms_m);
  EXPECT_LT(found.causal_parting.largest, 1.0);
  EXPECT_LT(found.smoothed_parting.largest, 1.0);
}

// The check detects estimators that assume exact deskewing: the paper's filter, and one residual per point.
TEST_F(WeakImuDefects, ArePartingsByMoreThanTheCovariances) {
  DriveChoice choice{grade("consumer"), 0.5};
  choice.duration_s = 12.0;
  const testing::Drive drive = site().drive(choice);
  EXPECT_GT(compare(drive, RunOptions{}).causal_parting.largest, 10.0);
  RunOptions points = consistent_filter();
  points.smoother.solver.condensed = false;
  const Comparison found = compare(drive, points);
  EXPECT_GT(found.causal_parting.largest, 10.0);
  EXPECT_GT(found.causal.largest_nees, 10.0);
}

INSTANTIATE_TEST_SUITE_P(Grid, WeakImu,
                         ::testing::Values(Case{"tactical", 0.1}, Case{"tactical", 0.5}, Case{"industrial", 0.1},
                                           Case{"industrial", 0.5}, Case{"consumer", 0.1}, Case{"consumer", 0.5},
                                           Case{"shaken", 0.1}, Case{"shaken", 0.5}, Case{"misstated", 0.1},
                                           Case{"misstated", 0.5}, Case{"misstated", 1.0}));

}  // namespace
}  // namespace lodestone::weak_imu
