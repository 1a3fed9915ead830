#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "core/angles.h"
#include "tests/tools/simulate/reality_world.h"

/// Effects of the section `reality` on the sensors of a drive. The world is free of noise: every difference to grade
/// exact is the effect.
namespace lodestone::simulation {
namespace {

bool same_points(const LidarScan& a, const LidarScan& b) {
  return a.points.size() == b.points.size() &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), [](const LidarPoint& x, const LidarPoint& y) {
           return x.position == y.position && x.offset_ns == y.offset_ns && x.ring == y.ring;
         });
}

class RealityOfSensors : public RealityHall {
 protected:
  struct Log {
    std::vector<LidarScan> scans;
    std::vector<ImuSample> imu;
    std::vector<MagneticSample> field;
  };

  Log log(const std::string& reality, std::uint64_t seed = 7, double duration_s = 4.0) const {
    Log found;
    SimulationSource source = source_of(load(reality), seed, Drive::sequence, duration_s);
    Time last = 0;
    for (Measurement measurement; source.next(measurement);) {
      EXPECT_GE(completion_time(measurement), last);
      last = completion_time(measurement);
      if (auto* scan = std::get_if<LidarScan>(&measurement)) found.scans.push_back(*scan);
      if (auto* sample = std::get_if<ImuSample>(&measurement)) found.imu.push_back(*sample);
      if (auto* sample = std::get_if<MagneticSample>(&measurement)) found.field.push_back(*sample);
    }
    return found;
  }

  static bool same_scans(const Log& a, const Log& b) {
    return std::equal(a.scans.begin(), a.scans.end(), b.scans.begin(), b.scans.end(),
                      [](const LidarScan& x, const LidarScan& y) { return x.end == y.end && same_points(x, y); });
  }
  static bool same_imu(const Log& a, const Log& b) {
    return std::equal(a.imu.begin(), a.imu.end(), b.imu.begin(), b.imu.end(), [](const auto& x, const auto& y) {
      return x.time == y.time && x.angular_velocity == y.angular_velocity &&
             x.linear_acceleration == y.linear_acceleration;
    });
  }
  static bool same_field(const Log& a, const Log& b) {
    return std::equal(a.field.begin(), a.field.end(), b.field.begin(), b.field.end(),
                      [](const auto& x, const auto& y) { return x.time == y.time && x.field_ut == y.field_ut; });
  }
};

TEST_F(RealityOfSensors, EveryEffectChangesItsOwnSensorAlone) {
  const Log exact = log("exact");
  const auto expect = [&](const std::string& reality, bool scans, bool imu, bool field) {
    const Log other = log(reality);
    EXPECT_EQ(same_scans(exact, other), scans) << reality;
    EXPECT_EQ(same_imu(exact, other), imu) << reality;
    EXPECT_EQ(same_field(exact, other), field) << reality;
  };
  expect("{grade: exact}", true, true, true);
  expect("{lidar_extrinsic_translation_sigma_m: 0.01}", false, true, true);
  expect("{lidar_clock_offset_sigma_s: 0.003}", false, true, true);
  expect("{lidar_stamp_jitter_sigma_s: 0.001}", false, true, true);
  expect("{range_bias_a_ring_sigma_m: 0.01}", false, true, true);
  expect("{range_bias_at_80deg_incidence_sigma_m: 0.01}", false, true, true);
  expect("{mixed_points: true}", false, true, true);
  expect("{imu_scale_sigma: 0.01}", true, false, true);
  expect("{imu_misalignment_sigma_deg: 0.1}", true, false, true);
  expect("{magnetometer_extrinsic_rotation_sigma_deg: 1}", true, true, false);
  expect("{magnetometer_clock_offset_sigma_s: 0.01}", true, true, false);
  expect("{magnetometer_offset_sigma_ut: 1}", true, true, false);
  expect("{magnetometer_matrix_sigma: 0.01}", true, true, false);
  expect("{platform_field_sigma_ut: 1}", true, true, false);
  expect("{cloud_displacement_rms_m: 0.02, cloud_noise_m: 0.02, doubled_walls_share: 0.2}", true, true, true);
  expect("{survey_pose_sigma_m: 0.01, noise_density_factor_max: 3}", true, true, true);
  expect("{moved_objects_share: 0.5}", false, true, false);
  expect("{people: 4}", false, true, true);
  expect("{people: 4, vehicles: 2}", false, true, false);
}

