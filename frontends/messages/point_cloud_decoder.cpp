#include "frontends/messages/point_cloud_decoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/platform_lidars.h"

namespace lodestone {
namespace {

using ros1::PointCloudMessage;
using ros1::PointField;

bool same_fields(const std::vector<PointField>& a, const std::vector<PointField>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const PointField& left, const PointField& right) {
    return left.offset == right.offset && left.datatype == right.datatype && left.count == right.count &&
           left.name == right.name;
  });
}

/// No LiDAR measures that far. The voxels of nearer points have coordinates within the range of int.
constexpr float kFarthestPoint_m = 131'072.0F;

bool is_far(const Eigen::Vector3f& position) {
  return position.allFinite() && position.cwiseAbs().maxCoeff() > kFarthestPoint_m;
}

bool is_return(const Eigen::Vector3f& position) {
  return position.allFinite() && !position.isZero(0.0F) && !is_far(position);
}

/// True if the rows of an organized cloud are longer than their points.
bool has_padded_rows(const PointCloudMessage& message) {
  return message.height > 1 && message.row_step > std::uint64_t{message.width} * message.point_step &&
         message.data_size >= std::uint64_t{message.height} * message.row_step;
}

/// Limit of a scan's duration, in periods.
constexpr double longest_scan = 5.0;

/// A ring index from a field of any type. Invalid indices form one ring.
template <class Number>
std::uint16_t to_ring(Number value) {
  constexpr std::uint16_t no_ring = std::numeric_limits<std::uint16_t>::max();
  const auto number = static_cast<double>(value);
  return number >= 0.0 && number < no_ring ? static_cast<std::uint16_t>(number) : no_ring;
}

}  // namespace

PointCloudDecoder::PointCloudDecoder(std::string source, const Platform& platform, WarningLog& warnings)
    : PointCloudDecoder(std::move(source), platform, 0, warnings) {}

PointCloudDecoder::PointCloudDecoder(std::string source, const Platform& platform, std::size_t lidar,
                                     WarningLog& warnings)
    : source_(std::move(source)),
      layout_(layout_of(platform, lidar)),
      platform_file_(platform.file_name()),
      keys_(lidar_key(lidar)),
      period_ns_(from_seconds(model_of(platform, lidar).scan_period_s)),
      warnings_(warnings) {
  if (!is_deskewed()) return;
  // The stamp is the time of all points of a deskewed scan, for any setting of `stamp`.
  layout_.time_field.clear();
  reading_ = PointTimeReading{PointTimeUnit::nanoseconds, PointTimeZero::stamp, ScanStamp::start, false};
  reading_is_final_ = true;
}

void PointCloudDecoder::decode(const PointCloudMessage& message, LidarScan& scan) {
  decode_compact(has_padded_rows(message) ? without_padding(message) : message, scan);
}

/// Copies the rows without padding, so that all points have the same distance.
const PointCloudMessage& PointCloudDecoder::without_padding(const PointCloudMessage& message) {
  const std::size_t row_bytes = std::size_t{message.width} * message.point_step;
  compact_data_.resize(row_bytes * message.height);
  for (std::size_t row = 0; row < message.height; ++row) {
    std::copy_n(message.data + row * message.row_step, row_bytes, compact_data_.data() + row * row_bytes);
  }
  compact_cloud_ = message;
  compact_cloud_.row_step = static_cast<std::uint32_t>(row_bytes);
  compact_cloud_.data = compact_data_.data();
  compact_cloud_.data_size = compact_data_.size();
  return compact_cloud_;
}

/// True if the columns of an earlier message are valid for this message.
bool PointCloudDecoder::fields_match(const PointCloudMessage& message) const {
  if (fields_.step == 0 || message.point_step != known_step_ || !same_fields(message.fields, known_fields_))
    return false;
  const std::size_t count = std::size_t{message.width} * message.height;
  if (count == 0) return true;
  // The size of the data decides whether points are packed or as announced; other sizes are inconclusive.
  return step_is_known_ &&
         (fields_.packed ? message.data_size == count * fields_.step : message.data_size / fields_.step >= count);
}

