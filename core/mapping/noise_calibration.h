#pragma once

#include <vector>

#include "core/mapping/field_survey.h"

namespace lodestone {

/// A held-out cell against its prediction, one component, squared.
struct HeldOutMiss {
  double error;      ///< of the cell's mean
  double predicted;  ///< variance of the prediction and of the cell's white noise
};

/// Enough misses for a calibration.
inline constexpr std::size_t enough_held_out_cells = 50;

/// The noise variance, at least `noise`, that makes the predicted variances right: the mean of error / (predicted +
/// noise) over the best nine tenths is that of a normal distribution. Trimmed, since at steel and at the survey's edge
/// a few errors are far larger than any stationary kernel says.
double calibrated_noise(const std::vector<HeldOutMiss>& misses, double noise);

/// As few blocks of `block_s` seconds as give a thousand held-out cells, since each costs the regression of its
/// surroundings; at most a fifth of all.
SurveySplit split_for_calibration(const std::vector<FieldObservation>& observations, double cell_m, double block_s);

}  // namespace lodestone
