#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/magnetometer/magnetic_map.h"

namespace lodestone::reproduce {

/// How well a run's stale-map report (field_cells.csv of its estimator) tells where its map no longer holds. What
/// changed is told by the two maps themselves, at the cells driven through: `field`, which the run used, against `own`,
/// surveyed in the log's own scene. Gives
///   changed_cells        cells changed by more than 10 µT
///   changed_found        share of them that are reported; 1 where there is none
///   unchanged_reported   share of the cells changed by less than 0.3 µT that are reported; 0 where there is none
/// Throws InputError where the file is malformed.
std::map<std::string, double> stale_figures(const std::filesystem::path& cells, const MagneticMap& field,
                                            const MagneticMap& own);

/// Their names. They exist for runs whose maps are kept: those with the first seed that a figure compares.
bool is_stale_figure(const std::string& name);

}  // namespace lodestone::reproduce
