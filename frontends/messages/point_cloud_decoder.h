#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "frontends/messages/point_columns.h"
#include "frontends/messages/point_fields.h"
#include "frontends/messages/point_times.h"
#include "frontends/messages/ros_messages.h"

namespace lodestone {

/// Converts the clouds of one topic to scans. Fields are checked once, then read column by column.
///
/// Settings that the platform file omits are inferred from the first suitable scan, reported once in `warnings`
/// ("lidar.told_from_content") and kept: a field with the name of a time and a span that fits the scan's period, its
/// unit, and the meaning of zero (point_times.h); intensity and ring by their names. Livox' PointCloud2 and CustomMsg
/// are known.
///
/// Rows of organized clouds may be padded (row_step). Points that are not finite are dropped and counted
/// ("lidar.nan_points"), as are points farther than 131 km ("lidar.far_points"). Points at the exact origin, which mean
/// "no return" in organized clouds, are also dropped. A scan without points keeps its stamp and gets the nominal period
/// ("lidar.empty_scan"). The same applies to a scan during which the LiDAR's clock jumps ("lidar.clock_jump"), and to a
/// scan with too few points to infer omitted settings.
///
/// With point_times: none, there is no time field, and a scan, empty or not, begins and ends at its stamp.
class PointCloudDecoder {
 public:
  /// For the platform's first LiDAR. `source` names the file in messages. `warnings` must outlive this.
  PointCloudDecoder(std::string source, const Platform& platform, WarningLog& warnings);

  /// For the LiDAR with this index: 0 is the first, then the further ones.
  PointCloudDecoder(std::string source, const Platform& platform, std::size_t lidar, WarningLog& warnings);

  /// Throws InputError if a field is missing (with the available fields) or has an invalid type, the sizes are
  /// inconsistent, or the points' times contradict the scan's period.
  void decode(const ros1::PointCloudMessage& message, LidarScan& scan);
  void decode(const ros1::LivoxMessage& message, LidarScan& scan);

  /// The layout with all that the scans have determined; nothing before. Livox' messages describe themselves: their
  /// layout names no fields, and no unit and zero of the times.
  std::optional<LidarMessageLayout> determined_layout() const;

 private:
  [[noreturn]] void fail(const ros1::PointCloudMessage& message, const std::string& what) const;
  [[noreturn]] void fail_unit(const ros1::PointCloudMessage& message, double span_s) const;
  bool apply_livox_fields(const ros1::PointCloudMessage& message);
  const ros1::PointCloudMessage& without_padding(const ros1::PointCloudMessage& message);
  void decode_compact(const ros1::PointCloudMessage& message, LidarScan& scan);
  bool is_deskewed() const { return layout_.point_times == PointTimes::none; }
  std::string deskewed_hint() const;
  bool fields_match(const ros1::PointCloudMessage& message) const;
  void resolve_fields(const ros1::PointCloudMessage& message);
  std::size_t point_count(const ros1::PointCloudMessage& message);
  bool infer_reading(const ros1::PointCloudMessage& message, const LidarScan& scan);
  PointTimeStatistics measure_times(const ros1::PointCloudMessage& message, const PointColumn& column,
                                    const LidarScan& scan) const;
  void read_points(const ros1::PointCloudMessage& message, std::size_t count, LidarScan& scan);
  void read_times(const ros1::PointCloudMessage& message, std::size_t count);
  void keep_returns(const ros1::PointCloudMessage& message, LidarScan& scan);
  void assign_times(const ros1::PointCloudMessage& message, LidarScan& scan);
  void keep_empty(const ros1::PointCloudMessage& message, LidarScan& scan, const char* kind, const char* detail);

  std::string source_;
  LidarMessageLayout layout_;
  std::string platform_file_;
  std::string keys_;  ///< key of this LiDAR in the platform file: "lidar"
  bool livox_ = false;
  Time period_ns_;
  WarningLog& warnings_;

  std::vector<ros1::PointField> known_fields_;  ///< the fields for which the columns below are valid
  std::uint32_t known_step_ = 0;
  bool step_is_known_ = false;  ///< set by a message with points, because only its size determines the layout
  PointFields fields_;
  PointColumn time_;  ///< one of fields_.times
  std::optional<PointTimeReading> reading_;
  bool reading_is_final_ = false;  ///< valid for all scans; otherwise of one sparse scan
  Time time_origin_ = 0;           ///< added to the points' times to make them absolute
  std::vector<Time> times_;        ///< of the points, ns, as in the message
  ros1::PointCloudMessage livox_cloud_;
  ros1::PointCloudMessage compact_cloud_;  ///< the last message with padded rows, without padding
  std::vector<std::uint8_t> compact_data_;
};

}  // namespace lodestone
