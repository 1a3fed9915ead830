#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "tests/tools/simulate/reality_world.h"
#include "tools/simulate/route.h"

/// Effects of the section `reality` on the maps, and differences between the survey and the drive.
namespace lodestone::simulation {
namespace {

class RealityOfMaps : public RealityHall {
 protected:
  static std::vector<Eigen::Vector3f> cloud_of(const World& world, std::uint64_t seed = 7) {
    return sample_cloud(world, Environment(world, "", draw_moved_objects(world, seed).mapped), seed);
  }
};

TEST_F(RealityOfMaps, WithoutEffectsTheCloudIsThatOfGradeExact) {
  EXPECT_EQ(cloud_of(load("exact")), cloud_of(load("{imu_scale_sigma: 0.1, people: 5, survey_pose_sigma_m: 0.1}")));
  const World world = load("rough");
  const auto many = cloud_of(world);
  tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(many, cloud_of(world));
}

TEST_F(RealityOfMaps, CloudAndTruthAreDisplacedByTheSameField) {
  const World exact_world = load("exact"),
              world = load("{cloud_displacement_rms_m: 0.05, cloud_displacement_length_m: 10}");
  const DisplacementField field = draw_reality(world, 7).displacement;
  const auto exact = cloud_of(exact_world), bent = cloud_of(world);
  ASSERT_EQ(exact.size(), bent.size());
  double squares = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const Vector3 shift = (bent[i] - exact[i]).cast<double>();
    EXPECT_LT((shift - field.at(exact[i].cast<double>())).norm(), 1e-5);
    squares += shift.squaredNorm() / (3.0 * static_cast<double>(exact.size()));
  }
  EXPECT_GT(std::sqrt(squares), 0.02);
  EXPECT_LT(std::sqrt(squares), 0.10);
  for (const Drive drive : {Drive::sequence, Drive::survey}) {
    SimulationSource source = source_of(world, 7, drive);
    for (const StampedPose& stamped : source.trajectory()) {
      const Pose actual = source.motion().pose_at(to_seconds(stamped.time - world.start_time));
      EXPECT_LT(stamped.pose.boxminus(field.displaced(actual)).norm(), 1e-12);
    }
  }
}

TEST_F(RealityOfMaps, AScanAtTheTruthLiesOnTheDisplacedMap) {
  const World world = load("{cloud_displacement_rms_m: 0.05, cloud_displacement_length_m: 20}");
  SimulationSource source = source_of(world);
  const DisplacementField field = source.reality().displacement;
  const Trajectory truth = source.trajectory();
  double squares = 0.0, undisplaced = 0.0;
  int count = 0;
  for (const LidarScan& scan : all<LidarScan>(source_of(world, 7, Drive::sequence, 1.5))) {
    for (const LidarPoint& point : scan.points) {
      const Time time = scan.start + point.offset_ns;  // the robot still rests
      const Pose actual = source.motion().pose_at(to_seconds(time - world.start_time));
      const Vector3 local = world.lidar.T_imu_lidar() * point.position.cast<double>();
      if (local.norm() > 6.0) continue;
      const Vector3 mapped = actual * local + field.at(actual * local);
      squares += (truth[0].pose * local - mapped).squaredNorm();
      undisplaced += (actual * local - mapped).squaredNorm();
      ++count;
    }
  }
  ASSERT_GT(count, 1000);
  // The remaining error is the strain of the map over at most 6 of its 20 m.
  EXPECT_LT(std::sqrt(squares / count), 0.015);
  EXPECT_LT(squares, 0.1 * undisplaced);
}

TEST_F(RealityOfMaps, TheSurveyMapsTheFieldInTheDisplacedFrame) {
  const World world = load("{cloud_displacement_rms_m: 0.05, cloud_displacement_length_m: 10}");
  const MagneticField field(world.earth_field_ut, build_scene(world).sources);
  SimulationSource source = source_of(world, 7, Drive::survey);
  const DisplacementField displacement = source.reality().displacement;
  const Trajectory trajectory = source.trajectory();
  int count = 0;
  for (Measurement measurement; source.next(measurement);) {
    const auto* sample = std::get_if<MagneticSample>(&measurement);
    if (sample == nullptr) continue;
    const auto pose = interpolate(trajectory, sample->time, from_seconds(0.1));
    if (!pose) continue;
    const Pose T_map_mag =
        *pose * world.magnetometers.mounts[static_cast<std::size_t>(sample->magnetometer)].T_imu_mag();
    // The true place that the map shows here: one step of the inverse is exact to a tenth of a millimetre.
    const Vector3 true_place =
        T_map_mag.position - displacement.at(T_map_mag.position - displacement.at(T_map_mag.position));
    const Pose frame = displacement.displaced({Quaternion::Identity(), true_place});
    const Vector3 mapped = T_map_mag.rotation * sample->field_ut;
    EXPECT_LT((mapped - frame.rotation * field.field_ut(true_place)).norm(), 0.25);
    ++count;
  }
  EXPECT_GT(count, 1000);
}

TEST_F(RealityOfMaps, TheSurveysTrajectoryErrsSlowly) {
  double squares = 0.0, steps = 0.0;
  constexpr int seeds = 60;
  const World world = load("{survey_pose_sigma_m: 0.02}");
  for (int seed = 1; seed <= seeds; ++seed) {
    const SimulationSource source = source_of(world, seed, Drive::survey, 6.0);
    const Trajectory trajectory = source.trajectory();
    const auto error = [&](std::size_t i) {
      const double seconds = to_seconds(trajectory[i].time - world.start_time);
      return Vector3(trajectory[i].pose.position - source.motion().pose_at(seconds).position);
    };
    squares += error(500).squaredNorm() / (3.0 * seeds);
    steps += (error(700) - error(500)).squaredNorm() / (3.0 * seeds);  // one second
  }
  EXPECT_NEAR(std::sqrt(squares), 0.02, 0.004);
  EXPECT_NEAR(std::sqrt(steps), 0.02 / 20.0, 0.0004);  // sigma / correlation time
}

TEST_F(RealityOfMaps, TheCloudHasItsOwnNoise) {
  double squares = 0.0;
  std::size_t count = 0;
  for (const auto& point : cloud_of(load("{cloud_noise_m: 0.03}"))) {
    if (std::abs(point.z()) > 0.1F) continue;
    squares += point.z() * point.z();
    ++count;
  }
  // A few points belong to the foot of a wall or a crate.
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 0.03, 0.006);
  const World own = load("exact", {"cloud.noise_m=0.02"});
  EXPECT_EQ(cloud_of(own), cloud_of(load("{people: 1}", {"cloud.noise_m=0.02"})));
}

