// Success of the search for the initial pose within recorded logs: it begins at scans spread over each log, and finds
// the robot anywhere on the maps. One row for each log, Markdown.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <deque>
#include <filesystem>
#include <numbers>

#include "core/error.h"
#include "core/geometry/trajectory.h"
#include "estimators/initialization/start_finder.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/plane_map_loader.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tests/benchmarks/starts.h"

namespace lodestone {
namespace {

constexpr double right_m = 1.5;  // three sigmas of a found pose, begin_at()
constexpr double right_rad = 5.0 * std::numbers::pi / 180.0;
constexpr Time largest_gap = 1'000'000'000;

struct Call {
  std::vector<std::string> folders;
  std::string log = "log.bag", cloud = "cloud.pcd", magnetic = "field.yaml", truth = "truth.tum";
  double every_s = 4.0;
  double data_s = 5.0;
  double max_range_m = 0.0;
  std::vector<std::string> settings;
};

struct Counts {
  int starts = 0, right_sure = 0, right_unsure = 0, wrong_unsure = 0, wrong_sure = 0;
  std::vector<double> errors_m, errors_m_s, data_s, wall_s;
};

/// Mean velocity over a second around `time`.
Vector3 velocity_at(const Trajectory& truth, Time time) {
  const Time half = 500'000'000;
  const std::optional<Pose> before = interpolate(truth, time - half, largest_gap);
  const std::optional<Pose> after = interpolate(truth, time + half, largest_gap);
  if (!before || !after) return Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
  return (after->position - before->position) / to_seconds(2 * half);
}

/// One search: the bundles begin with the scan at which the robot is looked for.
void search(const StartFinder& finder, std::vector<ScanBundle> bundles, const Trajectory& truth, Counts& counts) {
  ScanBundle& first = bundles.front();
  const Time begin = first.scan.start;
  const std::optional<Pose> pose = interpolate(truth, begin, largest_gap);
  if (!pose) return;
  begin_log_with(first);
  const auto before = std::chrono::steady_clock::now();
  const FoundStart found = finder.find(bundles);
  counts.wall_s.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count());
  counts.data_s.push_back(found.data_s);
  ++counts.starts;
  bool right = false;
  double probability = 0.0;
  if (!found.best.empty()) {
    const Vector6 error = found.best.front().T_map_imu.boxminus(*pose);
    right = error.tail<3>().norm() < right_m && error.head<3>().norm() < right_rad;
    if (right) {
      counts.errors_m.push_back(error.tail<3>().norm());
      const double error_m_s = (found.best.front().velocity - velocity_at(truth, begin)).norm();
      if (std::isfinite(error_m_s)) counts.errors_m_s.push_back(error_m_s);
    }
    probability = found.best.front().probability;
  }
  ++(right ? (found.sure ? counts.right_sure : counts.right_unsure)
           : (found.sure ? counts.wrong_sure : counts.wrong_unsure));
  fmt::print(stderr, "{:.1f} {:.1f}: {} {}, probability {:.4f}, {} candidates{}{}\n", pose->position.x(),
             pose->position.y(), right ? "right" : "WRONG", found.sure ? "sure" : "unsure", probability,
             found.candidates, found.doubt.empty() ? "" : ": ", found.doubt);
  for (const StartHypothesis& one : found.best) {
    const Vector6 error = one.T_map_imu.boxminus(*pose);
    fmt::print(stderr,
               "    off {:.2f} m {:.1f} deg {:.2f} m/s, p {:.5f}, scan cost {:.3f} share {:.3f}, field {:.1f}\n",
               error.tail<3>().norm(), error.head<3>().norm() * 180.0 / std::numbers::pi,
               (one.velocity - velocity_at(truth, begin)).norm(), one.probability, one.lidar.clutter_cost,
               one.lidar.share, one.field.log_likelihood);
  }
}

Counts searches(const Call& call, const std::filesystem::path& folder) {
  WarningLog warnings;
  EstimatorInput input;
  load_options(load_configuration({}, call.settings), input.options);
  Platform platform = load_platform(folder / "platform.yaml");
  if (call.max_range_m > 0.0) platform.suite.lidar.max_range_m = call.max_range_m;
  input.suite = platform.suite;
  const std::vector<LidarModel> lidars = platform.suite.lidars();
  input.planes = load_planes(folder / call.cloud, input.options.lidar.map, lidars,
                             std::filesystem::temp_directory_path(), warnings)
                     .source;
  if (std::filesystem::exists(folder / call.magnetic)) {
    input.field = std::make_shared<MagneticMap>(read_magnetic_map(folder / call.magnetic));
  }
  const StartFinder finder(input);
  const Trajectory truth = read_trajectory(folder / call.truth);
  BagSource source(folder / call.log, platform, warnings,
                   {.lidar = true, .imu = true, .magnetometers = input.field != nullptr});
  Synchronizer synchronizer(source, platform.suite, warnings);

  Counts counts;
  std::deque<ScanBundle> kept;
  ScanBundle bundle;
  Time next = source.begin_time() + from_seconds(1.0);  // the first scans may miss readings
  while (synchronizer.next(bundle)) {
    if (bundle.scan.start >= next) kept.push_back(bundle);
    if (kept.empty() || to_seconds(bundle.scan.end - kept.front().scan.start) < call.data_s) continue;
    next = kept.front().scan.start + from_seconds(call.every_s);
    search(finder, {kept.begin(), kept.end()}, truth, counts);
    while (!kept.empty() && kept.front().scan.start < next) kept.pop_front();
  }
  return counts;
}

void run(const Call& call) {
  fmt::print(
      "| log | starts | right, sure | right, not sure | wrong, not sure | wrong, sure | error m, median / largest | "
      "error m/s, median / largest | data s, median | search s, median |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const std::string& folder : call.folders) {
    const std::filesystem::path path(folder);
    const Counts counts = searches(call, path);
    fmt::print("| {}{} | {} | {} | {} | {} | {} | {:.3f} / {:.3f} | {:.2f} / {:.2f} | {:.1f} | {:.1f} |\n",
               path.filename().string(), call.max_range_m > 0.0 ? fmt::format(", {:g} m", call.max_range_m) : "",
               counts.starts, counts.right_sure, counts.right_unsure, counts.wrong_unsure, counts.wrong_sure,
               quantile(counts.errors_m, 0.5), quantile(counts.errors_m, 1.0), quantile(counts.errors_m_s, 0.5),
               quantile(counts.errors_m_s, 1.0), quantile(counts.data_s, 0.5), quantile(counts.wall_s, 0.5));
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace lodestone

int main(int argument_count, char** arguments) {
  lodestone::Call call;
  CLI::App app{"Searches the initial pose at many scans of recorded logs"};
  app.add_option("FOLDER", call.folders, "folders with platform.yaml and the files below")->required();
  app.add_option("--log", call.log, "log in each folder")->capture_default_str();
  app.add_option("--cloud", call.cloud, "cloud map in each folder")->capture_default_str();
  app.add_option("--magnetic", call.magnetic, "magnetic map in each folder, if there is one")->capture_default_str();
  app.add_option("--truth", call.truth, "trajectory in each folder")->capture_default_str();
  app.add_option("--every", call.every_s, "seconds between two starts")->capture_default_str();
  app.add_option("--data", call.data_s, "seconds of each search")->capture_default_str();
  app.add_option("--max-range", call.max_range_m, "LiDAR points up to so many metres only");
  app.add_option("--set", call.settings, "key.path=value, as of lodestone run");
  CLI11_PARSE(app, argument_count, arguments);
  try {
    lodestone::run(call);
  } catch (const lodestone::InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}
