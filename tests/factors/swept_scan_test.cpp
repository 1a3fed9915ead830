// Scans of a moving robot, deskewed by the same noisy IMU that connects the keyframes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "core/imu/propagation.h"
#include "factors/sliding_window.h"
#include "tests/factors/swept_room.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

struct Nees {
  double causal = 0.0;
  double smoothed = 0.0;
};

/// NEES per degree of freedom, over drives with the factors' noise. `knows`: whether the factor models the errors of
/// deskewing.
Nees nees_of_drives(int runs, bool knows) {
  constexpr std::size_t kWindow = 15;
  Nees result;
  for (int run = 0; run < runs; ++run) {
    Random random(300 + static_cast<std::uint64_t>(run));
    DriveOptions options;
    options.keyframes = 30;
    const Drive truth = drive(options, random);
    const std::vector<Vector3> normals = room_normals(random);
    const Matrix17 covariance = start_covariance();
    SlidingWindow window(0, truth.truth[0].boxplus(random.draw(covariance)), covariance, 0, options.noise, {});
    for (std::size_t k = 1; k < truth.truth.size(); ++k) {
      window.add_keyframe(truth.times[k],
                          propagate(window.state(window.size() - 1), truth.samples[k], options.noise, nullptr),
                          truth.samples[k]);
      const std::size_t newest = window.size() - 1;
      const Sweep sweep = sweep_of(truth.between[k], normals, 6, random);
      for (int pass = 0; pass < 2; ++pass) {
        const NavState state = window.state(newest);
        const ScanMotion motion(window.state(newest - 1), state, truth.samples[k]);
        const std::vector<Correspondence> matches = deskewed(sweep, motion, options.period_s, truth.between[k].size());
        window.set_lidar(
            newest,
            condense_scan(matches, state.T_map_imu, knows ? Deskewing(state, motion, options.noise) : Deskewing{}),
            matches, {});
        window.solve();
      }
      if (window.size() > kWindow) window.marginalize_oldest();
    }
    const auto nees = [&](std::size_t k) {
      const Vector6 error =
          window.state(k).T_map_imu.boxminus(truth.truth[truth.truth.size() - window.size() + k].T_map_imu);
      return error.dot(window.pose_covariances(std::array<std::size_t, 1>{k}).front().ldlt().solve(error)) /
             (6.0 * runs);
    };
    result.causal += nees(window.size() - 1);
    result.smoothed += nees(0);
  }
  return result;
}

TEST(SweptScans, TheWindowsCovarianceIsThatOfItsErrors) {
  constexpr int kRuns = 100;
  const Nees nees = nees_of_drives(kRuns, true);
  std::printf("NEES per degree of freedom: %.3f causal, %.3f smoothed\n", nees.causal, nees.smoothed);
  // Four sigmas of a mean of χ² values, and a twentieth for neglected modes of the bridge and second-order effects.
  const double spread = 4.0 * std::sqrt(2.0 / (6.0 * kRuns));
  for (const double value : {nees.causal, nees.smoothed}) {
    EXPECT_GT(value, 1.0 - spread);
    EXPECT_LT(value, 1.05 + spread);
  }
}

TEST(SweptScans, TakenAtOnceTheyPretendToKnowMore) {
  const Nees nees = nees_of_drives(20, false);
  std::printf("NEES per degree of freedom: %.3f causal, %.3f smoothed\n", nees.causal, nees.smoothed);
  EXPECT_GT(nees.causal, 2.0);
  EXPECT_GT(nees.smoothed, 2.0);
}

}  // namespace
}  // namespace lodestone
