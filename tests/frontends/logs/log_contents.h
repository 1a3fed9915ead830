#pragma once

#include <string>
#include <vector>

#include "frontends/synchronizer/bag_source.h"

namespace lodestone::testing {

/// All measurements of a log.
struct Contents {
  std::vector<LidarScan> scans;
  std::vector<ImuSample> imu;
  std::vector<MagneticSample> fields;
  std::vector<WheelSample> wheels;
  WarningLog warnings;
  Time begin = 0;
  Time end = 0;
};

/// The first sample of one magnetometer: several may have been recorded at the same time, in any order.
inline Vector3 first_field(const Contents& contents, int magnetometer) {
  for (const MagneticSample& sample : contents.fields) {
    if (sample.magnetometer == magnetometer) return sample.field_ut;
  }
  return Vector3::Zero();
}

inline Contents read_all(const std::string& path, const Platform& platform, SensorChoice choice = {}) {
  Contents contents;
  BagSource source(path, platform, contents.warnings, choice);
  contents.begin = source.begin_time();
  contents.end = source.end_time();
  Measurement measurement;
  while (source.next(measurement)) {
    if (auto* scan = std::get_if<LidarScan>(&measurement)) contents.scans.push_back(std::move(*scan));
    if (auto* imu = std::get_if<ImuSample>(&measurement)) contents.imu.push_back(*imu);
    if (auto* field = std::get_if<MagneticSample>(&measurement)) contents.fields.push_back(*field);
    if (auto* wheels = std::get_if<WheelSample>(&measurement)) contents.wheels.push_back(*wheels);
  }
  return contents;
}

}  // namespace lodestone::testing
