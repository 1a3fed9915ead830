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

constexpr double kNear_m = 0.1;

/// A comparison with the ground truth, common to stages and the whole run.
struct PoseComparison {
  PosePairs pairs;
  bool finite = false;  ///< there are pairs, and every estimate is finite
  StageFigures figures;
};

/// Share of the time from the first pose to `end` (the log's end, with a tolerance) in which the position error is at
/// most `limit_m`. An interval between two poses counts if the error is small at both ends and no pose is missing.
double share_within(const PosePairs& pairs, const std::vector<double>& error_m, double limit_m, Time end) {
  if (pairs.empty()) return 0.0;
  double within_s = 0.0;
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    const double step_s = to_seconds(pairs[i].time - pairs[i - 1].time);
    if (error_m[i - 1] <= limit_m && error_m[i] <= limit_m && step_s <= kEndTolerance_s) within_s += step_s;
  }
  const bool at_the_end = to_seconds(end - pairs.back().time) <= kEndTolerance_s;
  const double span_s = to_seconds((at_the_end ? pairs.back().time : end) - pairs.front().time);
  if (!(span_s > 0.0)) return error_m.front() <= limit_m ? 1.0 : 0.0;
  return within_s / span_s;
}

/// `end`: the last time that estimate and ground truth should cover.
PoseComparison compare_poses(const std::string& name, const EstimateRecord::Poses& poses, const Trajectory& truth,
                             Time end) {
  PoseComparison compared;
  compared.figures.name = name;
  compared.pairs = associate_interpolated(poses.trajectory, truth);
  compared.finite =
      !compared.pairs.empty() && std::all_of(compared.pairs.begin(), compared.pairs.end(), [](const PosePair& pair) {
        return pair.estimate.position.allFinite() && pair.estimate.rotation.coeffs().allFinite();
      });
  StageFigures& figures = compared.figures;
  const std::vector<double> error_m = translation_errors(compared.pairs);
  figures.share_within_100mm = share_within(compared.pairs, error_m, kNear_m, end);
  figures.share_within_1m = share_within(compared.pairs, error_m, kSuccess_m, end);
  if (!compared.finite) {
    figures.ate_m = figures.max_error_m = figures.heading_rmse_deg = std::nan("");
    return compared;
  }
  const ErrorStatistics translation = summarize(error_m);
  figures.ate_m = translation.rmse;
  figures.max_error_m = translation.max;
  if (compared.pairs.size() > 1) {
    figures.largest_jump_m =
        summarize(translations_of(relative_errors(compared.pairs, segments_by_count(compared.pairs.size(), 1, true))))
            .max;
  }
  figures.heading_rmse_deg = summarize(heading_errors(compared.pairs)).rmse * 180.0 / std::numbers::pi;
  std::vector<Matrix6> covariances;
  for (const PosePair& pair : compared.pairs) covariances.push_back(poses.covariances[pair.estimate_index]);
  const Consistency consistency = evaluate_consistency(compared.pairs, covariances);
  if (consistency.count > 0) figures.consistency = consistency;
  return compared;
}

}  // namespace

TruthFigures compare_with_truth(const EstimateRecord& record, const Trajectory& truth, Time log_end, RunStatus status) {
  PoseComparison compared = compare_poses("best", record.best_poses(), truth, log_end);
  TruthFigures figures;
  figures.ate_m = compared.figures.ate_m;
  figures.max_error_m = compared.figures.max_error_m;
  figures.heading_rmse_deg = compared.figures.heading_rmse_deg;
  if (compared.figures.consistency) figures.nees_pose = compared.figures.consistency->nees;
  figures.pairs = std::move(compared.pairs);
  if (!compared.finite) return figures;
  if (const auto similarity = find_alignment(figures.pairs, Alignment::se3)) {
    figures.ate_se3_m = summarize(translation_errors(align(*similarity, figures.pairs))).rmse;
  }
  const bool at_the_end = to_seconds(log_end - figures.pairs.back().time) <= kEndTolerance_s;
  figures.success = status == RunStatus::done && at_the_end && figures.max_error_m <= kSuccess_m;
  return figures;
}

std::vector<StageFigures> compare_stages(const EstimateRecord& record, const Trajectory& truth, Time log_end) {
  std::vector<StageFigures> result;
  const auto add = [&](const char* name, const EstimateRecord::Poses& poses) {
    PoseComparison compared = compare_poses(name, poses, truth, log_end);
    if (!compared.pairs.empty()) result.push_back(std::move(compared.figures));
  };
  const auto same = [](const StampedPose& a, const StampedPose& b) {
    return a.time == b.time && a.pose.position == b.pose.position &&
           a.pose.rotation.coeffs() == b.pose.rotation.coeffs();
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
