#pragma once

#include <span>
#include <vector>

#include "core/magnetometer/magnetic_map.h"
#include "factors/field_factor.h"
#include "factors/pose_factor.h"

namespace lodestone {

/// The paper's first step for one scan: each array sample's readings are localized by Gauss-Newton from the predicted
/// pose at t_k, with `covariance` (φ, p) as trust in it, and the results are put together into one pose with what the
/// field alone says of it: the prediction is taken out again, for the window has it already. A direction of which all
/// samples together know less than `unseen_gain` times what the prediction knows (information) gets none, instead of
/// noise. `arrays`: weighed readings of one array sample each; `weight` multiplies the information. Nothing is known (a
/// root of zero) where no reading meets the map.
MeasuredPose field_pose(std::span<const std::vector<FieldReading>> arrays, const Pose& T_map_imu,
                        const Matrix6& covariance, const MagneticMap& map, FieldInterpolation interpolation,
                        double unseen_gain);

}  // namespace lodestone