void PointCloudDecoder::decode_compact(const PointCloudMessage& message, LidarScan& scan) {
  if (!fields_match(message)) resolve_fields(message);
  const std::size_t count = point_count(message);
  read_points(message, count, scan);
  if (!reading_is_final_ && !infer_reading(message, scan)) {
    return keep_empty(message, scan, "lidar.empty_scan", "a scan has no points, or too few to infer their times");
  }
  read_times(message, count);
  keep_returns(message, scan);
  assign_times(message, scan);
}

void PointCloudDecoder::decode(const ros1::LivoxMessage& message, LidarScan& scan) {
  const ScanStamp stamp = layout_.stamp.value_or(ScanStamp::start);
  if (livox_cloud_.fields.empty()) {
    livox_ = !is_deskewed();
    livox_cloud_.fields = ros1::LivoxMessage::fields();
    livox_cloud_.point_step = ros1::LivoxMessage::point_step;
    layout_.intensity_field = "reflectivity";
    layout_.ring_field = "line";
    if (!is_deskewed()) {
      layout_.time_field = "offset_time";
      layout_.time_unit = PointTimeUnit::nanoseconds;
      const auto zero = stamp == ScanStamp::start ? PointTimeZero::epoch : PointTimeZero::scan_start;
      reading_ = PointTimeReading{PointTimeUnit::nanoseconds, zero, stamp, false};
      reading_is_final_ = true;
    }
  }
  livox_cloud_.stamp = message.stamp;
  livox_cloud_.width = message.point_count;
  livox_cloud_.data = message.data;
  livox_cloud_.data_size = message.data_size;
  // As in the driver's PointCloud2. The stamp instead of the timebase, because other sensors also use the host's clock.
  time_origin_ = stamp == ScanStamp::start ? message.stamp : 0;
  decode(livox_cloud_, scan);
}

void PointCloudDecoder::fail(const PointCloudMessage& message, const std::string& what) const {
  throw InputError(fmt::format("{}: {} at {:.9f} s: {}", source_, layout_.topic, to_seconds(message.stamp), what));
}

/// Reports a wrong unit, field or period, and the unit that would fit.
void PointCloudDecoder::fail_unit(const PointCloudMessage& message, double span_s) const {
  const double span = span_s * 1e9 / static_cast<double>(nanoseconds_per(reading_->unit));
  const auto fitting = livox_ ? std::nullopt : fitting_time_unit(span, period_ns_);
  std::string change = livox_ ? keys_ + ".scan_period_s" : fmt::format("{0}.time_unit or {0}.fields.time", keys_);
  if (fitting) change = fmt::format("{}.time_unit: {}", keys_, options_detail::write_value(*fitting));
  if (!livox_ && span_s > 0.01 && span_s < 1.0) change = fmt::format("{}.scan_period_s, or {},", keys_, change);
  fail(message, fmt::format("the points' times ('{}') span {:.3g} s; expected about the scan's period of {:g} s "
                            "({}.scan_period_s); set {} in {}{}",
                            time_.name, span_s, to_seconds(period_ns_), keys_, change, platform_file_,
                            span_s == 0.0 ? deskewed_hint() : ""));
}

/// A further remedy if all points have the same time.
std::string PointCloudDecoder::deskewed_hint() const {
  return fmt::format(", or {}.point_times: none if the scans are deskewed already", keys_);
}

/// Recognizes the PointCloud2 of a Livox by three of its fields.
bool PointCloudDecoder::apply_livox_fields(const PointCloudMessage& message) {
  const auto has = [&message](const char* name, std::uint8_t datatype) {
    return std::any_of(message.fields.begin(), message.fields.end(),
                       [&](const PointField& field) { return field.name == name && field.datatype == datatype; });
  };
  if (!has("tag", PointField::uint8) || !has("line", PointField::uint8) || !has("timestamp", PointField::float64)) {
    return false;
  }
  layout_.intensity_field = "intensity";
  layout_.ring_field = "line";
  layout_.time_field = "timestamp";
  layout_.time_unit = PointTimeUnit::nanoseconds;
  return true;
}

