#include "tools/run/field_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "frontends/configuration/output_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/table.h"

namespace lodestone {

namespace {

constexpr double kReportedOffset_ut = 0.5;  // smaller offsets are subtracted without a warning

/// Sums over one scan's readings.
struct RowSums {
  std::size_t pose_index = 0;
  int count = 0;
  Vector3 position = Vector3::Zero();
  Vector3 difference = Vector3::Zero();
  double size = 0.0;
  double correlated = 0.0;  // variance per component of errors that are correlated between neighbours
  double noise = 0.0;

  void add(const FieldDifference& one) {
    ++count;
    position += one.position;
    difference += one.difference_ut;
    size += one.difference_ut.norm();
    correlated += one.map_variance + one.pose_variance.trace() / 3.0;
    noise += one.noise_variance;
  }
};

/// The estimator's weight of magnetic samples at `time`. The search begins at `next`, which is advanced.
double weight_at(const std::vector<EstimateRecord::Step>& steps, Time time, std::size_t& next) {
  while (next < steps.size() && steps[next].time < time) ++next;
  if (next == steps.size() || steps[next].time != time || steps[next].diagnostics.magnetic_samples == 0)
    return std::nan("");
  return steps[next].diagnostics.magnetic_weight;
}

std::vector<FieldRow> field_rows(const FieldComparison& comparison, const std::vector<MagnetometerOffset>& offsets,
                                 const EstimateRecord& record) {
  std::vector<FieldRow> rows;
  RowSums sums;
  std::size_t next_step = 0;
  const auto finish = [&]() {
    if (sums.count > 0) {
      FieldRow row;
      row.time = comparison.trajectory[sums.pose_index].time;
      row.position = sums.position / sums.count;
      row.mean_size_ut = sums.size / sums.count;
      row.difference_ut = sums.difference / sums.count;
      row.sigma_ut =
          std::sqrt(sums.correlated / sums.count + sums.noise / (static_cast<double>(sums.count) * sums.count));
      row.weight = weight_at(record.steps(), row.time, next_step);
      rows.push_back(row);
    }
    sums = {};
  };
  compare_field(comparison, [&](const ComparedArray& array) {
    if (array.pose_index != sums.pose_index) finish();
    sums.pose_index = array.pose_index;
    for (FieldDifference one : array.differences) {
      if (subtract_offset(offsets, one)) sums.add(one);
    }
  });
  finish();
  return rows;
}

void warn(const StaleMap& stale, const SensorSuite& suite, Time time, WarningLog& warnings) {
  std::vector<std::string> offsets;
  for (std::size_t j = 0; j < stale.offsets.size(); ++j) {
    const MagnetometerOffset& offset = stale.offsets[j];
    const std::string& name = suite.magnetometers[j].name;
    if (offset.odd) {
      warnings.add("field.odd_magnetometer",
                   fmt::format("{}: its difference from the map varies by {:.1f} uT along the path, far more than for "
                               "the others: stuck, "
                               "drifting or loose; not used in the stale-map report",
                               name, offset.spread_ut),
                   time);
    } else if (offset.offset_ut.norm() > kReportedOffset_ut) {
      const Vector3& found = offset.offset_ut;
      offsets.push_back(fmt::format("{} ({:.2f}, {:.2f}, {:.2f})", name, found.x(), found.y(), found.z()));
    }
  }
  if (!offsets.empty()) {
    warnings.add(
        "field.offset",
        fmt::format("differences from the map along the whole path, uT in each magnetometer's x, y, z: {}: hard "
                    "iron, drift or a map built with these offsets; subtracted in the stale-map report",
                    fmt::join(offsets, ", ")),
        time);
  }
  if (stale.map_is_hardly_the_cause()) {
    warnings.add("field.disagrees",
                 fmt::format("the field differs from the map in {} of {} visited cells: trajectory, "
                             "calibration or choice of the map may be wrong instead of the map",
                             stale.stale_cells(), stale.cells.size()),
                 time);
  }
}

}  // namespace

FieldReport report_field(const FieldReportInputs& inputs, const ArrayLog& readings, const EstimateRecord& record,
                         WarningLog& warnings) {
  const FieldComparison comparison = comparison_with(*inputs.map, inputs.options->magnetic.interpolation, readings,
                                                     *inputs.suite, record.best(), record.covariances());
  FieldReport report;
  report.stale = find_stale_places(comparison, inputs.options->report.stale_map);
  report.rows = field_rows(comparison, report.stale.offsets, record);
  warn(report.stale, *inputs.suite, record.best().empty() ? 0 : record.best().front().time, warnings);
  return report;
}

void write_field_report(const std::filesystem::path& folder, const FieldReport& report) {
  OutputFile rows(folder / "field_residuals.csv");
  rows.write(
      "t_s,x_m,y_m,z_m,mean_difference_ut,difference_x_ut,difference_y_ut,difference_z_ut,sigma_ut,magnetic_weight\n");
  for (const FieldRow& row : report.rows) {
    rows.write(fmt::format("{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n",
                           format_stamp(row.time), row.position.x(), row.position.y(), row.position.z(),
                           row.mean_size_ut, row.difference_ut.x(), row.difference_ut.y(), row.difference_ut.z(),
                           row.sigma_ut, row.weight));
  }
  OutputFile places(folder / "stale_places.csv");
  places.write(
      "place,x_m,y_m,z_m,extent_m,cells,largest_difference_ut,mean_difference_ut,difference_x_ut,difference_y_ut,"
      "difference_z_ut,sigma_ut,chi_square,p_value,first_t_s,last_t_s\n");
  for (const StalePlace& place : report.stale.places) {
    places.write(
        fmt::format("{},{:.3f},{:.3f},{:.3f},{:.2f},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.6g},{:.3g},{},{}\n",
                    place.number, place.center.x(), place.center.y(), place.center.z(), place.extent_m, place.cells,
                    place.largest_difference_ut, place.mean_difference_ut, place.difference_ut.x(),
                    place.difference_ut.y(), place.difference_ut.z(), place.sigma_ut, place.chi_square, place.p_value,
                    format_stamp(place.first_time), format_stamp(place.last_time)));
  }
  OutputFile cells(folder / "field_cells.csv");
  cells.write(
      "x_m,y_m,z_m,readings,difference_x_ut,difference_y_ut,difference_z_ut,sigma_ut,chi_square,p_value,place\n");
  for (const FieldCellTest& cell : report.stale.cells) {
    cells.write(fmt::format("{:.3f},{:.3f},{:.3f},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.6g},{:.3g},{}\n", cell.center.x(),
                            cell.center.y(), cell.center.z(), cell.readings, cell.difference_ut.x(),
                            cell.difference_ut.y(), cell.difference_ut.z(), cell.sigma_ut, cell.chi_square,
                            cell.p_value, cell.place));
  }
  for (OutputFile* file : {&rows, &places, &cells}) file->commit();
}

std::string stale_map_text(const std::string& estimator, const StaleMap& stale) {
  if (stale.cells.empty()) {
    return fmt::format("Stale map ({}): {}\n", estimator,
                       stale.posed_readings > 0
                           ? "the map has no field along the path"
                           : "not tested, because no reading of the magnetometers is between two poses");
  }
  if (stale.map_is_hardly_the_cause()) {
    return fmt::format(
        "Stale map ({}): the field differs from the map in {} of {} visited cells; rather the trajectory, the "
        "calibration or the choice of the map is wrong\n",
        estimator, stale.stale_cells(), stale.cells.size());
  }
  std::string text = fmt::format(
      "Stale map ({}): {} place{} ({} of {} visited cells of {:g} m) where the field differs from the map\n"
      "  probability of false alarm {:g} per cell: {:.1f} cells by chance\n",
      estimator, stale.places.size(), stale.places.size() == 1 ? "" : "s", stale.stale_cells(), stale.cells.size(),
      stale.options.cell_m, stale.options.false_alarm_probability, stale.expected_false_alarms());
  if (stale.places.empty()) return text;
  Table table({"place", "x m", "y m", "z m", "extent m", "largest uT", "mean uT", "sigma uT", "p value"});
  for (std::size_t i = 0; i < std::min<std::size_t>(3, stale.places.size()); ++i) {
    const StalePlace& place = stale.places[i];
    table.add({std::to_string(place.number), fixed(place.center.x(), 1), fixed(place.center.y(), 1),
               fixed(place.center.z(), 1), fixed(place.extent_m, 1), fixed(place.largest_difference_ut, 1),
               fixed(place.mean_difference_ut, 1), fixed(place.sigma_ut, 2), fmt::format("{:.1g}", place.p_value)});
  }
  return text + table.to_string();
}

}  // namespace lodestone
