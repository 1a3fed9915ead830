#pragma once

#include <vector>

#include "core/mapping/field_survey.h"

namespace lodestone {

/// Squared prediction error of a held-out cell, one component, and its predicted variance.
struct HeldOutError {
  double error;      ///< of the cell's mean
  double predicted;  ///< variance of the prediction plus the cell's white noise
};

/// Trimmed mean of error / (predicted + noise) over the smallest 90 %, divided by its value for a normal distribution.
/// 1 is consistent.
double trimmed_normalized_square(const std::vector<HeldOutError>& errors, double noise);

/// Fewest held-out cells for a calibration.
inline constexpr std::size_t enough_held_out_cells = 50;

/// The noise variance, at least `noise`, that makes the predicted variances consistent: the trimmed mean of
/// error / (predicted + noise) over the smallest 90 % equals that of a normal distribution. Trimmed, because near steel
/// and at the survey's edge a few errors are far larger than a stationary kernel predicts.
double calibrated_noise(const std::vector<HeldOutError>& errors, double noise);

/// A split of the survey and the held-out cells' blocks.
struct CalibrationSplit {
  SurveySplit cells;
  std::vector<int> blocks;  ///< of each held-out cell
};

/// The fewest blocks of `block_m` of way that give a thousand held-out cells: each block costs the regression of its
/// surroundings. A short survey is held out in five turns, a fifth each.
std::vector<CalibrationSplit> splits_for_calibration(const std::vector<FieldObservation>& observations, double cell_m,
                                                     double block_m);

}  // namespace lodestone
