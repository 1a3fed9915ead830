// Partial solves of the window: block coordinate descent of the joint cost.
#include <gtest/gtest.h>

#include <array>

#include "core/imu/propagation.h"
#include "factors/sliding_window.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

using Part = SlidingWindow::Part;

/// Six keyframes with readings of three magnetometers that have biases, and start values with errors.
struct BiasedScene {
  static CalibrationSigmas sigmas() {
    CalibrationSigmas result = exact_calibration();
    result.magnetometers.offset_sigma_ut = 3.0;
    result.magnetometers.matrix_sigma = 0.01;
    result.magnetometers.rotation_sigma_deg = 1.0;
    return result;
  }

  BiasedScene() {
    Random random(11);
    DriveOptions options;
    options.keyframes = 6;
    const Drive truth = drive(options, random);
    const Matrix17 covariance = start_covariance();
    window = std::make_unique<SlidingWindow>(0, truth.truth[0].boxplus(random.draw(covariance)), covariance, 3,
                                             options.noise, SlidingWindowOptions{}, sigmas());
    const auto map = wavy_map();
    const std::vector<Vector3> biases{{2.0, -1.0, 0.5}, {0.0, 1.5, -2.0}, {-1.0, 0.0, 1.0}};
    for (std::size_t k = 0; k < truth.truth.size(); ++k) {
      if (k > 0) {
        const NavState predicted = propagate(window->state(k - 1), truth.samples[k], options.noise, nullptr);
        window->add_keyframe(truth.times[k], predicted, truth.samples[k]);
      }
      window->set_field(k, map, FieldInterpolation::bicubic,
                        field_readings(truth.truth[k].T_map_imu, *map, biases, 0.3, random), {});
    }
  }

  std::vector<Vector3> biases() const {
    return {window->magnetometer_bias(0, 0), window->magnetometer_bias(0, 1), window->magnetometer_bias(0, 2)};
  }

  std::unique_ptr<SlidingWindow> window;
};

TEST(WindowPart, OfStatesKeepsTheCalibrationToTheBit) {
  BiasedScene scene;
  scene.window->solve_part(Part::magnetometers);
  const std::vector<Vector3> biases = scene.biases();
  const Matrix3 matrix = scene.window->magnetometer_matrix(1);
  const NavState before = scene.window->state(5);
  scene.window->solve_part(Part::states);
  EXPECT_EQ(scene.biases(), biases);
  EXPECT_EQ(scene.window->magnetometer_matrix(1), matrix);
  EXPECT_GT(scene.window->state(5).boxminus(before).norm(), 1e-3);
}

TEST(WindowPart, OfMagnetometersKeepsTheStatesToTheBit) {
  BiasedScene scene;
  std::vector<NavState> before;
  for (std::size_t k = 0; k < scene.window->size(); ++k) before.push_back(scene.window->state(k));
  scene.window->solve_part(Part::magnetometers);
  for (std::size_t k = 0; k < before.size(); ++k) {
    const NavState after = scene.window->state(k);
    EXPECT_EQ(after.T_map_imu.position, before[k].T_map_imu.position);
    EXPECT_EQ(after.T_map_imu.rotation.coeffs(), before[k].T_map_imu.rotation.coeffs());
    EXPECT_EQ(after.velocity, before[k].velocity);
    EXPECT_EQ(after.gravity, before[k].gravity);
  }
  EXPECT_GT(scene.window->magnetometer_bias(0, 0).norm(), 0.1);
}

TEST(WindowPart, AlternationDescendsToTheCostOfTheJointSolution) {
  BiasedScene joint;
  for (int i = 0; i < 5; ++i) joint.window->solve();
  BiasedScene scene;
  double cost = scene.window->cost();
  for (int round = 0; round < 200; ++round) {
    for (const Part part : {Part::states, Part::magnetometers}) {
      scene.window->solve_part(part);
      const double after = scene.window->cost();
      EXPECT_LE(after, cost + 1e-6);
      cost = after;
    }
  }
  EXPECT_NEAR(cost, joint.window->cost(), 0.02);
}

TEST(WindowPart, LeavesAllVariablesFreeForTheNextSolve) {
  BiasedScene scene;
  scene.window->solve_part(Part::states);
  scene.window->solve_part(Part::magnetometers);
  BiasedScene joint;
  for (int i = 0; i < 5; ++i) {
    scene.window->solve();
    joint.window->solve();
  }
  EXPECT_NEAR(scene.window->cost(), joint.window->cost(), 0.02);
  EXPECT_LT((scene.biases()[0] - joint.biases()[0]).norm(), 0.05);
}

}  // namespace
}  // namespace lodestone
