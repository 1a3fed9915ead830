// The variance of the map's bends, from the log and from what the user states.
#include "estimators/smoother/repeated_map_error.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace lodestone {
namespace {

const Vector3 kHall_m(60.0, 18.0, 6.0);

/// The smooth parts after `scans` scans, 0.5 m apart, of a hall whose map is exact.
MapErrorVariances after(int scans, double stated_sigma_m) {
  RepeatedMapError error(stated_sigma_m);
  std::mt19937_64 random(3);
  for (int scan = 0; scan < scans; ++scan) {
    const Pose T_map_imu{Quaternion::Identity(), Vector3(10.0 + 0.5 * scan, 8.0, 1.5)};
    if (!error.takes(T_map_imu.position)) ADD_FAILURE() << "scan " << scan;
    std::vector<Plane> planes(600);
    std::vector<Correspondence> matches;
    for (int i = 0; i < 600; ++i) {
      Vector3 place;
      for (int k = 0; k < 3; ++k) place[k] = std::uniform_real_distribution<double>(0.1, kHall_m[k] - 0.1)(random);
      const int axis = i % 3;
      place[axis] = i % 2 == 0 ? 0.02 : kHall_m[axis] - 0.02;
      Plane& plane = planes[static_cast<std::size_t>(i)];
      const Vector3 normal = Vector3::Unit(axis);
      plane.normal = normal.cast<float>();
      plane.major = normal.unitOrthogonal().cast<float>();
      plane.center = place.cast<float>();
      const Vector3 point = T_map_imu.inverse() * place;
      matches.push_back({point.cast<float>(), &plane, 1e-4F, 1.0F, 0.0F, 1e-4F});
    }
    error.add(analyse_map_error(matches, T_map_imu), T_map_imu.position);
  }
  return error.variances_m2();
}

TEST(StatedMapError, IsTheVarianceBeforeAnythingIsSeen) {
  EXPECT_DOUBLE_EQ(after(0, 0.03).sum(), 9e-4);
  EXPECT_EQ(after(0, 0.0).sum(), 0.0);
}

TEST(StatedMapError, FadesAsTheLogShowsAnExactMapAndNeverToZero) {
  double last_m2 = after(0, 0.03).sum();
  for (const int scans : {10, 30, 70}) {
    const double now_m2 = after(scans, 0.03).sum();
    EXPECT_LT(now_m2, last_m2) << scans;
    EXPECT_GT(now_m2, 0.1 * 9e-4) << scans;
    last_m2 = now_m2;
  }
  EXPECT_LT(last_m2, 0.6 * 9e-4);
}

TEST(StatedMapError, ZeroAddsNothingToWhatTheLogShows) {
  EXPECT_LT(after(30, 0.0).sum(), 1e-8);
}

TEST(StatedMapError, OfTheLogCountsTheSameWhateverIsStated) {
  // Where nothing is found, the variance is a fixed share of the stated one.
  EXPECT_NEAR(after(20, 0.01).sum() / 1e-4, after(20, 0.05).sum() / 25e-4, 1e-3);
}

}  // namespace
}  // namespace lodestone
