#pragma once

#include <span>
#include <vector>

#include "core/imu/scan_motion.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/measurements.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// One array sample's localization, brought to the scan's end: the first step of the paper's two-step magnetic update.
struct MagneticPose {
  Pose T_map_imu;                         ///< at t_k
  Matrix6 information = Matrix6::Zero();  ///< R_n⁻¹, order φ, p; singular if the field does not observe all directions
};

struct MagneticPoses {
  std::vector<MagneticPose> poses;
  int off_map = 0;               ///< single readings off the map
  double residual_rms_ut = 0.0;  ///< of measured minus map at the localized poses
};

/// Localizes every array sample alone (Gauss-Newton from the propagated pose, with `covariance` as prior), moves each
/// result to the scan's end by the IMU's relative motion, and computes R from the spread of the results plus the
/// covariance from the field alone (paper, section "Magnetometer Synchronization"; docs/design/architecture.md).
MagneticPoses localize_samples(std::span<const MagneticArraySample> samples, const ScanMotion& motion,
                               const Matrix6& covariance, const SensorSuite& suite, const MagneticMap& map,
                               FieldInterpolation interpolation, bool map_sigma);

}  // namespace lodestone
