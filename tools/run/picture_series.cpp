#include "tools/run/picture_series.h"

#include <cmath>

#include "core/evaluation/errors.h"
#include "tools/plotting/stale_map_picture.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

/// The part of the ground truth during the log. A ground truth of a whole day would make the picture too wide.
Trajectory crop_to_log(const Trajectory& truth, const std::vector<PictureSeries>& series) {
  Trajectory part;
  for (const PictureSeries& one : series) {
    if (one.trajectory.empty()) continue;
    for (const StampedPose& pose : truth) {
      if (pose.time >= one.trajectory.front().time && pose.time <= one.trajectory.back().time) part.push_back(pose);
    }
    break;
  }
  return part;
}

}  // namespace

PictureSeries picture_series(const EstimatorOutcome& outcome) {
  PictureSeries series;
  series.name = outcome.summary.estimator;
  series.trajectory = outcome.record.best();
  if (outcome.summary.truth) {
    for (const PosePair& pair : outcome.summary.truth->pairs) {
      series.error_time_s.push_back(to_seconds(pair.time - outcome.log_begin));
    }
    series.error_m = translation_errors(outcome.summary.truth->pairs);
  }
  bool magnetic = false;
  for (const EstimateRecord::Step& step : outcome.record.steps()) {
    series.step_time_s.push_back(to_seconds(step.time - outcome.log_begin));
    series.degenerate_directions.push_back(step.diagnostics.degenerate_directions);
    const bool seen = step.diagnostics.magnetic_samples > 0;
    series.magnetic_weight.push_back(seen ? step.diagnostics.magnetic_weight : std::nan(""));
    magnetic = magnetic || seen;
  }
  if (!magnetic) series.magnetic_weight.clear();
  return series;
}

void write_pictures(const std::filesystem::path& folder, const MagneticMap* map, const Trajectory& truth,
                    const std::vector<PictureSeries>& series) {
  made_folder(folder);
  draw_map_picture(folder / "map", map, crop_to_log(truth, series), series);
  draw_error_picture(folder / "error", series);
  draw_distribution_picture(folder / "distribution", series);
}

void write_stale_map_pictures(const std::filesystem::path& folder, const MagneticMap& map,
                              const std::vector<EstimatorOutcome>& outcomes) {
  made_folder(folder);
  bool first = true;
  for (const EstimatorOutcome& outcome : outcomes) {
    if (!outcome.summary.stale_map || outcome.field_rows.empty()) continue;
    std::vector<DifferencePoint> drive;
    for (const FieldRow& row : outcome.field_rows) drive.push_back({row.position, row.mean_size_ut});
    const std::string name = first ? std::string("stale_map") : "stale_map_" + outcome.summary.estimator;
    draw_stale_map_picture(folder / name, map, drive, *outcome.summary.stale_map);
    first = false;
  }
}

}  // namespace lodestone
