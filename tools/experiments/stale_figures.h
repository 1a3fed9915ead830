#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/magnetometer/magnetic_map.h"

namespace lodestone::reproduce {

/// Quality of a run's stale-map report (field_cells.csv of its estimator). The true changes are the differences between
/// two maps at the visited cells: `field`, the run's map, and `own`, surveyed in the log's own scene. Returns
///   changed_cells        cells changed by more than 10 µT
///   changed_found        share of them that are reported; 1 if there are none
///   unchanged_reported   share of the cells changed by less than 0.3 µT that are reported; 0 if there are none
/// Throws InputError if the file is malformed.
std::map<std::string, double> stale_figures(const std::filesystem::path& cells, const MagneticMap& field,
                                            const MagneticMap& own);

/// Whether `name` is one of these. They exist only for runs whose maps are kept: those of the first seed, in figures
/// that compare maps.
bool is_stale_figure(const std::string& name);

}  // namespace lodestone::reproduce
