#pragma once

#include "factors/calibration_estimate.h"
#include "frontends/configuration/platform.h"

namespace lodestone {

/// `platform` with the calibration that a run estimated, so that the next run's corrections are zero:
///
/// - T_imu_lidar is (Exp(turn) R, t + shift). Further LiDARs move with the first, and so do their clock offsets.
/// - T_imu_mag is T Exp(θ), and soft_iron_correction is Exp(−θ) (1 + E)⁻¹ C. With C (reading − hard iron) =
///   b + (1 + E) field follows C' (reading − hard iron) = b' + Exp(−θ) field: exactly, not to first order.
/// - The wheels' scale becomes scale (1 + s), and T_imu_wheels is T Exp(θ).
/// - Clock offsets grow by the clocks' corrections.
///
/// A sigma of the file is common to several axes and magnetometers: it becomes the largest of their remaining sigmas,
/// and never grows. Parameters that were not estimated keep value and sigma. If the run did not use all magnetometers,
/// their sigmas are unchanged.
///
/// `suite`: of the run. Its magnetometers, in the order of `estimate`, are identified in `platform` by name.
Platform calibrated_platform(Platform platform, const SensorSuite& suite, const CalibrationEstimate& estimate);

}  // namespace lodestone
