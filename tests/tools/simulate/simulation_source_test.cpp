#include "tools/simulate/simulation_source.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "core/error.h"
#include "tests/tools/simulate/same_measurement.h"
#include "tools/simulate/cloud_map.h"
#include "tools/simulate/route.h"

namespace lodestone::simulation {
namespace {

using Drive = SimulationSource::Drive;

/// A world that no code refers to: a room with a rack and a pillar.
constexpr const char* room = R"(
name: room
steel_seed: 3
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {columns: 256}
  magnetometer_mounts:
    - {position_m: [0.3, 0.2, -0.08]}
    - {position_m: [-0.3, -0.2, -0.08], rotation_rpy_deg: [0, 0, 180]}
templates:
  shelf:
    - {shape: box, at_m: [0, 0, 0.5], size_m: [1, 0.5, 0.05],
       steel: [{kind: dipole, at_m: [0, 0, 0], moment_sigma_a_m2: 3}]}
solids:
  - {name: floor, shape: rectangle, size_m: [16, 12], steel: [{kind: rods, from_m: [-8, -6, -0.5], to_m: [8, 6, -0.4],
     density_per_m2: 1, length_m: [0.5, 1.0], moment_sigma_a_m2: 10}]}
  - {name: room, shape: box, at_m: [0, 0, 2], size_m: [16, 12, 4]}
  - {name: rack, template: shelf, at_m: [0, 5, 0], repeat: {count: [2, 1, 3], step_m: [1.2, 0, 0.8]}}
  - {name: pillar, shape: cylinder, at_m: [3, -4, 0], radius_m: 0.3, height_m: 4}
scenes:
  monday: {solids: [{name: cart, template: shelf, at_m: [5, 4, 0]}, {name: crate, template: shelf, at_m: [-5, 4, 0]}]}
  tuesday: {solids: [{template: shelf, at_m: [0, -5, 0]}, {name: crate, template: shelf, at_m: [-5, 4, 0]}]}
sequences:
  loop: {waypoints_m: [[-6, -3], [5, -3], [5, 3]], speed: [[0, 1.5]]}
)";

class SimulatedRoom : public ::testing::Test {
 protected:
  void SetUp() override { std::ofstream(file_) << room; }
  void TearDown() override { std::remove(file_.c_str()); }

  World load(const std::vector<std::string>& settings = {}) const { return load_world(file_, settings); }

  std::vector<Measurement> drain(std::uint64_t seed, Drive drive = Drive::sequence) const {
    const World world = load();
    SimulationSource source(world, std::make_shared<Environment>(world), "loop", drive, seed, 4.0);
    std::vector<Measurement> all;
    for (Measurement measurement; source.next(measurement);) all.push_back(measurement);
    return all;
  }

  std::string expect_error(const std::vector<std::string>& settings) const {
    try {
      load(settings);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  std::string file_ = ::testing::TempDir() + "simulated_room_" + std::to_string(::getpid()) + ".yaml";
};

TEST_F(SimulatedRoom, SameSeedSameBitsOnAnyNumberOfThreads) {
  const auto first = drain(1);
  std::vector<Measurement> second;
  {
    tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    second = drain(1);
  }
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) ASSERT_TRUE(same_measurement(first[i], second[i])) << i;
}

TEST_F(SimulatedRoom, AnotherSeedMakesOtherNoise) {
  const auto first = drain(1), second = drain(2);
  std::size_t equal = 0;
  for (std::size_t i = 0; i < std::min(first.size(), second.size()); ++i)
    equal += same_measurement(first[i], second[i]);
  EXPECT_EQ(equal, 0U);
}

TEST_F(SimulatedRoom, MeasurementsComeInTheOrderOfTheirCompletionAndRate) {
  const auto all = drain(1);
  std::map<std::size_t, int> counts;
  Time last = 0;
  for (const Measurement& measurement : all) {
    EXPECT_GE(completion_time(measurement), last);
    last = completion_time(measurement);
    ++counts[measurement.index()];
  }
  EXPECT_NEAR(counts[0], 800, 25);      // IMU, 4 s at 200 Hz and a margin
  EXPECT_NEAR(counts[1], 2 * 800, 50);  // two magnetometers
  EXPECT_NEAR(counts[2], 40, 2);
}

TEST_F(SimulatedRoom, SurveyHasNoScansAndOtherShaking) {
  const auto survey = drain(1, Drive::survey);
  for (const Measurement& measurement : survey) EXPECT_FALSE(std::holds_alternative<LidarScan>(measurement));
  const World world = load();
  const auto environment = std::make_shared<Environment>(world);
  SimulationSource source(world, environment, "loop", Drive::survey, 1, 1e9);
  double squares = 0.0;
  const Trajectory noisy = source.trajectory();
  for (const StampedPose& pose : noisy)
    squares += (pose.pose.position - source.motion().pose_at(to_seconds(pose.time - world.start_time)).position)
                   .squaredNorm() /
               3;
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(noisy.size())), world.survey.position_sigma_m, 1e-4);
}

