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

/// What is not as the window believes: displacements in m at each keyframe, and their sigmas.
struct Displaced {
  double cloud_sigma_m = 0.0;
  double field_sigma_m = 0.0;
  std::vector<Vector3> cloud_m;
  std::vector<Vector3> field_m;
  bool with_readings = true;
};

/// A drive of 9 m in a room, in maps whose displacement changes over `length_m`; three magnetometers.
std::unique_ptr<SlidingWindow> window_in_map(double length_m, const Displaced& displaced) {
  Random random(21);
  DriveOptions options;
  options.keyframes = 19;
  options.period_s = 0.5;
  const Drive truth = drive(options, random);
  const std::vector<Vector3> normals = room_normals(random);
  const std::shared_ptr<const MagneticMap> map = wavy_map();
  CalibrationSigmas sigmas = exact_calibration();
  sigmas.magnetometers.survey_pose_sigma_m = displaced.field_sigma_m;
  auto window = std::make_unique<SlidingWindow>(0, truth.truth[0], 100.0 * start_covariance(), 3, options.noise,
                                                SlidingWindowOptions{}, sigmas);
  for (std::size_t k = 0; k < truth.truth.size(); ++k) {
    if (k > 0) window->add_keyframe(truth.times[k], truth.truth[k], truth.samples[k]);
    const Pose& pose = truth.truth[k].T_map_imu;
    Scan seen = scan(pose, normals, 300, 0.01, 5.0, 0.0, random);
    for (Correspondence& match : seen.matches) {
      if (displaced.cloud_m.empty()) break;
      match.point += (pose.rotation.conjugate() * displaced.cloud_m[k]).cast<float>();
    }
    CondensedScan condensed = condense_scan(seen.matches, pose);
    condensed.by_lidar = true;
    condensed.map_error_root = 1e-6 * Matrix6::Identity();
    condensed.long_map_error_root = shared_root(displaced.cloud_sigma_m);
    condensed.long_map_error_length_m = length_m;
    window->set_lidar(k, condensed, seen.matches, {});
    if (!displaced.with_readings) continue;
    Pose in_field = pose;
    if (!displaced.field_m.empty()) in_field.position += displaced.field_m[k];
    window->set_field(k, map, FieldInterpolation::bicubic,
                      field_readings(in_field, *map, std::vector<Vector3>(3, Vector3::Zero()), 0.02, random), {});
  }
  return window;
}

Matrix6 newest_covariance(const SlidingWindow& window) {
  return window.pose_covariances(std::array{window.size() - 1}).front();
}

Displaced errors(double cloud_sigma_m, double field_sigma_m) {
  Displaced result;
  result.cloud_sigma_m = cloud_sigma_m;
  result.field_sigma_m = field_sigma_m;
  return result;
}

Displaced cloud(double sigma_m) {
  return errors(sigma_m, 0.0);
}

Displaced field(double sigma_m) {
  return errors(0.0, sigma_m);
}

TEST(ConsideredError, ThatAllScansShareMovesThePoseByAllOfIt) {
  Displaced scans = cloud(kShared_m);
  Displaced exact;
  scans.with_readings = exact.with_readings = false;
  const Matrix6 with = newest_covariance(*window_in_map(1e6, scans));
  const Matrix6 without = newest_covariance(*window_in_map(1e6, exact));
  const Matrix3 added = (with - without).bottomRightCorner<3, 3>();
  EXPECT_LT((added - kShared_m * kShared_m * Matrix3::Identity()).norm(), 0.05 * kShared_m * kShared_m);
  EXPECT_GT(without.trace(), 0.0);
}

TEST(ConsideredError, OfScansAndOfReadingsAreIndependent) {
  const Matrix6 with = newest_covariance(*window_in_map(1e6, errors(kShared_m, kShared_m)));
  const Matrix6 without = newest_covariance(*window_in_map(1e6, {}));
  const Matrix3 added = (with - without).bottomRightCorner<3, 3>();
  // Each map takes its share of the position: the two displacements are independent.
  EXPECT_LT(added.trace(), 3.0 * kShared_m * kShared_m);
  EXPECT_GT(added.trace(), 1.5 * kShared_m * kShared_m);
  const Matrix6 scans = newest_covariance(*window_in_map(1e6, cloud(kShared_m)));
  const Matrix6 readings = newest_covariance(*window_in_map(1e6, field(kShared_m)));
  EXPECT_LT((scans + readings - without - with).norm(), 1e-9 * with.norm());
  EXPECT_GT(without.trace(), 0.0);
}

// Brute force: a map is displaced by each source of the error, one at a time.
void expect_what_displacements_make(const Displaced& sigmas) {
  constexpr double kLength_m = 4.0;
  const auto plain = window_in_map(kLength_m, {});
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
      Displaced displaced;
      for (const auto& weight : weights) {
        const double share = source < weight.size() ? weight[source] : 0.0;
        displaced.cloud_m.emplace_back(sigmas.cloud_sigma_m * share * Vector3::Unit(axis));
        displaced.field_m.emplace_back(sigmas.field_sigma_m * share * Vector3::Unit(axis));
      }
      const auto moved = window_in_map(kLength_m, displaced);
      moved->solve();
      const Vector3 step = moved->state(newest).T_map_imu.position - plain->state(newest).T_map_imu.position;
      expected += step * step.transpose();
    }
  }
  const auto considered = window_in_map(kLength_m, sigmas);
  considered->solve();
  const Matrix3 added = (newest_covariance(*considered) - newest_covariance(*plain)).bottomRightCorner<3, 3>();
  EXPECT_LT((added - expected).norm(), 0.02 * expected.norm());
}

TEST(ConsideredError, AddsWhatEachDisplacementOfTheCloudMapMakesOfTheEstimate) {
  expect_what_displacements_make(cloud(kShared_m));
}

TEST(ConsideredError, AddsWhatEachDisplacementOfTheFieldMapMakesOfTheEstimate) {
  expect_what_displacements_make(field(kShared_m));
}

TEST(ConsideredError, StaysWithThePriorOfWhatHasLeftTheWindow) {
  for (const Displaced& sigmas : {cloud(kShared_m), field(kShared_m)}) {
    const auto whole = window_in_map(4.0, sigmas);
    const auto sliding = window_in_map(4.0, sigmas);
    for (int i = 0; i < 14; ++i) {
      sliding->marginalize_oldest();
      const Matrix6 expected = newest_covariance(*whole);
      EXPECT_LT((newest_covariance(*sliding) - expected).norm(), 1e-4 * expected.norm()) << i;
    }
    // The same by the recursion over all keyframes.
    const std::size_t all[] = {0, 1, 2, 3, 4};
    EXPECT_LT((sliding->pose_covariances(all).back() - newest_covariance(*sliding)).norm(), 1e-10);
  }
}

TEST(ConsideredError, LeavesTheEstimateAsItIs) {
  const auto with = window_in_map(4.0, errors(kShared_m, kShared_m));
  const auto without = window_in_map(4.0, {});
  with->solve();
  without->solve();
  const std::size_t newest = with->size() - 1;
  EXPECT_EQ(with->state(newest).T_map_imu.position, without->state(newest).T_map_imu.position);
}

}  // namespace
}  // namespace lodestone
