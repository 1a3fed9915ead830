// IMU: preintegration and propagation, per sample.
#include <benchmark/benchmark.h>

#include <cmath>

#include "core/imu/preintegration.h"
#include "core/imu/propagation.h"

namespace lodestone {
namespace {

std::vector<ImuSample> samples(int count) {
  std::vector<ImuSample> result;
  for (int i = 0; i <= count; ++i) {
    const double t = 0.005 * i;
    result.push_back({i * Time{5'000'000}, Vector3(0.3 * std::sin(t), 0.2 * std::cos(2.0 * t), 0.5 * std::sin(0.7 * t)),
                      Vector3(0.5 * std::sin(3.0 * t), 0.3 * std::cos(t), 9.8 + 0.4 * std::sin(2.0 * t))});
  }
  return result;
}

/// Increment, covariance and bias Jacobians; 20 samples are a scan of 10 Hz at 200 Hz.
void preintegration(benchmark::State& state) {
  const std::vector<ImuSample> log = samples(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    Preintegration preintegration(log, Vector3(0.01, 0.0, -0.01), Vector3(0.1, 0.05, 0.0), {});
    benchmark::DoNotOptimize(preintegration);
  }
  state.counters["time/sample"] = benchmark::Counter(
      static_cast<double>(state.range(0)), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(preintegration)->Arg(20)->Arg(200)->Unit(benchmark::kMicrosecond);

void propagation(benchmark::State& state) {
  const std::vector<ImuSample> log = samples(20);
  const bool with_covariance = state.range(0) != 0;
  for (auto _ : state) {
    Matrix17 covariance = Matrix17::Identity();
    benchmark::DoNotOptimize(propagate({}, log, {}, with_covariance ? &covariance : nullptr));
  }
  state.counters["time/sample"] =
      benchmark::Counter(20.0, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(propagation)->ArgName("covariance")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace lodestone