void PointCloudDecoder::resolve_fields(const PointCloudMessage& message) {
  if (layout_.time_field.empty() && !is_deskewed()) livox_ = apply_livox_fields(message);
  const std::string time_field = time_.name;
  const std::string where = fmt::format("{}: {} at {:.9f} s", source_, layout_.topic, to_seconds(message.stamp));
  fields_ = find_point_fields(message, layout_, {where, keys_, platform_file_});
  if (fields_.packed) {
    warnings_.add(
        "lidar.packed_points",
        fmt::format("{}: points have {} bytes instead of the {} of point_step; read without gaps between fields",
                    layout_.topic, fields_.step, message.point_step),
        message.stamp);
  }
  known_fields_ = message.fields;
  known_step_ = message.point_step;
  step_is_known_ = message.width > 0 && message.height > 0;
  if (is_deskewed()) return;
  time_ = fields_.times.front();
  if (!reading_is_final_) return;
  // A known meaning of times is kept for its field. If the field is missing, the meaning is inferred again.
  const auto same = std::find_if(fields_.times.begin(), fields_.times.end(),
                                 [&](const PointColumn& column) { return column.name == time_field; });
  reading_is_final_ = same != fields_.times.end() || time_field.empty();
  if (same != fields_.times.end()) time_ = *same;
}

std::size_t PointCloudDecoder::point_count(const PointCloudMessage& message) {
  const std::size_t count = std::size_t{message.width} * message.height;
  if (message.data_size / fields_.step < count) {
    fail(message, fmt::format("the cloud has {} bytes of data; expected {} ({} x {} points of {} bytes)",
                              message.data_size, count * fields_.step, message.width, message.height, fields_.step));
  }
  return count;
}

/// The times of the points with a return, as numbers of the field.
PointTimeStatistics PointCloudDecoder::measure_times(const PointCloudMessage& message, const PointColumn& column,
                                                     const LidarScan& scan) const {
  PointTimeStatistics seen;
  bool any = false;
  double earliest_but_zero = std::numeric_limits<double>::infinity();
  std::size_t returns = 0, zeros = 0;
  read_column(column, message.data, scan.points.size(), fields_.step, [&](std::size_t i, auto raw) {
    const auto value = static_cast<double>(raw);
    if (!std::isfinite(value) || !is_return(scan.points[i].position)) return;
    ++returns;
    if (value == 0.0) ++zeros;
    if (value != 0.0) earliest_but_zero = std::min(earliest_but_zero, value);
    seen.earliest = any ? std::min(seen.earliest, value) : value;
    seen.latest = any ? std::max(seen.latest, value) : value;
    any = true;
    using Number = decltype(raw);
    if constexpr (sizeof(Number) <= 2) seen.limit = static_cast<double>(std::numeric_limits<Number>::max());
  });
  // A few zeros among times far from zero are points without a time.
  if (seen.earliest == 0.0 && 10 * zeros < returns && earliest_but_zero > 0.5 * seen.latest)
    seen.earliest = earliest_but_zero;
  const double largest = std::max(std::abs(seen.earliest), std::abs(seen.latest));
  if (column.datatype == PointField::float32) seen.step = largest * std::numeric_limits<float>::epsilon();
  if (column.datatype == PointField::float64) seen.step = largest * std::numeric_limits<double>::epsilon();
  return seen;
}