TEST_F(RealityOfMaps, AShareOfTheSurfacesIsThereTwice) {
  double doubled = 0.0;
  constexpr int seeds = 8;
  for (int seed = 1; seed <= seeds; ++seed) {
    const std::size_t once = cloud_of(load("exact"), seed).size();
    const auto twice = cloud_of(load("{doubled_walls_share: 0.2, doubled_walls_distance_m: 0.03}"), seed);
    doubled += (static_cast<double>(twice.size()) / static_cast<double>(once) - 1.0) / seeds;
    for (const auto& point : twice) {
      if (std::abs(point.z()) > 0.1F || std::abs(point.x()) > 19.5F || std::abs(point.y()) > 9.0F) continue;
      const float off_floor = std::abs(point.z());
      if (off_floor > 1e-5F && off_floor < 0.029F) ADD_FAILURE() << off_floor;
    }
    if (::testing::Test::HasFailure()) break;
  }
  EXPECT_NEAR(doubled, 0.2, 0.05);
}

TEST_F(RealityOfMaps, ObjectsAreMovedGoneOrAddedOffThePathOfEverySequence) {
  const World world = load("{moved_objects_share: 0.4}");
  const MovedObjects moved = draw_moved_objects(world, 7);
  int shifted = 0, gone = 0, added = 0, new_boxes = 0;
  for (const MovedObject& object : moved.list) {
    const bool is_new = object.name.rfind("added box", 0) == 0;
    new_boxes += is_new;
    shifted += object.change == ObjectChange::shifted;
    gone += object.change == ObjectChange::gone;
    added += !is_new && object.change == ObjectChange::added;
    if (object.change == ObjectChange::gone) continue;
    for (const auto& [name, sequence] : world.sequences) {
      const Route route(sequence.waypoints, sequence.corner_radius_m);
      for (double distance = 0.0; distance <= route.length(); distance += 0.1) {
        const Eigen::Vector2d offset = (route.at(distance).position - object.driven_at.head<2>()).cwiseAbs();
        const Eigen::Vector2d outside = (offset - 0.5 * object.size.head<2>()).cwiseMax(0.0);
        EXPECT_GT(outside.norm(), 0.9) << object.name;
      }
    }
    if (object.change == ObjectChange::shifted) {
      const double step = (object.driven_at - object.mapped_at).norm();
      EXPECT_GE(step, 0.3);
      EXPECT_LE(step, 2.0);
    }
  }
  // 40 % of 48 crates: 19, with a standard deviation of 3.4.
  EXPECT_NEAR(shifted + gone + added, 19, 10);
  EXPECT_GT(shifted, 0);
  EXPECT_GT(gone, 0);
  EXPECT_GT(added, 0);
  EXPECT_GT(new_boxes, 2);
  EXPECT_EQ(draw_moved_objects(world, 7).list.size(), moved.list.size());
  EXPECT_NE(draw_moved_objects(world, 8).list.front().driven_at, moved.list.front().driven_at);
  EXPECT_TRUE(draw_moved_objects(load("exact"), 7).list.empty());
}

