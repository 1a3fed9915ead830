#pragma once

#include "tools/plotting/pictures.h"
#include "tools/run/estimator_run.h"

namespace lodestone {

/// What the pictures show of one pass; its figures against the truth must be there.
PictureSeries picture_series(const EstimatorOutcome& outcome);

/// Writes map, error and distribution, each as .png, .pdf and .svg, into `folder`. `map` may be null.
void write_pictures(const std::filesystem::path& folder, const MagneticMap* map, const Trajectory& truth,
                    const std::vector<PictureSeries>& series);

/// Writes stale_map as .png, .pdf and .svg into `folder`: of the first pass with a stale-map report; of others
/// stale_map_NAME.
void write_stale_map_pictures(const std::filesystem::path& folder, const MagneticMap& map,
                              const std::vector<EstimatorOutcome>& outcomes);

}  // namespace lodestone
