#include "frontends/checks/scan_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/evaluation/statistics.h"
#include "frontends/readers/point_cloud_decoder.h"

namespace lodestone {
namespace {

constexpr double span_tolerance = 0.4;  // of the period: a scan may be cut off, not stretched
constexpr std::size_t fewest_points = 100;

bool sounds_like_time(const std::string& name) {
  return name == "t" || name.find("time") != std::string::npos || name.find("stamp") != std::string::npos;
}

/// Which keys of the platform file would make the cloud readable: every field that sounds like a time, in every unit.
std::vector<std::string> readable_times(const LogSample& sample, const Platform& platform) {
  std::vector<std::string> found;
  if (!sample.cloud) return found;
  std::vector<std::string> names = sample.fields_of_cloud();
  std::stable_partition(names.begin(), names.end(),
                        [&](const std::string& name) { return name == platform.lidar.time_field; });
  for (const std::string& name : names) {
    if (!sounds_like_time(name) && name != platform.lidar.time_field) continue;
    for (const auto& [unit, unit_name] : enum_names(PointTimeUnit::seconds)) {
      Platform probe = platform;
      probe.lidar.time_field = name;
      probe.lidar.time_unit = unit;
      WarningLog unheard;
      LidarScan scan;
      try {
        PointCloudDecoder(sample.path, probe, unheard).decode(sample.cloud->message, scan);
      } catch (const InputError&) {
        continue;
      }
      // Units beside the right one give spans that pass the reader and are no scan all the same.
      if (std::abs(to_seconds(scan.end - scan.start) / platform.suite.lidar.scan_period_s - 1.0) > span_tolerance)
        continue;
      found.push_back(fmt::format("lidar.fields.time: {}, lidar.time_unit: {}", name, unit_name));
    }
  }
  return found;
}

Findings check_refused(const LogSample& sample, const Platform& platform) {
  Finding finding = error_finding("lidar.point_time", *sample.refused_cloud);
  if (finding.seen.find("points' times") == std::string::npos &&
      finding.seen.find("latest point") == std::string::npos && finding.seen.find("time") == std::string::npos) {
    finding.kind = "lidar.cloud";
    return {finding};
  }
  const std::vector<std::string> keys = readable_times(sample, platform);
  if (!keys.empty()) {
    finding.change = keys.front() + " in " + platform.file_name();
    for (std::size_t i = 1; i < keys.size(); ++i) finding.change += "; or " + keys[i];
  }
  return {finding};
}

Findings check_spans(const LogSample& sample, const Platform& platform) {
  std::vector<double> spans;
  std::size_t sparse = 0;
  for (const LidarScan& scan : sample.scans) {
    spans.push_back(to_seconds(scan.end - scan.start));
    if (scan.points.size() < fewest_points) ++sparse;
  }
  Findings findings;
  if (spans.empty()) return findings;
  const Time first = sample.scans.front().start;
  const double period_s = platform.suite.lidar.scan_period_s;
  const double span_s = summarize(spans).median;
  const std::string& topic = platform.lidar.topic;
  if (span_s <= 0.0) {
    findings.push_back({Severity::error, "lidar.point_time",
                        topic + ": all points of a scan have the same time: the scan cannot be undistorted",
                        "lidar.fields.time: the field with each point's own time; record the driver's full points",
                        first});
  } else if (std::abs(span_s / period_s - 1.0) > span_tolerance) {
    findings.push_back(
        {Severity::warning, "lidar.point_time",
         fmt::format("{}: the points of a scan span {:.4f} s; its period is {:g} s", topic, span_s, period_s),
         "lidar.time_unit, lidar.fields.time or lidar.scan_period_s", first});
  }
  if (sparse > 0) {
    findings.push_back({Severity::warning, "lidar.sparse",
                        fmt::format("{}: {} of {} scans have fewer than {} points, thinned to 0.2 m, between {:g} and {:g} m", topic,
                                    sparse, sample.scans.size(), fewest_points, platform.suite.lidar.min_range_m,
                                    platform.suite.lidar.max_range_m),
                        "lidar.min_range_m and lidar.max_range_m; are x, y, z metres?", first});
  }
  return findings;
}

}  // namespace

Findings check_scans(const LogSample& sample, const Platform& platform) {
  Findings findings;
  if (sample.refused_cloud) append(findings, check_refused(sample, platform));
  append(findings, check_spans(sample, platform));
  if (sample.empty_scans > 0) {
    findings.push_back({Severity::warning, "lidar.empty",
                        fmt::format("{}: {} scans have no point", platform.lidar.topic, sample.empty_scans),
                        "check the sensor: it is covered, or stopped", sample.first_empty_scan});
  }
  return findings;
}

}  // namespace lodestone
