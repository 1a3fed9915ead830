// Success of `--initial-pose auto` at random starts on a world's floor: how often it is right, how often it is
// confident, and its duration. Short logs, simulated in memory.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "estimators/initialization/start_finder.h"
#include "frontends/configuration/options.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tests/benchmarks/kidnapped/site_maps.h"
#include "tests/benchmarks/starts.h"
#include "tests/estimators/initialization/random_starts.h"

namespace lodestone {
namespace {

constexpr double right_m = 0.5;
constexpr double right_rad = 5.0 * std::numbers::pi / 180.0;

struct Call {
  std::string world;
  std::string maps;
  std::string kind = "drives";
  simulation::RandomStarts starts;
  double max_range_m = 0.0;
  double data_s = 5.0;
  int threads = 0;
  int only = -1;
  bool without_field = false;
  std::vector<std::string> settings;
};

/// Result of one start.
struct Outcome {
  bool right = false;
  bool sure = false;
  bool on_field = false;  ///< the true place has field
  bool moves = false;
  double error_m = std::numeric_limits<double>::infinity();
  double error_deg = 0.0;
  double wall_s = 0.0;
};

std::vector<ScanBundle> read_bundles(simulation::SimulationSource& source, const SensorSuite& suite, double skip_s,
                                     double data_s) {
  WarningLog warnings;
  Synchronizer synchronizer(source, suite, warnings);
  std::vector<ScanBundle> bundles;
  ScanBundle bundle;
  const Time begin = source.begin_time() + from_seconds(skip_s);
  while (synchronizer.next(bundle)) {
    if (bundle.scan.start < begin) continue;
    if (to_seconds(bundle.scan.end - begin) > data_s) break;
    bundles.push_back(bundle);
  }
  begin_log_with(bundles.front());
  return bundles;
}

void report(const std::string& name, const std::vector<Outcome>& outcomes) {
  if (outcomes.empty()) return;
  int counts[2][2] = {};
  std::vector<double> errors;
  std::vector<double> angles;
  std::vector<double> times;
  for (const Outcome& one : outcomes) {
    ++counts[one.right ? 1 : 0][one.sure ? 1 : 0];
    times.push_back(one.wall_s);
    if (!one.right) continue;
    errors.push_back(one.error_m);
    angles.push_back(one.error_deg);
  }
  const auto percent = [&](int count) { return 100.0 * count / static_cast<double>(outcomes.size()); };
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.3f} / {:.3f} | {:.2f} / {:.2f} | {:.1f} / {:.1f} |\n",
             name, outcomes.size(), percent(counts[1][1]), percent(counts[1][0]), percent(counts[0][0]),
             percent(counts[0][1]), quantile(errors, 0.5), quantile(errors, 0.95), quantile(angles, 0.5),
             quantile(angles, 0.95), quantile(times, 0.5), quantile(times, 1.0));
}

