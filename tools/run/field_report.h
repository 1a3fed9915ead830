#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/evaluation/stale_map.h"
#include "core/warnings.h"
#include "estimators/options.h"
#include "tools/writers/estimate_record.h"

namespace lodestone {

/// Inputs of the comparison with the magnetic map. All must outlive the run.
struct FieldReportInputs {
  const MagneticMap* map = nullptr;  ///< null: no comparison
  const SensorSuite* suite = nullptr;
  const RunOptions* options = nullptr;
};

/// The array compared with the map over one scan, at the best pose. Map axes, µT.
struct FieldRow {
  Time time = 0;                            ///< the scan's end
  Vector3 position = Vector3::Zero();       ///< mean position of the magnetometers, map, metres
  double mean_size_ut = 0.0;                ///< mean |measured − map| over readings
  Vector3 difference_ut = Vector3::Zero();  ///< mean of measured − map
  double sigma_ut = 0.0;                    ///< of `difference_ut` from map, noise and pose, per component
  double weight = 0.0;                      ///< mean Huber weight in the estimator; nan if there is none
};

struct FieldReport {
  StaleMap stale;
  std::vector<FieldRow> rows;  ///< one per scan within the map, in order of time
};

/// Compares all readings of a run with the map along the best trajectory, until track is lost. Offsets of magnetometers
/// are subtracted, and counted in `warnings` as field.offset and field.odd_magnetometer. If most cells differ,
/// field.disagrees warns that the cause may not be the map.
FieldReport report_field(const FieldReportInputs& inputs, const ArrayLog& readings, const EstimateRecord& record,
                         WarningLog& warnings);

/// Writes field_residuals.csv, stale_places.csv and field_cells.csv (all visited cells) into `folder`. Throws
/// InputError if this fails.
void write_field_report(const std::filesystem::path& folder, const FieldReport& report);

/// Text for the terminal: number of places, number expected by chance, the worst three.
std::string stale_map_text(const std::string& estimator, const StaleMap& stale);

}  // namespace lodestone
