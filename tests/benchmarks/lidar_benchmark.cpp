// Cost of a scan from its points to a condensed factor, in a hall of 60 by 40 by 8 m: a map of 1.5 million points and
// scans of 28,800 points (32 rings by 900 columns).
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <random>

#include "core/lidar/association.h"
#include "core/lidar/condensed_cost.h"
#include "core/lidar/deskew.h"
#include "core/lidar/scan_sampling.h"
#include "estimators/smoother/smoother.h"

namespace lodestone {
namespace {

const Vector3 kHalf(30.0, 20.0, 4.0);  // half size of the hall, centred at the map's origin

double uniform(std::mt19937_64& generator) {
  return static_cast<double>(generator() >> 11) * 0x1.0p-53;
}

/// Surfaces of the hall with 5 mm of noise and uniform density.
std::shared_ptr<const PlaneMap> hall() {
  static const std::shared_ptr<const PlaneMap> map = [] {
    std::mt19937_64 generator(1);
    std::normal_distribution<double> noise(0.0, 0.005);
    const double areas[3] = {kHalf.y() * kHalf.z(), kHalf.x() * kHalf.z(), kHalf.x() * kHalf.y()};
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < 1'500'000; ++i) {
      const double place = uniform(generator) * (areas[0] + areas[1] + areas[2]);
      const int axis = place < areas[0] ? 0 : place < areas[0] + areas[1] ? 1 : 2;
      Vector3 point;
      for (int k = 0; k < 3; ++k) point[k] = (2.0 * uniform(generator) - 1.0) * kHalf[k];
      point[axis] = (uniform(generator) < 0.5 ? -1.0 : 1.0) * kHalf[axis] + noise(generator);
      points.push_back(point.cast<float>());
    }
    return std::make_shared<const PlaneMap>(points, PlaneMapOptions{});
  }();
  return map;
}

const Pose kPose{so3::exp(Vector3(0.0, 0.0, 0.4)), Vector3(3.0, -5.0, -2.0)};

LidarScan scan_at(Time start) {
  std::mt19937_64 generator(static_cast<std::uint64_t>(start) + 2);
  std::normal_distribution<double> noise(0.0, 0.02);
  LidarScan scan{start, start + 100'000'000, {}};
  for (int column = 0; column < 900; ++column) {
    for (int ring = 0; ring < 32; ++ring) {
      const double azimuth = 2.0 * M_PI * column / 900.0;
      const double elevation = (ring - 15.5) * 1.4 * M_PI / 180.0;
      const Vector3 beam(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                         std::sin(elevation));
      const Vector3 in_map = kPose.rotation * beam;
      double range = 1e9;
      for (int k = 0; k < 3; ++k) {
        if (in_map[k] != 0.0)
          range = std::min(range, (std::copysign(kHalf[k], in_map[k]) - kPose.position[k]) / in_map[k]);
      }
      LidarPoint point;
      point.position = (beam * (range + noise(generator))).cast<float>();
      point.offset_ns = static_cast<std::int32_t>(100'000'000LL * column / 899);
      point.ring = static_cast<std::uint16_t>(ring);
      scan.points.push_back(point);
    }
  }
  return scan;
}

std::vector<ImuSample> resting_imu(Time begin, Time end) {
  std::vector<ImuSample> samples;
  for (Time time = begin; time <= end; time += 5'000'000)
    samples.push_back({time, Vector3::Zero(), Vector3(0.0, 0.0, 9.80665)});
  return samples;
}

NavState resting_state() {
  NavState state;
  state.T_map_imu = kPose;
  return state;
}

void count_points(benchmark::State& state, std::size_t points) {
  state.counters["points"] = static_cast<double>(points);
  state.counters["time/point"] = benchmark::Counter(
      static_cast<double>(points), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

std::vector<Eigen::Vector3f> imu_points() {
  const LidarScan scan = scan_at(0);
  return deskew(scan.points, scan.start, ScanMotion(resting_state(), resting_imu(0, scan.end)), Pose{});
}

Matrix6 predicted_covariance() {
  Vector6 sigma;
  sigma << Vector3::Constant(0.005), Vector3::Constant(0.02);
  return sigma.cwiseAbs2().asDiagonal();
}

Pose predicted_pose() {
  return kPose.boxplus((Vector6() << 0.002, -0.001, 0.003, 0.02, -0.01, 0.01).finished());
}

void plane_map_query(benchmark::State& state) {
  const auto map = hall();
  std::vector<Eigen::Vector3f> places;
  for (const Eigen::Vector3f& point : imu_points()) places.push_back((kPose * point.cast<double>()).cast<float>());
  for (auto _ : state) {
    for (const Eigen::Vector3f& place : places) benchmark::DoNotOptimize(map->match(place, 0.3F));
  }
  count_points(state, places.size());
}
BENCHMARK(plane_map_query)->Unit(benchmark::kMicrosecond);

void scan_sampling(benchmark::State& state) {
  const LidarScan scan = scan_at(0);
  for (auto _ : state) benchmark::DoNotOptimize(sample_scan(scan, LidarModel{}, {}));
  count_points(state, scan.points.size());
}
BENCHMARK(scan_sampling)->Unit(benchmark::kMicrosecond);

void deskewing(benchmark::State& state) {
  const LidarScan scan = scan_at(0);
  const ScanMotion motion(resting_state(), resting_imu(0, scan.end));
  for (auto _ : state) benchmark::DoNotOptimize(deskew(scan.points, scan.start, motion, Pose{}));
  count_points(state, scan.points.size());
}
BENCHMARK(deskewing)->Unit(benchmark::kMicrosecond);

void association(benchmark::State& state) {
  const auto map = hall();
  const std::vector<Eigen::Vector3f> points = imu_points();
  const Pose pose = predicted_pose();
  for (auto _ : state) {
    benchmark::DoNotOptimize(associate(points, pose, predicted_covariance(), *map, LidarModel{}, {}));
  }
  count_points(state, points.size());
}
BENCHMARK(association)->Unit(benchmark::kMicrosecond)->UseRealTime()->MeasureProcessCPUTime();

void condensing(benchmark::State& state) {
  const auto map = hall();
  const auto matches = associate(imu_points(), predicted_pose(), predicted_covariance(), *map, LidarModel{}, {});
  for (auto _ : state) benchmark::DoNotOptimize(condense(matches, predicted_pose()));
  count_points(state, matches.size());
}
BENCHMARK(condensing)->Unit(benchmark::kMicrosecond)->UseRealTime()->MeasureProcessCPUTime();

struct NoSink : EstimateSink {
  void causal(const Estimate&) override {}
  void best(const Estimate&) override {}
};

/// The smoother's whole step in its steady state, without magnetometers: sampling, deskewing, association, condensing,
/// degeneracy, two solves, covariances, marginalization. `voxel_m` of the sampling; 0 registers every point.
void smoother_step(benchmark::State& state, double voxel_m) {
  constexpr Time kPeriod = 100'000'000;
  EstimatorInput input;
  input.planes = hall();
  input.initial_pose = kPose;
  input.options.lidar.sampling.voxel_m = voxel_m;
  input.options.lidar.sampling.max_points = 0;
  WarningLog warnings;
  input.warnings = &warnings;
  std::vector<LidarScan> scans;
  for (int i = 0; i < 8; ++i) scans.push_back(scan_at(i * kPeriod));
  Smoother smoother(input);
  NoSink sink;
  Time start = 0;
  const auto step = [&] {
    ScanBundle bundle;
    bundle.scan = scans[static_cast<std::size_t>(start / kPeriod) % scans.size()];
    bundle.scan.start = start;
    bundle.scan.end = start + kPeriod;
    bundle.imu = resting_imu(start, start + kPeriod);
    start += kPeriod;
    smoother.process(bundle, sink);
  };
  for (int i = 0; i < 40; ++i) step();
  for (auto _ : state) step();
  count_points(state, scans[0].points.size());
}
BENCHMARK_CAPTURE(smoother_step, as_it_comes, ScanSamplingOptions{}.voxel_m)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(smoother_step, every_point, 0.0)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

}  // namespace
}  // namespace lodestone
