#pragma once

#include <memory>
#include <string>

#include "tests/estimators/drive.h"

namespace lodestone::testing {

/// A shipped world with its maps, for drives with faults. The LiDAR is thinned; the field map is the true field along
/// the sequence.
class Site {
 public:
  Site(const std::string& world, std::string sequence, double max_range_m, double most_s)
      : file_(LODESTONE_SOURCE_DIR "/config/worlds/" + world),
        sequence_(std::move(sequence)),
        max_range_m_(max_range_m),
        environment_(std::make_shared<const simulation::Environment>(load({}))) {
    const simulation::World healthy = load({});
    planes_ = std::make_shared<PlaneMap>(sample_cloud(healthy, *environment_, 7), PlaneMapOptions{});
    const simulation::SimulationSource source(healthy, environment_, sequence_,
                                              simulation::SimulationSource::Drive::sequence, 7, most_s);
    const Trajectory truth = source.trajectory();
    const double height_m =
        truth.front().pose.position.z() + simulation::sensor_suite(healthy).magnetometers[0].T_imu_mag.position.z();
    field_ = true_field(*environment_, truth, height_m);
  }

  /// `faults`: entries of a world's list of faults, in its YAML format.
  Drive drive(double duration_s, const std::string& faults) const {
    const simulation::World world = load(faults);
    simulation::SimulationSource source(world, environment_, sequence_, simulation::SimulationSource::Drive::sequence,
                                        7, duration_s);
    Drive drive;
    drive.suite = simulation::sensor_suite(world);
    drive.suite.lidar.max_range_m = max_range_m_;
    drive.truth = source.trajectory();
    drive.planes = planes_;
    drive.field = field_;
    WarningLog warnings;
    Synchronizer synchronizer(source, drive.suite, warnings);
    ScanBundle bundle;
    while (synchronizer.next(bundle)) drive.bundles.push_back(bundle);
    return drive;
  }

 private:
  simulation::World load(const std::string& faults) const {
    return simulation::load_world(file_,
                                  {"sensors.lidar.rows=16", "sensors.lidar.columns=256", "faults=[" + faults + "]"});
  }

  std::string file_;
  std::string sequence_;
  double max_range_m_;
  std::shared_ptr<const simulation::Environment> environment_;
  std::shared_ptr<const PlaneMap> planes_;
  std::shared_ptr<const MagneticMap> field_;
};

/// LiDAR does not observe the position along it.
inline const Site& tunnel() {
  static const Site site("tunnel.yaml", "3", 10.0, 45.0);
  return site;
}

/// An aisle between racks, then an open floor, with a LiDAR range of 10 m.
inline const Site& warehouse() {
  static const Site site("warehouse.yaml", "1", 10.0, 30.0);
  return site;
}

}  // namespace lodestone::testing
