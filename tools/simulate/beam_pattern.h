#pragma once

#include <span>
#include <vector>

#include "core/geometry/so3.h"
#include "tools/simulate/sensor_options.h"

namespace lodestone::simulation {

/// When a LiDAR fires and where its beams go. A scan is a fixed number of firings, evenly spread over its period; the
/// beams of one firing leave at one instant. Immutable.
///
/// - `rotating`: a column of `rows` beams, evenly spread over the vertical field of view (line 0 is the uppermost); the
///   head turns clockwise from behind once a scan.
/// - `rosette`: the Livox Mid-360's. Four beams that rise along the axis, a small fan fixed in the housing, meet a
/// mirror
///   that turns fast and nods slowly; being reflected, the fan rolls once a turn. Neither rate divides the other or
///   the scan's, so that no scan repeats the one before it and coverage grows with time.
class BeamPattern {
 public:
  /// `options` must have passed check().
  explicit BeamPattern(const LidarOptions& options);

  int firings() const { return firings_; }  ///< a scan
  int lines() const { return lines_; }      ///< beams a firing

  /// Moment of a firing (0 to firings() - 1) of a scan (from 0), since the motion's second 0.
  double seconds(int scan, int firing) const;

  /// Fills `beams` (lines() of them) with unit directions in the lidar frame.
  void directions(int scan, int firing, std::span<Vector3> beams) const;

 private:
  void rotating(int firing, std::span<Vector3> beams) const;
  void rosette(double seconds, std::span<Vector3> beams) const;

  LidarPattern pattern_;
  double first_scan_s_;
  double rate_hz_;
  int firings_;
  int lines_;
  std::vector<Vector3> line_directions_;  ///< rotating: in the head's plane x, z; rosette: before the mirror
  double nod_center_rad_ = 0.0;           ///< of the middle beam's zenith angle
  double nod_swing_rad_ = 0.0;
};

}  // namespace lodestone::simulation
