#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/lidar/plane_map_source.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/measurement_source.h"
#include "core/warnings.h"
#include "estimators/factory.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/sensor_choice.h"

namespace lodestone {

/// Prior maps of a site.
struct MapFiles {
  std::string cloud{};                 ///< point cloud: PCD, PLY or LAS; empty: LiDAR is not used
  std::string magnetic{};              ///< magnetic map, YAML; empty: magnetometers are not used
  Vector3 origin_m = Vector3::Zero();  ///< of the site, in the maps' coordinates; subtracted when they are read
};

/// What all estimators of a log share: the robot's sensors, the options and the maps. Copies share the maps.
struct Site {
  Platform platform;     ///< with the magnetometers and the range that are used
  RunOptions options{};  ///< of the estimators
  MapFiles files{};      ///< named in messages
  SensorChoice sensors{};
  std::shared_ptr<const PlaneMapSource> planes{};  ///< of the cloud map; null: LiDAR is not used
  std::shared_ptr<const MagneticMap> field{};      ///< null: magnetometers are not used
  WarningLog warnings{};                           ///< of loading the maps
};

/// The sensors that these maps serve. A platform file may lack the others.
SensorChoice sensors_for(const MapFiles& files);

/// A site whose maps are not loaded. `max_range_m` replaces the largest range of every LiDAR. Throws InputError if
/// `files` names no map, if the range is not above 0, or if options.magnetic.magnetometers names an unknown one.
Site site_without_maps(Platform platform, const RunOptions& options, const MapFiles& files,
                       std::optional<double> max_range_m = std::nullopt);

/// Loads the cloud map. A map too large for memory is kept in a temporary file in `folder`. Returns the number of
/// planes and their storage, as text. Throws as load_planes.
std::string load_cloud(Site& site, const std::string& folder);

/// Opens the magnetic map. Returns its size as text. Throws as read_magnetic_map, and InputError if the platform has no
/// magnetometer.
std::string load_field(Site& site);

/// A site with its maps: platform file, options, files of the maps. Throws InputError, as the functions above.
Site load_site(const std::string& platform_file, const RunOptions& options, const MapFiles& files,
               std::optional<double> max_range_m = std::nullopt);

/// A log as a sequence of bundles.
struct OpenedLog {
  Time begin = 0;
  Time end = 0;
  std::function<bool(ScanBundle&)> next;  ///< the next bundle; false at the end of the log
};

/// Opens a log of any supported format. `site` may lack its maps. `warnings` must outlive the result. Throws InputError
/// as BagSource.
OpenedLog open_bundles(const std::string& log, const Site& site, WarningLog& warnings);

/// The bundles of a source, which must outlive the result.
OpenedLog open_bundles(MeasurementSource& source, const Site& site, WarningLog& warnings);

/// The input of an estimator at this site that begins with `T_map_imu` at the first scan's start.
EstimatorInput estimator_input(const Site& site, const Pose& T_map_imu, WarningLog* warnings);

}  // namespace lodestone
