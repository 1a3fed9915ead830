#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/geometry/trajectory.h"
#include "core/lidar/plane_map_source.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "tools/export/packed_cloud.h"

namespace lodestone {

/// A scan of the log with each point in the map frame.
struct DeskewedScan {
  Time end = 0;
  PackedCloud cloud;
};

/// Streams the scans of a log. Each point is transformed with the pose at the point's own time, interpolated on the
/// trajectory between scan ends. Points before the first pose, after the last one, or in gaps are discarded.
class DeskewedScans {
 public:
  /// `trajectory` must outlive this. With `planes`, each point has the field residual_m: its distance from the plane
  /// that it belongs to, positive on the side of the LiDAR, NaN without a plane. Throws InputError if the log or its
  /// scans cannot be read.
  DeskewedScans(const std::string& log, const Platform& platform, const Trajectory& trajectory,
                std::shared_ptr<const PlaneMapSource> planes);
  ~DeskewedScans();

  /// The next scan with points; empty at the end of the log.
  std::optional<DeskewedScan> next();

  const WarningLog& warnings() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone
