// Cost of the smoother's back end: the window's solve, marginalization, covariances and degeneracy analysis.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>

#include "core/imu/propagation.h"
#include "core/observability/window_information.h"
#include "factors/sliding_window.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

constexpr int kKeyframes = 20;
constexpr int kPlanes = 2000;

/// A drive with its scans, accumulated at predicted poses.
struct Log {
  explicit Log(int keyframes) {
    Random random(1);
    options.keyframes = keyframes;
    truth = drive(options, random);
    const std::vector<Vector3> normals = room_normals(random);
    for (int k = 0; k < keyframes; ++k) {
      const std::size_t i = static_cast<std::size_t>(k);
      const Pose& pose = truth.truth[i].T_map_imu;
      scans.push_back(scan(pose, normals, kPlanes, 0.02, 5.0, 0.0, random));
      // Errors of some centimetres and a degree: a poor prediction.
      guesses.push_back(truth.truth[i].boxplus(random.draw(start_covariance())));
      costs.push_back(condense_scan(scans.back().matches, guesses.back().T_map_imu));
    }
  }

  DriveOptions options;
  Drive truth;
  std::vector<Scan> scans;
  std::vector<NavState> guesses;
  std::vector<CondensedScan> costs;
};

void set_scan(SlidingWindow& window, const Log& log, std::size_t place, std::size_t k) {
  window.set_lidar(place, log.costs[k], log.scans[k].matches, {});
}

std::unique_ptr<SlidingWindow> full_window(const Log& log, bool condensed) {
  SlidingWindowOptions options;
  options.condensed = condensed;
  options.max_iterations = 4;
  auto window = std::make_unique<SlidingWindow>(log.truth.times[0], log.guesses[0], start_covariance(), 8,
                                                log.options.noise, options);
  for (std::size_t k = 1; k < kKeyframes; ++k) {
    window->add_keyframe(log.truth.times[k], log.guesses[k], log.truth.samples[k]);
    set_scan(*window, log, k, k);
  }
  return window;
}

/// Every keyframe starts with an error: a full solve, not an update.
void window_solve(benchmark::State& state, bool condensed) {
  static const Log log(kKeyframes);
  double iterations = 0.0;
  for (auto _ : state) {
    state.PauseTiming();
    auto window = full_window(log, condensed);
    state.ResumeTiming();
    iterations += window->solve();
    state.PauseTiming();
    window.reset();
    state.ResumeTiming();
  }
  state.counters["iterations"] = benchmark::Counter(iterations, benchmark::Counter::kAvgIterations);
}
BENCHMARK_CAPTURE(window_solve, condensed, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(window_solve, one_residual_a_point, false)->Unit(benchmark::kMillisecond);

/// Cost of a scan after its points are condensed: a keyframe is added, the window is solved, the oldest keyframe is
/// removed. With magnetometers: 32 readings per keyframe and biases of eight sensors.
void window_update(benchmark::State& state, bool magnetometers) {
  static const Log log(400);
  static const std::shared_ptr<const MagneticMap> map = wavy_map();
  std::vector<std::vector<FieldReading>> readings(log.truth.times.size());
  if (magnetometers) {
    Random random(2);
    for (std::size_t k = 0; k < readings.size(); ++k) {
      for (int i = 0; i < 4; ++i) {
        for (const FieldReading& reading : field_readings(log.truth.truth[k].T_map_imu, *map,
                                                          std::vector<Vector3>(8, Vector3::Zero()), 1.0, random)) {
          readings[k].push_back(reading);
        }
      }
    }
  }
  std::unique_ptr<SlidingWindow> window;
  std::size_t next = log.truth.times.size();
  double iterations = 0.0;
  for (auto _ : state) {
    if (next == log.truth.times.size()) {
      state.PauseTiming();
      window = full_window(log, true);
      for (std::size_t k = 0; k < kKeyframes; ++k) {
        window->set_field(k, map, FieldInterpolation::bicubic, readings[k], {});
      }
      window->solve();
      next = kKeyframes;
      state.ResumeTiming();
    }
    const NavState predicted =
        propagate(window->state(kKeyframes - 1), log.truth.samples[next], log.options.noise, nullptr);
    window->add_keyframe(log.truth.times[next], predicted, log.truth.samples[next]);
    set_scan(*window, log, kKeyframes, next);
    window->set_field(kKeyframes, map, FieldInterpolation::bicubic, readings[next], {});
    iterations += window->solve();
    window->marginalize_oldest();
    ++next;
  }
  state.counters["iterations"] = benchmark::Counter(iterations, benchmark::Counter::kAvgIterations);
}
BENCHMARK_CAPTURE(window_update, lidar, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(window_update, lidar_and_magnetometers, true)->Unit(benchmark::kMillisecond);

/// The same with LiDAR, without the solve.
void add_and_marginalize(benchmark::State& state) {
  static const Log log(400);
  std::unique_ptr<SlidingWindow> window;
  std::size_t next = log.truth.times.size();
  for (auto _ : state) {
    if (next == log.truth.times.size()) {
      state.PauseTiming();
      window = full_window(log, true);
      window->solve();
      next = kKeyframes;
      state.ResumeTiming();
    }
    window->add_keyframe(log.truth.times[next], log.truth.truth[next], log.truth.samples[next]);
    set_scan(*window, log, kKeyframes, next);
    window->marginalize_oldest();
    ++next;
  }
}
BENCHMARK(add_and_marginalize)->Unit(benchmark::kMicrosecond);

void pose_covariances(benchmark::State& state) {
  static const Log log(kKeyframes);
  const auto window = full_window(log, true);
  window->solve();
  const std::array<std::size_t, 2> wanted{0, kKeyframes - 1};
  for (auto _ : state) benchmark::DoNotOptimize(window->pose_covariances(wanted));
}
BENCHMARK(pose_covariances)->Unit(benchmark::kMicrosecond);

struct Chain {
  explicit Chain(const Log& log) {
    const auto window = full_window(log, true);
    window->solve();
    for (std::size_t k = 0; k < kKeyframes; ++k)
      information.push_back(log.costs[k].cost.hessian(window->state(k).T_map_imu));
    for (std::size_t k = 0; k + 1 < kKeyframes; ++k) links.push_back(window->link(k));
  }
  std::vector<Matrix6> information;
  std::vector<ChainLink> links;
};

void marginal_information(benchmark::State& state) {
  static const Chain chain{Log(kKeyframes)};
  for (auto _ : state) {
    benchmark::DoNotOptimize(marginal_pose_information(chain.information, chain.links, kKeyframes - 1));
  }
}
BENCHMARK(marginal_information)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace lodestone
