#pragma once

#include "tools/plotting/pictures.h"
#include "tools/run/estimator_run.h"

namespace lodestone {

/// The data of one pass for the pictures. Has errors at scans with ground truth; nan if the estimator was lost.
PictureSeries picture_series(const EstimatorOutcome& outcome, const Trajectory& truth);

/// The scan ends of all passes, in order of time. One pass may have ended early.
std::vector<Time> scan_ends(const std::vector<EstimatorOutcome>& outcomes);

/// Writes map, error and distribution, each as .png, .pdf and .svg, into `folder`. `map` may be null. The ground truth
/// is cropped to `scans`. If no scan has ground truth, only the map.
void write_pictures(const std::filesystem::path& folder, const MagneticMap* map, const Trajectory& truth,
                    const std::vector<Time>& scans, const std::vector<PictureSeries>& series);

/// Writes stale_map as .png, .pdf and .svg into `folder` for the first pass with a stale-map report, and
/// stale_map_NAME for the others.
void write_stale_map_pictures(const std::filesystem::path& folder, const MagneticMap& map,
                              const std::vector<EstimatorOutcome>& outcomes);

}  // namespace lodestone
