#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/lidar/plane_map_source.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/sensor_choice.h"

namespace lodestone {

/// Inputs of the check before a run.
struct FirstSeconds {
  std::string log;
  const Platform& platform;
  SensorChoice sensors;
  double seconds = 0.0;                               ///< duration of the checked part
  std::shared_ptr<const PlaneMapSource> planes;       ///< may be null
  std::function<std::optional<Pose>(Time)> start_at;  ///< T_map_imu, if an initial pose is given; may throw InputError
  Vector3 origin_m = Vector3::Zero();                 ///< added to proposed poses
};

/// The quick checks of `lodestone check` (docs/user/check.md) on a log's first seconds. Throws InputError for errors
/// that certainly make a run wrong. Other findings are counted as check.KIND, except those that the run itself counts.
void check_first_seconds(const FirstSeconds& run, WarningLog& warnings);

}  // namespace lodestone
