#pragma once

#include <span>
#include <vector>

#include "core/magnetometer/magnetic_map.h"
#include "factors/field_factor.h"
#include "factors/pose_factor.h"

namespace lodestone {

/// The paper's first step for one scan: localizes each array sample by Gauss-Newton from the predicted pose at t_k,
/// with `covariance` (φ, p) as prior, and combines the results to one pose with the information of the field alone. The
/// prior is subtracted again, because the window already contains it. A direction whose information from all samples is
/// below `unseen_gain` times that of the prediction gets no information. `arrays`: weighted readings, one array sample
/// each; `weight` scales the information. If no reading is on the map, the information root is zero.
MeasuredPose field_pose(std::span<const std::vector<FieldReading>> arrays, const Pose& T_map_imu,
                        const Matrix6& covariance, const MagneticMap& map, FieldInterpolation interpolation,
                        double unseen_gain);

}  // namespace lodestone
