#include "frontends/synchronizer/scan_merger.h"

#include <algorithm>

namespace lodestone {
namespace {

/// A silent LiDAR is waited for over this number of scans of the first LiDAR, which limits memory.
constexpr std::size_t scans_of_patience = 3;

/// More queued scans of another LiDAR than this have no corresponding scan of the first.
constexpr std::size_t most_waiting_scans = 10;

}  // namespace

ScanMerger::ScanMerger(const LidarModel& first, const std::vector<LidarModel>& others, WarningLog& warnings)
    : warnings_(warnings), period_(from_seconds(first.scan_period_s)) {
  const Pose T_first_imu = first.T_imu_lidar.inverse();
  for (const LidarModel& other : others) {
    others_.push_back({T_first_imu * other.T_imu_lidar, {}});
  }
}

void ScanMerger::add(std::size_t lidar, LidarScan&& scan) {
  for (LidarPoint& point : scan.points) point.lidar = static_cast<std::uint8_t>(lidar);
  if (lidar == 0) {
    first_.push_back(std::move(scan));
    return;
  }
  Other& other = others_.at(lidar - 1);
  const Eigen::Matrix3f R = other.T_first_other.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f t = other.T_first_other.position.cast<float>();
  for (LidarPoint& point : scan.points) point.position = R * point.position + t;
  other.reached = scan.end;
  other.any = true;
  other.scans.push_back(std::move(scan));
  if (other.scans.size() <= most_waiting_scans) return;
  warnings_.add("lidar.unmerged_points",
                "points of a further LiDAR arrived while the first was silent, and were discarded",
                other.scans.front().start, static_cast<std::int64_t>(other.scans.front().points.size()));
  other.scans.pop_front();
}

/// Adds the points within (after, merged.end]; discards earlier ones and keeps later ones in the queue.
void ScanMerger::join(Other& other, Time after, LidarScan& merged, std::vector<Time>& times) {
  std::int64_t dropped = 0;
  for (LidarScan& scan : other.scans) {
    if (scan.start > merged.end) break;
    std::size_t later = 0;
    for (const LidarPoint& point : scan.points) {
      const Time time = scan.start + point.offset_ns;
      if (time > merged.end) {
        scan.points[later++] = point;
      } else if (time > after) {
        merged.points.push_back(point);
        times.push_back(time);
      } else {
        ++dropped;
      }
    }
    scan.points.resize(later);
  }
  while (!other.scans.empty() && other.scans.front().points.empty()) other.scans.pop_front();
  // Before the log's first scan, points have no scan to join.
  if (dropped > 0 && started_) {
    warnings_.add("lidar.unmerged_points",
                  "points of a further LiDAR arrived after their scan was complete, and were discarded", merged.start,
                  dropped);
  }
}

bool ScanMerger::take(LidarScan& merged) {
  if (first_.empty()) return false;
  const Time end = first_.front().end;
  const bool waits = std::any_of(others_.begin(), others_.end(),
                                 [end](const Other& other) { return !other.any || other.reached < end; });
  if (waits && !ended_ && first_.size() < scans_of_patience) return false;
  merged = std::move(first_.front());
  first_.pop_front();
  // Points within a gap of the first LiDAR go back one scan at most. A deskewed scan has no duration and stands for one
  // period.
  const Time earliest = merged.start - (merged.end > merged.start ? merged.end - merged.start : period_);
  const Time after = started_ ? std::max(earliest, std::min(previous_end_, merged.start)) : merged.start - 1;
  const std::size_t own = merged.points.size();
  std::vector<Time> times;
  for (Other& other : others_) join(other, after, merged, times);
  // The scan begins with its first point, of any LiDAR.
  Time start = merged.start;
  for (const Time time : times) start = std::min(start, time);
  for (std::size_t i = 0; i < own; ++i) merged.points[i].offset_ns += static_cast<std::int32_t>(merged.start - start);
  for (std::size_t i = 0; i < times.size(); ++i) {
    merged.points[own + i].offset_ns = static_cast<std::int32_t>(times[i] - start);
  }
  merged.start = start;
  previous_end_ = std::max(previous_end_, merged.end);
  started_ = true;
  return true;
}

}  // namespace lodestone
