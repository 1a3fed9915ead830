#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "core/evaluation/field_comparison.h"
#include "core/evaluation/magnetometer_offsets.h"
#include "core/option_checks.h"
#include "core/options.h"

namespace lodestone {

struct StaleMapOptions {
  double cell_m = 0.5;
  double false_alarm_probability = 1e-3;
  double min_difference_ut = 0.0;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("cell_m", cell_m, "side of a cell; the differences from the map are averaged and tested per cell");
    visitor.field("false_alarm_probability", false_alarm_probability,
                  "probability that a visited cell is reported stale although the map is valid there");
    visitor.field("min_difference_ut", min_difference_ut,
                  "smaller differences are ignored, even if they are significant");
  }

  void check() const {
    option_checks::within("cell_m", cell_m, 0.05, 100.0);
    option_checks::within("false_alarm_probability", false_alarm_probability, 1e-12, 0.5);
    option_checks::not_negative("min_difference_ut", min_difference_ut);
  }
};

/// Column and row of a cell in the x-y plane of the map.
using CellKey = std::pair<int, int>;

inline CellKey cell_of(const Vector3& position, double cell_m) {
  return {static_cast<int>(std::floor(position.x() / cell_m)), static_cast<int>(std::floor(position.y() / cell_m))};
}

/// Probability that χ² with 3 degrees of freedom exceeds `chi_square`.
double chi_square_tail(double chi_square);

/// A visited cell: the mean difference of all its readings, and the covariance expected from the map's and sensors'
/// noise.
struct FieldCellTest {
  CellKey key;
  Vector3 center = Vector3::Zero();         ///< mean position of the readings, map, metres
  Vector3 difference_ut = Vector3::Zero();  ///< measured minus map, map axes
  double sigma_ut = 0.0;                    ///< of the mean difference, root mean square over the components
  double chi_square = 0.0;                  ///< dᵀ V⁻¹ d, 3 degrees of freedom
  double p_value = 1.0;
  int readings = 0;
  Time first_time = 0;
  Time last_time = 0;
  int place = 0;  ///< number of its stale place; 0: no significant difference
};

/// Connected stale cells (8-neighbourhood). Vector, sigma, χ² and p value are those of the cell with the largest
/// difference.
struct StalePlace {
  int number = 0;                    ///< from 1, in descending order of the difference
  Vector3 center = Vector3::Zero();  ///< mean of its cells' centres, map, metres
  double extent_m = 0.0;             ///< longer side of the bounding box
  int cells = 0;
  double largest_difference_ut = 0.0;
  double mean_difference_ut = 0.0;  ///< of |d| over its cells
  Vector3 difference_ut = Vector3::Zero();
  double sigma_ut = 0.0;
  double chi_square = 0.0;
  double p_value = 1.0;
  Time first_time = 0;
  Time last_time = 0;
};

struct StaleMap {
  std::vector<FieldCellTest> cells;         ///< visited cells, by column and row
  std::vector<StalePlace> places;           ///< in the order of their numbers
  std::vector<MagnetometerOffset> offsets;  ///< one per magnetometer; subtracted before the test
  std::size_t posed_readings = 0;           ///< array readings with a pose; only these are compared
  StaleMapOptions options;

  std::size_t stale_cells() const;

  /// More than half of the cells are stale: rather the trajectory, the calibration or the choice of the map is wrong.
  bool map_is_hardly_the_cause() const { return 2 * stale_cells() > cells.size(); }
  double expected_false_alarms() const { return options.false_alarm_probability * static_cast<double>(cells.size()); }
};

/// Places where the field differs significantly from the map. In each cell, the weighted mean difference d of the
/// readings in motion is tested: dᵀ V⁻¹ d against χ² with 3 degrees of freedom, with
///   V = Σ a_i (σ_map² I + J P Jᵀ)_i + Σ a_i² σ_noise,i² I,  Σ a_i = 1.
/// Errors of map and pose are correlated within a cell. The mean of their variances is an upper bound for any
/// correlation. Constant offsets of magnetometers are subtracted first (magnetometer_offsets), in a second round from
/// the cells that are not stale. Odd magnetometers are rejected.
StaleMap find_stale_places(const FieldComparison& comparison, const StaleMapOptions& options);

/// Subtracts the magnetometer's offset from `difference`. False if the magnetometer is rejected.
bool subtract_offset(const std::vector<MagnetometerOffset>& offsets, FieldDifference& difference);

}  // namespace lodestone
