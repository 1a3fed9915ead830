#pragma once

#include <functional>
#include <vector>

#include "core/geometry/so3.h"
#include "core/time.h"

namespace lodestone {

/// One reading of a survey, turned to the map frame.
struct FieldObservation {
  Vector3 position = Vector3::Zero();  ///< map, metres
  Vector3 field_ut = Vector3::Zero();  ///< map axes, µT
  double noise_ut = 1.0;               ///< white, one sigma a component
  Time time = 0;
};

/// The mean of all observations in one voxel.
struct FieldCell {
  Vector3 position = Vector3::Zero();  ///< centroid of the observations
  Vector3 field_ut = Vector3::Zero();
  double variance_ut2 = 0.0;  ///< of the mean of white noise, a component
  int count = 0;
};

/// Which observations to take.
using ObservationChoice = std::function<bool(const FieldObservation&)>;

/// Averages observations in voxels of `cell_m` a side, in order of the voxels (z, y, x). The white noise averages out
/// with the count; whatever does not (survey pose, calibration, structure within the voxel) is left to the noise that
/// the regression fits per cell. Observations that are not finite, or not `chosen`, are left out.
std::vector<FieldCell> thin_survey(const std::vector<FieldObservation>& observations, double cell_m,
                                   const ObservationChoice& chosen = {});

/// Every `period`-th block of `block` ns of a survey, counted from the earliest observation, the middle one of the
/// period: held out, they test what the regression makes of the rest.
class HeldOutBlocks {
 public:
  HeldOutBlocks(const std::vector<FieldObservation>& observations, Time block, Time period);

  bool contain(const FieldObservation& observation) const;

 private:
  Time begin_ = 0;
  Time block_;
  Time period_;
};

/// A survey thinned in two parts by such blocks.
struct SurveySplit {
  std::vector<FieldCell> training;
  std::vector<FieldCell> held_out;
};

inline SurveySplit split_survey(const std::vector<FieldObservation>& observations, double cell_m, Time block,
                                Time period) {
  const HeldOutBlocks blocks(observations, block, period);
  return {thin_survey(observations, cell_m, [&](const FieldObservation& one) { return !blocks.contain(one); }),
          thin_survey(observations, cell_m, [&](const FieldObservation& one) { return blocks.contain(one); })};
}

}  // namespace lodestone
