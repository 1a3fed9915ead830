#include "tools/simulate/faults.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <optional>

#include "tests/frontends/logs/test_files.h"
#include "tests/tools/simulate/same_measurement.h"
#include "tools/simulate/simulation_source.h"

namespace lodestone::simulation {
namespace {

using Drive = SimulationSource::Drive;

constexpr const char* hall = R"(
name: hall
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 4, columns: 32}
  magnetometer_mounts:
    - {name: left, position_m: [0.3, 0.2, -0.08]}
    - {name: right, position_m: [0.3, -0.2, -0.08]}
    - {name: rear, position_m: [-0.3, 0, -0.08], rotation_rpy_deg: [0, 0, 180]}
solids:
  - {name: floor, shape: rectangle, size_m: [16, 12], steel: [{kind: rods, from_m: [-8, -6, -0.5], to_m: [8, 6, -0.4],
     density_per_m2: 1, length_m: [0.5, 1.0], moment_sigma_a_m2: 10}]}
  - {name: walls, shape: box, at_m: [0, 0, 2], size_m: [16, 12, 4]}
sequences:
  a: {waypoints_m: [[-6, -3], [5, -3]], speed: [[0, 1.5]]}
  b: {waypoints_m: [[-6, 3], [5, 3]], speed: [[0, 1.5]], faults: [{kind: dead, magnetometer: rear}]}
)";

class Faults : public ::testing::Test {
 protected:
  void SetUp() override { std::ofstream(file_) << hall; }

  std::vector<Measurement> drain(const std::vector<std::string>& settings, const std::string& sequence = "a",
                                 Drive drive = Drive::sequence, std::uint64_t seed = 3) const {
    const World world = load_world(file_, settings);
    SimulationSource source(world, std::make_shared<Environment>(world), sequence, drive, seed, 4.0);
    start_ = source.begin_time();
    std::vector<Measurement> all;
    for (Measurement measurement; source.next(measurement);) all.push_back(measurement);
    return all;
  }
  std::vector<Measurement> drain(const std::string& faults) const {
    return drain(std::vector<std::string>{"faults=[" + faults + "]"});
  }
  const std::vector<Measurement>& healthy() const {
    if (healthy_.empty()) healthy_ = drain(std::vector<std::string>{});
    return healthy_;
  }
  double seconds(const Measurement& measurement) const { return to_seconds(completion_time(measurement) - start_); }

  /// Every measurement equals the result of `expected` for the healthy one (nothing: missing), bit for bit, in the same
  /// order.
  void expect_stream(const std::string& faults,
                     const std::function<std::optional<Measurement>(Measurement)>& expected) const {
    const std::vector<Measurement> found = drain(faults);
    std::size_t index = 0;
    std::size_t changed = 0;
    for (const Measurement& was : healthy()) {
      const std::optional<Measurement> should = expected(was);
      changed += should && same_measurement(*should, was) ? 0 : 1;
      if (!should) continue;
      ASSERT_LT(index, found.size()) << faults;
      ASSERT_TRUE(same_measurement(*should, found[index]))
          << faults << ", measurement " << index << " at " << seconds(was) << " s";
      ++index;
    }
    EXPECT_EQ(index, found.size()) << faults;
    EXPECT_GT(changed, 0U) << faults << " does nothing";
  }
  /// The same for readings of one magnetometer; all other measurements must be unchanged.
  void expect_readings(const std::string& faults, int magnetometer,
                       const std::function<std::optional<Vector3>(const MagneticSample&, double)>& expected) const {
    expect_stream(faults, [&](Measurement measurement) -> std::optional<Measurement> {
      auto* sample = std::get_if<MagneticSample>(&measurement);
      if (sample == nullptr || sample->magnetometer != magnetometer) return measurement;
      const std::optional<Vector3> field_ut = expected(*sample, seconds(measurement));
      if (!field_ut) return std::nullopt;
      sample->field_ut = *field_ut;
      return measurement;
    });
  }

  testing::TemporaryFolder folder_;
  std::string file_ = folder_ / "hall.yaml";
  mutable Time start_ = 0;
  mutable std::vector<Measurement> healthy_;
};

TEST_F(Faults, HardIronIsAConstantFieldOnTopWhileItLasts) {
  expect_readings("{kind: hard_iron, magnetometer: left, offset_ut: [3, -4, 5]}", 0,
                  [](const MagneticSample& sample, double) -> Vector3 { return sample.field_ut + Vector3(3, -4, 5); });
  expect_readings("{kind: hard_iron, magnetometer: rear, offset_ut: [3, -4, 5], begin_s: 1, end_s: 2}", 2,
                  [](const MagneticSample& sample, double s) -> Vector3 {
                    return s >= 1.0 && s < 2.0 ? (sample.field_ut + Vector3(3, -4, 5)).eval() : sample.field_ut;
                  });
}

