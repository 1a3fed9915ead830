#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/warnings.h"
#include "frontends/configuration/platform.h"
#include "frontends/logs/ros1/messages.h"
#include "frontends/messages/point_columns.h"
#include "frontends/messages/point_fields.h"
#include "frontends/messages/point_times.h"

namespace lodestone {

/// Turns the clouds of one topic into scans: checks the fields once, then reads column by column.
///
/// What the platform file leaves out is told from the first scan that shows it, said once in `warnings`
/// ("lidar.told_from_content") and kept: a field that is called like a time and whose span fits the scan's period, its
/// unit, and what its zero means (point_times.h); intensity and ring by their names. A Livox' PointCloud2 and CustomMsg
/// are known and need no word.
///
/// The rows of an organized cloud may be padded (row_step). Points that are not finite are dropped and counted
/// ("lidar.nan_points"); points at the exact origin, which is how organized clouds say "no return", are dropped as
/// well. A scan without points keeps its stamp and gets the nominal period ("lidar.empty_scan"); so does one in the
/// midst of which the LiDAR's own clock jumps ("lidar.clock_jump"), and one with too few points to tell what is left
/// out.
///
/// With point_times: none no field of a time is looked for, and a scan, empty or not, starts and ends at its stamp.
class PointCloudDecoder {
 public:
  /// Of the platform's first LiDAR. `source` names the file in messages. `warnings` must outlive this.
  PointCloudDecoder(std::string source, const Platform& platform, WarningLog& warnings);

  /// Of the LiDAR with this index: 0 is the first, then the further ones.
  PointCloudDecoder(std::string source, const Platform& platform, std::size_t lidar, WarningLog& warnings);

  /// Throws InputError where a field is missing (listing those that are there) or of a type that cannot be, the sizes
  /// disagree, or the per-point times contradict the scan's period.
  void decode(const ros1::PointCloudMessage& message, LidarScan& scan);
  void decode(const ros1::LivoxMessage& message, LidarScan& scan);

 private:
  [[noreturn]] void fail(const ros1::PointCloudMessage& message, const std::string& what) const;
  [[noreturn]] void fail_unit(const ros1::PointCloudMessage& message, double span_s) const;
  bool take_livox_fields(const ros1::PointCloudMessage& message);
  const ros1::PointCloudMessage& without_padding(const ros1::PointCloudMessage& message);
  void decode_compact(const ros1::PointCloudMessage& message, LidarScan& scan);
  bool is_deskewed() const { return layout_.point_times == PointTimes::none; }
  std::string deskewed_hint() const;
  bool fields_hold(const ros1::PointCloudMessage& message) const;
  void resolve_fields(const ros1::PointCloudMessage& message);
  std::size_t point_count(const ros1::PointCloudMessage& message);
  bool settle_reading(const ros1::PointCloudMessage& message, const LidarScan& scan);
  PointTimesSeen look_at_times(const ros1::PointCloudMessage& message, const PointColumn& column,
                               const LidarScan& scan) const;
  void read_points(const ros1::PointCloudMessage& message, std::size_t count, LidarScan& scan);
  void read_times(const ros1::PointCloudMessage& message, std::size_t count);
  void keep_returns(const ros1::PointCloudMessage& message, LidarScan& scan);
  void place_in_time(const ros1::PointCloudMessage& message, LidarScan& scan);
  void keep_empty(const ros1::PointCloudMessage& message, LidarScan& scan, const char* kind, const char* detail);

  std::string source_;
  LidarMessageLayout layout_;
  std::string platform_file_;
  std::string keys_;  ///< where the platform file describes this LiDAR: "lidar"
  bool livox_ = false;
  Time period_ns_;
  WarningLog& warnings_;

  std::vector<ros1::PointField> known_fields_;  ///< the fields that the columns below were found in
  std::uint32_t known_step_ = 0;
  bool step_settled_ = false;  ///< by a message with points: only its size tells how they lie
  PointFields fields_;
  PointColumn time_;  ///< one of fields_.times
  std::optional<PointTimeReading> reading_;
  bool reading_holds_ = false;  ///< for all scans; else `reading_` is one sparse scan's
  Time time_origin_ = 0;        ///< added to the points' times, which are absolute then
  std::vector<Time> times_;     ///< of the points, in ns as the message gives them
  ros1::PointCloudMessage livox_cloud_;
  ros1::PointCloudMessage compact_cloud_;  ///< the last one whose rows were padded, without the padding
  std::vector<std::uint8_t> compact_data_;
};

}  // namespace lodestone
