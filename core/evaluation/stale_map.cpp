#include "core/evaluation/stale_map.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <map>
#include <numbers>

namespace lodestone {

namespace {

constexpr double kLeastHolding = 0.2;  // share of cells that must not be stale if offsets are estimated from them alone

/// Weighted sums over the readings of a cell.
struct CellSums {
  double weight = 0.0;
  Vector3 position = Vector3::Zero();
  Vector3 difference = Vector3::Zero();
  Matrix3 correlated = Matrix3::Zero();  // weighted variance of the errors that are correlated within the cell
  double noise = 0.0;                    // squared weights times variance of the noise
  int readings = 0;
  Time first_time = std::numeric_limits<Time>::max();
  Time last_time = std::numeric_limits<Time>::min();

  void add(Time time, const FieldDifference& one) {
    const double share = 1.0 / (one.map_variance + one.pose_variance.trace() / 3.0 + one.noise_variance);
    weight += share;
    position += share * one.position;
    difference += share * one.difference_ut;
    correlated += share * (one.map_variance * Matrix3::Identity() + one.pose_variance);
    noise += share * share * one.noise_variance;
    ++readings;
    first_time = std::min(first_time, time);
    last_time = std::max(last_time, time);
  }

  FieldCellTest test(const CellKey& key) const {
    FieldCellTest result;
    result.key = key;
    result.center = position / weight;
    result.difference_ut = difference / weight;
    const Matrix3 variance = correlated / weight + noise / (weight * weight) * Matrix3::Identity();
    result.sigma_ut = std::sqrt(variance.trace() / 3.0);
    result.chi_square = result.difference_ut.dot(variance.llt().solve(result.difference_ut));
    result.p_value = chi_square_tail(result.chi_square);
    result.readings = readings;
    result.first_time = first_time;
    result.last_time = last_time;
    return result;
  }
};

std::vector<FieldCellTest> test_cells(const FieldComparison& comparison, const StaleMapOptions& options,
                                      const std::vector<MagnetometerOffset>& offsets) {
  std::map<CellKey, CellSums> sums;
  compare_field(comparison, [&](const ComparedArray& array) {
    if (!array.moved) return;
    for (FieldDifference one : array.differences) {
      if (subtract_offset(offsets, one)) sums[cell_of(one.position, options.cell_m)].add(array.time, one);
    }
  });
  std::vector<FieldCellTest> cells;
  for (const auto& [key, sum] : sums) {
    cells.push_back(sum.test(key));
    FieldCellTest& cell = cells.back();
    const bool stale =
        cell.p_value < options.false_alarm_probability && cell.difference_ut.norm() >= options.min_difference_ut;
    cell.place = stale ? -1 : 0;  // join() assigns the number
  }
  return cells;
}

/// Indices of the stale cells that are connected with `first`.
std::vector<std::size_t> connected(const std::vector<FieldCellTest>& cells, const std::map<CellKey, std::size_t>& index,
                                   std::size_t first, std::vector<bool>& taken) {
  std::vector<std::size_t> group{first};
  taken[first] = true;
  for (std::size_t next = 0; next < group.size(); ++next) {
    const CellKey key = cells[group[next]].key;
    for (int column = -1; column <= 1; ++column) {
      for (int row = -1; row <= 1; ++row) {
        const auto found = index.find({key.first + column, key.second + row});
        if (found == index.end() || taken[found->second]) continue;
        taken[found->second] = true;
        group.push_back(found->second);
      }
    }
  }
  return group;
}

StalePlace place_of(const std::vector<FieldCellTest>& cells, const std::vector<std::size_t>& group, double cell_m) {
  StalePlace place;
  place.cells = static_cast<int>(group.size());
  place.first_time = cells[group.front()].first_time;
  place.last_time = cells[group.front()].last_time;
  CellKey low = cells[group.front()].key;
  CellKey high = low;
  const double share = 1.0 / static_cast<double>(group.size());
  for (const std::size_t i : group) {
    const FieldCellTest& cell = cells[i];
    const double size_ut = cell.difference_ut.norm();
    place.center += share * cell.center;
    place.mean_difference_ut += share * size_ut;
    place.first_time = std::min(place.first_time, cell.first_time);
    place.last_time = std::max(place.last_time, cell.last_time);
    low = {std::min(low.first, cell.key.first), std::min(low.second, cell.key.second)};
    high = {std::max(high.first, cell.key.first), std::max(high.second, cell.key.second)};
    if (size_ut < place.largest_difference_ut) continue;
    place.largest_difference_ut = size_ut;
    place.difference_ut = cell.difference_ut;
    place.sigma_ut = cell.sigma_ut;
    place.chi_square = cell.chi_square;
    place.p_value = cell.p_value;
  }
  place.extent_m = cell_m * (1 + std::max(high.first - low.first, high.second - low.second));
  return place;
}

/// Joins the stale cells to places, numbers the places and writes the numbers into the cells.
std::vector<StalePlace> join(std::vector<FieldCellTest>& cells, double cell_m) {
  std::map<CellKey, std::size_t> index;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].place != 0) index.emplace(cells[i].key, i);
  }
  struct Found {
    StalePlace place;
    std::vector<std::size_t> group;
  };
  std::vector<Found> found;
  std::vector<bool> taken(cells.size(), false);
  for (const auto& [key, first] : index) {
    if (taken[first]) continue;
    std::vector<std::size_t> group = connected(cells, index, first, taken);
    found.push_back({place_of(cells, group, cell_m), std::move(group)});
  }
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return a.place.largest_difference_ut > b.place.largest_difference_ut;
  });
  std::vector<StalePlace> places;
  for (Found& one : found) {
    one.place.number = static_cast<int>(places.size()) + 1;
    for (const std::size_t i : one.group) cells[i].place = one.place.number;
    places.push_back(one.place);
  }
  return places;
}

}  // namespace

