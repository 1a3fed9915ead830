#include "frontends/maps/field_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "core/error.h"
#include "core/magnetometer/sparse_field_nodes.h"
#include "core/middle_value.h"
#include "frontends/configuration/options.h"
#include "frontends/maps/field_table.h"
#include "frontends/messages/sensor_checks.h"

namespace lodestone {
namespace {

/// Positions closer than this are equal: files round to millimetres, often to centimetres.
constexpr double same_m = 5e-4;

/// Measured positions vary about their nodes. If there is no grid otherwise, positions within this distance are merged.
constexpr std::array scatters_m{same_m, 5e-3, 2e-2};

/// Smallest ratio of the node spacing to that distance.
constexpr double least_step_over_scatter = 5.0;

/// A grid with more nodes per line is not a grid, only numbers with few digits.
constexpr double most_nodes_a_row = 1000.0;

/// Larger sites, or coarser maps with integer positions, are probably in millimetres.
constexpr double largest_usual_site_m = 20e3, largest_usual_step_m = 20.0;

/// The centres of clusters of values that are closer together than `scatter`, sorted.
std::vector<double> cluster_centres(std::vector<double> values, double scatter) {
  std::sort(values.begin(), values.end());
  std::vector<double> result;
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    for (end = begin + 1; end < values.size() && values[end] - values[end - 1] <= scatter;) ++end;
    result.push_back(values[begin + (end - begin) / 2]);
  }
  return result;
}

struct Axis {
  double origin = 0.0, step = 0.0;
  int count = 0;

  /// Index of the nearest node.
  int place(double value) const { return static_cast<int>(std::lround((value - origin) / step)); }
};

/// The regular grid through all values; nothing if there is none or only one value.
std::optional<Axis> even_axis(const std::vector<double>& values) {
  if (values.size() < 2) return std::nullopt;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < values.size(); ++i) smallest = std::min(smallest, values[i] - values[i - 1]);
  // Rounded positions have uneven steps. The mean of the single steps is the spacing.
  double sum = 0.0;
  int singles = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (const double gap = values[i] - values[i - 1]; gap < 1.5 * smallest) {
      sum += gap;
      ++singles;
    }
  }
  Axis axis;
  axis.origin = values.front();
  const double length = values.back() - values.front();
  const double steps = std::round(length / (sum / singles));
  if (!(steps >= 1.0 && steps <= 1e6)) return std::nullopt;
  axis.step = length / steps;
  axis.count = static_cast<int>(steps) + 1;
  const double tolerance = std::min(0.05 + same_m / axis.step, 0.2);  // relative to the step
  for (const double value : values) {
    const double place = (value - axis.origin) / axis.step;
    if (std::abs(place - std::round(place)) > tolerance) return std::nullopt;
  }
  return axis;
}

class Importer {
 public:
  Importer(const std::string& path, const FieldImportOptions& options)
      : path_(path), options_(options), table_(read_field_table(path)) {}

  ImportedField make() {
    find_grid();
    const double factor = find_unit();
    place_rows(factor);
    const auto nodes = std::make_shared<SparseFieldNodes>();
    double largest_sigma = 0.0;
    for (const Placed& placed : placed_) {
      const FieldTableRow& row = *placed.row;
      const double sigma = row.sigma >= 0.0 ? row.sigma * factor : options_.sigma_ut;
      largest_sigma = std::max(largest_sigma, sigma);
      nodes->set(placed.layer, placed.row_index, placed.column,
                 Eigen::Vector4f(static_cast<float>(row.field[0] * factor), static_cast<float>(row.field[1] * factor),
                                 static_cast<float>(row.field[2] * factor), static_cast<float>(sigma)));
    }
    constexpr std::size_t cache_bytes = 64U << 20U;
    // Rounding of a float must not put the largest sigma above the limit.
    const double max_sigma = std::max(largest_sigma * (1.0 + 1e-6), 1e-3);
    return {MagneticMap(grid_, nodes, max_sigma, cache_bytes),
            unit_,
            unit_from_size_,
            table_.rows.front().sigma >= 0.0,
            median_ut_,
            static_cast<std::int64_t>(placed_.size()),
            in_cells_,
            metres_in_doubt()};
  }

