#include "frontends/synchronizer/synchronizer.h"

#include <fmt/format.h>

#include <algorithm>

namespace lodestone {
namespace {

/// A sensor is silent if the others are this far ahead in log time.
constexpr Time patience = 1'000'000'000;

/// Share of a scan that may be older than the previous scan's end, since stamps jitter.
constexpr double overlap_share = 0.1;

/// Up to this number of IMU periods, missing samples at a log's begin or end cause no warning.
constexpr Time tolerated_imu_periods = 2;

ImuSample interpolate(const ImuSample& before, const ImuSample& after, Time time) {
  if (time <= before.time || after.time == before.time)
    return {time, before.angular_velocity, before.linear_acceleration};
  const double share = to_seconds(time - before.time) / to_seconds(after.time - before.time);
  return {time, before.angular_velocity + share * (after.angular_velocity - before.angular_velocity),
          before.linear_acceleration + share * (after.linear_acceleration - before.linear_acceleration)};
}

std::string at(Time time) {
  return fmt::format("at {:.3f} s", to_seconds(time));
}

}  // namespace

Synchronizer::Synchronizer(MeasurementSource& source, const SensorSuite& suite, WarningLog& warnings,
                           SensorChoice choice)
    : source_(source),
      warnings_(warnings),
      choice_(choice),
      period_(from_seconds(suite.lidar.scan_period_s)),
      imu_period_(from_seconds(1.0 / suite.imu.rate_hz)),
      fields_(choice.magnetometers ? suite.magnetometers.size() : 0) {
  choice_.wheels = choice.wheels && suite.wheels.has_value();
}

bool Synchronizer::next(ScanBundle& bundle) {
  while (plan(bundle.scan)) {
    wait_for(bundle.scan.end);
    if (!take_imu(bundle)) continue;
    take_fields(bundle.scan, bundle.magnetic);
    take_wheels(bundle.scan, bundle.wheels);
    previous_end_ = bundle.scan.end;
    started_ = true;
    return true;
  }
  return false;
}

bool Synchronizer::pull() {
  Measurement measurement;
  if (ended_ || !source_.next(measurement)) {
    ended_ = true;
    return false;
  }
  newest_ = std::max(newest_, completion_time(measurement));
  std::visit([this](auto& each) { add(std::move(each)); }, measurement);
  return true;
}

void Synchronizer::add(LidarScan&& scan) {
  if (choice_.lidar) scans_.push_back(std::move(scan));
}

void Synchronizer::add(const ImuSample& sample) {
  if (!imu_.empty() && sample.time <= imu_.back().time) {
    warnings_.add("imu.late", "a sample arrived after its time had been bridged, and was discarded " + at(sample.time),
                  sample.time);
    return;
  }
  imu_.push_back(sample);
  last_measured_imu_ = sample.time;
  // Before the first scan nothing else empties the queue.
  while (!started_ && scans_.empty() && choice_.lidar && imu_.front().time < newest_ - patience) imu_.pop_front();
}

void Synchronizer::add(const MagneticSample& sample) {
  if (!choice_.magnetometers) return;
  if ((started_ && sample.time <= previous_end_) || !fields_.add(sample)) {
    warnings_.add("magnetometer.late",
                  "a sample arrived after its bundle was complete, and was discarded " + at(sample.time), sample.time);
  }
  if (!started_ && scans_.empty() && choice_.lidar) fields_.forget(newest_ - patience);
}

void Synchronizer::add(const WheelSample& sample) {
  if (!choice_.wheels) return;
  if ((started_ && sample.time <= previous_end_) || (!wheels_.empty() && sample.time <= wheels_.back().time)) {
    warnings_.add("wheels.late", "a sample arrived after its bundle was complete, and was discarded " + at(sample.time),
                  sample.time);
    return;
  }
  wheels_.push_back(sample);
  while (!started_ && scans_.empty() && choice_.lidar && wheels_.front().time < newest_ - patience) wheels_.pop_front();
}

bool Synchronizer::plan_empty(Time length, LidarScan& scan) const {
  scan = {};
  scan.start = previous_end_;
  scan.end = previous_end_ + length;
  return true;
}

/// Begin of the interval of a scan. A deskewed scan has no duration and stands for its period.
Time Synchronizer::begin_of(const LidarScan& scan) const {
  return scan.end - scan.start < period_ / 2 ? scan.end - period_ : scan.start;
}

/// Discards points from before the previous scan's end: a bundle has no IMU samples from there, and estimators cannot
/// correct the motion. Returns false if hardly anything of the scan is later.
bool Synchronizer::cut_overlap(LidarScan& scan) {
  const Time most = from_seconds(overlap_share * to_seconds(scan.end - scan.start));
  const Time early = previous_end_ - scan.start;
  const auto is_late = [](const LidarPoint& point) { return point.offset_ns > 0; };
  if (early <= most || std::none_of(scan.points.begin(), scan.points.end(), is_late)) return true;
  const bool remains = scan.end - previous_end_ > most;
  const auto points = static_cast<std::int64_t>(scan.points.size());
  const auto discarded =
      std::erase_if(scan.points, [early](const LidarPoint& point) { return point.offset_ns <= early; });
  warnings_.add("lidar.overlap",
                fmt::format("the scan {} begins {:.3f} s before the end of the one before; its points from before were "
                            "discarded; several LiDARs need a topic each, with further_lidars in the platform file",
                            at(scan.start), to_seconds(early)),
                scan.start, remains ? static_cast<std::int64_t>(discarded) : points);
  for (LidarPoint& point : scan.points) point.offset_ns -= static_cast<std::int32_t>(early);
  scan.start = previous_end_;
  return remains;
}

/// Plans the next step: a scan, or an empty scan during a LiDAR outage. Returns false at the end of the log.
bool Synchronizer::plan(LidarScan& scan) {
  if (!choice_.lidar) {
    while (imu_.empty() && pull()) {
    }
    if (!started_ && !imu_.empty()) previous_end_ = imu_.front().time;
    while (!imu_reaches(previous_end_ + period_) && pull()) {
    }
    return imu_reaches(previous_end_ + period_) && plan_empty(period_, scan);
  }
  const Time one_and_a_half = period_ + period_ / 2;
  for (;;) {
    while (scans_.empty() && !(started_ && imu_reaches(previous_end_ + one_and_a_half + patience)) && pull()) {
    }
    if (scans_.empty()) {
      // LiDAR is silent, or the log ends. Empty scans follow while there are IMU samples for a whole period, but not
      // for the usual remaining samples after the last scan.
      if (!started_ || !imu_reaches(previous_end_ + (silent_ ? period_ : one_and_a_half))) return false;
      silent_ = true;
      warnings_.add("lidar.silent", "no scan " + at(previous_end_) + "; an empty one was inserted", previous_end_);
      return plan_empty(period_, scan);
    }
    if (started_ && scans_.front().end <= previous_end_) {
      warnings_.add(
          "lidar.late_scan",
          "a scan ends before the previous one, or arrived too late, and was discarded " + at(scans_.front().end),
          scans_.front().end);
      scans_.pop_front();
      continue;
    }
    if (started_ && !cut_overlap(scans_.front())) {
      scans_.pop_front();
      continue;
    }
    if (const Time hole = begin_of(scans_.front()) - previous_end_; started_ && hole > period_ / 2) {
      silent_ = true;
      warnings_.add("lidar.silent", "no scan " + at(previous_end_) + "; an empty one was inserted", previous_end_);
      return plan_empty(hole > one_and_a_half ? period_ : hole, scan);
    }
    silent_ = false;
    scan = std::move(scans_.front());
    scans_.pop_front();
    return true;
  }
}

void Synchronizer::wait_for(Time time) {
  while (!(imu_reaches(time) && fields_.passed(time) && wheels_reach(time)) && newest_ <= time + patience && pull()) {
  }
}

/// Repeats the last IMU sample up to the scan's end if samples are missing. Returns false if no sample is left.
bool Synchronizer::hold_last_imu(const LidarScan& scan) {
  if (imu_.empty()) return false;
  const Time missing = scan.end - last_measured_imu_;
  if (ended_ && missing > period_) return false;
  if (missing > tolerated_imu_periods * imu_period_) {
    warnings_.add("imu.held",
                  fmt::format("{:.3f} s without a sample before {:.3f} s; the last one was repeated",
                              to_seconds(missing), to_seconds(scan.end)),
                  scan.end);
  }
  ImuSample held = imu_.back();
  held.time = scan.end;
  added_imu_ = scan.end;
  imu_.push_back(held);
  return true;
}

bool Synchronizer::take_imu(ScanBundle& bundle) {
  const LidarScan& scan = bundle.scan;
  std::vector<ImuSample>& samples = bundle.imu;
  const Time begin = started_ ? previous_end_ : scan.start;
  if (!imu_reaches(scan.end) && !hold_last_imu(scan)) {
    // At the end of the log, queued scans after this one have no IMU samples either.
    const auto waiting = ended_ ? static_cast<std::int64_t>(scans_.size()) : 0;
    warnings_.add("lidar.after_imu", "a scan has no IMU samples and was discarded " + at(scan.end), scan.end,
                  waiting + (silent_ ? 0 : 1));
    if (ended_) scans_.clear();
    return false;
  }
  while (imu_.size() > 1 && imu_[1].time <= begin) {
    if (is_measured(imu_.front())) taken_imu_ = imu_.front().time;
    imu_.pop_front();
  }
  if (imu_.front().time > begin + tolerated_imu_periods * imu_period_) {
    warnings_.add("lidar.before_imu", "a scan starts before the first IMU sample and was discarded " + at(scan.start),
                  scan.start);
    return false;
  }
  samples.clear();
  samples.push_back(interpolate(imu_.front(), imu_.size() > 1 ? imu_[1] : imu_.front(), begin));
  ImuSample last = samples.front();
  if (!started_) taken_imu_ = imu_.front().time;
  Time gap = 0;
  while (!imu_.empty() && imu_.front().time < scan.end) {
    last = imu_.front();
    imu_.pop_front();
    if (last.time > begin) samples.push_back(last);
    if (!is_measured(last)) continue;
    if (last.time > begin) gap = std::max(gap, last.time - taken_imu_);
    taken_imu_ = last.time;
  }
  if (scan.end > begin) samples.push_back(interpolate(last, imu_.front(), scan.end));
  bundle.imu_gap_s = to_seconds(std::max(gap, imu_.front().time - taken_imu_));
  // The next bundle starts with the same sample.
  if (imu_.front().time > scan.end) {
    imu_.push_front(samples.back());
    added_imu_ = scan.end;
  }
  return true;
}

void Synchronizer::take_fields(const LidarScan& scan, std::vector<MagneticArraySample>& samples) {
  samples.clear();
  if (!started_) fields_.forget(scan.start);
  while (auto sample = fields_.take(scan.end)) samples.push_back(std::move(*sample));
}

void Synchronizer::take_wheels(const LidarScan& scan, std::vector<WheelSample>& samples) {
  samples.clear();
  for (; !wheels_.empty() && wheels_.front().time <= scan.end; wheels_.pop_front()) {
    if (started_ || wheels_.front().time > scan.start) samples.push_back(wheels_.front());
  }
}

}  // namespace lodestone
