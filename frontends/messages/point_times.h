#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/time.h"
#include "frontends/configuration/platform.h"

/// Meaning of the times of a scan's points. Drivers use many names and units, from the scan's begin, relative to the
/// stamp or absolute. The span of a scan's times is about its nominal period, which determines nearly everything.
namespace lodestone {

/// Interpretation of the numbers of one scan's time field.
struct PointTimeReading {
  PointTimeUnit unit = PointTimeUnit::nanoseconds;
  PointTimeZero zero = PointTimeZero::scan_start;
  ScanStamp stamp = ScanStamp::start;  ///< only for scan_start and lidar_clock
  bool stamp_assumed = false;          ///< neither the scan nor the platform file determines it
};

/// The times of a scan's points, as numbers of the field.
struct PointTimeStatistics {
  double earliest = 0.0;
  double latest = 0.0;
  double step = 0.0;      ///< resolution of the field's type at these numbers; 0: negligible
  double limit = 0.0;     ///< largest number of a type of one or two bytes; 0 for others
  bool doubtful = false;  ///< the name is rarely that of a time: only milliseconds of a whole scan from 0 are accepted
};

/// Fewer points may be in any part of a scan: they determine a unit only if they cover the scan.
constexpr std::size_t conclusive_points = 1000;

Time nanoseconds_per(PointTimeUnit unit);

/// The unit in which `span` is nearest to `period`; nothing if no unit gives 1/20 to 5 periods.
std::optional<PointTimeUnit> fitting_time_unit(double span, Time period);

/// The reading of `seen`: settings of `layout`, the rest inferred. Nothing if no unit fits, or if the field's type
/// cannot resolve a hundredth of a period or cannot contain a whole period; `why_not` then has the reason ("spans 7,
/// which …").
///
/// The zero is inferred with the unit: times within five periods of zero are relative to the stamp if some are clearly
/// negative, otherwise to the scan's begin. Larger times are absolute if they are within a second (and five periods) of
/// `stamp`, otherwise of the LiDAR's clock.
std::optional<PointTimeReading> read_point_times(const PointTimeStatistics& seen, const LidarMessageLayout& layout,
                                                 Time stamp, Time period, std::string& why_not);

/// Position of a scan: the point time `zero` (ns, of the field) is at `start`, which is not after the earliest point.
struct ScanPlace {
  Time start = 0;
  Time zero = 0;
};

/// `earliest` and `latest`: of the points, ns, as in the field. Their difference fits into a Time.
ScanPlace place_scan(const PointTimeReading& reading, Time earliest, Time latest, Time stamp);

/// Rank of a field's name among drivers' names of point times, from 0; nothing for other names. Ignores case and
/// underscores.
std::optional<std::size_t> time_name_rank(const std::string& field);

/// True if the name is rarely that of a time: FAST-LIO's "curvature" has milliseconds since the scan's begin, but in
/// clouds of normals it is the curvature of the surface.
bool is_doubtful_time_name(const std::string& field);

/// One of the two fields of a time, e.g. "time_sec" or "time_nsec". Fields with the same stem belong together.
struct TimePart {
  std::string stem;  ///< lower case, without underscores and the unit: "time"
  bool nanoseconds = false;
};

/// Nothing if the name contains neither seconds nor nanoseconds.
std::optional<TimePart> time_part_of(const std::string& field);

/// Text such as "ns since the scan's begin; the stamp is the scan's start".
std::string describe(const PointTimeReading& reading);

}  // namespace lodestone
