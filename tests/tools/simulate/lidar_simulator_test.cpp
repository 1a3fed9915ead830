#include "tools/simulate/lidar_simulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tools/simulate/route.h"

namespace lodestone::simulation {
namespace {

Solid box(const Vector3& center, const Vector3& size) {
  Solid solid;
  solid.shape = SolidShape::box;
  solid.placement.position = center;
  solid.size = size;
  return solid;
}

Solid cylinder(const Vector3& foot, double radius, double height) {
  Solid solid;
  solid.shape = SolidShape::cylinder;
  solid.placement.position = foot;
  solid.radius_m = radius;
  solid.height_m = height;
  solid.facet_m = 0.01;
  return solid;
}

TriangleMesh mesh_of(const std::vector<Solid>& solids) {
  TriangleMesh mesh;
  for (const Solid& solid : solids) append_shape(solid, solid.placement, mesh);
  return mesh;
}

float cast_one(const RayCaster& caster, const Vector3& from, const Vector3& along) {
  const std::vector<Eigen::Vector3f> directions{along.normalized().cast<float>()};
  std::vector<RayHit> hits(1);
  caster.cast(from.cast<float>(), directions, 100.0F, hits);
  return hits[0].range;
}

TEST(RayCaster, RangesOfABox) {
  const RayCaster caster(mesh_of({box({5, 0, 1}, {2, 4, 2})}));
  EXPECT_NEAR(cast_one(caster, {0, 0, 1}, {1, 0, 0}), 4.0, 1e-5);
  EXPECT_NEAR(cast_one(caster, {0, 0, 1}, {1, 0.25, 0}), 4.0 * std::hypot(1.0, 0.25), 1e-5);
  EXPECT_NEAR(cast_one(caster, {5, 0, 1}, {0, 1, 0}), 2.0, 1e-5);
  EXPECT_LT(cast_one(caster, {0, 0, 1}, {-1, 0, 0}), 0.0F);
  EXPECT_LT(cast_one(caster, {-100, 0, 1}, {1, 0, 0}), 0.0F);  // beyond the range
}

TEST(RayCaster, RangesOfACylinder) {
  const RayCaster caster(mesh_of({cylinder({3, 0, 0}, 0.5, 2.0)}));
  for (const double y : {0.0, 0.1, -0.3, 0.45}) {
    EXPECT_NEAR(cast_one(caster, {0, y, 1}, {1, 0, 0}), 3.0 - std::sqrt(0.25 - y * y), 2e-4) << y;
  }
  EXPECT_NEAR(cast_one(caster, {3, 0.1, 5}, {0, 0, -1}), 3.0, 1e-5);
  EXPECT_LT(cast_one(caster, {0, 0.6, 1}, {1, 0, 0}), 0.0F);
}

TEST(RayCaster, SeesWhatIsNotHidden) {
  const RayCaster caster(mesh_of({box({5, 0, 1}, {2, 4, 2})}));
  EXPECT_TRUE(caster.sees({0, 0, 1}, {4, 0, 1}));
  EXPECT_FALSE(caster.sees({0, 0, 1}, {6, 0, 1}));
}

class RollingScan : public ::testing::Test {
 protected:
  RollingScan()
      : caster_(mesh_of({box({0, 0, 1}, {20, 16, 2}), cylinder({3, 4, 0}, 0.5, 2.0)})),
        motion_(plan_drive(winding()), 0.2, FloorOptions{}, 9) {
    options_.position_m = {0.1, -0.05, 0.3};
    options_.rotation_rpy_deg = {1.0, -2.0, 30.0};
    options_.direction_noise_rad = 0.0;  // exact beam directions
  }

  static Sequence winding() {
    Sequence sequence;
    sequence.waypoints = {{-7, -5}, {6, -5}, {6, 2}, {-6, 2}};
    sequence.corner_radius_m = 1.5;
    sequence.speed = {{0.0, 2.0}};
    return sequence;
  }

