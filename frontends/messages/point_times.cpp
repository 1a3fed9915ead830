#include "frontends/messages/point_times.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include "frontends/configuration/options.h"

namespace lodestone {
namespace {

/// Names of time fields in drivers, in order of preference; letters and digits only.
constexpr std::array time_names{
    "t",         "time",         "timestamp",   "offsettime", "timeoffset", "timeoffsetns", "timestampns",
    "pointtime", "relativetime", "reltime",     "deltatime",  "deltat",     "dt",           "ts",
    "stamp",     "timens",       "timeus",      "timems",     "tns",        "tus",          "toffset",
    "utime",     "timeoffsetus", "timestampus", "gpstime",    "curvature"};

std::string lower_case(const std::string& name) {
  std::string lower = name;
  for (char& letter : lower) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return lower;
}

std::string without_underscores(std::string name) {
  std::erase(name, '_');
  return name;
}

/// `name` without the first of `words` in it (a word with an underscore must be at the end); nothing if there is none.
std::optional<std::string> stem_of(const std::string& name, std::initializer_list<std::string_view> words) {
  for (const std::string_view word : words) {
    const std::size_t at = name.rfind(word);
    if (at == std::string::npos || (word.front() == '_' && at + word.size() != name.size())) continue;
    return without_underscores(name.substr(0, at) + name.substr(at + word.size()));
  }
  return std::nullopt;
}

}  // namespace

Time nanoseconds_per(PointTimeUnit unit) {
  switch (unit) {
    case PointTimeUnit::seconds:
      return 1'000'000'000;
    case PointTimeUnit::milliseconds:
      return 1'000'000;
    case PointTimeUnit::microseconds:
      return 1'000;
    case PointTimeUnit::nanoseconds:
      break;
  }
  return 1;
}

std::optional<PointTimeUnit> fitting_time_unit(double span, Time period) {
  for (const auto& [unit, name] : enum_names(PointTimeUnit::seconds)) {
    const double periods = span * static_cast<double>(nanoseconds_per(unit)) / static_cast<double>(period);
    if (periods >= 0.05 && periods <= 5.0)
      return unit;  // units differ by a factor of a thousand, so that at most one fits
  }
  return std::nullopt;
}

std::optional<PointTimeReading> read_point_times(const PointTimeStatistics& seen, const LidarMessageLayout& layout,
                                                 Time stamp, Time period, std::string& why_not) {
  const double span = seen.latest - seen.earliest;
  if (seen.doubtful) {
    const double periods = span * 1e6 / static_cast<double>(period);
    const bool from_zero = std::abs(seen.earliest) * 1e6 < 0.1 * static_cast<double>(period);
    const bool otherwise = layout.time_unit && *layout.time_unit != PointTimeUnit::milliseconds;
    if (otherwise || !from_zero || !(periods > 0.5 && periods < 1.5)) {
      why_not = fmt::format("ranges from {:.6g} to {:.6g}, which is not a scan of {:g} s in ms since its begin",
                            seen.earliest, seen.latest, to_seconds(period));
      return std::nullopt;
    }
  }
  const auto unit = layout.time_unit ? layout.time_unit : fitting_time_unit(span, period);
  if (!unit) {
    why_not = fmt::format("spans {:.6g}, which is not a scan of {:g} s in s, ms, us or ns", span, to_seconds(period));
    return std::nullopt;
  }
  const std::string unit_name = options_detail::write_value(*unit);
  const auto to_ns = static_cast<double>(nanoseconds_per(*unit));
  const auto period_ns = static_cast<double>(period);
  if (seen.step * to_ns > 0.01 * period_ns) {
    why_not = fmt::format(
        "has values of {:.6g} {} in steps of {:.3g} s, too coarse for a scan of {:g} s: record it as float64, or "
        "from the scan's begin",
        seen.latest, unit_name, seen.step * to_ns * 1e-9, to_seconds(period));
    return std::nullopt;
  }
  if (seen.limit > 0.0 && seen.latest > 0.98 * seen.limit && seen.limit * to_ns < 0.9 * period_ns) {
    why_not = fmt::format(
        "has a limit of {:g} {}, so that it overflows within a scan of {:g} s: record it as "
        "uint32",
        seen.latest, unit_name, to_seconds(period));
    return std::nullopt;
  }
  PointTimeReading reading;
  reading.unit = *unit;
  const double earliest = seen.earliest * to_ns, latest = seen.latest * to_ns;
  if (layout.time_zero) {
    reading.zero = *layout.time_zero;
  } else if (earliest < -5.0 * period_ns || latest > 5.0 * period_ns) {
    const double away = std::abs(0.5 * (earliest + latest) - static_cast<double>(stamp));
    // A message without a stamp requires absolute times.
    reading.zero = away < 1e9 + 5.0 * period_ns || stamp == 0 ? PointTimeZero::epoch : PointTimeZero::lidar_clock;
  } else {
    // Slightly negative times are a firing's position within its packet, not a stamp in the middle.
    reading.zero = earliest < -0.02 * period_ns ? PointTimeZero::stamp : PointTimeZero::scan_start;
  }
  reading.stamp = layout.stamp.value_or(ScanStamp::start);
  const bool stamp_counts = reading.zero == PointTimeZero::scan_start || reading.zero == PointTimeZero::lidar_clock;
  reading.stamp_assumed = stamp_counts && !layout.stamp;
  return reading;
}

ScanPlace place_scan(const PointTimeReading& reading, Time earliest, Time latest, Time stamp) {
  ScanPlace place;
  switch (reading.zero) {
    case PointTimeZero::epoch:
      return {earliest, earliest};
    case PointTimeZero::stamp:
      place.zero = std::min<Time>(earliest, 0);
      place.start = stamp + place.zero;
      return place;
    case PointTimeZero::scan_start:
      place.zero = std::min<Time>(earliest, 0);
      break;
    case PointTimeZero::lidar_clock:
      place.zero = earliest;
      break;
  }
  // Here the stamp is an instant of the scan. `begin` is the time of its first firing.
  const Time begin = reading.zero == PointTimeZero::lidar_clock ? earliest : 0;
  const Time length = latest - begin;
  const Time into_scan = reading.stamp == ScanStamp::start    ? 0
                         : reading.stamp == ScanStamp::middle ? length / 2
                                                              : length;
  place.start = stamp - into_scan + (place.zero - begin);
  return place;
}

std::optional<std::size_t> time_name_rank(const std::string& field) {
  const auto found = std::find(time_names.begin(), time_names.end(), without_underscores(lower_case(field)));
  if (found == time_names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - time_names.begin());
}

bool is_doubtful_time_name(const std::string& field) {
  return lower_case(field) == "curvature";
}

std::optional<TimePart> time_part_of(const std::string& field) {
  const std::string name = lower_case(field);
  // Nanoseconds first: their names contain those of seconds.
  if (auto stem =
          stem_of(name, {"nanoseconds", "nanosecond", "nanosecs", "nanosec", "nanos", "nsecs", "nsec", "_ns"})) {
    return TimePart{*stem, true};
  }
  if (auto stem = stem_of(name, {"seconds", "second", "secs", "sec", "_s"})) return TimePart{*stem, false};
  return std::nullopt;
}

std::string describe(const PointTimeReading& reading) {
  const std::string unit = options_detail::write_value(reading.unit);
  const std::string instant = options_detail::write_value(reading.stamp);
  switch (reading.zero) {
    case PointTimeZero::epoch:
      return unit + ", absolute";
    case PointTimeZero::stamp:
      return unit + " relative to the stamp";
    case PointTimeZero::scan_start:
      return fmt::format("{} since the scan's begin; the stamp is the scan's {}", unit, instant);
    case PointTimeZero::lidar_clock:
      break;
  }
  return fmt::format("{} of the LiDAR's clock; the stamp is the scan's {}", unit, instant);
}

}  // namespace lodestone
