#include "core/evaluation/magnetometer_offsets.h"

#include <array>
#include <cmath>
#include <set>

#include "core/evaluation/stale_map.h"
#include "core/middle_value.h"

namespace lodestone {

namespace {

constexpr double kNormalSigma = 1.4826;  // standard deviation over median absolute deviation, normal distribution
constexpr double kMedianSigma = 1.2533;  // standard error of the median over that of the mean
constexpr double kCellsAShare = 2.0;     // effective correlation: neighbouring cells have a common map error
constexpr double kFalseAlarm = 1e-3;
constexpr double kOddSpread = 4.0;  // over the median spread of the other magnetometers
constexpr std::size_t kFewestCells = 8;

/// One difference of a magnetometer, in its own axes.
struct OffsetSample {
  std::array<std::vector<float>, 3> differences;
  std::set<CellKey> cells;
};

MagnetometerOffset offset_of(const OffsetSample& sample) {
  MagnetometerOffset result;
  result.cells = sample.cells.size();
  if (sample.differences[0].empty()) return result;
  Vector3 middle;
  double variance = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<float> values = sample.differences[axis];
    middle[static_cast<Eigen::Index>(axis)] = middle_value(values);
    for (float& value : values) value = std::abs(value - static_cast<float>(middle[static_cast<Eigen::Index>(axis)]));
    variance += std::pow(kNormalSigma * middle_value(values), 2) / 3.0;
  }
  result.spread_ut = std::sqrt(variance);
  if (sample.cells.size() < kFewestCells) return result;
  const double independent = static_cast<double>(sample.cells.size()) / kCellsAShare;
  const double sigma = kMedianSigma * result.spread_ut / std::sqrt(independent);
  if (sigma > 0.0 && chi_square_tail(middle.squaredNorm() / (sigma * sigma)) >= kFalseAlarm) return result;
  result.offset_ut = middle;
  result.sigma_ut = sigma;
  return result;
}

}  // namespace

std::vector<MagnetometerOffset> magnetometer_offsets(const FieldComparison& comparison, double cell_m,
                                                     const std::function<bool(const Vector3&)>& holds) {
  std::vector<OffsetSample> samples(comparison.suite.magnetometers.size());
  compare_field(comparison, [&](const ComparedArray& array) {
    if (!array.moved) return;
    for (const FieldDifference& one : array.differences) {
      if (!holds(one.position)) continue;
      OffsetSample& sample = samples[static_cast<std::size_t>(one.magnetometer)];
      const Vector3 own = one.R_map_mag.transpose() * one.difference_ut;
      for (int axis = 0; axis < 3; ++axis)
        sample.differences[static_cast<std::size_t>(axis)].push_back(static_cast<float>(own[axis]));
      sample.cells.insert(cell_of(one.position, cell_m));
    }
  });
  std::vector<MagnetometerOffset> offsets;
  std::vector<float> spreads;
  for (const OffsetSample& sample : samples) {
    offsets.push_back(offset_of(sample));
    if (offsets.back().spread_ut > 0.0) spreads.push_back(static_cast<float>(offsets.back().spread_ut));
  }
  if (spreads.size() < 3) return offsets;
  const double usual = middle_value(spreads);
  for (MagnetometerOffset& offset : offsets) offset.odd = offset.spread_ut > kOddSpread * usual;
  return offsets;
}

}  // namespace lodestone