TEST_F(Faults, SoftIronIsAMatrixHoweverItIsWritten) {
  Matrix3 matrix;
  matrix << 1.1, 0.02, 0.03, 0.02, 0.9, -0.04, 0.03, -0.04, 1.0;
  for (const char* how : {"matrix: [[1.1, 0.02, 0.03], [0.02, 0.9, -0.04], [0.03, -0.04, 1.0]]",
                          "scale: [1.1, 0.9, 1.0], shear: [0.02, 0.03, -0.04]"}) {
    expect_readings("{kind: soft_iron, magnetometer: right, " + std::string(how) + "}", 1,
                    [&](const MagneticSample& sample, double) { return (matrix * sample.field_ut).eval(); });
  }
}

TEST_F(Faults, AMisalignedSensorReadsTheFieldInAxesThatAreTurned) {
  // Rotated by 90° about z: the field along y is read along the sensor's x.
  const auto found = drain("{kind: misalignment, magnetometer: left, rotation_rpy_deg: [0, 0, 90]}");
  ASSERT_EQ(found.size(), healthy().size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto* sample = std::get_if<MagneticSample>(&found[i]);
    if (sample == nullptr || sample->magnetometer != 0) {
      ASSERT_TRUE(same_measurement(found[i], healthy()[i]));
      continue;
    }
    const Vector3& was = std::get<MagneticSample>(healthy()[i]).field_ut;
    ASSERT_LT((sample->field_ut - Vector3(was.y(), -was.x(), was.z())).norm(), 1e-12);
  }
}

TEST_F(Faults, ABiasDriftsAtItsRateAndStaysWhereItCameTo) {
  expect_readings("{kind: bias_drift, magnetometer: right, rate_ut_s: [1, 0, -2], begin_s: 1, end_s: 3}", 1,
                  [](const MagneticSample& sample, double s) {
                    return (sample.field_ut + (std::clamp(s, 1.0, 3.0) - 1.0) * Vector3(1, 0, -2)).eval();
                  });
}

TEST_F(Faults, ARandomWalkGrowsWithTheRootOfTime) {
  double squared = 0.0;
  int components = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const auto faulty =
        drain({"faults=[{kind: bias_drift, magnetometer: all, random_walk_ut_sqrt_s: 2, begin_s: 0.5, end_s: 2.5}]",
               "sensors.lidar.rate_hz=0.1"},
              "a", Drive::sequence, seed);
    const auto clean = drain({"sensors.lidar.rate_hz=0.1"}, "a", Drive::sequence, seed);
    for (std::size_t i = clean.size() - 40; i < clean.size(); ++i) {
      const auto* sample = std::get_if<MagneticSample>(&clean[i]);
      if (sample == nullptr || sample->magnetometer != 1) continue;
      squared += (std::get<MagneticSample>(faulty[i]).field_ut - sample->field_ut).squaredNorm();
      components += 3;
      break;
    }
  }
  ASSERT_EQ(components, 120);
  EXPECT_NEAR(std::sqrt(squared / components), 2.0 * std::sqrt(2.0), 0.4);  // 2 µT/√s over 2 s
}

TEST_F(Faults, ADeadMagnetometerSaysNothingAndAStuckOneRepeatsItself) {
  expect_readings("{kind: dead, magnetometer: right, begin_s: 1.5}", 1,
                  [](const MagneticSample& sample, double s) -> std::optional<Vector3> {
                    if (s >= 1.5) return std::nullopt;
                    return sample.field_ut;
                  });
  std::optional<Vector3> held;
  expect_readings("{kind: stuck, magnetometer: left, begin_s: 1, end_s: 3}", 0,
                  [&](const MagneticSample& sample, double s) {
                    if (s < 1.0 || s >= 3.0) return sample.field_ut;
                    if (!held) held = sample.field_ut;
                    return *held;
                  });
}

TEST_F(Faults, ASaturatedMagnetometerIsClippedComponentByComponent) {
  expect_readings("{kind: saturated, magnetometer: rear, limit_ut: 30}", 2, [](const MagneticSample& sample, double) {
    return sample.field_ut.cwiseMax(-30.0).cwiseMin(30.0).eval();
  });
}

