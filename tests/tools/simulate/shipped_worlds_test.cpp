#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>

#include "frontends/configuration/platform.h"
#include "tools/simulate/lidar_simulator.h"
#include "tools/simulate/magnetic_field.h"
#include "tools/simulate/route.h"
#include "tools/simulate/scene.h"

namespace lodestone::simulation {
namespace {

std::vector<std::string> shipped_worlds() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(LODESTONE_SOURCE_DIR "/config/worlds"))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

/// All scenes, and no scene.
std::vector<std::string> scenes_of(const World& world) {
  std::vector<std::string> names{""};
  for (const auto& entry : world.scenes) names.push_back(entry.first);
  return names;
}

/// Horizontal gradients of the field's components along a path at the magnetometers' height, every 5 cm.
struct FieldStatistics {
  double gradient_rms = 0.0;          ///< µT/m, of one component along one horizontal axis
  double weakest_gradient_rms = 0.0;  ///< the same over the weakest 2 m of the path
  double field_sigma = 0.0;           ///< µT, a component, about its mean over 5 m
  double structure_m = 0.0;  ///< field_sigma / gradient_rms: the field changes by its own size over this length
};

FieldStatistics field_statistics(const World& world, const Sequence& sequence) {
  const MagneticField field(world.earth_field_ut, build_scene(world, sequence.scene).sources);
  const double height = world.imu.height_m + world.magnetometers.mounts.at(0).T_imu_mag().position.z();
  const Route route(sequence.waypoints, sequence.corner_radius_m);
  constexpr double step = 0.05, half = 0.01;
  std::vector<double> squares;
  std::vector<Vector3> values;
  for (double distance = 0.0; distance < route.length(); distance += step) {
    const Eigen::Vector2d place = route.at(distance).position;
    const Vector3 point(place.x(), place.y(), height);
    double sum = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
      const Vector3 offset = half * Vector3::Unit(axis);
      sum += ((field.field_ut(point + offset) - field.field_ut(point - offset)) / (2.0 * half)).squaredNorm();
    }
    squares.push_back(sum / 6.0);
    values.push_back(field.field_ut(point));
  }
  const auto mean_square = [&](std::size_t begin, std::size_t end) {
    double sum = 0.0;
    for (std::size_t i = begin; i < end; ++i) sum += squares[i];
    return sum / static_cast<double>(end - begin);
  };
  FieldStatistics statistics;
  statistics.gradient_rms = std::sqrt(mean_square(0, squares.size()));
  statistics.weakest_gradient_rms = 1e9;
  for (std::size_t i = 0; i + 40 <= squares.size(); ++i)
    statistics.weakest_gradient_rms = std::min(statistics.weakest_gradient_rms, std::sqrt(mean_square(i, i + 40)));
  double variance = 0.0;
  std::size_t count = 0;
  for (std::size_t begin = 0; begin + 100 <= values.size(); begin += 100) {
    Vector3 mean = Vector3::Zero();
    for (std::size_t i = begin; i < begin + 100; ++i) mean += values[i] / 100.0;
    for (std::size_t i = begin; i < begin + 100; ++i, ++count) variance += (values[i] - mean).squaredNorm() / 3.0;
  }
  statistics.field_sigma = std::sqrt(variance / static_cast<double>(count));
  statistics.structure_m = statistics.field_sigma / statistics.gradient_rms;
  return statistics;
}

/// In this field, a map with 0.5 µT of error localizes eight magnetometers to a centimetre or two: gradients near those
/// measured in buildings at this height, and structures that a map of 0.1 m cells can represent.
TEST(ShippedWorlds, FieldAlongEveryPathCanPlaceARobot) {
  for (const std::string& file : shipped_worlds()) {
    const World world = load_world(file);
    for (const auto& [name, sequence] : world.sequences) {
      const FieldStatistics s = field_statistics(world, sequence);
      const Route route(sequence.waypoints, sequence.corner_radius_m);
      std::cout << std::filesystem::path(file).filename().string() << " sequence " << name << ": " << route.length()
                << " m, gradient rms " << s.gradient_rms << " (weakest 2 m: " << s.weakest_gradient_rms
                << ") uT/m, sigma " << s.field_sigma << " uT, structure " << s.structure_m << " m\n";
      EXPECT_GT(s.gradient_rms, 8.0) << file << " " << name;
      EXPECT_LT(s.gradient_rms, 30.0) << file << " " << name;
      EXPECT_GT(s.weakest_gradient_rms, 3.0) << file << " " << name;
      EXPECT_GT(s.structure_m, 0.3) << file << " " << name;
      EXPECT_LT(s.structure_m, 1.2) << file << " " << name;
    }
  }
}

