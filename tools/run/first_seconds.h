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

/// What a run can have looked at before it begins.
struct FirstSeconds {
  std::string log;
  const Platform& platform;
  SensorChoice sensors;
  double seconds = 0.0;                               ///< of the log's begin
  std::shared_ptr<const PlaneMapSource> planes;       ///< may be null
  std::function<std::optional<Pose>(Time)> start_at;  ///< T_map_imu where a start is given; may throw InputError
};

/// The quick checks of `lodestone check` (docs/user/check.md) on a log's first seconds. Throws InputError for what
/// makes a run wrong beyond doubt; what a run would be worse for is counted as check.KIND, unless the run itself counts
/// it.
void check_first_seconds(const FirstSeconds& run, WarningLog& warnings);

}  // namespace lodestone
