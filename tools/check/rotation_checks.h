#pragma once

#include <optional>

#include "frontends/configuration/platform.h"
#include "tools/check/finding.h"
#include "tools/check/rotation_fit.h"

namespace lodestone {

/// Checks clock offset, unit of the turn rate, rotation of T_imu_lidar, and steps of the gyroscope's bias. For a
/// further LiDAR (index above 0), only findings about that LiDAR.
Findings check_rotation(const std::optional<RotationFit>& fit, const Platform& platform, std::size_t lidar = 0);

}  // namespace lodestone
