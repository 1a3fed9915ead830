#pragma once

#include "tools/plotting/pictures.h"
#include "tools/run/estimator_run.h"

namespace lodestone {

/// The data of one pass for the pictures. Requires errors against the ground truth.
PictureSeries picture_series(const EstimatorOutcome& outcome);

/// Writes map, error and distribution, each as .png, .pdf and .svg, into `folder`. `map` may be null.
void write_pictures(const std::filesystem::path& folder, const MagneticMap* map, const Trajectory& truth,
                    const std::vector<PictureSeries>& series);

/// Writes stale_map as .png, .pdf and .svg into `folder` for the first pass with a stale-map report, and
/// stale_map_NAME for the others.
void write_stale_map_pictures(const std::filesystem::path& folder, const MagneticMap& map,
                              const std::vector<EstimatorOutcome>& outcomes);

}  // namespace lodestone
