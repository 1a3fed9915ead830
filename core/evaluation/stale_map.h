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
    visitor.field("cell_m", cell_m, "side of a cell: differences from the map are averaged and judged cell by cell");
    visitor.field("false_alarm_probability", false_alarm_probability,
                  "that a cell driven through is called stale though the map still holds there");
    visitor.field("min_difference_ut", min_difference_ut, "smaller differences are of no interest, however certain");
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

/// A cell driven through: the mean difference of all readings in it, and what the map's and the sensors' noise allow.
struct FieldCellTest {
  CellKey key;
  Vector3 center = Vector3::Zero();         ///< mean position of the readings, map, metres
  Vector3 difference_ut = Vector3::Zero();  ///< measured minus map, map axes
  double sigma_ut = 0.0;                    ///< of that mean, root mean square over the components
  double chi_square = 0.0;                  ///< dᵀ V⁻¹ d, 3 degrees of freedom
  double p_value = 1.0;
  int readings = 0;
  Time first_time = 0;
  Time last_time = 0;
  int place = 0;  ///< number of its stale place; 0: the map holds here as far as can be told
};

/// Stale cells that touch, corners included. Vector, sigma, χ² and p value are those of the cell of largest difference.
struct StalePlace {
  int number = 0;                    ///< from 1; the largest difference first
  Vector3 center = Vector3::Zero();  ///< mean of its cells' centres, map, metres
  double extent_m = 0.0;             ///< longer side of the box round its cells
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
  std::vector<FieldCellTest> cells;         ///< driven through, by column and row
  std::vector<StalePlace> places;           ///< in the order of their numbers
  std::vector<MagnetometerOffset> offsets;  ///< one a magnetometer; taken off before anything was judged
  StaleMapOptions options;

  std::size_t stale_cells() const;
  double expected_false_alarms() const { return options.false_alarm_probability * static_cast<double>(cells.size()); }
};

/// Where the field disagrees with the map beyond what both allow. In each cell the weighted mean difference d of the
/// readings on the move is tested, dᵀ V⁻¹ d against χ² with 3 degrees of freedom, with
///   V = Σ a_i (σ_map² I + J P Jᵀ)_i + Σ a_i² σ_noise,i² I,  Σ a_i = 1:
/// errors of map and pose are alike within a cell to an unknown degree, so their mean is given the mean of their
/// variances, which is an upper bound whatever the correlation; noise averages out. Errors of a magnetometer that it
/// carries everywhere are taken off first (magnetometer_offsets), in a second round from the cells that hold; odd
/// magnetometers are left out.
StaleMap find_stale_places(const FieldComparison& comparison, const StaleMapOptions& options);

/// `difference` less the offset of its magnetometer; false for one that is left out.
bool without_offset(const std::vector<MagnetometerOffset>& offsets, FieldDifference& difference);

}  // namespace lodestone
