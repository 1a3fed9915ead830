#include "tests/estimators/weak_imu/site.h"

#include <algorithm>
#include <cmath>

#include "tests/estimators/initialization/random_starts.h"

namespace lodestone::weak_imu {

namespace {

simulation::Sequence rounds(double speed_m_s) {
  constexpr double side_s = 7.0;
  constexpr int corners = 12;
  const double side_m = side_s * speed_m_s;
  const Eigen::Vector2d first(22.0 - 0.5 * side_m, 22.0 - 0.5 * side_m);
  simulation::Sequence sequence;
  for (int corner = 0; corner <= corners; ++corner) {
    const int side = corner % 4;
    sequence.waypoints.emplace_back(first.x() + (side == 1 || side == 2 ? side_m : 0.0),
                                    first.y() + (side >= 2 ? side_m : 0.0));
  }
  // A yaw rate of 0.7 rad/s, or a lateral acceleration of 1.3 m/s²; the plan slows down to 1 m/s².
  sequence.corner_radius_m = std::max(speed_m_s / 0.7, speed_m_s * speed_m_s / 1.3);
  sequence.speed = {{0.0, speed_m_s}};
  sequence.acceleration_m_s2 = 1.5;
  return sequence;
}

simulation::World hall(const std::string& reality_grade) {
  return simulation::load_world(LODESTONE_SOURCE_DIR "/tests/estimators/weak_imu/hall.yaml",
                                {"reality=" + reality_grade});
}

}  // namespace

Site::Site(const std::string& reality_grade, std::uint64_t seed) : seed_(seed), world_(hall(reality_grade)) {
  const simulation::MovedObjects moved = simulation::draw_moved_objects(world_, seed);
  environment_ = std::make_shared<const simulation::Environment>(world_, "", moved.driven);
  const simulation::Environment mapped(world_, world_.cloud.scene, moved.mapped);
  planes_ = std::make_shared<const PlaneMap>(simulation::sample_cloud(world_, mapped, seed), PlaneMapOptions{});
}

testing::Drive Site::drive(const DriveChoice& choice) const {
  simulation::World world = simulation::with_sequence(world_, "rounds", rounds(choice.speed_m_s));
  const double height_m = world.imu.height_m;
  world.imu = choice.imu.sensor;
  world.imu.height_m = height_m;
  world.lidar.rate_hz = 1.0 / choice.scan_period_s;
  if (!choice.with_field) world.magnetometers.mounts.clear();
  simulation::SimulationSource source(world, environment_, "rounds", simulation::SimulationSource::Drive::sequence,
                                      seed_, choice.duration_s);
  testing::Drive drive;
  drive.suite = simulation::believed_suite(world, source.reality());
  drive.suite.imu = choice.imu.stated(drive.suite.imu);
  drive.truth = source.trajectory();
  drive.planes = planes_;
  if (choice.with_field) {
    const double array_m = drive.suite.magnetometers[0].T_imu_mag.position.z();
    drive.field = testing::true_field(*environment_, drive.truth, drive.truth.front().pose.position.z() + array_m);
  }
  WarningLog warnings;
  Synchronizer synchronizer(source, drive.suite, warnings);
  ScanBundle bundle;
  while (synchronizer.next(bundle)) drive.bundles.push_back(bundle);
  return drive;
}

}  // namespace lodestone::weak_imu