/// Determines the meaning of the times. False if there are too few points.
bool PointCloudDecoder::infer_reading(const PointCloudMessage& message, const LidarScan& scan) {
  const auto returns = static_cast<std::size_t>(std::count_if(
      scan.points.begin(), scan.points.end(), [](const LidarPoint& point) { return is_return(point.position); }));
  if (returns == 0) return false;
  std::string seen_fields;
  bool all_at_once = false;
  for (const PointColumn& candidate : fields_.times) {
    std::string why_not;
    PointTimeStatistics seen = measure_times(message, candidate, scan);
    seen.doubtful = layout_.time_field.empty() && is_doubtful_time_name(candidate.name);
    reading_ = read_point_times(seen, layout_, message.stamp, period_ns_, why_not);
    if (!reading_) {
      all_at_once = all_at_once || seen.earliest == seen.latest;
      seen_fields += fmt::format("{}'{}' ({}) {}", seen_fields.empty() ? "" : ", ", candidate.name,
                                 name_of_datatype(candidate.datatype), why_not);
      continue;
    }
    time_ = candidate;
    const double span_s = (seen.latest - seen.earliest) * 1e-9 * static_cast<double>(nanoseconds_per(reading_->unit));
    const double period_s = to_seconds(period_ns_);
    const bool dense = returns >= conclusive_points;
    // A wrong unit is wrong by a factor of a thousand or more. A sparse scan is shorter than the period, but not so
    // much.
    if (span_s > longest_scan * period_s || (dense && span_s < 0.01 * period_s)) fail_unit(message, span_s);
    reading_is_final_ = dense || span_s > 0.8 * period_s;  // few points, but over the whole scan
    const bool is_told = layout_.time_field.empty() || !layout_.time_unit || reading_->stamp_assumed ||
                         (reading_->zero == PointTimeZero::lidar_clock && !layout_.time_zero);
    if (reading_is_final_ && is_told) {
      warnings_.add("lidar.told_from_content",
                    fmt::format("{}: the points' times are read from '{}' ({}) as {}; to change this, set "
                                "{}.fields.time, time_unit, time_zero "
                                "and stamp in {}",
                                layout_.topic, time_.name, name_of_datatype(time_.datatype), describe(*reading_), keys_,
                                platform_file_),
                    message.stamp);
    }
    return true;
  }
  if (returns < conclusive_points) return false;
  fail(message, fmt::format("no point field is readable as each point's time: {}; set {}.fields.time and time_unit, or "
                            "scan_period_s, in {}, or record the driver's full points{}",
                            seen_fields, keys_, platform_file_, all_at_once ? deskewed_hint() : ""));
}

void PointCloudDecoder::read_points(const PointCloudMessage& message, std::size_t count, LidarScan& scan) {
  scan.points.resize(count);
  const auto read = [&](const PointColumn& column, const auto& sink) {
    read_column(column, message.data, count, fields_.step, sink);
  };
  LidarPoint* points = scan.points.data();
  read(fields_.x, [points](std::size_t i, auto value) { points[i].position.x() = static_cast<float>(value); });
  read(fields_.y, [points](std::size_t i, auto value) { points[i].position.y() = static_cast<float>(value); });
  read(fields_.z, [points](std::size_t i, auto value) { points[i].position.z() = static_cast<float>(value); });
  read(fields_.intensity, [points](std::size_t i, auto value) { points[i].intensity = static_cast<float>(value); });
  read(fields_.ring, [points](std::size_t i, auto value) { points[i].ring = to_ring(value); });
}

void PointCloudDecoder::read_times(const PointCloudMessage& message, std::size_t count) {
  if (is_deskewed()) return times_.assign(count, 0);
  times_.resize(count);
  const Time unit = nanoseconds_per(reading_->unit), origin = time_origin_;
  Time* times = times_.data();
  read_column(time_, message.data, count, fields_.step, [times, unit, origin](std::size_t i, auto value) {
    const double nanoseconds = static_cast<double>(value) * static_cast<double>(unit);
    if (!(std::abs(nanoseconds) < static_cast<double>(farthest_time))) {
      times[i] = farthest_time;
    } else if constexpr (std::is_floating_point_v<decltype(value)>) {
      times[i] = std::llround(nanoseconds);
    } else {
      times[i] = static_cast<Time>(value) * unit + origin;
    }
  });
}