TEST_F(SimulatedRoom, SurveyLanesRunAlongTheirOwnWayPointsWhereThereAreSome) {
  const World world = load({"sequences.loop.survey_waypoints_m=[[-5, 2], [5, 2]]"});
  const Sequence& loop = world.sequences.at("loop");
  Eigen::AlignedBox2d lanes, drive;
  for (const PlannedPose& pose : plan_survey(loop, world.survey)) lanes.extend(pose.position);
  for (const PlannedPose& pose : plan_drive(loop)) drive.extend(pose.position);
  EXPECT_NEAR(lanes.min().y(), 2.0 - 0.6, 0.01);
  EXPECT_NEAR(lanes.max().y(), 2.0 + 0.6, 0.01);
  EXPECT_NEAR(lanes.max().x(), 5.0 + world.survey.overrun_m, 0.01);
  EXPECT_LT(drive.min().y(), -2.9);
}

TEST_F(SimulatedRoom, MagnetometersReadTheFieldWhereTheyAre) {
  const World world = load({"sensors.magnetometers.noise_ut=0"});
  const auto environment = std::make_shared<Environment>(world);
  SimulationSource source(world, environment, "", Drive::sequence, 1, 5.0);
  int checked = 0;
  for (Measurement measurement; source.next(measurement);) {
    const auto* sample = std::get_if<MagneticSample>(&measurement);
    if (sample == nullptr) continue;
    const Pose pose = source.motion().pose_at(to_seconds(sample->time - world.start_time)) *
                      world.magnetometers.mounts[static_cast<std::size_t>(sample->magnetometer)].T_imu_mag();
    const Vector3 expected = pose.rotation.conjugate() * environment->field.field_of_all_ut(pose.position);
    ASSERT_LT((sample->field_ut - expected).norm(), 0.001);
    EXPECT_EQ((sample->time - world.start_time) % 5'000'000, 1'300'000);
    ++checked;
  }
  EXPECT_GT(checked, 1000);
}

TEST_F(SimulatedRoom, RepeatedSolidsAreMagnetizedEachInItsOwnWay) {
  const Scene scene = build_scene(load());
  std::vector<Vector3> moments;
  for (const FieldSource& source : scene.sources)
    if (!source.is_bar) moments.push_back(source.moment);
  ASSERT_EQ(moments.size(), 6U);
  for (std::size_t i = 1; i < moments.size(); ++i) EXPECT_NE(moments[i], moments[0]);
}

bool same(const FieldSource& a, const FieldSource& b) {
  return a.is_bar == b.is_bar && a.position == b.position && a.south == b.south && a.moment == b.moment &&
         a.pole == b.pole;
}

