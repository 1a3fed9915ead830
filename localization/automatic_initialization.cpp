#include "localization/automatic_initialization.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/stopwatch.h"
#include "frontends/configuration/trajectory_file.h"

namespace lodestone {

namespace {

constexpr std::size_t kNamed = 3;  // candidates in a message

double heading_deg(const Quaternion& rotation) {
  const Vector3 forward = rotation * Vector3::UnitX();
  return std::atan2(forward.y(), forward.x()) * 180.0 / std::numbers::pi;
}

std::string candidates_text(const FoundStart& found, const Vector3& origin_m) {
  std::string text;
  for (std::size_t i = 0; i < std::min(kNamed, found.best.size()); ++i) {
    const StartHypothesis& one = found.best[i];
    text += fmt::format("{}\"{}\" ({:.1f} %, {:.0f} % of the scan on the map)", i == 0 ? "" : ", ",
                        pose_text(one.T_map_imu, origin_m), 100.0 * one.probability, 100.0 * one.lidar.share);
  }
  return text;
}

}  // namespace

FoundInitialPose find_initial_pose(const std::string& log, const EstimatorInput& input,
                                   const std::function<bool(ScanBundle&)>& next, WarningLog& warnings,
                                   const Vector3& origin_m) {
  const Stopwatch search;
  std::vector<ScanBundle> bundles;
  ScanBundle bundle;
  while (next(bundle)) {
    if (!bundles.empty() && to_seconds(bundle.scan.end - bundles.front().scan.start) > input.options.search.data_s)
      break;
    bundles.push_back(bundle);
  }
  if (bundles.empty())
    throw InputError(log +
                     ": there is no scan between the first and the last IMU sample; --initial-pose auto requires one");
  const FoundStart found = StartFinder(input).find(bundles);
  const double wall_s = search.elapsed_s();
  if (!found.sure) {
    const std::string advice = found.best.empty() ? "set --initial-pose"
                                                  : "set --initial-pose to one of " + candidates_text(found, origin_m) +
                                                        ", or lower search.min_probability to accept the first";
    throw InputError(fmt::format("{}: --initial-pose auto found no certain initial pose in {:.1f} s of data: {}; {}",
                                 log, found.data_s, found.doubt, advice));
  }
  const StartHypothesis& best = found.best.front();
  const std::string description = fmt::format(
      "initial pose \"{}\": heading {:.1f}°, {:.2f} m/s, probability {:.4f} among {} candidates; {:.1f} s of data, "
      "found in {:.1f} s",
      pose_text(best.T_map_imu, origin_m), heading_deg(best.T_map_imu.rotation), best.velocity.norm(), best.probability,
      found.candidates, found.data_s, wall_s);
  if (best.probability < PlaceSearchOptions{}.min_probability) {
    warnings.add("run.initial_pose",
                 fmt::format("the initial pose has a probability of only {:.1f} %; candidates: {}",
                             100.0 * best.probability, candidates_text(found, origin_m)),
                 bundles.front().scan.start);
  }
  return {best, description};
}

}  // namespace lodestone