void PointCloudDecoder::keep_returns(const PointCloudMessage& message, LidarScan& scan) {
  std::size_t kept = 0;
  std::int64_t not_finite = 0, far = 0, untimed = 0;
  // For a point without a time, drivers write NaN, or zero among absolute times.
  const bool absolute = reading_->zero == PointTimeZero::epoch;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3f& position = scan.points[i].position;
    if (!position.allFinite()) ++not_finite;
    if (is_far(position)) ++far;
    if (!is_return(position)) continue;
    if (times_[i] == farthest_time || (absolute && times_[i] == 0)) {
      ++untimed;
      continue;
    }
    scan.points[kept] = scan.points[i];
    times_[kept] = times_[i];
    ++kept;
  }
  scan.points.resize(kept);
  times_.resize(kept);
  if (not_finite > 0) {
    warnings_.add("lidar.nan_points", fmt::format("{}: points without a finite position were dropped", layout_.topic),
                  message.stamp, not_finite);
  }
  if (far > 0) {
    warnings_.add("lidar.far_points",
                  fmt::format("{}: points farther than 131 km from the LiDAR were dropped", layout_.topic),
                  message.stamp, far);
  }
  if (untimed == 0) return;
  if (static_cast<std::size_t>(untimed) > kept) {
    fail(message,
         fmt::format("{} of {} points have no time in '{}': not a number, zero, or out of range; set {}.time_unit or "
                     "{}.fields.time in {}",
                     untimed, untimed + static_cast<std::int64_t>(kept), time_.name, keys_, keys_, platform_file_));
  }
  warnings_.add("lidar.untimed_points", fmt::format("{}: points without a time were dropped", layout_.topic),
                message.stamp, untimed);
}

void PointCloudDecoder::keep_empty(const PointCloudMessage& message, LidarScan& scan, const char* kind,
                                   const char* detail) {
  warnings_.add(kind, fmt::format("{}: {}", layout_.topic, detail), message.stamp);
  scan.points.clear();
  if (is_deskewed()) {
    scan.start = scan.end = message.stamp;
    return;
  }
  const ScanStamp stamp = layout_.stamp.value_or(ScanStamp::start);
  scan.start = message.stamp - (stamp == ScanStamp::start    ? 0
                                : stamp == ScanStamp::middle ? period_ns_ / 2
                                                             : period_ns_);
  scan.end = scan.start + period_ns_;
}

void PointCloudDecoder::assign_times(const PointCloudMessage& message, LidarScan& scan) {
  if (scan.points.empty()) return keep_empty(message, scan, "lidar.empty_scan", "a scan has no points");
  const auto [first, last] = std::minmax_element(times_.begin(), times_.end());
  const Time earliest = *first;
  const Time latest = *last;
  const double span_s = static_cast<double>(latest) * 1e-9 - static_cast<double>(earliest) * 1e-9;
  const double period_s = to_seconds(period_ns_);
  const bool too_long = span_s > longest_scan * period_s;
  if (too_long && reading_->zero == PointTimeZero::lidar_clock) {
    return keep_empty(message, scan, "lidar.clock_jump",
                      "the LiDAR's clock jumps within a scan; the scan's points were dropped");
  }
  const bool too_short = !is_deskewed() && scan.points.size() >= conclusive_points && span_s < 0.01 * period_s;
  if (too_long || too_short) fail_unit(message, span_s);
  const ScanPlace place = place_scan(*reading_, earliest, latest, message.stamp);
  scan.start = place.start;
  scan.end = scan.start + (latest - place.zero);
  if (to_seconds(latest - place.zero) > longest_scan * period_s ||
      latest - place.zero > std::numeric_limits<std::int32_t>::max()) {
    fail(message,
         fmt::format("the latest point is {:.3g} s after the stamp; expected about the scan's period of {:g} s; "
                     "set {}.time_zero or {}.time_unit in {}",
                     to_seconds(latest - place.zero), period_s, keys_, keys_, platform_file_));
  }
  for (std::size_t i = 0; i < times_.size(); ++i) {
    scan.points[i].offset_ns = static_cast<std::int32_t>(times_[i] - place.zero);
  }
}

}  // namespace lodestone
