#include "tools/run/automatic_start.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/error.h"

namespace lodestone {

namespace {

constexpr std::size_t kNamed = 3;  // candidates in a message

double heading_deg(const Quaternion& rotation) {
  const Vector3 forward = rotation * Vector3::UnitX();
  return std::atan2(forward.y(), forward.x()) * 180.0 / std::numbers::pi;
}

std::string candidates_text(const FoundStart& found) {
  std::string text;
  for (std::size_t i = 0; i < std::min(kNamed, found.best.size()); ++i) {
    const StartHypothesis& one = found.best[i];
    text += fmt::format("{}\"{}\" ({:.1f} %, {:.0f} % of the scan fits)", i == 0 ? "" : ", ", pose_text(one.T_map_imu),
                        100.0 * one.probability, 100.0 * one.lidar.share);
  }
  return text;
}

}  // namespace

std::string pose_text(const Pose& pose) {
  const Vector3& p = pose.position;
  const Quaternion& q = pose.rotation;
  return fmt::format("{:.3f} {:.3f} {:.3f} {:.5f} {:.5f} {:.5f} {:.5f}", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

AutomaticStart find_automatic_start(const std::string& log, const EstimatorInput& input,
                                    const std::function<bool(ScanBundle&)>& next, WarningLog& warnings) {
  const auto begin = std::chrono::steady_clock::now();
  std::vector<ScanBundle> bundles;
  ScanBundle bundle;
  while (next(bundle)) {
    if (!bundles.empty() && to_seconds(bundle.scan.end - bundles.front().scan.start) > input.options.search.data_s) break;
    bundles.push_back(bundle);
  }
  if (bundles.empty()) throw InputError(log + ": no scan between its first and last IMU sample; --initial-pose auto needs one");
  const FoundStart found = StartFinder(input).find(bundles);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!found.sure) {
    throw InputError(fmt::format("{}: --initial-pose auto is not sure of the start: {} of {:.1f} s of data; {}", log, found.doubt,
                                 found.data_s,
                                 found.best.empty() ? "give --initial-pose"
                                                    : "give --initial-pose yourself, one of " + candidates_text(found) +
                                                          ", or lower search.min_probability to take the first"));
  }
  const StartHypothesis& best = found.best.front();
  std::printf("%s\n", fmt::format("start: {:.2f} {:.2f} {:.2f}, heading {:.1f}°, {:.2f} m/s, probability {:.4f} among {} candidates; "
                                  "{:.1f} s of data, found in {:.1f} s",
                                  best.T_map_imu.position.x(), best.T_map_imu.position.y(), best.T_map_imu.position.z(),
                                  heading_deg(best.T_map_imu.rotation), best.velocity.norm(), best.probability, found.candidates,
                                  found.data_s, wall_s)
                          .c_str());
  if (best.probability < PlaceSearchOptions{}.min_probability) {
    warnings.add("run.initial_pose", fmt::format("the start is {:.1f} % probable only; also possible: {}", 100.0 * best.probability,
                                                 candidates_text(found)),
                 bundles.front().scan.start);
  }
  return {best.T_map_imu, best.velocity};
}

}  // namespace lodestone