TEST_F(RealityOfSensors, SameSeedSameBitsOnAnyNumberOfThreadsOtherSeedOtherDraws) {
  const Log first = log("{grade: rough, people: 4}");
  Log second;
  {
    tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    second = log("{grade: rough, people: 4}");
  }
  EXPECT_TRUE(same_scans(first, second) && same_imu(first, second) && same_field(first, second));
  const Reality one = draw_reality(load("rough"), 1), two = draw_reality(load("rough"), 2);
  EXPECT_NE(one.lidar.mounting, two.lidar.mounting);
  EXPECT_NE(one.lidar.clock_offset_s, two.lidar.clock_offset_s);
  EXPECT_NE(one.magnetometers[0].offset_ut, one.magnetometers[1].offset_ut);
  EXPECT_NE(one.magnetometers[0].offset_ut, one.survey_magnetometers[0].offset_ut);
  EXPECT_EQ(one.magnetometers[0].mounting, one.survey_magnetometers[0].mounting);
}

TEST_F(RealityOfSensors, ALogIsTheBeginningOfALongerOne) {
  const Log brief = log("{grade: field, people: 3}", 3, 3.0), whole = log("{grade: field, people: 3}", 3, 6.0);
  ASSERT_LT(brief.scans.size(), whole.scans.size());
  for (std::size_t i = 0; i < brief.scans.size(); ++i) EXPECT_TRUE(same_points(brief.scans[i], whole.scans[i])) << i;
}

TEST_F(RealityOfSensors, PointsAreThoseOfALidarThatIsMountedElsewhere) {
  const World world = load("{lidar_extrinsic_translation_sigma_m: 0.03, lidar_extrinsic_rotation_sigma_deg: 1}");
  SimulationSource source = source_of(world);
  const Pose believed = world.lidar.T_imu_lidar(), actual = believed.boxplus(source.reality().lidar.mounting);
  double largest = 0.0, largest_believed = 0.0;
  for (Measurement measurement; source.next(measurement);) {
    const auto* scan = std::get_if<LidarScan>(&measurement);
    if (scan == nullptr) continue;
    for (const LidarPoint& point : scan->points) {
      const Pose T_map_imu = source.motion().pose_at(to_seconds(scan->start + point.offset_ns - world.start_time));
      const auto place = [&](const Pose& T_imu_lidar) {
        return Vector3(T_map_imu * T_imu_lidar * point.position.cast<double>());
      };
      const auto height = [&](const Pose& T_imu_lidar) { return place(T_imu_lidar).z(); };
      const Vector3 hit = place(actual);
      // Points on the floor, not on a wall or a crate.
      if (std::abs(hit.z()) > 0.1 || std::abs(hit.x()) > 19.0 || std::abs(hit.y()) > 9.0) continue;
      largest = std::max(largest, std::abs(height(actual)));
      largest_believed = std::max(largest_believed, std::abs(height(believed)));
    }
  }
  EXPECT_LT(largest, 2e-4);
  EXPECT_GT(largest_believed, 5e-3);
}

