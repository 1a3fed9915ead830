#pragma once

#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/warnings.h"
#include "frontends/readers/platform.h"
#include "frontends/readers/ros1/messages.h"

namespace lodestone {

/// Turns the clouds of one topic into scans: checks the fields once, then reads column by column.
///
/// Clouds of a Livox need no keys of the platform file: a CustomMsg's fields are known, and a PointCloud2 whose platform
/// names no time field is read as Livox' where it has that layout. Their points are placed by absolute times.
///
/// Points that are not finite are dropped and counted ("lidar.nan_points"); points at the exact origin, which is how
/// organized clouds say "no return", are dropped as well. A scan without points keeps its stamp and gets the nominal
/// period ("lidar.empty_scan").
class PointCloudDecoder {
 public:
  /// `source` names the file in messages. `warnings` must outlive this.
  PointCloudDecoder(std::string source, const Platform& platform, WarningLog& warnings);

  /// Throws InputError where a field is missing (listing those that are there) or of a type that cannot be, the sizes
  /// disagree, or the per-point times contradict the scan's period.
  void decode(const ros1::PointCloudMessage& message, LidarScan& scan);
  void decode(const ros1::LivoxMessage& message, LidarScan& scan);

 private:
  struct Column {
    std::uint32_t offset = 0;
    std::uint8_t datatype = 0;  ///< 0: absent
  };

  [[noreturn]] void fail(const ros1::PointCloudMessage& message, const std::string& what) const;
  void take_livox_fields(const char* intensity, const char* time);
  void resolve_fields(const ros1::PointCloudMessage& message);
  Column find_column(const ros1::PointCloudMessage& message, const std::string& name, const char* key,
                     bool floating_only) const;
  std::size_t point_count(const ros1::PointCloudMessage& message);
  void read_points(const ros1::PointCloudMessage& message, std::size_t count, LidarScan& scan);
  void keep_returns(const ros1::PointCloudMessage& message, LidarScan& scan);
  void place_in_time(const ros1::PointCloudMessage& message, LidarScan& scan);

  std::string source_;
  LidarMessageLayout layout_;
  std::string platform_file_;
  const char* time_keys_ = "lidar.time_unit or lidar.fields.time";  ///< what to change where times cannot be
  Time period_ns_;
  WarningLog& warnings_;

  std::vector<ros1::PointField> known_fields_;  ///< the fields that the columns below were found in
  std::uint32_t known_step_ = 0;
  std::uint32_t step_ = 0;
  Column x_, y_, z_, intensity_, ring_, time_;
  Time time_origin_ = 0;     ///< added to the points' times, which are absolute then
  std::vector<Time> times_;  ///< of the points, in ns as the message gives them
  ros1::PointCloudMessage livox_cloud_;
};

}  // namespace lodestone
