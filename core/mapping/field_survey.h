#pragma once

#include <functional>
#include <vector>

#include "core/geometry/so3.h"
#include "core/time.h"

namespace lodestone {

/// One reading of a survey, rotated to the map frame.
struct FieldObservation {
  Vector3 position = Vector3::Zero();  ///< map, metres
  Vector3 field_ut = Vector3::Zero();  ///< map axes, µT
  double noise_ut = 1.0;               ///< white noise, one sigma per component
  Time time = 0;
  int magnetometer = -1;                          ///< which one of the survey's array; below 0: unknown
  Quaternion R_map_mag = Quaternion::Identity();  ///< used if the magnetometer is known
};

/// The mean of all observations in one voxel.
struct FieldCell {
  Vector3 position = Vector3::Zero();  ///< centroid of the observations
  Vector3 field_ut = Vector3::Zero();
  double variance_ut2 = 0.0;  ///< variance of the mean due to white noise, per component
  int count = 0;
  Time time = 0;  ///< of the first observation
};

/// True for observations that are used.
using ObservationChoice = std::function<bool(const FieldObservation&)>;

/// Averages observations in voxels of side `cell_m`, in order of the voxels (z, y, x). White noise averages out. Other
/// errors (survey pose, calibration, structure within the voxel) are part of the noise that the regression fits per
/// cell. Observations that are not finite or not `chosen` are ignored.
std::vector<FieldCell> thin_survey(const std::vector<FieldObservation>& observations, double cell_m,
                                   const ObservationChoice& chosen = {});

/// Held-out blocks for cross-validation: stretches of `block_m` along the survey's way, of which every `period`-th is
/// held out, beginning with number `phase`. Blocks are by way and not by time: errors of poses and calibration are
/// correlated over a stretch of way, and a block must be longer than that at any speed. The way is that of the
/// readings' mean position over a fifth of a second, in steps of a decimetre, so that noise of the poses does not add
/// to it.
class HeldOutBlocks {
 public:
  HeldOutBlocks(const std::vector<FieldObservation>& observations, double block_m, int period, int phase);

  bool contain(const FieldObservation& observation) const { return block_of(observation.time) % period_ == phase_; }

  /// Number of the block at a time of the survey.
  int block_of(Time time) const;

 private:
  std::vector<Time> begins_;  ///< of each block
  int period_;
  int phase_;
};

/// A survey divided by such blocks, both parts thinned.
struct SurveySplit {
  std::vector<FieldCell> training;
  std::vector<FieldCell> held_out;
};

inline SurveySplit split_survey(const std::vector<FieldObservation>& observations, double cell_m,
                                const HeldOutBlocks& blocks) {
  return {thin_survey(observations, cell_m, [&](const FieldObservation& one) { return !blocks.contain(one); }),
          thin_survey(observations, cell_m, [&](const FieldObservation& one) { return blocks.contain(one); })};
}

}  // namespace lodestone