 private:
  struct Placed {
    int layer, row_index, column;
    const FieldTableRow* row;
    auto key() const { return std::array{layer, row_index, column}; }
  };

  [[noreturn]] void fail(const std::string& what) const { throw InputError(path_ + ": " + what); }
  [[noreturn]] void fail_scattered(const std::string& what) const {
    fail(what +
         "; these are scattered readings, not a grid: build a map from the survey with `lodestone map "
         "magnetic`");
  }

  static bool has_field(const FieldTableRow& row) { return !std::isnan(row.field[0] + row.field[1] + row.field[2]); }

  std::vector<double> positions(std::size_t axis) const {
    std::vector<double> values;
    values.reserve(table_.rows.size());
    for (const FieldTableRow& row : table_.rows) values.push_back(row.position[axis]);
    return values;
  }

  Axis find_axis(std::size_t axis) const {
    const std::vector<double> values = positions(axis);
    for (const double scatter : scatters_m) {
      const std::vector<double> places = cluster_centres(values, scatter);
      if (places.size() < 2) break;
      const auto even = even_axis(places);
      if (even && (scatter == same_m || even->step > least_step_over_scatter * scatter)) return *even;
    }
    const char name = "xy"[axis];
    if (cluster_centres(values, same_m).size() < 2)
      fail(fmt::format("all positions have the same {}; a map requires at least two nodes per side", name));
    fail_scattered(fmt::format("the positions' {} are not evenly spaced", name));
  }

  /// Heights at which most nodes with field exist. A layer without field would leave none between it and the next.
  std::vector<double> find_heights() const {
    std::vector<double> values;
    for (const FieldTableRow& row : table_.rows) {
      if (has_field(row)) values.push_back(row.position[2]);
    }
    if (values.empty()) fail("no line has a field");
    for (const double scatter : scatters_m) {
      std::vector<double> heights = cluster_centres(values, scatter);
      if (static_cast<double>(x_.count) * y_.count * static_cast<double>(heights.size()) <
          4.0 * static_cast<double>(values.size())) {
        return heights;
      }
    }
    return cluster_centres(values, same_m);
  }

  void find_grid() {
    if (table_.has_height && options_.height_m) fail("the table has heights (z); omit --height");
    if (!table_.has_height && !options_.height_m)
      fail("the table has no heights (z); set --height to the map's height in metres");
    x_ = find_axis(0);
    y_ = find_axis(1);
    if (std::abs(x_.step - y_.step) > 0.01 * std::max(x_.step, y_.step)) {
      fail(fmt::format(
          "the nodes are {:.4g} m apart along x and {:.4g} m along y; expected equal spacing: resample the grid",
          x_.step, y_.step));
    }
    grid_.heights_m = table_.has_height ? find_heights() : std::vector<double>{*options_.height_m};
    const double rows = static_cast<double>(table_.rows.size());
    if (static_cast<double>(x_.count) * y_.count * static_cast<double>(grid_.heights_m.size()) >
        most_nodes_a_row * rows) {
      fail_scattered(fmt::format("{} lines for {} x {} x {} places", table_.rows.size(), x_.count, y_.count,
                                 grid_.heights_m.size()));
    }
    // The longer side gives the most accurate spacing.
    grid_.resolution_m = x_.count >= y_.count ? x_.step : y_.step;
    grid_.origin = {x_.origin, y_.origin};
    grid_.columns = x_.count;
    grid_.rows = y_.count;
  }

  bool metres_in_doubt() const {
    if (table_.names_metres) return false;
    if (std::max(grid_.columns - 1, grid_.rows - 1) * grid_.resolution_m > largest_usual_site_m) return true;
    return grid_.resolution_m > largest_usual_step_m &&
           std::all_of(table_.rows.begin(), table_.rows.end(), [](const FieldTableRow& row) {
             return std::nearbyint(row.position[0]) == row.position[0] &&
                    std::nearbyint(row.position[1]) == row.position[1];
           });
  }

