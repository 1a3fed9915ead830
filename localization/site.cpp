#include "localization/site.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "core/error.h"
#include "core/lidar/scan_sampling.h"
#include "core/thread_limit.h"
#include "frontends/configuration/magnetometer_choice.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/plane_map_loader.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/synchronizer.h"
#include "localization/read_ahead.h"

namespace lodestone {

namespace {

/// Reads a log's bundles and, where they are read ahead, samples their scans.
struct LogReader {
  LogReader(const std::string& log, const Site& site)
      : source(log, site.platform, warnings, site.sensors),
        synchronizer(source, site.platform.suite, warnings, site.sensors),
        lidars(site.sensors.lidar ? site.platform.suite.lidars() : std::vector<LidarModel>()),
        sampling(site.options.lidar.sampling) {}

  bool read(ScanBundle& bundle) {
    const bool any = synchronizer.next(bundle);
    if (any && !lidars.empty() && usable_threads() > 1) bundle.sampled = sample_scan(bundle.scan, lidars, sampling);
    return any;
  }

  WarningLog warnings;  // not given to the caller yet
  BagSource source;
  Synchronizer synchronizer;
  std::vector<LidarModel> lidars;
  ScanSamplingOptions sampling;
};

}  // namespace

SensorChoice sensors_for(const MapFiles& files) {
  return {.lidar = !files.cloud.empty(), .magnetometers = !files.magnetic.empty()};
}

Site site_without_maps(Platform platform, const RunOptions& options, const MapFiles& files,
                       std::optional<double> max_range_m) {
  if (files.cloud.empty() && files.magnetic.empty()) {
    throw InputError("no map: set --cloud MAP.pcd, --magnetic FIELD.yaml, or both");
  }
  if (max_range_m && !(*max_range_m > 0.0)) {
    throw InputError(fmt::format("--max-range: expected metres above 0, found {}", *max_range_m));
  }
  Site site{std::move(platform), options, files};
  if (!files.magnetic.empty()) choose_magnetometers(options.magnetic.magnetometers, site.platform);
  if (max_range_m) site.platform.suite.set_max_range(*max_range_m);
  site.sensors = sensors_for(files);
  site.sensors.wheels = options.wheels.enabled;
  return site;
}

std::string load_cloud(Site& site, const std::string& folder) {
  const LoadedPlanes loaded = load_planes(site.files.cloud, site.options.lidar.map, site.platform.suite.lidars(),
                                          folder, site.warnings, site.files.origin_m);
  site.planes = loaded.source;
  return loaded.description;
}

std::string load_field(Site& site) {
  site.field = std::make_shared<MagneticMap>(
      read_magnetic_map(site.files.magnetic, site.options.magnetic.map.max_bytes(), site.files.origin_m));
  if (site.platform.magnetometers.empty()) {
    throw InputError(
        fmt::format("{}: there are no magnetometers, but --magnetic requires them; add them under 'magnetometers', or "
                    "omit --magnetic",
                    site.platform.file_name()));
  }
  const FieldGrid& grid = site.field->grid();
  return fmt::format("{} x {} nodes of {:g} m, {} layer{}", grid.columns, grid.rows, grid.resolution_m,
                     grid.heights_m.size(), grid.heights_m.size() == 1 ? "" : "s");
}

Site load_site(const std::string& platform_file, const RunOptions& options, const MapFiles& files,
               std::optional<double> max_range_m) {
  Site site = site_without_maps(load_platform(platform_file, sensors_for(files)), options, files, max_range_m);
  if (!files.cloud.empty()) load_cloud(site, std::filesystem::temp_directory_path().string());
  if (!files.magnetic.empty()) load_field(site);
  return site;
}

OpenedLog open_bundles(MeasurementSource& source, const Site& site, WarningLog& warnings) {
  const auto synchronizer = std::make_shared<Synchronizer>(source, site.platform.suite, warnings, site.sensors);
  return {source.begin_time(), source.end_time(),
          [synchronizer](ScanBundle& bundle) { return synchronizer->next(bundle); }};
}

OpenedLog open_bundles(const std::string& log, const Site& site, WarningLog& warnings) {
  const auto reader = std::make_shared<LogReader>(log, site);
  warnings.add(std::exchange(reader->warnings, {}));
  const auto read = [reader](ScanBundle& bundle) { return reader->read(bundle); };
  const auto ahead = std::make_shared<ReadAhead>(read, reader->warnings, warnings);
  return {reader->source.begin_time(), reader->source.end_time(),
          [ahead](ScanBundle& bundle) { return ahead->next(bundle); }};
}

EstimatorInput estimator_input(const Site& site, const Pose& T_map_imu, WarningLog* warnings) {
  return {site.platform.suite, site.planes, site.field, T_map_imu, Vector3::Zero(),
          site.options,        warnings,    nullptr,    {}};
}

}  // namespace lodestone
