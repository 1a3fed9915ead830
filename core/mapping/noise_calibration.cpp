#include "core/mapping/noise_calibration.h"

#include <algorithm>
#include <numeric>

namespace lodestone {

double trimmed_normalized_square(const std::vector<HeldOutError>& errors, double noise) {
  constexpr double share = 0.9;
  constexpr double normal_value = 0.6231;  // of χ² with one degree of freedom, below its 90 % quantile
  std::vector<double> ratios;
  ratios.reserve(errors.size());
  for (const HeldOutError& held_out : errors) ratios.push_back(held_out.error / (held_out.predicted + noise));
  const auto count = static_cast<std::ptrdiff_t>(share * static_cast<double>(ratios.size()));
  std::nth_element(ratios.begin(), ratios.begin() + count, ratios.end());
  std::sort(ratios.begin(), ratios.begin() + count);  // fixed order of summation: the partition depends on the library
  return std::accumulate(ratios.begin(), ratios.begin() + count, 0.0) / static_cast<double>(count) / normal_value;
}

double calibrated_noise(const std::vector<HeldOutError>& errors, double noise) {
  constexpr double tolerance = 1.2;  // spread of this estimate
  if (trimmed_normalized_square(errors, noise) <= tolerance) return noise;
  double low = noise;
  double high = noise;
  for (const HeldOutError& held_out : errors) high = std::max(high, 4.0 * held_out.error);
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (trimmed_normalized_square(errors, middle) > 1.0 ? low : high) = middle;
  }
  return high;
}

std::vector<CalibrationSplit> splits_for_calibration(const std::vector<FieldObservation>& observations, double cell_m,
                                                     double block_m) {
  constexpr std::size_t enough = 1000;
  constexpr int turns = 5;
  const auto split_by = [&](int period, int phase) {
    const HeldOutBlocks blocks(observations, block_m, period, phase);
    CalibrationSplit split{split_survey(observations, cell_m, blocks), {}};
    for (const FieldCell& cell : split.cells.held_out) split.blocks.push_back(blocks.block_of(cell.time));
    return split;
  };
  std::vector<CalibrationSplit> splits;
  for (const int period : {96, 48, 24, 12}) {
    splits = {split_by(period, period / 2)};
    if (splits.front().cells.held_out.size() >= enough) return splits;
  }
  splits.clear();
  std::size_t held_out = 0;
  for (int turn = 0; turn < turns && held_out < enough; ++turn) {
    splits.push_back(split_by(turns, (turns / 2 + turn) % turns));
    held_out += splits.back().cells.held_out.size();
  }
  return splits;
}

}  // namespace lodestone