  /// Factor to µT.
  double find_unit() {
    std::vector<double> sizes;
    for (const FieldTableRow& row : table_.rows) {
      const double size = std::hypot(row.field[0], row.field[1], row.field[2]);
      if (std::isfinite(size)) sizes.push_back(size);
    }
    if (sizes.empty()) fail("no line has a field");
    const double median = middle_value(std::move(sizes));
    const auto told = options_.unit ? options_.unit : table_.unit;
    unit_from_size_ = !told;
    const std::string fitting = fitting_field_unit(median);
    if (!told && fitting.empty()) {
      fail(
          fmt::format("half of the field is above {:.4g}, which is not the earth's field in any unit (20 to 70 "
                      "microtesla); set --unit",
                      median));
    }
    if (told) {
      unit_ = *told;
    } else {
      options_detail::parse_name(fitting, unit_);
    }
    median_ut_ = median * microtesla_per(unit_);
    if (median_ut_ < 0.1 || median_ut_ > 1000.0) {
      fail(fmt::format("half of the field is above {:.4g} microtesla if it is in {}; expected 0.1 to 1000{}",
                       median_ut_, options_detail::write_value(unit_),
                       fitting.empty() ? "" : ": it looks like " + fitting + ", set --unit " + fitting));
    }
    return microtesla_per(unit_);
  }

  void place_rows(double factor) {
    constexpr double largest_ut = 1e6;  // near a magnet
    for (const FieldTableRow& row : table_.rows) {
      if (!has_field(row)) continue;
      for (const double value : {row.field[0], row.field[1], row.field[2], std::max(row.sigma, 0.0)}) {
        if (std::abs(value * factor) < largest_ut) continue;
        throw InputError(fmt::format("{}:{}: {:g} microtesla is not a valid field; expected less than {:g}", path_,
                                     row.line, value * factor, largest_ut));
      }
      int layer = 0;
      if (table_.has_height) {
        const auto nearer = [&](double a, double b) {
          return std::abs(a - row.position[2]) < std::abs(b - row.position[2]);
        };
        layer = static_cast<int>(std::min_element(grid_.heights_m.begin(), grid_.heights_m.end(), nearer) -
                                 grid_.heights_m.begin());
      }
      placed_.push_back({layer, y_.place(row.position[1]), x_.place(row.position[0]), &row});
    }
    const auto before = [](const Placed& a, const Placed& b) { return a.key() < b.key(); };
    std::stable_sort(placed_.begin(), placed_.end(), before);
    for (std::size_t i = 1; i < placed_.size(); ++i) {
      if (placed_[i].key() != placed_[i - 1].key()) continue;
      const FieldTableRow& row = *placed_[i].row;
      fail(fmt::format("lines {} and {} have the same position, x {:g}, y {:g}; expected one line per node",
                       placed_[i - 1].row->line, row.line, row.position[0], row.position[1]));
    }
    std::vector<bool> in_cell(placed_.size(), false);
    const auto index_of = [&](const Placed& node, int up, int right) {
      const Placed wanted{node.layer, node.row_index + up, node.column + right, nullptr};
      const auto found = std::lower_bound(placed_.begin(), placed_.end(), wanted, before);
      return found != placed_.end() && found->key() == wanted.key() ? static_cast<std::size_t>(found - placed_.begin())
                                                                    : placed_.size();
    };
    for (std::size_t i = 0; i < placed_.size(); ++i) {
      const std::size_t corners[] = {i, index_of(placed_[i], 0, 1), index_of(placed_[i], 1, 0),
                                     index_of(placed_[i], 1, 1)};
      if (*std::max_element(std::begin(corners), std::end(corners)) == placed_.size()) continue;
      for (const std::size_t corner : corners) in_cell[corner] = true;
    }
    in_cells_ = std::count(in_cell.begin(), in_cell.end(), true);
    if (10 * in_cells_ < static_cast<std::int64_t>(placed_.size())) {
      fail_scattered(fmt::format("only {1} of {0} positions have neighbours every {2:.4g} m", placed_.size(), in_cells_,
                                 grid_.resolution_m));
    }
  }

  std::string path_;
  FieldImportOptions options_;
  FieldTable table_;
  FieldGrid grid_;
  Axis x_, y_;
  FieldUnit unit_ = FieldUnit::microtesla;
  bool unit_from_size_ = false;
  double median_ut_ = 0.0;
  std::vector<Placed> placed_;
  std::int64_t in_cells_ = 0;
};

}  // namespace

ImportedField import_field_table(const std::string& path, const FieldImportOptions& options) {
  return Importer(path, options).make();
}

}  // namespace lodestone