TEST_F(Faults, SpikesAreAsOftenAndAsLargeAsTold) {
  const auto found = drain("{kind: spikes, magnetometer: left, rate_per_s: 20, size_ut: 50}");
  ASSERT_EQ(found.size(), healthy().size());
  int spikes = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (same_measurement(found[i], healthy()[i])) continue;
    const auto* sample = std::get_if<MagneticSample>(&found[i]);
    ASSERT_NE(sample, nullptr);
    ASSERT_EQ(sample->magnetometer, 0);
    ASSERT_NEAR((sample->field_ut - std::get<MagneticSample>(healthy()[i]).field_ut).norm(), 50.0, 1e-9);
    ++spikes;
  }
  EXPECT_NEAR(spikes, 80, 27);  // 4 s, three sigmas of a Poisson number
}

TEST_F(Faults, AnOutageTakesScansAwayOrTheirPoints) {
  for (const std::string scans : {"none", "empty"}) {
    expect_stream("{kind: lidar_outage, begin_s: 1, end_s: 2.5, scans: " + scans + "}",
                  [&](Measurement measurement) -> std::optional<Measurement> {
                    auto* scan = std::get_if<LidarScan>(&measurement);
                    const double s = seconds(measurement);
                    if (scan == nullptr || s < 1.0 || s >= 2.5) return measurement;
                    if (scans == "none") return std::nullopt;
                    scan->points.clear();
                    return measurement;
                  });
  }
}

TEST_F(Faults, TheImuHasAGapAndItsBiasesJump) {
  expect_stream("{kind: imu_gap, begin_s: 1, end_s: 1.25}", [&](Measurement measurement) -> std::optional<Measurement> {
    if (std::holds_alternative<ImuSample>(measurement) && seconds(measurement) >= 1.0 && seconds(measurement) < 1.25) {
      return std::nullopt;
    }
    return measurement;
  });
  expect_stream("{kind: imu_bias_jump, at_s: 2, gyroscope_rad_s: [0.1, 0, -0.2], accelerometer_m_s2: [0, 0.3, 0]}",
                [&](Measurement measurement) -> std::optional<Measurement> {
                  auto* sample = std::get_if<ImuSample>(&measurement);
                  if (sample != nullptr && seconds(measurement) >= 2.0) {
                    sample->angular_velocity += Vector3(0.1, 0, -0.2);
                    sample->linear_acceleration += Vector3(0, 0.3, 0);
                  }
                  return measurement;
                });
}

TEST_F(Faults, AClockOffsetShiftsTheStampsOfItsSensorAloneAndTheStreamStaysInOrder) {
  struct Case {
    std::string sensor;
    Time offset;
    std::function<bool(const Measurement&)> is;
  };
  const auto magnetometer = [](int index) {
    return [index](const Measurement& m) {
      const auto* sample = std::get_if<MagneticSample>(&m);
      return sample != nullptr && (index < 0 || sample->magnetometer == index);
    };
  };
  for (const Case& one :
       {Case{"imu", 30'000'000, [](const Measurement& m) { return std::holds_alternative<ImuSample>(m); }},
        Case{"lidar", -70'000'000, [](const Measurement& m) { return std::holds_alternative<LidarScan>(m); }},
        Case{"magnetometers", -20'000'000, magnetometer(-1)}, Case{"right", 20'000'000, magnetometer(1)}}) {
    const auto found = drain("{kind: clock_offset, sensor: " + one.sensor +
                             ", offset_s: " + std::to_string(static_cast<double>(one.offset) * 1e-9) + "}");
    ASSERT_EQ(found.size(), healthy().size());
    std::vector<Measurement> expected[2], seen[2];
    Time last = 0;
    for (const Measurement& measurement : found) {
      ASSERT_GE(completion_time(measurement), last) << one.sensor;
      last = completion_time(measurement);
      seen[one.is(measurement) ? 1 : 0].push_back(measurement);
    }
    for (Measurement measurement : healthy()) {
      const bool shifted = one.is(measurement);
      if (auto* sample = std::get_if<ImuSample>(&measurement); shifted && sample != nullptr) sample->time += one.offset;
      if (auto* sample = std::get_if<MagneticSample>(&measurement); shifted && sample != nullptr)
        sample->time += one.offset;
      if (auto* scan = std::get_if<LidarScan>(&measurement); shifted && scan != nullptr) {
        scan->start += one.offset;
        scan->end += one.offset;
      }
      expected[shifted ? 1 : 0].push_back(measurement);
    }
    for (int part = 0; part < 2; ++part) {
      ASSERT_EQ(seen[part].size(), expected[part].size());
      for (std::size_t i = 0; i < seen[part].size(); ++i)
        ASSERT_TRUE(same_measurement(seen[part][i], expected[part][i])) << one.sensor;
    }
  }
}

