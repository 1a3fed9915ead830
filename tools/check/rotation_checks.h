#pragma once

#include <optional>

#include "frontends/configuration/platform.h"
#include "tools/check/finding.h"
#include "tools/check/rotation_fit.h"

namespace lodestone {

/// Offset of clocks, unit of the turn rate, direction of T_imu_lidar, a step of the gyroscope's bias. Of a further
/// LiDAR (its index above 0) what concerns itself alone.
Findings check_rotation(const std::optional<RotationFit>& fit, const Platform& platform, std::size_t lidar = 0);

}  // namespace lodestone
