#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "tools/simulate/cloud_map.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone::simulation {

/// A hall with crates and without noise. A test sets its section `reality`: every difference to grade exact is the
/// effect.
class RealityHall : public ::testing::Test {
 protected:
  using Drive = SimulationSource::Drive;

  void SetUp() override { std::ofstream(file_) << hall; }
  void TearDown() override { std::remove(file_.c_str()); }

  World load(const std::string& reality, std::vector<std::string> settings = {}) const {
    settings.push_back("reality=" + reality);
    return load_world(file_, settings);
  }

  static SimulationSource source_of(const World& world, std::uint64_t seed = 7, Drive drive = Drive::sequence,
                                    double duration_s = 4.0) {
    const MovedObjects moved = draw_moved_objects(world, seed);
    const Rearrangement& there = drive == Drive::sequence ? moved.driven : moved.mapped;
    return SimulationSource(world, std::make_shared<Environment>(world, "", there), "loop", drive, seed, duration_s);
  }

  template <class Kind>
  static std::vector<Kind> all(SimulationSource source) {
    std::vector<Kind> found;
    for (Measurement measurement; source.next(measurement);)
      if (auto* value = std::get_if<Kind>(&measurement)) found.push_back(*value);
    return found;
  }

  std::string file_ = ::testing::TempDir() + "reality_hall_" + std::to_string(::getpid()) + ".yaml";

 private:
  static constexpr const char* hall = R"(
name: hall
steel_seed: 3
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 8, columns: 128, vertical_field_of_view_deg: 30, range_noise_m: 0, direction_noise_rad: 0,
          dropout_probability: 0}
  imu: {gyroscope_noise_density_rad_s_sqrt_hz: 0, accelerometer_noise_density_m_s2_sqrt_hz: 0,
        gyroscope_bias_random_walk_rad_s2_sqrt_hz: 0, accelerometer_bias_random_walk_m_s3_sqrt_hz: 0,
        gyroscope_bias_sigma_rad_s: 0, accelerometer_bias_sigma_m_s2: 0}
  magnetometers: {noise_ut: 0}
  magnetometer_mounts:
    - {name: front, position_m: [0.3, 0.2, -0.08]}
    - {name: rear, position_m: [-0.3, -0.2, -0.08], rotation_rpy_deg: [0, 0, 180]}
cloud: {point_spacing_m: 0.15, noise_m: 0}
survey: {lateral_offsets_m: [0.0], position_sigma_m: 0, angle_sigma_deg: 0}
solids:
  - {name: floor, shape: rectangle, size_m: [40, 30]}
  - {name: hall, shape: box, at_m: [0, 0, 2.5], size_m: [40, 30, 5]}
  - {name: crates, shape: box, at_m: [-17, 10, 0.5], size_m: [1, 1, 1],
     repeat: {count: [12, 2, 1], step_m: [2.8, 2, 0]},
     steel: [{kind: dipole, at_m: [0, 0, 0], moment_sigma_a_m2: 30}]}
  - {name: more crates, shape: box, at_m: [-17, -12, 0.5], size_m: [1, 1, 1],
     repeat: {count: [12, 2, 1], step_m: [2.8, 2, 0]}, steel: [{kind: dipole, at_m: [0, 0, 0], moment_sigma_a_m2: 30}]}
sequences:
  loop: {waypoints_m: [[-14, -6], [13, -6], [13, 6], [-13, 6]], speed: [[0, 1.5]]}
  other: {waypoints_m: [[-14, 0], [14, 0]], speed: [[0, 1.0]]}
)";
};

}  // namespace lodestone::simulation