TEST_F(SimulatedRoom, SceneLeavesTheSteelOfTheWorldAsItIs) {
  const World world = load();
  const Scene alone = build_scene(world), monday = build_scene(world, "monday"),
              tuesday = build_scene(world, "tuesday");
  ASSERT_EQ(monday.sources.size(), alone.sources.size() + 2);
  ASSERT_EQ(tuesday.sources.size(), alone.sources.size() + 2);
  for (std::size_t i = 0; i < alone.sources.size(); ++i) {
    ASSERT_TRUE(same(alone.sources[i], monday.sources[i])) << i;
    ASSERT_TRUE(same(alone.sources[i], tuesday.sources[i])) << i;
  }
  EXPECT_GT(monday.mesh.triangles.size(), alone.mesh.triangles.size());
  // An object with the same name on another day has the same magnetization, whatever else has changed; other objects
  // differ.
  EXPECT_TRUE(same(monday.sources.back(), tuesday.sources.back()));
  EXPECT_NE(monday.sources[alone.sources.size()].moment, monday.sources.back().moment);
  EXPECT_NE(tuesday.sources[alone.sources.size()].moment, monday.sources[alone.sources.size()].moment);
  // The field is the sum of both.
  const Vector3 place(4.5, 3.5, 0.1);
  const MagneticField field(world.earth_field_ut, monday.sources), bare(world.earth_field_ut, alone.sources);
  Vector3 expected = bare.field_of_all_ut(place);
  for (std::size_t i = alone.sources.size(); i < monday.sources.size(); ++i)
    expected += source_field_ut(monday.sources[i], place);
  EXPECT_EQ(field.field_of_all_ut(place), expected);
}

TEST_F(SimulatedRoom, LogsOfTwoScenesDifferOnlyByWhatStandsThereAndSurveysByTheirNoiseToo) {
  const World world = load();
  const auto alone = std::make_shared<Environment>(world), monday = std::make_shared<Environment>(world, "monday");
  for (const Drive drive : {Drive::sequence, Drive::survey}) {
    SimulationSource first(world, alone, "", drive, 1, 2.0), second(world, monday, "", drive, 1, 2.0);
    int same_imu = 0, other_imu = 0, other_field = 0;
    for (Measurement a, b; first.next(a) && second.next(b);) {
      if (std::holds_alternative<ImuSample>(a)) ++(same_measurement(a, b) ? same_imu : other_imu);
      if (std::holds_alternative<MagneticSample>(a)) other_field += !same_measurement(a, b);
    }
    EXPECT_GT(other_field, 100);
    EXPECT_EQ((drive == Drive::sequence ? other_imu : same_imu), 0);
    EXPECT_GT((drive == Drive::sequence ? same_imu : other_imu), 100);
  }
}

TEST_F(SimulatedRoom, CloudCoversWhatIsSeenAndNothingElse) {
  const World world = load();
  const Environment environment(world);
  const auto cloud = sample_cloud(world, environment, 1);
  EXPECT_EQ(cloud.size(), sample_cloud(world, environment, 1).size());
  std::size_t on_floor = 0, inside_pillar_foot = 0;
  for (const auto& point : cloud) {
    EXPECT_LT(std::abs(point.x()), 8.1F);
    EXPECT_LT(std::abs(point.y()), 6.1F);
    on_floor += std::abs(point.z()) < 0.05F;
    inside_pillar_foot += std::hypot(point.x() - 3.0F, point.y() + 4.0F) < 0.22F && point.z() < 3.9F;
  }
  // The floor of 192 m² exists twice (it is the bottom of the room as well); one point per (0.09 m)².
  EXPECT_NEAR(static_cast<double>(on_floor), 2 * 192 / 0.0081, 0.1 * 2 * 192 / 0.0081);
  EXPECT_EQ(inside_pillar_foot, 0U);
}

