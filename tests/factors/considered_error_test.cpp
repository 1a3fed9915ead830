// Map errors over tens of metres: they increase covariances and leave estimates unchanged.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

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

/// A drive of 9 m in a room, in a map whose displacement changes over `length_m`. `displaced_m`: of the map at each
/// keyframe.
std::unique_ptr<SlidingWindow> window_in_map(double sigma_m, double length_m,
                                             const std::vector<Vector3>& displaced_m = {}) {
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
    Scan seen = scan(truth.truth[k].T_map_imu, normals, 300, 0.01, 5.0, 0.0, random);
    for (Correspondence& match : seen.matches) {
      if (displaced_m.empty()) break;
      match.point += (truth.truth[k].T_map_imu.rotation.conjugate() * displaced_m[k]).cast<float>();
    }
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

// Brute force: the map is displaced by each source of the error, one at a time.
TEST(ConsideredError, AddsWhatEachDisplacementOfTheMapMakesOfTheEstimate) {
  constexpr double kLength_m = 4.0;
  const auto plain = window_in_map(0.0, kLength_m);
  plain->solve();
  const std::size_t newest = plain->size() - 1;
  // u = decay u_before + √(1 − decay²) w from stretch to stretch, each of one metre at least.
  std::vector<std::vector<double>> weights;  // of the sources, for each keyframe
  std::vector<double> now{1.0};
  Vector3 start = plain->state(0).T_map_imu.position;
  for (std::size_t k = 0; k < plain->size(); ++k) {
    const Vector3 position = plain->state(k).T_map_imu.position;
    if (const double way_m = (position - start).norm(); way_m >= 1.0) {
      const double decay = std::exp(-way_m / kLength_m);
      for (double& weight : now) weight *= decay;
      now.push_back(std::sqrt(1.0 - decay * decay));
      start = position;
    }
    weights.push_back(now);
  }
  ASSERT_GT(now.size(), 4U);
  Matrix3 expected = Matrix3::Zero();
  for (std::size_t source = 0; source < now.size(); ++source) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<Vector3> displaced_m;
      for (const auto& weight : weights) {
        const double share = source < weight.size() ? weight[source] : 0.0;
        displaced_m.emplace_back(kShared_m * share * Vector3::Unit(axis));
      }
      const auto moved = window_in_map(0.0, kLength_m, displaced_m);
      moved->solve();
      const Vector3 step = moved->state(newest).T_map_imu.position - plain->state(newest).T_map_imu.position;
      expected += step * step.transpose();
    }
  }
  const auto considered = window_in_map(kShared_m, kLength_m);
  considered->solve();
  const Matrix3 added = (newest_covariance(*considered) - newest_covariance(*plain)).bottomRightCorner<3, 3>();
  EXPECT_LT((added - expected).norm(), 0.02 * expected.norm());
}

TEST(ConsideredError, StaysWithThePriorOfWhatHasLeftTheWindow) {
  const auto whole = window_in_map(kShared_m, 4.0);
  const auto sliding = window_in_map(kShared_m, 4.0);
  for (int i = 0; i < 14; ++i) {
    sliding->marginalize_oldest();
    const Matrix6 expected = newest_covariance(*whole);
    EXPECT_LT((newest_covariance(*sliding) - expected).norm(), 1e-4 * expected.norm()) << i;
  }
  // The same by the recursion over all keyframes.
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
