#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/evaluation/statistics.h"
#include "frontends/configuration/platform_lidars.h"
#include "frontends/messages/point_cloud_decoder.h"
#include "tools/check/sensor_checks.h"

namespace lodestone {
namespace {

constexpr double span_tolerance = 0.4;  // relative to the period; a scan may be shorter, not longer
constexpr std::size_t fewest_points = 100;

bool has_time_name(const std::string& name) {
  return name == "t" || name.find("time") != std::string::npos || name.find("stamp") != std::string::npos ||
         time_part_of(name);
}

/// One LiDAR of a platform and its sample in the log.
struct LidarOfLog {
  const LogSample& log;
  const Platform& platform;
  std::size_t index;

  const LidarSample& sample() const { return log.lidars[index]; }
  const LidarMessageLayout& layout() const { return layout_of(platform, index); }
  const LidarModel& model() const { return model_of(platform, index); }
  std::string key() const { return lidar_key(index); }
};

/// Keys of the platform file that would make the cloud readable: every field with a time-like name, in every unit.
std::vector<std::string> readable_times(const LidarOfLog& lidar) {
  std::vector<std::string> found;
  if (!lidar.sample().cloud) return found;
  const std::string& given = lidar.layout().time_field;
  std::vector<std::string> names = lidar.sample().fields_of_cloud();
  std::stable_partition(names.begin(), names.end(), [&](const std::string& name) { return name == given; });
  for (const std::string& name : names) {
    if (!has_time_name(name) && name != given) continue;
    for (const auto& [unit, unit_name] : enum_names(PointTimeUnit::seconds)) {
      Platform probe = lidar.platform;
      layout_of(probe, lidar.index).point_times = PointTimes::field;
      layout_of(probe, lidar.index).time_field = name;
      layout_of(probe, lidar.index).time_unit = unit;
      WarningLog unheard;
      LidarScan scan;
      try {
        PointCloudDecoder(lidar.log.path, probe, lidar.index, unheard).decode(lidar.sample().cloud->message, scan);
      } catch (const InputError&) {
        continue;
      }
      // A wrong unit can pass the reader, but its span is not a scan period.
      if (std::abs(to_seconds(scan.end - scan.start) / lidar.model().scan_period_s - 1.0) > span_tolerance) continue;
      found.push_back(fmt::format("{0}.fields.time: {1}, {0}.time_unit: {2}", lidar.key(), name, unit_name));
    }
  }
  return found;
}

Findings check_refused(const LidarOfLog& lidar) {
  Finding finding = error_finding("lidar.point_time", *lidar.sample().refused_cloud);
  if (finding.seen.find("points' times") == std::string::npos &&
      finding.seen.find("latest point") == std::string::npos && finding.seen.find("time") == std::string::npos) {
    finding.kind = "lidar.cloud";
    return {finding};
  }
  const std::vector<std::string> keys = readable_times(lidar);
  if (!keys.empty()) {
    finding.change = keys.front() + " in " + lidar.platform.file_name();
    for (std::size_t i = 1; i < keys.size(); ++i) finding.change += "; or " + keys[i];
  }
  return {finding};
}

Findings check_spans(const LidarOfLog& lidar) {
  const std::vector<LidarScan>& scans = lidar.sample().scans;
  std::vector<double> spans;
  std::size_t sparse = 0;
  for (const LidarScan& scan : scans) {
    spans.push_back(to_seconds(scan.end - scan.start));
    if (scan.points.size() < fewest_points) ++sparse;
  }
  Findings findings;
  if (spans.empty()) return findings;
  const Time first = scans.front().start;
  const double period_s = lidar.model().scan_period_s;
  const double span_s = summarize(spans).median;
  const std::string& topic = lidar.layout().topic;
  const std::string key = lidar.key();
  if (lidar.layout().point_times == PointTimes::none) {
    // No finding: the reader gives all points one time.
  } else if (span_s <= 0.0) {
    findings.push_back({Severity::error, "lidar.point_time",
                        topic + ": all points of a scan have the same time, so the scan cannot be deskewed",
                        key + ".fields.time: the field with each point's time; record the driver's full points; or " +
                            key + ".point_times: none if the scans are deskewed already",
                        first});
  } else if (std::abs(span_s / period_s - 1.0) > span_tolerance) {
    findings.push_back(
        {Severity::warning, "lidar.point_time",
         fmt::format("{}: the points of a scan span {:.4f} s; its period is {:g} s", topic, span_s, period_s),
         fmt::format("{0}.time_unit, {0}.fields.time or {0}.scan_period_s", key), first});
  }
  if (sparse > 0) {
    findings.push_back(
        {Severity::warning, "lidar.sparse",
         fmt::format("{}: {} of {} scans have fewer than {} points between {:g} and {:g} m, thinned to 0.2 m", topic,
                     sparse, scans.size(), fewest_points, lidar.model().min_range_m, lidar.model().max_range_m),
         fmt::format("check {0}.min_range_m, {0}.max_range_m, and that x, y, z are metres", key), first});
  }
  return findings;
}

}  // namespace

Findings check_scans(const LogSample& sample, const Platform& platform) {
  Findings findings;
  for (std::size_t index = 0; index < sample.lidars.size(); ++index) {
    const LidarOfLog lidar{sample, platform, index};
    if (lidar.sample().refused_cloud) append(findings, check_refused(lidar));
    append(findings, check_spans(lidar));
    if (lidar.sample().empty_scans == 0) continue;
    findings.push_back({Severity::warning, "lidar.empty",
                        fmt::format("{}: {} scans have no points", lidar.layout().topic, lidar.sample().empty_scans),
                        "check whether the sensor is covered or stopped", lidar.sample().first_empty_scan});
  }
  return findings;
}

}  // namespace lodestone