void run(const Call& call) {
  std::optional<tbb::global_control> limit;
  if (call.threads > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(call.threads));
  simulation::World world = simulation::load_world(call.world);
  const auto environment = std::make_shared<const simulation::Environment>(world);
  const SiteMaps maps = make_maps(world, environment, call.kind == "site" ? MapKind::site : MapKind::drives, call.maps);
  EstimatorInput input;
  load_options(load_configuration({}, call.settings), input.options);
  input.suite = simulation::sensor_suite(world);
  if (call.max_range_m > 0.0) input.suite.lidar.max_range_m = call.max_range_m;
  input.planes = maps.planes;
  input.field = call.without_field ? nullptr : maps.field;
  const auto clock = [] { return std::chrono::steady_clock::now(); };
  const auto seconds = [](auto from, auto to) { return std::chrono::duration<double>(to - from).count(); };
  const auto before = clock();
  const StartFinder finder(input);
  fmt::print("search structures: {:.2f} s\n", seconds(before, clock()));

  std::vector<Outcome> outcomes;
  const auto starts = random_starts(*environment, call.starts);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (call.only >= 0 && static_cast<int>(i) != call.only) continue;
    const simulation::World with = with_sequence(world, "start", starts[i].sequence);
    simulation::SimulationSource source(with, environment, "start", simulation::SimulationSource::Drive::sequence,
                                        call.starts.seed + i, starts[i].skip_s + call.data_s + 0.2);
    const std::vector<ScanBundle> bundles = read_bundles(source, input.suite, starts[i].skip_s, call.data_s);
    const Pose truth = source.motion().pose_at(to_seconds(bundles.front().scan.start - source.begin_time()));
    Outcome outcome;
    outcome.moves = starts[i].skip_s > 0.0;
    outcome.on_field = maps.field->query(truth.position, FieldInterpolation::bilinear).has_value();
    const auto begin = clock();
    const FoundStart found = finder.find(bundles);
    outcome.wall_s = seconds(begin, clock());
    outcome.sure = found.sure;
    double probability = 0.0;
    if (!found.best.empty()) {
      const Vector6 error = found.best.front().T_map_imu.boxminus(truth);
      outcome.error_m = error.tail<3>().norm();
      outcome.error_deg = error.head<3>().norm() * 180.0 / std::numbers::pi;
      outcome.right = outcome.error_m < right_m && error.head<3>().norm() < right_rad;
      probability = found.best.front().probability;
    }
    outcomes.push_back(outcome);
    const Vector3 forward = truth.rotation * Vector3::UnitX();
    const double yaw_deg = std::atan2(forward.y(), forward.x()) * 180.0 / std::numbers::pi;
    fmt::print(stderr, "{:3d} ({:6.2f} {:6.2f} {:6.1f}°) {} {} {} {}: {:.3f} m {:.2f}°, p {:.4f}", i,
               truth.position.x(), truth.position.y(), yaw_deg, outcome.moves ? "moves" : "stands",
               outcome.on_field ? "on field" : "off field", outcome.right ? "right" : "WRONG",
               outcome.sure ? "sure" : "unsure", outcome.error_m, outcome.error_deg, probability);
    if (!found.best.empty()) {
      fmt::print(stderr, ", share {:.2f}, field {:.1f} uT", found.best.front().lidar.share,
                 found.best.front().field.residual_rms_ut);
    }
    fmt::print(stderr, ", {} candidates, {:.1f} s of data, {:.2f} s{}{}\n", found.candidates, found.data_s,
               outcome.wall_s, found.doubt.empty() ? "" : ": ", found.doubt);
    if (call.only < 0) continue;
    for (const StartHypothesis& one : found.best) {
      const Vector3& p = one.T_map_imu.position;
      fmt::print(stderr,
                 "    {:.2f} {:.2f} {:.2f} p {:.5f} cost {:.3f} share {:.3f} field {:.1f} ({} on map, {:.2f} uT)\n",
                 p.x(), p.y(), p.z(), one.probability, one.lidar.cost, one.lidar.share, one.field.log_likelihood,
                 one.field.on_map, one.field.residual_rms_ut);
    }
  }
  fmt::print(
      "| starts | | right and sure % | right, not sure % | wrong, not sure % | wrong and sure % | error m, median / 95 "
      "% | "
      "° | s, median / most |\n|---|---|---|---|---|---|---|---|---|\n");
  report("all", outcomes);
  const auto those = [&](auto chosen) {
    std::vector<Outcome> some;
    std::copy_if(outcomes.begin(), outcomes.end(), std::back_inserter(some), chosen);
    return some;
  };
  report("standing", those([](const Outcome& one) { return !one.moves; }));
  report("driving", those([](const Outcome& one) { return one.moves; }));
  report("with field", those([](const Outcome& one) { return one.on_field; }));
  report("without field", those([](const Outcome& one) { return !one.on_field; }));
}

}  // namespace
}  // namespace lodestone

int main(int argument_count, char** arguments) {
  lodestone::Call call;
  CLI::App app{"Starts anywhere on a world's floor: how often --initial-pose auto is right, and how often it is sure"};
  app.add_option("WORLD", call.world, "config/worlds/NAME.yaml")->required();
  app.add_option("--places", call.starts.count, "how many starts")->capture_default_str();
  app.add_option("--seed", call.starts.seed, "of places, headings and noise")->capture_default_str();
  app.add_option("--map-kind", call.kind, "drives or site: what the maps cover")
      ->check(CLI::IsMember({"drives", "site"}))
      ->capture_default_str();
  app.add_option("--maps", call.maps, "folder that keeps the maps for the next call");
  app.add_option("--max-range", call.max_range_m, "LiDAR points up to so many metres only");
  app.add_option("--data", call.data_s, "seconds of each log")->capture_default_str();
  app.add_option("--threads", call.threads, "at most so many");
  app.add_option("--only", call.only, "this start alone, with all its hypotheses");
  app.add_flag("--without-field", call.without_field, "LiDAR alone");
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
