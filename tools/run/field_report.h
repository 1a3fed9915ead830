#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/evaluation/stale_map.h"
#include "core/warnings.h"
#include "estimators/options.h"
#include "tools/run/estimate_record.h"

namespace lodestone {

/// What the field's differences from the map are judged with; all must outlive the run.
struct FieldMaterial {
  const MagneticMap* map = nullptr;  ///< null: nothing is compared
  const SensorSuite* suite = nullptr;
  const RunOptions* options = nullptr;
};

/// The array against the map over one scan, at the best pose. Map axes, µT.
struct FieldRow {
  Time time = 0;                            ///< of the scan's end
  Vector3 position = Vector3::Zero();       ///< mean of the magnetometers', map, metres
  double mean_size_ut = 0.0;                ///< mean |measured − map| over readings
  Vector3 difference_ut = Vector3::Zero();  ///< mean of measured − map
  double sigma_ut = 0.0;                    ///< that map, noise and pose allow `difference_ut`, a component
  double weight = 0.0;                      ///< mean Huber weight that the estimator gave; nan where it took none
};

struct FieldReport {
  StaleMap stale;
  std::vector<FieldRow> rows;  ///< one a scan that met the map, in order of time
};

/// Holds all readings of a run against the map along its best trajectory, up to where it lost track. Offsets of
/// magnetometers are taken off, and counted in `warnings` as field.offset and field.odd_magnetometer; where most of the
/// drive disagrees field.disagrees says that the map need not be what is wrong.
FieldReport report_field(const FieldMaterial& material, const ArrayLog& readings, const EstimateRecord& record,
                         WarningLog& warnings);

/// Writes field_residuals.csv, stale_places.csv and field_cells.csv (every cell driven through) into `folder`. Throws
/// InputError where that fails.
void write_field_report(const std::filesystem::path& folder, const FieldReport& report);

/// For the terminal: how many places, what was to be expected by chance, the worst three.
std::string stale_map_text(const std::string& estimator, const StaleMap& stale);

}  // namespace lodestone
