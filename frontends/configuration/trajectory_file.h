#pragma once

#include <string>
#include <string_view>

#include "core/geometry/trajectory.h"

namespace lodestone {

/// Parses a stamp in decimal seconds to exact nanoseconds, without conversion to double. Exponents ("1.4e+09", as numpy
/// writes) are supported. Returns false if the text is no number, or further than `farthest_time`.
bool parse_stamp(std::string_view text, Time& time);

/// Seconds with nine decimals, exact: "1403715529.112143517".
std::string format_stamp(Time time);

/// "FROM s to TO s".
std::string span_text(Time from, Time to);

/// Reads a trajectory in TUM order (t x y z qx qy qz qw, seconds and metres); '#' starts a comment line. Quaternions
/// are normalized. Equal stamps are kept, since real files contain some. Throws InputError, with file and line, for a
/// malformed line, a quaternion far from unit length, or a decreasing stamp; and for a file without poses.
Trajectory read_tum(const std::string& path);

/// Reads a TUM file or a EuRoC ground-truth csv (t in integer ns, p x y z, q w x y z, further columns ignored); commas
/// distinguish them. Throws as read_tum. `origin_m` is subtracted from all positions. KITTI's format has no times:
/// throws InputError that names --times of `lodestone evaluate` (kitti_trajectory.h).
Trajectory read_trajectory(const std::string& path, const Vector3& origin_m = Vector3::Zero());

/// No coordinate of a site is larger. Larger ones have another origin.
inline constexpr double kSiteReach_m = 1e5;

/// read_trajectory of a drive at the site: throws InputError also if its first pose is beyond kSiteReach_m.
Trajectory read_site_trajectory(const std::string& path, const Vector3& origin_m);

/// "x y z qx qy qz qw", the format of --initial-pose. `origin_m` is added to the position.
std::string pose_text(const Pose& pose, const Vector3& origin_m = Vector3::Zero());

/// One line of a TUM file, without line end: stamp with nine decimals, nine significant digits,
/// but coordinates to a micrometre.
std::string format_tum(const StampedPose& pose);

/// The text of a EuRoC csv: stamps in ns, digits as in format_tum.
std::string euroc_text(const Trajectory& trajectory);

/// Writes a TUM file (temporary file, then rename). `comment`, if any, becomes its first lines. Throws InputError.
void write_tum(const std::string& path, const Trajectory& trajectory, const std::string& comment = {});

}  // namespace lodestone