TEST_F(Faults, SteelThatPassesAddsTheFieldOfADipoleWhereverTheRobotIs) {
  const World world = load_world(file_, {});
  const SimulationSource source(world, std::make_shared<Environment>(world), "a", Drive::sequence, 3, 4.0);
  const auto steel = [&](const MagneticSample& sample, double s) {
    const Pose T_map_mag = source.motion().pose_at(s) *
                           world.magnetometers.mounts[static_cast<std::size_t>(sample.magnetometer)].T_imu_mag();
    const Vector3 m(0, 50, 100), r = T_map_mag.position - (Vector3(-8, -2, 0.5) + (s - 1.0) / 2.0 * Vector3(10, 0, 0));
    const Vector3 u = r.normalized();
    // μ0/4π = 0.1 µT m³ / (A m²)
    return (T_map_mag.rotation.conjugate() * (0.1 * (3.0 * m.dot(u) * u - m) / std::pow(r.norm(), 3))).eval();
  };
  const auto found = drain(
      "{kind: passing_steel, begin_s: 1, end_s: 3, from_m: [-8, -2, 0.5], to_m: [2, -2, 0.5], "
      "moment_a_m2: [0, 50, 100]}");
  ASSERT_EQ(found.size(), healthy().size());
  double largest_ut = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto* sample = std::get_if<MagneticSample>(&found[i]);
    const double s = seconds(healthy()[i]);
    if (sample == nullptr || s < 1.0 || s >= 3.0) {
      ASSERT_TRUE(same_measurement(found[i], healthy()[i]));
      continue;
    }
    const Vector3 added = sample->field_ut - std::get<MagneticSample>(healthy()[i]).field_ut;
    ASSERT_LT((added - steel(*sample, s)).norm(), 1e-5 * added.norm() + 1e-9) << s;
    largest_ut = std::max(largest_ut, added.norm());
  }
  EXPECT_GT(largest_ut, 5.0);
}

TEST_F(Faults, ActInTheOrderOfTheListOnOneSeveralOrAllMagnetometers) {
  expect_stream(
      "{kind: hard_iron, magnetometer: all, offset_ut: [1, 1, 1]}, "
      "{kind: soft_iron, magnetometer: [left, rear], scale: [2, 2, 2]}",
      [](Measurement measurement) -> std::optional<Measurement> {
        auto* sample = std::get_if<MagneticSample>(&measurement);
        if (sample == nullptr) return measurement;
        sample->field_ut += Vector3(1, 1, 1);
        if (sample->magnetometer != 1) sample->field_ut *= 2.0;
        return measurement;
      });
}

TEST_F(Faults, OfTheWorldAndOfASequenceAddUpAndTheSurveyHasNone) {
  const auto count = [](const std::vector<Measurement>& all, int magnetometer) {
    return std::count_if(all.begin(), all.end(), [&](const Measurement& m) {
      const auto* sample = std::get_if<MagneticSample>(&m);
      return sample != nullptr && sample->magnetometer == magnetometer;
    });
  };
  const std::vector<std::string> world{"faults=[{kind: dead, magnetometer: left}]"};
  EXPECT_EQ(count(drain(world, "a"), 0), 0);
  EXPECT_GT(count(drain(world, "a"), 2), 0);
  EXPECT_EQ(count(drain(world, "b"), 0), 0);
  EXPECT_EQ(count(drain(world, "b"), 2), 0);
  EXPECT_GT(count(drain(std::vector<std::string>{"sequences.b.faults=[]"}, "b"), 2), 0);
  const auto survey = drain(world, "a", Drive::survey);
  const auto healthy_survey = drain(std::vector<std::string>{}, "a", Drive::survey);
  ASSERT_EQ(survey.size(), healthy_survey.size());
  for (std::size_t i = 0; i < survey.size(); ++i) ASSERT_TRUE(same_measurement(survey[i], healthy_survey[i]));
}

TEST_F(Faults, SameSeedSameBitsOnAnyNumberOfThreads) {
  const std::string faults =
      "{kind: spikes, magnetometer: all, rate_per_s: 20, size_ut: 50}, "
      "{kind: bias_drift, magnetometer: all, random_walk_ut_sqrt_s: 1}";
  const auto first = drain(faults);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const auto second = drain(faults);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) ASSERT_TRUE(same_measurement(first[i], second[i])) << i;
}

}  // namespace
}  // namespace lodestone::simulation
