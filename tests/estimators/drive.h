#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/evaluation/errors.h"
#include "core/geometry/trajectory.h"
#include "core/lidar/plane_map.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/warnings.h"
#include "estimators/factory.h"
#include "frontends/synchronizer/synchronizer.h"
#include "tools/simulate/cloud_map.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone::testing {

/// A short drive through a shipped world with a thinned LiDAR: bundles, ground truth and both maps. The field map is
/// the true field at its nodes, since these tests examine estimators, not surveys.
struct Drive {
  SensorSuite suite;
  std::vector<ScanBundle> bundles;
  Trajectory truth;
  std::shared_ptr<const PlaneMap> planes;
  std::shared_ptr<const MagneticMap> field;

  EstimatorInput input() const {
    EstimatorInput result;
    result.suite = suite;
    result.planes = planes;
    result.field = field;
    result.initial_pose = *interpolate(truth, std::max(bundles.front().scan.start, truth.front().time), 1'000'000'000);
    return result;
  }
};

inline std::shared_ptr<const MagneticMap> true_field(const simulation::Environment& environment,
                                                     const Trajectory& truth, double height_m) {
  FieldGrid grid;
  grid.resolution_m = 0.1;
  Eigen::Vector2d low = truth.front().pose.position.head<2>();
  Eigen::Vector2d high = low;
  for (const StampedPose& pose : truth) {
    low = low.cwiseMin(pose.pose.position.head<2>());
    high = high.cwiseMax(pose.pose.position.head<2>());
  }
  grid.origin = low.array() - 1.5;
  grid.columns = static_cast<int>((high.x() - low.x() + 3.0) / grid.resolution_m) + 1;
  grid.rows = static_cast<int>((high.y() - low.y() + 3.0) / grid.resolution_m) + 1;
  grid.heights_m = {height_m};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Vector3 point(grid.origin.x() + grid.resolution_m * column, grid.origin.y() + grid.resolution_m * row,
                          height_m);
      const Vector3 field = environment.field.field_ut(point);
      nodes.emplace_back(field.x(), field.y(), field.z(), 0.1F);
    }
  }
  return std::make_shared<MagneticMap>(grid, nodes, 3.0);
}

inline Drive world_drive(const std::string& name, const std::string& sequence, double duration_s, std::uint64_t seed) {
  const simulation::World world = simulation::load_world(LODESTONE_SOURCE_DIR "/config/worlds/" + name + ".yaml",
                                                         {"sensors.lidar.rows=16", "sensors.lidar.columns=512"});
  const auto environment = std::make_shared<const simulation::Environment>(world, world.sequences.at(sequence).scene);
  simulation::SimulationSource source(world, environment, sequence, simulation::SimulationSource::Drive::sequence, seed,
                                      duration_s);
  Drive drive;
  drive.suite = simulation::sensor_suite(world);
  drive.truth = source.trajectory();
  drive.planes = std::make_shared<PlaneMap>(
      sample_cloud(world, simulation::Environment(world, world.cloud.scene), seed), PlaneMapOptions{});
  const double height_m = drive.truth.front().pose.position.z() + drive.suite.magnetometers[0].T_imu_mag.position.z();
  drive.field = true_field(*environment, drive.truth, height_m);
  WarningLog warnings;
  Synchronizer synchronizer(source, drive.suite, warnings);
  ScanBundle bundle;
  while (synchronizer.next(bundle)) drive.bundles.push_back(bundle);
  return drive;
}

inline Drive tunnel_drive(double duration_s, std::uint64_t seed) {
  return world_drive("tunnel", "3", duration_s, seed);
}

/// The drive that most tests share, created once.
inline const Drive& shared_drive() {
  static const Drive drive = tunnel_drive(22.0, 7);
  return drive;
}

struct Collector final : EstimateSink {
  std::vector<Estimate> causal_estimates;
  std::vector<Estimate> best_estimates;
  void causal(const Estimate& estimate) override { causal_estimates.push_back(estimate); }
  void best(const Estimate& estimate) override { best_estimates.push_back(estimate); }
};

inline Collector run(const std::string& name, const EstimatorInput& input, const std::vector<ScanBundle>& bundles,
                     std::size_t most = ~std::size_t{0}) {
  Collector collector;
  const auto estimator = make_estimator(name, input);
  for (std::size_t i = 0; i < std::min(most, bundles.size()); ++i) estimator->process(bundles[i], collector);
  estimator->finish(collector);
  return collector;
}

struct Accuracy {
  double ate_m = 0.0;
  double max_m = 0.0;
  double nees = 0.0;  ///< per degree of freedom
};

inline Accuracy accuracy(const std::vector<Estimate>& estimates, const Trajectory& truth) {
  Accuracy result;
  double squared = 0.0;
  double nees = 0.0;
  int count = 0;
  for (const Estimate& estimate : estimates) {
    const auto pose = interpolate(truth, estimate.time, 20'000'000);
    if (!pose) continue;
    const Vector6 error = estimate.state.T_map_imu.boxminus(*pose);
    squared += error.tail<3>().squaredNorm();
    result.max_m = std::max(result.max_m, error.tail<3>().norm());
    nees += error.dot(estimate.covariance.inverse() * error) / 6.0;
    ++count;
  }
  result.ate_m = std::sqrt(squared / count);
  result.nees = nees / count;
  return result;
}

}  // namespace lodestone::testing
