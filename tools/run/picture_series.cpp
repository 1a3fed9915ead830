#include "tools/run/picture_series.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/evaluation/association.h"
#include "core/evaluation/errors.h"
#include "tools/plotting/stale_map_picture.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

/// The part of the ground truth during the scans. A ground truth of a whole day would make the picture too wide.
Trajectory crop_to_scans(const Trajectory& truth, const std::vector<Time>& scans) {
  Trajectory part;
  for (const StampedPose& pose : truth) {
    if (!scans.empty() && pose.time >= scans.front() && pose.time <= scans.back()) part.push_back(pose);
  }
  return part;
}

std::vector<Time> scans_of(const EstimateRecord& record) {
  std::vector<Time> scans;
  for (const EstimateRecord::Step& step : record.steps()) scans.push_back(step.time);
  return scans;
}

/// The position error at each scan with ground truth; nan without a pose.
void add_position_errors(PictureSeries& series, const EstimatorOutcome& outcome, const Trajectory& truth) {
  if (!outcome.summary.truth) return;
  const PosePairs& pairs = outcome.summary.truth->pairs;
  const std::vector<double> errors_m = translation_errors(pairs);
  std::size_t next = 0;
  for (const StampedPose& scan : truth_at(scans_of(outcome.record), truth)) {
    while (next < pairs.size() && pairs[next].time < scan.time) ++next;
    const bool found = next < pairs.size() && pairs[next].time == scan.time;
    series.error_time_s.push_back(to_seconds(scan.time - outcome.log_begin));
    series.error_m.push_back(found ? errors_m[next] : std::nan(""));
  }
}

}  // namespace

PictureSeries picture_series(const EstimatorOutcome& outcome, const Trajectory& truth) {
  PictureSeries series;
  series.name = outcome.summary.estimator;
  series.trajectory = outcome.record.best();
  add_position_errors(series, outcome, truth);
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

std::vector<Time> scan_ends(const std::vector<EstimatorOutcome>& outcomes) {
  std::set<Time> ends;
  for (const EstimatorOutcome& outcome : outcomes) {
    const std::vector<Time> scans = scans_of(outcome.record);
    ends.insert(scans.begin(), scans.end());
  }
  return {ends.begin(), ends.end()};
}

void write_pictures(const std::filesystem::path& folder, const MagneticMap* map, const Trajectory& truth,
                    const std::vector<Time>& scans, const std::vector<PictureSeries>& series) {
  made_folder(folder);
  draw_map_picture(folder / "map", map, crop_to_scans(truth, scans), series);
  const auto compared = [](const PictureSeries& one) { return !one.error_m.empty(); };
  if (std::none_of(series.begin(), series.end(), compared)) return;
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
    draw_stale_map_picture(folder / name, outcome.summary.estimator, map, drive, *outcome.summary.stale_map);
    first = false;
  }
}

}  // namespace lodestone