TEST_F(RealityOfSensors, StampsAreLateByTheDrawnOffsetAndJitter) {
  const std::string reality =
      "{lidar_clock_offset_sigma_s: 0.003, lidar_stamp_jitter_sigma_s: 0.001, magnetometer_clock_offset_sigma_s: 0.01}";
  const Log exact = log("exact"), late = log(reality);
  const Reality drawn = draw_reality(load(reality), 7);
  const std::vector<double> errors = source_of(load(reality)).scan_stamp_errors();
  ASSERT_EQ(exact.scans.size(), late.scans.size());
  ASSERT_EQ(errors.size(), late.scans.size());
  double squares = 0.0;
  for (std::size_t i = 0; i < late.scans.size(); ++i) {
    EXPECT_EQ(late.scans[i].start - exact.scans[i].start, from_seconds(errors[i]));
    EXPECT_EQ(late.scans[i].end - exact.scans[i].end, from_seconds(errors[i]));
    EXPECT_TRUE(same_points(late.scans[i], exact.scans[i]));
    squares += std::pow(errors[i] - drawn.lidar.clock_offset_s, 2) / static_cast<double>(errors.size());
  }
  EXPECT_NEAR(std::sqrt(squares), 0.001, 0.0004);
  ASSERT_EQ(exact.field.size(), late.field.size());
  for (std::size_t i = 0; i < late.field.size(); ++i) {
    EXPECT_EQ(late.field[i].time - exact.field[i].time, from_seconds(drawn.magnetometer_clock_offset_s));
    EXPECT_EQ(late.field[i].field_ut, exact.field[i].field_ut);
  }
}

TEST_F(RealityOfSensors, RangesAreOffByTheBiasOfTheirRingAndTheirIncidence) {
  const auto bias_of = [&](const std::string& reality, auto&& expected) {
    const Log exact = log("exact", 7, 1.5), biased = log(reality, 7, 1.5);
    const Reality drawn = draw_reality(load(reality), 7);
    std::size_t count = 0;
    for (std::size_t i = 0; i < exact.scans.size(); ++i) {
      if (exact.scans[i].points.size() != biased.scans[i].points.size()) continue;
      for (std::size_t k = 0; k < exact.scans[i].points.size(); ++k, ++count) {
        const LidarPoint &a = exact.scans[i].points[k], &b = biased.scans[i].points[k];
        expected(drawn, a, b.position.norm() - a.position.norm());
      }
    }
    EXPECT_GT(count, 5000U);
  };
  bias_of("{range_bias_a_ring_sigma_m: 0.02}", [](const Reality& drawn, const LidarPoint& point, double difference) {
    EXPECT_NEAR(difference, drawn.lidar.ring_bias_m[point.ring], 1e-5);
  });
  bias_of("{range_bias_at_80deg_incidence_sigma_m: 0.02}",
          [](const Reality& drawn, const LidarPoint& point, double difference) {
            const double cosine = std::max(0.01, 0.01 * point.intensity);  // rounded: the intensity is 100 times it
            if (cosine < 0.17 || cosine > 0.18) return;                    // about 80 degrees
            EXPECT_NEAR(difference, drawn.lidar.incidence_bias_m, 0.1 * std::abs(drawn.lidar.incidence_bias_m));
          });
}

TEST_F(RealityOfSensors, SomeBeamsAtEdgesReturnAPointInBetween) {
  const Log exact = log("exact", 7, 8.0), mixed = log("{mixed_points: true}", 7, 8.0);
  std::size_t points = 0, changed = 0;
  double nearer = 0.0;
  for (std::size_t i = 0; i < exact.scans.size(); ++i) {
    ASSERT_EQ(exact.scans[i].points.size(), mixed.scans[i].points.size());
    for (std::size_t k = 0; k < exact.scans[i].points.size(); ++k, ++points) {
      const double step = mixed.scans[i].points[k].position.norm() - exact.scans[i].points[k].position.norm();
      EXPECT_LE(std::abs(step), 2.0);
      if (step == 0.0) continue;
      ++changed;
      nearer += step < 0.0 ? 1.0 : 0.0;
    }
  }
  // Beams are 50 mrad apart here, and one beam in forty meets a crate's edge.
  EXPECT_GT(changed, points / 20000);
  EXPECT_LT(changed, points / 200);
  EXPECT_GT(nearer, 0.0);
  EXPECT_LT(nearer, static_cast<double>(changed));
}