  static double distance_to_surface(const Vector3& p) {
    const double room =
        std::min({std::abs(10 - std::abs(p.x())), std::abs(8 - std::abs(p.y())), std::abs(p.z()), std::abs(2 - p.z())});
    return std::min(room, std::abs((p.head<2>() - Eigen::Vector2d(3, 4)).norm() - 0.5));
  }

  RayCaster caster_;
  Motion motion_;
  LidarOptions options_;
};

TEST_F(RollingScan, NoiseFreePointsLandOnTheSurfacesFromTheirOwnTimes) {
  options_.range_noise_m = 0.0;
  const LidarSimulator lidar(caster_, motion_, options_, 1'000'000'000, 1);
  double worst = 0.0, worst_frozen = 0.0;
  for (int index = 40; index < 120; index += 10) {
    const LidarScan scan = lidar.scan(index);
    ASSERT_GT(scan.points.size(), 20000U);
    const Pose end = motion_.pose_at(to_seconds(scan.end - 1'000'000'000));
    for (const LidarPoint& point : scan.points) {
      const Vector3 in_imu = options_.T_imu_lidar() * point.position.cast<double>();
      const Pose pose = motion_.pose_at(to_seconds(scan.start + point.offset_ns - 1'000'000'000));
      worst = std::max(worst, distance_to_surface(pose * in_imu));
      worst_frozen = std::max(worst_frozen, distance_to_surface(end * in_imu));
    }
  }
  EXPECT_LT(worst, 1e-3);
  EXPECT_GT(worst_frozen, 0.05);  // the robot rolls during the scan
}

TEST_F(RollingScan, HasOustersShape) {
  const LidarSimulator lidar(caster_, motion_, options_, 1'000'000'000, 1);
  const LidarScan scan = lidar.scan(50);
  EXPECT_EQ(scan.start, 1'000'000'000 + 5'050'000'000);
  EXPECT_EQ(scan.end - scan.start, 99'902'344);
  EXPECT_EQ(lidar.scan_end(50), scan.end);
  EXPECT_GT(scan.points.size(), 32000U);
  EXPECT_LE(scan.points.size(), 32768U);
  for (std::size_t i = 1; i < scan.points.size(); ++i) {
    const LidarPoint &a = scan.points[i - 1], &b = scan.points[i];
    ASSERT_TRUE(a.offset_ns < b.offset_ns || (a.offset_ns == b.offset_ns && a.ring < b.ring));
  }
  for (const LidarPoint& point : scan.points) {
    const double elevation = std::asin(point.position.z() / point.position.norm()) * 180.0 / M_PI;
    ASSERT_NEAR(elevation, 22.5 - 45.0 * point.ring / 31.0, 1e-3);
  }
}

TEST_F(RollingScan, NoiseAndDropoutsAreWhatTheOptionsSay) {
  const LidarSimulator noisy(caster_, motion_, options_, 0, 1);
  const LidarScan scan = noisy.scan(10);
  EXPECT_NEAR(static_cast<double>(scan.points.size()) / 32768.0, 1.0 - options_.dropout_probability, 0.004);
  double squares = 0.0;
  int count = 0;
  for (const LidarPoint& point : scan.points) {
    const Vector3 beam = point.position.cast<double>();
    const Pose T_map_lidar = motion_.pose_at(to_seconds(point.offset_ns) + 1.05) * options_.T_imu_lidar();
    const double truth = cast_one(caster_, T_map_lidar.position, T_map_lidar.rotation * beam);
    squares += std::pow(beam.norm() - truth, 2);
    ++count;
  }
  EXPECT_NEAR(std::sqrt(squares / count), options_.range_noise_m, 0.001);
}

TEST_F(RollingScan, BeamsGoAsideByTheNoiseOfTheirDirections) {
  options_.direction_noise_rad = 2e-3;
  options_.dropout_probability = 0.0;
  const LidarScan noisy = LidarSimulator(caster_, motion_, options_, 0, 1).scan(10);
  // Each line's elevation is known.
  double squares = 0.0;
  for (const LidarPoint& point : noisy.points) {
    const double elevation_rad = std::asin(static_cast<double>(point.position.z() / point.position.norm()));
    squares += std::pow(elevation_rad - (22.5 - 45.0 * point.ring / 31.0) * M_PI / 180.0, 2);
  }
  EXPECT_GT(noisy.points.size(), 32000U);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(noisy.points.size())), 2e-3, 5e-5);
}

TEST_F(RollingScan, RangeAndIncidenceLimitWhatComesBack) {
  options_.max_range_m = 2.5;  // the walls are 3 m away: only the floor is in range
  options_.max_incidence_deg = 70.0;
  options_.rotation_rpy_deg = {0.0, 0.0, 0.0};
  const LidarSimulator lidar(caster_, motion_, options_, 0, 1);
  const LidarScan scan = lidar.scan(10);
  EXPECT_GT(scan.points.size(), 100U);
  // From half a metre above, the angle of incidence on the floor is below 70° only within 0.5 m / cos 70° (and noise).
  for (const LidarPoint& point : scan.points)
    EXPECT_LT(point.position.norm(), 0.5 / std::cos(70.0 * M_PI / 180.0) + 0.1);
}

TEST_F(RollingScan, RosetteFiresAtItsOwnPaceAndFromItsOwnTimes) {
  options_.pattern = LidarPattern::rosette;
  options_.range_noise_m = 0.0;
  options_.dropout_probability = 0.0;
  options_.min_range_m = 0.1;
  options_.max_incidence_deg = 90.0;
  const LidarSimulator lidar(caster_, motion_, options_, 1'000'000'000, 1);
  double worst = 0.0;
  std::size_t points = 0;
  for (int index = 40; index < 50; ++index) {
    const LidarScan scan = lidar.scan(index);
    EXPECT_EQ(scan.start, 1'000'000'000 + 4'050'000'000 + (index - 40) * 100'000'000LL);
    EXPECT_EQ(scan.end - scan.start, 99'980'000);  // the last of 5000 firings
    EXPECT_EQ(scan.points.front().offset_ns, 0);
    EXPECT_EQ(scan.points.back().offset_ns, scan.end - scan.start);
    points += scan.points.size();
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const LidarPoint& point = scan.points[i];
      ASSERT_TRUE(i == 0 || scan.points[i - 1].offset_ns <= point.offset_ns);
      ASSERT_EQ(point.offset_ns, static_cast<std::int32_t>(i / 4) * 20'000);
      ASSERT_EQ(point.ring, i % 4);
      const double elevation = std::asin(point.position.z() / point.position.norm()) * 180.0 / M_PI;
      ASSERT_GT(elevation, -7.001);
      ASSERT_LT(elevation, 52.001);
      const Pose pose = motion_.pose_at(to_seconds(scan.start + point.offset_ns - 1'000'000'000));
      worst = std::max(worst, distance_to_surface(pose * (options_.T_imu_lidar() * point.position.cast<double>())));
    }
  }
  EXPECT_EQ(points, 200'000U);  // a second in a closed room
  EXPECT_LT(worst, 1e-3);
}

/// A pane at x = 3 m in front of a wall at x = 6 m, seen from a LiDAR at the origin.
class GlassPane : public ::testing::Test {
 protected:
  static Solid pane(double transparency, double max_incidence_deg) {
    Solid solid;
    solid.shape = SolidShape::rectangle;
    solid.placement.position = {3, 0, 0};
    solid.placement.rotation = Eigen::AngleAxisd(M_PI / 2, Vector3::UnitY());
    solid.size = {40, 40, 0};
    solid.transparency = transparency;
    solid.max_incidence_deg = max_incidence_deg;
    return solid;
  }

  struct Count {
    double pane = 0, wall = 0, beams = 0;
    double steepest_deg = 0;  ///< incidence of what came back from the pane
  };

  /// Beams within 60° of the x axis.
  static Count count(const std::vector<Solid>& solids) {
    Sequence sequence;
    sequence.waypoints = {{0, 0}, {0.1, 0}};
    sequence.speed = {{0.0, 0.1}};
    sequence.rest_s = 8.0;
    FloorOptions still;
    still.height_sigma_m = still.tilt_sigma_deg = still.slip_yaw_sigma_deg = still.slip_position_sigma_m = 0.0;
    still.vibration_m = still.vibration_tilt_deg = 0.0;
    const Motion motion(plan_drive(sequence), 0.0, still, 1);
    LidarOptions options;
    options.position_m = {0, 0, 0};
    options.range_noise_m = options.direction_noise_rad = options.dropout_probability = 0.0;
    const RayCaster caster(mesh_of(solids));
    const LidarScan scan = LidarSimulator(caster, motion, options, 0, 1).scan(3);
    Count result;
    for (const LidarPoint& point : scan.points) {
      const double incidence = std::acos(point.position.x() / point.position.norm()) * 180.0 / M_PI;
      if (incidence > 60.0) continue;
      ++result.beams;
      if (std::abs(point.position.x() - 3.0F) < 1e-3F) {
        ++result.pane;
        result.steepest_deg = std::max(result.steepest_deg, incidence);
      }
      if (std::abs(point.position.x() - 6.0F) < 1e-3F) ++result.wall;
    }
    return result;
  }

  const Solid wall_ = box({56, 0, 0}, {100, 200, 200});
};

TEST_F(GlassPane, LetsItsShareOfBeamsPass) {
  const Count open = count({wall_});
  const Count opaque = count({wall_, pane(0.0, 90.0)});
  const Count glass = count({wall_, pane(0.8, 90.0)});
  EXPECT_EQ(open.wall, open.beams);
  EXPECT_EQ(opaque.pane, open.beams);
  EXPECT_EQ(glass.pane + glass.wall, open.beams);
  EXPECT_NEAR(glass.wall / open.beams, 0.8, 4.0 * std::sqrt(0.8 * 0.2 / open.beams));
  const Count two = count({wall_, pane(0.8, 90.0), [] {
                             Solid second = pane(0.5, 90.0);
                             second.placement.position.x() = 4.0;
                             return second;
                           }()});
  EXPECT_NEAR(two.wall / open.beams, 0.4, 4.0 * std::sqrt(0.4 * 0.6 / open.beams));
}

TEST_F(GlassPane, MirrorsWhatMeetsItAslant) {
  const Count open = count({wall_});
  const Count glass = count({wall_, pane(0.8, 12.0)});
  EXPECT_NEAR(glass.wall / open.beams, 0.8, 4.0 * std::sqrt(0.8 * 0.2 / open.beams));
  EXPECT_GT(glass.pane, 20);
  EXPECT_LT(glass.pane, 0.05 * open.beams);
  EXPECT_LE(glass.steepest_deg, 12.0 + 1e-3);
}

TEST_F(GlassPane, CasterTellsHowMuchGetsThrough) {
  const RayCaster caster(mesh_of({wall_, pane(0.8, 90.0)}));
  EXPECT_TRUE(caster.has_glass());
  EXPECT_FALSE(RayCaster(mesh_of({wall_})).has_glass());
  EXPECT_DOUBLE_EQ(caster.transmission({0, 0, 0}, {2.5F, 0, 0}), 1.0);
  EXPECT_DOUBLE_EQ(caster.transmission({0, 0, 0}, {3, 0, 0}), 1.0);  // the pane itself
  EXPECT_DOUBLE_EQ(caster.transmission({0, 0, 0}, {6, 0, 0}), 0.8);
  EXPECT_DOUBLE_EQ(caster.transmission({0, 0, 0}, {7, 0, 0}), 0.0);  // within the wall
  EXPECT_FALSE(caster.sees({0, 0, 0}, {6, 0, 0}));
}

}  // namespace
}  // namespace lodestone::simulation
