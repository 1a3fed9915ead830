#pragma once

#include <span>
#include <vector>

#include "core/geometry/so3.h"
#include "tools/simulate/sensor_options.h"

namespace lodestone::simulation {

/// Firing times and beam directions of a LiDAR. A scan is a fixed number of firings, evenly spread over the scan's
/// period; all beams of one firing leave at the same instant. Immutable.
///
/// - `rotating`: a column of `rows` beams, evenly spread over the vertical field of view (line 0 is the uppermost).
///   The head turns clockwise, once per scan, starting from behind.
/// - `rosette`: the Livox Mid-360. A fixed fan of four beams along the axis meets a mirror that spins fast and nods
///   slowly. By reflection, the fan also rolls once per turn. None of the rates of spin, nod and scan
///   divides another: no scan repeats the previous one, and coverage grows with time.
class BeamPattern {
 public:
  /// Requires that `options` has passed check().
  explicit BeamPattern(const LidarOptions& options);

  int firings() const { return firings_; }  ///< per scan
  int lines() const { return lines_; }      ///< beams per firing

  /// Time of a firing (0 to firings() - 1) of a scan (from 0), in seconds from the start of the motion.
  double seconds(int scan, int firing) const;

  /// Fills `beams` (size lines()) with unit directions in the lidar frame.
  void directions(int scan, int firing, std::span<Vector3> beams) const;

 private:
  void rotating(int firing, std::span<Vector3> beams) const;
  void rosette(double seconds, std::span<Vector3> beams) const;

  LidarPattern pattern_;
  double first_scan_s_;
  double rate_hz_;
  int firings_;
  int lines_;
  std::vector<Vector3> line_directions_;  ///< rotating: in the head's x-z plane; rosette: before the mirror
  double nod_center_rad_ = 0.0;           ///< of the middle beam's zenith angle
  double nod_swing_rad_ = 0.0;
};

}  // namespace lodestone::simulation