double chi_square_tail(double chi_square) {
  if (!(chi_square > 0.0)) return 1.0;
  return std::erfc(std::sqrt(0.5 * chi_square)) +
         std::sqrt(2.0 * chi_square / std::numbers::pi) * std::exp(-0.5 * chi_square);
}

bool subtract_offset(const std::vector<MagnetometerOffset>& offsets, FieldDifference& difference) {
  const MagnetometerOffset& offset = offsets[static_cast<std::size_t>(difference.magnetometer)];
  if (offset.odd) return false;
  difference.difference_ut -= difference.R_map_mag * offset.offset_ut;
  difference.map_variance += offset.sigma_ut * offset.sigma_ut;  // a constant error, correlated like the map's
  return true;
}

std::size_t StaleMap::stale_cells() const {
  return static_cast<std::size_t>(
      std::count_if(cells.begin(), cells.end(), [](const auto& cell) { return cell.place != 0; }));
}

StaleMap find_stale_places(const FieldComparison& comparison, const StaleMapOptions& options) {
  StaleMap result;
  result.options = options;
  result.offsets = magnetometer_offsets(comparison, options.cell_m, [](const Vector3&) { return true; });
  result.cells = test_cells(comparison, options, result.offsets);
  if (result.cells.empty()) compare_field(comparison, [&](const ComparedArray&) { ++result.posed_readings; });
  if (result.stale_cells() > 0) {
    std::map<CellKey, bool> stale;
    for (const FieldCellTest& cell : result.cells) stale[cell.key] = cell.place != 0;
    const auto again = magnetometer_offsets(comparison, options.cell_m, [&](const Vector3& position) {
      const auto found = stale.find(cell_of(position, options.cell_m));
      return found != stale.end() && !found->second;
    });
    for (std::size_t j = 0; j < again.size(); ++j) {
      if (again[j].cells >= kLeastHolding * static_cast<double>(result.offsets[j].cells)) result.offsets[j] = again[j];
    }
    result.cells = test_cells(comparison, options, result.offsets);
  }
  result.places = join(result.cells, options.cell_m);
  return result;
}

}  // namespace lodestone
