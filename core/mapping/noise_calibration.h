#pragma once

#include <vector>

#include "core/mapping/field_survey.h"

namespace lodestone {

/// Squared prediction error of a held-out cell, one component, and its predicted variance.
struct HeldOutError {
  double error;      ///< of the cell's mean
  double predicted;  ///< variance of the prediction plus the cell's white noise
};

/// Fewest held-out cells for a calibration.
inline constexpr std::size_t enough_held_out_cells = 50;

/// The noise variance, at least `noise`, that makes the predicted variances consistent: the trimmed mean of
/// error / (predicted + noise) over the smallest 90 % equals that of a normal distribution. Trimmed, because near steel
/// and at the survey's edge a few errors are far larger than a stationary kernel predicts.
double calibrated_noise(const std::vector<HeldOutError>& errors, double noise);

/// The fewest blocks of `block_s` seconds that give a thousand held-out cells, at most a fifth of all: each block costs
/// the regression of its surroundings.
SurveySplit split_for_calibration(const std::vector<FieldObservation>& observations, double cell_m, double block_s);

}  // namespace lodestone
