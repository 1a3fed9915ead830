#include "tools/run/run_summary.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/evaluation/alignment.h"
#include "core/evaluation/consistency.h"
#include "core/evaluation/errors.h"
#include "core/evaluation/statistics.h"

namespace lodestone {

namespace {

constexpr double kLostError_m = 1.0;
constexpr double kEndTolerance_s = 1.0;  // a log may end with IMU samples after its last whole scan

}  // namespace

const char* status_name(RunStatus status) {
  switch (status) {
    case RunStatus::done:
      return "done";
    case RunStatus::lost:
      return "lost";
    case RunStatus::interrupted:
      return "interrupted";
    case RunStatus::stopped:
      return "stopped";
  }
  return "stopped";
}

TruthFigures compare_with_truth(const EstimateRecord& record, const Trajectory& truth, Time log_end, RunStatus status) {
  TruthFigures figures;
  figures.pairs = associate_interpolated(record.best(), truth);
  const bool finite = std::all_of(figures.pairs.begin(), figures.pairs.end(), [](const PosePair& pair) {
    return pair.estimate.position.allFinite() && pair.estimate.rotation.coeffs().allFinite();
  });
  if (figures.pairs.empty() || !finite) {
    figures.ate_m = figures.max_error_m = figures.heading_rmse_deg = std::nan("");
    return figures;
  }
  const ErrorStatistics translation = summarize(translation_errors(figures.pairs));
  figures.ate_m = translation.rmse;
  figures.max_error_m = translation.max;
  if (const auto similarity = find_alignment(figures.pairs, Alignment::se3)) {
    figures.ate_se3_m = summarize(translation_errors(align(*similarity, figures.pairs))).rmse;
  }
  figures.heading_rmse_deg = summarize(heading_errors(figures.pairs)).rmse * 180.0 / std::numbers::pi;

  std::vector<Matrix6> covariances;
  for (const PosePair& pair : figures.pairs) covariances.push_back(record.covariances()[pair.estimate_index]);
  const Consistency consistency = evaluate_consistency(figures.pairs, covariances);
  if (consistency.count > 0) figures.nees_pose = consistency.nees;

  const bool at_the_end = to_seconds(log_end - record.best().back().time) <= kEndTolerance_s;
  figures.success = status == RunStatus::done && at_the_end && translation.max <= kLostError_m;
  return figures;
}

std::vector<StageFigures> compare_stages(const EstimateRecord& record, const Trajectory& truth) {
  std::vector<StageFigures> result;
  const auto add = [&](const char* name, const EstimateRecord::Poses& poses) {
    const PosePairs pairs = associate_interpolated(poses.trajectory, truth);
    if (pairs.empty()) return;
    StageFigures figures{name, 0.0, 0.0, 0.0, {}};
    const ErrorStatistics translation = summarize(translation_errors(pairs));
    figures.ate_m = translation.rmse;
    figures.max_error_m = translation.max;
    figures.heading_rmse_deg = summarize(heading_errors(pairs)).rmse * 180.0 / std::numbers::pi;
    std::vector<Matrix6> covariances;
    for (const PosePair& pair : pairs) covariances.push_back(poses.covariances[pair.estimate_index]);
    const Consistency consistency = evaluate_consistency(pairs, covariances);
    if (consistency.count > 0) figures.consistency = consistency;
    result.push_back(figures);
  };
  const auto same = [](const StampedPose& a, const StampedPose& b) {
    return a.time == b.time && a.pose.position == b.pose.position && a.pose.rotation.coeffs() == b.pose.rotation.coeffs();
  };
  add("causal", record.causal_poses());
  if (!record.smoothed_poses().trajectory.empty()) {
    add("smoothed", record.smoothed_poses());
    add("batch", record.best_poses());
  } else if (!std::equal(record.best().begin(), record.best().end(), record.causal_poses().trajectory.begin(),
                         record.causal_poses().trajectory.end(), same)) {
    add("smoothed", record.best_poses());
  }
  return result;
}

}  // namespace lodestone
