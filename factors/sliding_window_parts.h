#pragma once

#include <vector>

#include "core/measurements.h"
#include "factors/sliding_window.h"

namespace lodestone {

/// Magnetometer biases over one epoch, and the walk from the epoch before.
struct SlidingWindow::BiasEpoch {
  Time start = 0;
  WindowBlock biases;
  WindowFactor walk;
  int keyframes = 0;  // how many keyframes use it
};

struct SlidingWindow::Keyframe {
  Time time = 0;
  WindowBlock pose{BlockKind::pose, std::vector<double>(7)};
  WindowBlock motion{BlockKind::motion, std::vector<double>(9)};
  std::vector<ImuSample> samples;  // from the keyframe before
  WindowFactor imu;                // to the keyframe before
  WindowFactor lidar;
  bool lidar_in_prior = false;     // it leaned on a keyframe that is gone
  WindowFactor field;
  BiasEpoch* epoch = nullptr;
};

}  // namespace lodestone