TEST_F(RealityOfMaps, StatisticsOfMovedObjectsMatchTheShare) {
  const World world = load("{moved_objects_share: 0.25}");
  double moved = 0.0;
  for (int seed = 1; seed <= 50; ++seed) {
    for (const MovedObject& object : draw_moved_objects(world, seed).list)
      moved += object.name.rfind("added box", 0) != 0 ? 1.0 / (48.0 * 50.0) : 0.0;
  }
  EXPECT_NEAR(moved, 0.25, 0.035);
}

TEST_F(RealityOfMaps, SteelGoesWithItsObjectAndAllOtherSteelStays) {
  const World world = load("{moved_objects_share: 0.4}");
  const MovedObjects moved = draw_moved_objects(world, 7);
  const Scene original = build_scene(world), mapped = build_scene(world, "", moved.mapped),
              driven = build_scene(world, "", moved.driven);
  const auto finds = [](const Scene& scene, const Vector3& place) {
    return std::any_of(scene.sources.begin(), scene.sources.end(),
                       [&](const FieldSource& source) { return (source.position - place).norm() < 1e-4; });
  };
  std::size_t kept = 0;
  for (const FieldSource& source : original.sources) {
    const auto same = [&](const FieldSource& other) {
      return other.position == source.position && other.moment == source.moment;
    };
    const bool in_mapped = std::any_of(mapped.sources.begin(), mapped.sources.end(), same);
    const bool in_driven = std::any_of(driven.sources.begin(), driven.sources.end(), same);
    EXPECT_TRUE(in_mapped || in_driven);
    kept += in_mapped && in_driven;
  }
  EXPECT_LT(kept, original.sources.size());
  EXPECT_GT(kept, original.sources.size() / 3);
  for (const MovedObject& object : moved.list) {
    if (object.name.rfind("added box", 0) == 0) continue;
    EXPECT_EQ(finds(mapped, object.mapped_at), object.change != ObjectChange::added);
    if (object.change != ObjectChange::gone) {
      EXPECT_TRUE(finds(driven, object.driven_at));
    }
    if (object.change == ObjectChange::shifted) {
      EXPECT_FALSE(finds(driven, object.mapped_at));
    }
  }
}

