#pragma once

#include <functional>
#include <optional>

#include "core/lidar/plane_map_source.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"
#include "tools/check/scan_odometry.h"

namespace lodestone {

/// A place on the map where the scan fits, found without the start that was given.
struct PlaceOnMap {
  Pose T_map_imu;
  double share = 0.0;  ///< of the scan's points that fit there
  bool sure = false;   ///< no other place fits about as well
};

/// The start as a check sees it. All must outlive it.
struct StartMaterial {
  const LogSample& sample;
  const Platform& platform;
  const ScanOdometry& odometry;
  const PlaneMapSource& map;
  Pose start;  ///< T_map_imu as given, at the first scan
  std::function<std::optional<PlaceOnMap>()>
      find_anywhere;  ///< takes seconds; asked only where the start does not fit; may be null
};

/// Lays the first scan on the map at the start: how much of it fits, how far off the start is, whether T_imu_lidar fits
/// as given or as its inverse, whether gravity stands upright on the map. Where nothing fits, what would: another
/// start.
Findings check_start(const StartMaterial& material);

/// Without a map: the floor that the first scan shows against gravity, with T_imu_lidar as given and as its inverse.
Findings check_floor(const LogSample& sample, const Platform& platform, const ScanOdometry& odometry);

}  // namespace lodestone
