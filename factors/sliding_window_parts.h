#pragma once

#include <array>
#include <vector>

#include "core/measurements.h"
#include "factors/gauss_markov_factor.h"
#include "factors/point_plane_factor.h"
#include "factors/preintegration_factor.h"
#include "factors/random_walk_factor.h"
#include "factors/sliding_window.h"

namespace lodestone {

/// Least sigma of a parameter of which others of its block are estimated: held, for all that a log may say.
inline constexpr double kHeldSigma = 1e-9;

/// Magnetometer biases over one epoch, and the walk from the epoch before.
struct SlidingWindow::BiasEpoch {
  Time start = 0;
  WindowBlock biases;
  RenewableFactor<RandomWalkFactor> walk;
  int keyframes = 0;  // how many keyframes use it
};

/// The map's error as scans share it over one stretch of the way (φ in map axes, p), and the step from the stretch
/// before.
struct SlidingWindow::MapErrorEpoch {
  Vector3 start = Vector3::Zero();  // m, map
  WindowBlock error;
  RenewableFactor<GaussMarkovFactor> step;
  int keyframes = 0;        // how many keyframes use it
  double long_decay = 0.0;  // share of the error over tens of metres that is left of the stretch before
  double long_way_m = 0.0;  // since that error changed last
};

struct SlidingWindow::Keyframe {
  Time time = 0;
  WindowBlock pose{BlockKind::pose, std::vector<double>(7)};
  WindowBlock motion{BlockKind::motion, std::vector<double>(9)};
  MotionRates rates;                          // here, as known when they were renewed last
  std::vector<ImuSample> samples;             // from the keyframe before
  ImuNoise noise;                             // of these samples
  RenewableFactor<PreintegrationFactor> imu;  // to the keyframe before
  RenewableFactor<CondensedLidarFactor> lidar;
  RenewableFactor<PointPlaneFactor> points;  // in place of `lidar`, without condensing
  bool lidar_in_prior = false;               // it leaned on a keyframe that is gone
  RenewableFactor<FieldFactor> field;
  RenewableFactor<PoseFactor> field_pose;  // in place of `field`, with measured poses
  BiasEpoch* epoch = nullptr;
  MapErrorEpoch* map_error = nullptr;

  /// The measurements of this keyframe, set or not.
  std::array<const WindowFactor*, 4> measurements() const { return {&lidar, &points, &field, &field_pose}; }
};

}  // namespace lodestone