TEST_F(RealityOfSensors, TheImuReadsThroughItsMatrices) {
  const std::string reality = "{imu_scale_sigma: 0.01, imu_misalignment_sigma_deg: 0.5}";
  const Log exact = log("exact"), skewed = log(reality);
  const ImuErrors errors = draw_reality(load(reality), 7).imu;
  EXPECT_GT((errors.accelerometer - Matrix3::Identity()).norm(), 0.005);
  ASSERT_EQ(exact.imu.size(), skewed.imu.size());
  for (std::size_t i = 0; i < exact.imu.size(); ++i) {
    EXPECT_LT((skewed.imu[i].angular_velocity - errors.gyroscope * exact.imu[i].angular_velocity).norm(), 1e-12);
    EXPECT_LT((skewed.imu[i].linear_acceleration - errors.accelerometer * exact.imu[i].linear_acceleration).norm(),
              1e-11);
  }
}

TEST_F(RealityOfSensors, MagnetometersReadThroughTheirResidualsAndTheMotors) {
  const std::string residual = "{magnetometer_offset_sigma_ut: 2, magnetometer_matrix_sigma: 0.02}";
  const Log exact = log("exact", 7, 20.0), off = log(residual, 7, 20.0);
  const Reality drawn = draw_reality(load(residual), 7);
  ASSERT_EQ(exact.field.size(), off.field.size());
  for (std::size_t i = 0; i < exact.field.size(); ++i) {
    const MagnetometerErrors& errors = drawn.magnetometers[static_cast<std::size_t>(exact.field[i].magnetometer)];
    EXPECT_LT((off.field[i].field_ut - (errors.matrix * exact.field[i].field_ut + errors.offset_ut)).norm(), 1e-10);
  }
  const std::string motors = "{platform_field_sigma_ut: 1}";
  const Log driven = log(motors, 7, 20.0);
  const Reality motor_reality = draw_reality(load(motors), 7);
  double largest = 0.0;
  for (std::size_t i = 0; i < exact.field.size(); ++i) {
    const double seconds = to_seconds(exact.field[i].time - exact.field[0].time);
    const double field = (driven.field[i].field_ut - exact.field[i].field_ut).norm();
    if (seconds < 1.0) {
      EXPECT_EQ(field, 0.0);  // the robot rests for two seconds
    }
    largest = std::max(largest, field);
  }
  // The robot starts with about 0.6 m/s² and turns with about 0.5 rad/s.
  const MagnetometerErrors& front = motor_reality.magnetometers[0];
  EXPECT_GT(largest, 0.3 * 0.6 * front.acceleration_field.norm());
  EXPECT_LT(largest, 6.0);
}

TEST_F(RealityOfSensors, MagnetometersSitWhereTheyAreMounted) {
  const World world =
      load("{magnetometer_extrinsic_translation_sigma_m: 0.02, magnetometer_extrinsic_rotation_sigma_deg: 2}");
  SimulationSource source = source_of(world);
  const MagneticField field(world.earth_field_ut, build_scene(world).sources);
  const Reality reality = source.reality();
  double largest_believed = 0.0;
  for (Measurement measurement; source.next(measurement);) {
    const auto* sample = std::get_if<MagneticSample>(&measurement);
    if (sample == nullptr) continue;
    const auto j = static_cast<std::size_t>(sample->magnetometer);
    const Pose T_map_imu = source.motion().pose_at(to_seconds(sample->time - world.start_time));
    const auto expected = [&](const Pose& T_imu_mag) {
      const Pose T_map_mag = T_map_imu * T_imu_mag;
      return Vector3(T_map_mag.rotation.conjugate() * field.field_ut(T_map_mag.position));
    };
    const Pose believed = world.magnetometers.mounts[j].T_imu_mag();
    EXPECT_LT((sample->field_ut - expected(with_error(believed, reality.magnetometers[j].mounting))).norm(), 1e-6);
    largest_believed = std::max(largest_believed, (sample->field_ut - expected(believed)).norm());
  }
  EXPECT_GT(largest_believed, 0.3);
}

}  // namespace
}  // namespace lodestone::simulation