TEST_F(SimulatedRoom, GlassIsSurveyedInFewPointsAndHidesLittle) {
  // A pane from wall to wall in front of y = 4.5 m, with the rack behind it.
  const auto cloud_with = [&](const char* pane) {
    std::string text = room;
    text.insert(text.find("  - {name: floor"), pane);
    std::ofstream(file_) << text;
    const World world = load();
    return sample_cloud(world, Environment(world), 1);
  };
  const auto count = [](const std::vector<Eigen::Vector3f>& cloud, float from_y, float to_y) {
    return static_cast<double>(std::count_if(cloud.begin(), cloud.end(), [&](const Eigen::Vector3f& point) {
      return point.y() > from_y && point.y() < to_y && point.z() > 0.1F && point.z() < 3.9F;
    }));
  };
  constexpr const char* place =
      "  - {name: pane, shape: rectangle, size_m: [16, 4], at_m: [0, 4.5, 2], "
      "rotation_rpy_deg: [90, 0, 0]";
  const auto open = cloud_with("");
  const auto opaque = cloud_with((std::string(place) + "}\n").c_str());
  const auto glass = cloud_with((std::string(place) + ", transparency: 0.9}\n").c_str());
  const auto mirror = cloud_with((std::string(place) + ", transparency: 0.9, max_incidence_deg: 4}\n").c_str());
  const double on_pane = count(opaque, 4.44F, 4.56F);
  EXPECT_GT(on_pane, 5000);
  EXPECT_EQ(count(opaque, 4.7F, 7.0F), 0);
  EXPECT_NEAR(count(glass, 4.44F, 4.56F) / on_pane, 0.1, 0.02);
  EXPECT_NEAR(count(glass, 4.7F, 7.0F) / count(open, 4.7F, 7.0F), 0.9, 0.05);
  EXPECT_GT(count(mirror, 4.44F, 4.56F), 0);
  EXPECT_LT(count(mirror, 4.44F, 4.56F), 0.5 * count(glass, 4.44F, 4.56F));
  // In front of the pane nothing changes: the same surfaces with the same density.
  EXPECT_NEAR(count(glass, -6.5F, 4.3F) / count(open, -6.5F, 4.3F), 1.0, 0.02);
}

TEST_F(SimulatedRoom, MistakesInTheWorldAreNamed) {
  using ::testing::AssertionResult;
  const auto mentions = [](const std::string& message, const std::string& part) {
    return message.find(part) != std::string::npos;
  };
  std::string message = expect_error({"sensors.lidar.colums=5"});
  EXPECT_TRUE(mentions(message, "columns")) << message;
  message = expect_error({"sensors.magnetometers.noise_ut=loud"});
  EXPECT_TRUE(mentions(message, "noise_ut")) << message;
  message = expect_error({"sensors.imu.rate_hz=0"});
  EXPECT_TRUE(mentions(message, "rate_hz")) << message;
  message = expect_error({"sensors.lidar.pattern=rossette"});
  EXPECT_TRUE(mentions(message, "rosette")) << message;
  message = expect_error({"solids.1.transparency=2"});
  EXPECT_TRUE(mentions(message, "transparency")) << message;
  message = expect_error({"sequences.loop.along=subway"});
  EXPECT_TRUE(mentions(message, "subway")) << message;
  message = expect_error({"sequences.loop.waypoints_m=[[1, 2]]"});
  EXPECT_TRUE(mentions(message, "waypoints_m")) << message;
  message = expect_error({"scenes.monday.solid=[]"});
  EXPECT_TRUE(mentions(message, "solids")) << message;
  message = expect_error({"cloud.scene=sunday"});
  EXPECT_TRUE(mentions(message, "monday")) << message;
  message = expect_error({"sequences.loop.scene=sunday"});
  EXPECT_TRUE(mentions(message, "sequences.loop.scene") && mentions(message, "tuesday")) << message;
  message = expect_error({"scenes.none.solids=[]"});
  EXPECT_TRUE(mentions(message, "none")) << message;
  EXPECT_THROW(build_scene(load(), "sunday"), InputError);
  message = expect_error({"sequences.loop.survey_waypoints_m=[[1, 2]]"});
  EXPECT_TRUE(mentions(message, "survey_waypoints_m")) << message;
  message = expect_error({"walls=3"});
  EXPECT_TRUE(mentions(message, "walls")) << message;
  EXPECT_THROW(find_sequence(load(), "9"), InputError);
  EXPECT_THROW(load_world("no_such_world.yaml"), InputError);
}

}  // namespace
}  // namespace lodestone::simulation
