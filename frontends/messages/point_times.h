#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/time.h"
#include "frontends/configuration/platform.h"

/// What the times of a scan's points mean. Drivers write them under many names, in many units, from the scan's start,
/// from the stamp or absolute; yet a scan lasts about its nominal period, and that tells nearly everything.
namespace lodestone {

/// How the numbers of one scan's time field are to be read.
struct PointTimeReading {
  PointTimeUnit unit = PointTimeUnit::nanoseconds;
  PointTimeZero zero = PointTimeZero::scan_start;
  ScanStamp stamp = ScanStamp::start;  ///< counts for scan_start and lidar_clock alone
  bool stamp_assumed = false;          ///< nothing in the scan tells it, nor does the platform file
};

/// The times of a scan's points in the field's own numbers.
struct PointTimesSeen {
  double earliest = 0.0;
  double latest = 0.0;
  double step = 0.0;   ///< of the field's type at such numbers; 0 where it has none worth speaking of
  double limit = 0.0;  ///< the largest number of a type of one or two bytes; 0 for others
  bool doubtful =
      false;  ///< by its name the field is mostly no time: nothing but milliseconds of a whole scan from 0 on is read
};

/// Fewer points than this may lie in any part of a scan: they prove no unit unless they lie all over it.
constexpr std::size_t points_that_tell = 1000;

Time nanoseconds_per(PointTimeUnit unit);

/// The unit in which `span` comes nearest to `period`; nothing where no unit brings it within 1/20 to 5 periods.
std::optional<PointTimeUnit> fitting_time_unit(double span, Time period);

/// The reading of `seen`: what `layout` says, and for the rest what fits. Nothing where no unit fits, or where the
/// field's type cannot tell a hundredth of a period or not hold a whole one; `why_not` then says so ("spans 7 in its
/// own …").
///
/// With a unit, the zero is told so: times within five periods of zero count from the stamp where some are well below
/// zero, from the scan's start else; larger ones are absolute where they lie within a second of `stamp` (and five
/// periods), and of the LiDAR's own clock else.
std::optional<PointTimeReading> read_point_times(const PointTimesSeen& seen, const LidarMessageLayout& layout,
                                                 Time stamp, Time period, std::string& why_not);

/// Where a scan lies: the point of time `zero` (ns, of the field) is at `start`; the earliest point not before.
struct ScanPlace {
  Time start = 0;
  Time zero = 0;
};

/// `earliest` and `latest`: of the points, ns, as the field has them. Their difference fits into a Time.
ScanPlace place_scan(const PointTimeReading& reading, Time earliest, Time latest, Time stamp);

/// How well a point field's name says "each point's time": its place among the names that drivers use, from 0; nothing
/// for any other name. Case and underscores do not count.
std::optional<std::size_t> time_name_rank(const std::string& field);

/// Whether a field of this name is mostly no time: FAST-LIO's "curvature" holds milliseconds since the scan's start,
/// that of a cloud of normals how much the surface bends.
bool is_doubtful_time_name(const std::string& field);

/// One of the two fields of a time, "time_sec" or "time_nsec": those that share a stem belong together.
struct TimePart {
  std::string stem;  ///< lower-case, without underscores and what says seconds or nanoseconds: "time"
  bool nanoseconds = false;
};

/// Nothing where the name says neither seconds nor nanoseconds.
std::optional<TimePart> time_part_of(const std::string& field);

/// "ns since the scan's start, which the stamp names", for people.
std::string describe(const PointTimeReading& reading);

}  // namespace lodestone