TEST_F(RealityOfMaps, PeopleAndVehiclesAreHitAndKeepOffTheRobot) {
  const World world = load("{people: 5, vehicles: 2}");
  SimulationSource source = source_of(world, 7, Drive::sequence, 30.0);
  const Movers& movers = source.movers();
  ASSERT_GT(movers.list().size(), 6U);
  EXPECT_TRUE(std::any_of(movers.list().begin(), movers.list().end(), [](const Mover& m) { return m.is_vehicle; }));
  for (const Mover& mover : movers.list()) {
    EXPECT_EQ(mover.steel.empty(), !mover.is_vehicle);
    EXPECT_GE((mover.to - mover.from).norm(), 3.0);
    EXPECT_LE(mover.speed_m_s, 3.0);
    for (double seconds = std::max(0.0, mover.begin_s); seconds < std::min(30.0, mover.end_s); seconds += 0.02) {
      const double distance = (source.motion().pose_at(seconds).position.head<2>() - mover.place(seconds)).norm();
      EXPECT_GT(distance, mover.is_vehicle ? 1.0 : 0.75);
    }
  }
  const auto exact = all<LidarScan>(source_of(load("exact"), 7, Drive::sequence, 30.0));
  const auto peopled = all<LidarScan>(source_of(world, 7, Drive::sequence, 30.0));
  ASSERT_EQ(exact.size(), peopled.size());
  std::set<const Mover*> met;
  std::size_t hits = 0, stray = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const auto key = [](const LidarPoint& point) { return std::make_pair(point.offset_ns, point.ring); };
    std::map<std::pair<std::int32_t, std::uint16_t>, Eigen::Vector3f> alone;
    for (const LidarPoint& point : exact[i].points) alone[key(point)] = point.position;
    for (const LidarPoint& point : peopled[i].points) {
      const auto found = alone.find(key(point));
      if (found != alone.end() && found->second == point.position) continue;
      const double seconds = to_seconds(peopled[i].start + point.offset_ns - world.start_time);
      const Vector3 place =
          source.motion().pose_at(seconds) * (world.lidar.T_imu_lidar() * point.position.cast<double>());
      ++hits;
      bool on_one = false;
      for (const Mover& mover : movers.list()) {
        if (seconds < mover.begin_s || seconds > mover.end_s) continue;
        const double distance = (place.head<2>() - mover.place(seconds)).norm();
        const bool on = mover.is_vehicle ? distance > 0.59 && distance < 1.4 : std::abs(distance - 0.25) < 1e-3;
        if (on) met.insert(&mover);
        on_one = on_one || on;
      }
      stray += on_one || (place.z() > 1.74 && place.z() < 2.01) ? 0 : 1;
    }
  }
  EXPECT_GT(hits, 2000U);
  EXPECT_GT(met.size(), 4U);
  EXPECT_LT(stray, hits / 100);  // nothing else differs
}

TEST_F(RealityOfMaps, TheSurveyMeetsNobodyAndIsDrivenByTheSameRobot) {
  const World world = load("field");
  const SimulationSource drive = source_of(world), survey = source_of(world, 7, Drive::survey);
  EXPECT_TRUE(survey.movers().list().empty());
  EXPECT_EQ(drive.reality().magnetometers[0].mounting, survey.reality().survey_magnetometers[0].mounting);
  EXPECT_EQ(drive.reality().magnetometer_clock_offset_s, survey.reality().magnetometer_clock_offset_s);
}

}  // namespace
}  // namespace lodestone::simulation
