#pragma once

#include <vector>

#include "core/measurements.h"
#include "factors/gauss_markov_factor.h"
#include "factors/point_plane_factor.h"
#include "factors/preintegration_factor.h"
#include "factors/random_walk_factor.h"
#include "factors/sliding_window.h"
#include "factors/slip_factor.h"
#include "factors/wheel_factor.h"

namespace lodestone {

/// Sigma of a constant parameter within a block of which other parameters are estimated.
inline constexpr double kHeldSigma = 1e-9;

/// Magnetometer biases over one epoch, and the random walks from the previous epoch: one each per magnetometer.
struct SlidingWindow::BiasEpoch {
  Time start = 0;
  std::vector<WindowBlock> biases;
  std::vector<RenewableFactor<RandomWalkFactor>> walks;  // empty: the biases are constant
  int keyframes = 0;                                     // number of keyframes that use it
};

/// The map error that scans share over one stretch of the path (φ in map axes, p), and the step from the previous
/// stretch.
struct SlidingWindow::MapErrorEpoch {
  Vector3 start = Vector3::Zero();  // m, map
  WindowBlock error;
  RenewableFactor<GaussMarkovFactor> step;
  int keyframes = 0;        // number of keyframes that use it
  double long_decay = 0.0;  // correlation of the error over tens of metres with that of the previous stretch
  double long_way_m = 0.0;  // path since that error changed last
};

/// The wheels' slip over one epoch, and the step from the previous epoch.
struct SlidingWindow::SlipEpoch {
  Time start = 0;
  WindowBlock slip;
  RenewableFactor<SlipFactor> step;
  int keyframes = 0;  // number of keyframes that use it
};

/// Variables of a keyframe, and its factors. Its measurements are those of the estimator.
struct SlidingWindow::KeyframeFactors {
  Time time = 0;
  WindowBlock pose{BlockKind::pose, std::vector<double>(7)};
  WindowBlock motion{BlockKind::motion, std::vector<double>(9)};
  MotionRates rates;                          // at this keyframe, as of their last update
  std::vector<ImuSample> samples;             // from the previous keyframe
  ImuNoise noise;                             // of these samples
  RenewableFactor<PreintegrationFactor> imu;  // to the previous keyframe
  RenewableFactor<CondensedLidarFactor> lidar;
  RenewableFactor<PointPlaneFactor> points;          // instead of `lidar`, without condensing
  bool lidar_in_prior = false;                       // its factor depended on a keyframe that has left the window
  std::vector<RenewableFactor<FieldFactor>> fields;  // one per magnetometer, or none
  RenewableFactor<PoseFactor> field_pose;            // instead of `fields`, with measured poses
  RenewableFactor<WheelFactor> wheels;
  BiasEpoch* epoch = nullptr;
  SlipEpoch* slip = nullptr;
  MapErrorEpoch* map_error = nullptr;

  /// The measurements of this keyframe, set or not.
  std::vector<const WindowFactor*> measurements() const {
    std::vector<const WindowFactor*> result{&lidar, &points};
    for (const WindowFactor& field : fields) result.push_back(&field);
    result.insert(result.end(), {&field_pose, &wheels});
    return result;
  }
};

}  // namespace lodestone
