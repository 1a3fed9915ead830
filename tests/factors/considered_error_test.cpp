// Errors of the map over tens of metres: they widen covariances and leave estimates as they are.
#include <gtest/gtest.h>

#include <array>

#include "core/lidar/swept_cost.h"
#include "factors/sliding_window.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

constexpr double kShared_m = 0.02;

Matrix6 shared_root(double sigma_m) {
  Matrix6 root = 1e-6 * Matrix6::Identity();
  root.bottomRightCorner<3, 3>() = sigma_m * Matrix3::Identity();
  return root;
}

/// A drive of 9 m in a room, in a map whose displacement changes over `length_m`.
std::unique_ptr<SlidingWindow> window_in_map(double sigma_m, double length_m) {
  Random random(21);
  DriveOptions options;
  options.keyframes = 19;
  options.period_s = 0.5;
  const Drive truth = drive(options, random);
  const std::vector<Vector3> normals = room_normals(random);
  auto window = std::make_unique<SlidingWindow>(0, truth.truth[0], 100.0 * start_covariance(), 0, options.noise,
                                                SlidingWindowOptions{});
  for (std::size_t k = 0; k < truth.truth.size(); ++k) {
    if (k > 0) window->add_keyframe(truth.times[k], truth.truth[k], truth.samples[k]);
    const Scan seen = scan(truth.truth[k].T_map_imu, normals, 300, 0.01, 5.0, 0.0, random);
    CondensedScan condensed = condense_scan(seen.matches, truth.truth[k].T_map_imu);
    condensed.by_lidar = true;
    condensed.map_error_root = 1e-6 * Matrix6::Identity();
    condensed.long_map_error_root = shared_root(sigma_m);
    condensed.long_map_error_length_m = length_m;
    window->set_lidar(k, condensed, seen.matches, {});
  }
  return window;
}

Matrix6 newest_covariance(const SlidingWindow& window) {
  return window.pose_covariances(std::array{window.size() - 1}).front();
}

TEST(ConsideredError, ThatAllScansShareMovesThePoseByAllOfIt) {
  const Matrix6 with = newest_covariance(*window_in_map(kShared_m, 1e6));
  const Matrix6 without = newest_covariance(*window_in_map(0.0, 1e6));
  const Matrix3 added = (with - without).bottomRightCorner<3, 3>();
  EXPECT_LT((added - kShared_m * kShared_m * Matrix3::Identity()).norm(), 0.05 * kShared_m * kShared_m);
  EXPECT_GT(without.trace(), 0.0);
}

TEST(ConsideredError, ThatChangesOnTheWayIsAveragedInPart) {
  const Matrix3 shared = newest_covariance(*window_in_map(kShared_m, 1e6)).bottomRightCorner<3, 3>();
  const Matrix3 changing = newest_covariance(*window_in_map(kShared_m, 4.0)).bottomRightCorner<3, 3>();
  EXPECT_LT(changing.trace(), 1.001 * shared.trace());
  EXPECT_GT(changing.trace(), 0.3 * shared.trace());
}

TEST(ConsideredError, StaysWithThePriorOfWhatHasLeftTheWindow) {
  const auto whole = window_in_map(kShared_m, 4.0);
  const auto sliding = window_in_map(kShared_m, 4.0);
  for (int i = 0; i < 14; ++i) {
    sliding->marginalize_oldest();
    const Matrix6 expected = newest_covariance(*whole);
    EXPECT_LT((newest_covariance(*sliding) - expected).norm(), 1e-4 * expected.norm()) << i;
  }
  // By the recursion over all keyframes, the same.
  const std::size_t all[] = {0, 1, 2, 3, 4};
  EXPECT_LT((sliding->pose_covariances(all).back() - newest_covariance(*sliding)).norm(), 1e-10);
}

TEST(ConsideredError, LeavesTheEstimateAsItIs) {
  const auto with = window_in_map(kShared_m, 4.0);
  const auto without = window_in_map(0.0, 4.0);
  with->solve();
  without->solve();
  const std::size_t newest = with->size() - 1;
  EXPECT_EQ(with->state(newest).T_map_imu.position, without->state(newest).T_map_imu.position);
}

}  // namespace
}  // namespace lodestone