TEST(ShippedWorlds, SequencesLastAsLongAsTheyShould) {
  for (const std::string& file : shipped_worlds()) {
    const World world = load_world(file);
    for (const auto& [name, sequence] : world.sequences) {
      const auto plan = plan_drive(sequence);
      double fastest = 0.0;
      for (const PlannedPose& pose : plan) fastest = std::max(fastest, pose.speed);
      std::cout << std::filesystem::path(file).filename().string() << " sequence " << name << ": "
                << static_cast<double>(plan.size()) * plan_step_s << " s, up to " << fastest << " m/s\n";
      EXPECT_GT(static_cast<double>(plan.size()) * plan_step_s, 80.0);
      EXPECT_LT(static_cast<double>(plan.size()) * plan_step_s, 220.0);
      EXPECT_LE(fastest, 3.1);
    }
  }
}

TEST(ShippedWorlds, NothingStandsWhereTheRobotAndItsSurveyDrive) {
  for (const std::string& file : shipped_worlds()) {
    const World world = load_world(file);
    std::vector<Eigen::Vector3f> around;
    for (int k = 0; k < 36; ++k) around.emplace_back(std::cos(k * M_PI / 18.0), std::sin(k * M_PI / 18.0), 0.0F);
    for (const std::string& scene : scenes_of(world)) {
      const RayCaster caster(build_scene(world, scene).mesh);
      for (const auto& [name, sequence] : world.sequences) {
        for (const auto& plan : {plan_drive(sequence), plan_survey(sequence, world.survey)}) {
          for (std::size_t i = 0; i < plan.size(); i += 20) {
            std::vector<RayHit> hits(around.size());
            const Eigen::Vector2f place = plan[i].position.cast<float>();
            for (const float height : {0.12F, 0.3F, 0.5F}) {
              caster.cast({place.x(), place.y(), height}, around, 0.45F, hits);
              for (const RayHit& hit : hits)
                ASSERT_LT(hit.range, 0.0F) << file << " " << name << " " << scene << " at " << place.transpose();
            }
          }
        }
      }
    }
  }
}

/// Longest continuous time of a sequence in which a LiDAR of this range sees only the floor, s.
double longest_blind_stretch(const World& world, const Sequence& sequence, double max_range_m) {
  const RayCaster caster(build_scene(world).mesh);
  const Motion motion(plan_drive(sequence), world.imu.height_m, world.floor, 1);
  LidarOptions options = world.lidar;
  options.columns = 128;
  options.max_range_m = max_range_m;
  options.range_noise_m = 0.0;
  const LidarSimulator lidar(caster, motion, options, 0, 1);
  int blind = 0, longest = 0;
  for (int index = 0; index < lidar.scan_count(); ++index) {
    bool floor_only = true;
    const LidarScan scan = lidar.scan(index);
    for (const LidarPoint& point : scan.points) {
      const Pose pose = motion.pose_at(to_seconds(scan.start + point.offset_ns)) * options.T_imu_lidar();
      floor_only = floor_only && (pose * point.position.cast<double>()).z() < 0.05;
    }
    blind = floor_only ? blind + 1 : 0;
    longest = std::max(longest, blind);
  }
  return longest / options.rate_hz;
}

TEST(ShippedWorlds, TheOpenFloorOfTheWarehouseTakesTwentySecondsToCross) {
  const World world = load_world(LODESTONE_SOURCE_DIR "/config/worlds/warehouse.yaml");
  for (const auto& [name, sequence] : world.sequences) {
    const double seconds = longest_blind_stretch(world, sequence, 10.0);
    std::cout << "warehouse sequence " << name << ": " << seconds << " s with nothing but the floor within 10 m\n";
    EXPECT_GT(seconds, 18.0) << name;
    EXPECT_LT(seconds, 25.0) << name;
    EXPECT_EQ(longest_blind_stretch(world, sequence, 100.0), 0.0) << name;
  }
}

TEST(ShippedWorlds, EmptyYardsOfTheSeaportLeaveNothingToBeSeenAtTenMetres) {
  const World world = load_world(LODESTONE_SOURCE_DIR "/config/worlds/seaport.yaml");
  for (const auto& [name, sequence] : world.sequences) {
    const double seconds = longest_blind_stretch(world, sequence, 10.0);
    std::cout << "seaport sequence " << name << ": " << seconds << " s with nothing but the ground within 10 m\n";
    EXPECT_GT(seconds, 20.0) << name;
    EXPECT_EQ(longest_blind_stretch(world, sequence, 100.0), 0.0) << name;
  }
}

/// The paper's sizes: a sequence stays within its world and covers most of its length.
TEST(ShippedWorlds, SequencesFillTheWorldsThatThePaperDescribes) {
  const std::map<std::string, Eigen::Vector2d> sizes = {{"warehouse", {90, 80}},
                                                        {"seaport", {300, 300}},
                                                        {"walkway", {181, 23}},
                                                        {"corridor", {15, 65}},
                                                        {"carpark", {56, 7}}};
  for (const std::string& file : shipped_worlds()) {
    const auto size = sizes.find(std::filesystem::path(file).stem().string());
    if (size == sizes.end()) continue;
    const World world = load_world(file);
    const Scene scene = build_scene(world);
    std::cout << world.name << ": " << scene.mesh.triangles.size() << " triangles, " << scene.sources.size()
              << " pieces of steel\n";
    EXPECT_LT(scene.mesh.triangles.size(), 500'000U) << file;
    for (const auto& [name, sequence] : world.sequences) {
      Eigen::AlignedBox2d box;
      for (const PlannedPose& pose : plan_drive(sequence)) box.extend(pose.position);
      EXPECT_GT(box.min().minCoeff(), 0.4) << file << " " << name;
      EXPECT_LT((box.max() - size->second).maxCoeff(), -0.4) << file << " " << name;
      EXPECT_GT(box.sizes().cwiseQuotient(size->second).maxCoeff(), 0.4) << file << " " << name;
    }
  }
}

/// Largest difference between the fields of two scenes, µT, within the area of a survey's map: at the magnetometers
/// along its lanes, and beside them up to the map's border.
double largest_change_ut(const World& world, const Sequence& sequence, const std::string& a, const std::string& b) {
  const std::size_t common = build_scene(world).sources.size();
  const std::vector<FieldSource> first = build_scene(world, a).sources, second = build_scene(world, b).sources;
  double largest = 0.0;
  const auto plan = plan_survey(sequence, world.survey);
  for (std::size_t i = 0; i < plan.size(); i += 4) {
    Pose base;
    base.position = {plan[i].position.x(), plan[i].position.y(), world.imu.height_m};
    base.rotation = Eigen::AngleAxisd(plan[i].heading, Vector3::UnitZ());
    for (const MagnetometerMount& mount : world.magnetometers.mounts) {
      for (const double beside_m : {-0.23, 0.0, 0.23}) {
        const Vector3 point = (base * mount.T_imu_mag()).position + base.rotation * Vector3(0.0, beside_m, 0.0);
        Vector3 difference = Vector3::Zero();
        for (std::size_t k = common; k < first.size(); ++k) difference += source_field_ut(first[k], point);
        for (std::size_t k = common; k < second.size(); ++k) difference -= source_field_ut(second[k], point);
        largest = std::max(largest, difference.norm());
      }
    }
  }
  return largest;
}

TEST(ShippedWorlds, ParkedCarsChangeTheFieldAsMuchAsInThePaper) {
  const std::map<std::string, double> changes_ut = {{"2025-12-20", 30.47}, {"2026-02-06", 80.04}, {"2026-02-07", 18.90},
                                                    {"2026-03-18", 28.50}, {"2026-03-19", 53.73}, {"2026-03-20", 0.0}};
  const World world = load_world(LODESTONE_SOURCE_DIR "/config/worlds/carpark.yaml");
  EXPECT_EQ(world.scenes.size(), changes_ut.size());
  for (const auto& [name, sequence] : world.sequences) {
    for (const auto& [scene, expected] : changes_ut) {
      const double change = largest_change_ut(world, sequence, scene, sequence.scene);
      std::cout << "carpark sequence " << name << ", " << scene << ": largest change " << change << " uT\n";
      EXPECT_NEAR(change, expected, 0.1 * expected + 1e-9) << scene;  // rounding of sums
    }
  }
}

/// Neither portal nor end is visible: from everywhere on the path, all returns are from the bore, and beams along it
/// give no return.
TEST(ShippedWorlds, TheTunnelGoesOnPastTheLidarsRange) {
  const World world = load_world(LODESTONE_SOURCE_DIR "/config/worlds/tunnel.yaml");
  ASSERT_EQ(world.solids.size(), 1U);
  const Solid& bore = world.solids[0];
  for (const auto& [name, sequence] : world.sequences) {
    for (const double end : {bore.tube_begin_m, bore.tube_end_m}) {
      const Eigen::Vector2d portal = (bore.placement * tube_point(bore, {end, 0, 0})).head<2>();
      for (const Eigen::Vector2d& waypoint : sequence.waypoints)
        EXPECT_GT((waypoint - portal).norm(), world.lidar.max_range_m + 10.0) << name;
    }
  }
}

TEST(ShippedWorlds, CarryTheScoutOfItsPlatformFile) {
  const Platform scout = load_platform(LODESTONE_SOURCE_DIR "/config/platforms/scout_os32.yaml");
  for (const std::string& file : shipped_worlds()) {
    const SensorSuite suite = sensor_suite(load_world(file));
    EXPECT_LT(suite.lidar.T_imu_lidar.boxminus(scout.suite.lidar.T_imu_lidar).norm(), 1e-9) << file;
    EXPECT_EQ(suite.imu.accelerometer_noise_density, scout.suite.imu.accelerometer_noise_density) << file;
    EXPECT_EQ(suite.imu.gyroscope_noise_density, scout.suite.imu.gyroscope_noise_density) << file;
    ASSERT_EQ(suite.magnetometers.size(), scout.suite.magnetometers.size()) << file;
    for (std::size_t j = 0; j < suite.magnetometers.size(); ++j) {
      EXPECT_EQ(suite.magnetometers[j].name, scout.suite.magnetometers[j].name) << file;
      EXPECT_LT(suite.magnetometers[j].T_imu_mag.boxminus(scout.suite.magnetometers[j].T_imu_mag).norm(), 1e-9) << file;
    }
  }
}

}  // namespace
}  // namespace lodestone::simulation
