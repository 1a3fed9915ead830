#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "frontends/configuration/platform.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/tools/program_runner.h"
#include "tools/run/calibration_consistency.h"

namespace lodestone {
namespace {

constexpr const char* yard = R"(
name: yard
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {columns: 128}
  magnetometer_mounts:
    - {name: front, position_m: [0.3, 0.2, -0.08]}
    - {name: rear, position_m: [-0.3, -0.2, -0.08], rotation_rpy_deg: [0, 0, 180]}
survey: {lateral_offsets_m: [0.0]}
cloud: {point_spacing_m: 0.2}
solids:
  - {shape: rectangle, size_m: [30, 30], steel: [{kind: rods, from_m: [-15, -15, -0.6], to_m: [15, 15, -0.4],
     density_per_m2: 1, length_m: [0.5, 1.0], moment_sigma_a_m2: 10}]}
  - {shape: box, at_m: [0, 8, 1], size_m: [4, 4, 2]}
scenes:
  busy: {solids: [{name: van, shape: box, at_m: [8, -5, 1], size_m: [2, 5, 2],
     steel: [{kind: dipole, at_m: [0, 0, -0.5], moment_a_m2: [0, 0, 200]}]}]}
sequences:
  short: {waypoints_m: [[-4, 0], [4, 0]], speed: [[0, 2.0]]}
)";

class SimulateCommand : public ::testing::Test {
 protected:
  void SetUp() override { std::ofstream(folder_ / "yard.yaml") << yard; }

  ProgramResult simulate(const std::string& out, const std::string& options) const {
    return run_lodestone("simulate " + (folder_ / "yard.yaml").string() + " --out " + (folder_ / out).string() + " " +
                         options);
  }
  std::string bytes(const std::string& out, const std::string& file) const { return content_of(folder_ / out / file); }

  TemporaryFolder folder_;
};

const std::vector<std::string> all_files = {"log.bag",   "truth.tum",  "platform.yaml", "reality.yaml",
                                            "cloud.pcd", "survey.bag", "survey.tum"};

TEST_F(SimulateCommand, WarnsOfARobotThatDrivesThroughSolids) {
  const ProgramResult free = simulate("free", "--duration 1");
  ASSERT_EQ(free.code, 0) << free.errors;
  EXPECT_THAT(free.output, ::testing::Not(::testing::HasSubstr("warning")));
  // Enters the box of 4 m at y = 6 and leaves it at y = 10. The survey is not cut.
  const std::string through =
      "--duration 12 --set sequences.short.waypoints_m=[[0,0],[0,20]] --set sequences.short.speed=[[0,2.0]]";
  const std::string output = simulate("through", through).output;
  EXPECT_THAT(output, ::testing::ContainsRegex("warning: sequence short passes through a surface [0-9.]+ s after the "
                                               "start, at x -?0.[0-9]+ y (5.9|6.[01])[0-9] z [0-9.]+; move"));
  EXPECT_THAT(output, ::testing::HasSubstr("warning: the survey of sequence short passes through"));
}

TEST_F(SimulateCommand, WritesALogThatReadsBackAsWhatWasDriven) {
  const ProgramResult result = simulate("run", "--duration 4");
  ASSERT_EQ(result.code, 0) << result.errors;
  const std::string folder = (folder_ / "run").string() + "/";
  const Platform platform = load_platform(folder + "platform.yaml");
  ASSERT_EQ(platform.suite.magnetometers.size(), 2U);
  EXPECT_EQ(platform.suite.magnetometers[1].name, "rear");
  const Trajectory truth = read_tum(folder + "truth.tum");
  EXPECT_NEAR(to_seconds(truth.back().time - truth.front().time), 4.0, 0.1);
  EXPECT_EQ(truth[1].time - truth[0].time, 5'000'000);

  WarningLog warnings;
  BagSource source(folder + "log.bag", platform, warnings);
  int scans = 0, imu = 0, magnetic = 0;
  for (Measurement measurement; source.next(measurement);) {
    if (const auto* scan = std::get_if<LidarScan>(&measurement)) {
      ++scans;
      // Points are on the floor and on the box, at the true poses.
      for (const LidarPoint& point : scan->points) {
        const auto pose = interpolate(truth, scan->start + point.offset_ns, from_seconds(0.01));
        ASSERT_TRUE(pose.has_value());
        const Vector3 p = *pose * (platform.suite.lidar.T_imu_lidar * point.position.cast<double>());
        const double box = std::max({std::abs(p.x()) - 2.0, std::abs(p.y() - 8.0) - 2.0, std::abs(p.z() - 1.0) - 1.0});
        ASSERT_LT(std::min(std::abs(p.z()), std::abs(box)), 0.15);
      }
    }
    if (const auto* sample = std::get_if<ImuSample>(&measurement)) {
      ++imu;
      EXPECT_NEAR(sample->linear_acceleration.norm(), 9.8, 3.0);
    }
    if (const auto* sample = std::get_if<MagneticSample>(&measurement)) {
      ++magnetic;
      EXPECT_GT(sample->field_ut.norm(), 10.0);
      EXPECT_LT(sample->field_ut.norm(), 100.0);
    }
  }
  EXPECT_NEAR(scans, 40, 2);
  EXPECT_NEAR(imu, 800, 20);
  EXPECT_NEAR(magnetic, 1600, 40);
  EXPECT_TRUE(warnings.entries().empty());

  const Trajectory survey = read_tum(folder + "survey.tum");
  BagSource survey_source(folder + "survey.bag", platform, warnings, {.lidar = false});
  EXPECT_EQ(survey_source.begin_time() / 1'000'000'000, survey.front().time / 1'000'000'000);
  EXPECT_EQ(content_of(folder + "cloud.pcd").substr(0, 20), std::string("# .PCD v0.7 - Point "));
}

TEST_F(SimulateCommand, WheelsAreRecordedIfTheWorldHasThem) {
  const ProgramResult result =
      simulate("run", "--duration 4 --only log --reality field --set sensors.wheels.rate_hz=20");
  ASSERT_EQ(result.code, 0) << result.errors;
  const std::string folder = (folder_ / "run").string() + "/";
  const Platform platform = load_platform(folder + "platform.yaml");
  ASSERT_TRUE(platform.suite.wheels);
  EXPECT_EQ(platform.wheels.topic, "/wheels");
  EXPECT_EQ(platform.suite.calibration.wheels.scale_sigma, 0.01);
  EXPECT_NE(read_true_calibration(folder + "reality.yaml", platform.suite).wheels.correction.scale, 0.0);
  WarningLog warnings;
  BagSource source(folder + "log.bag", platform, warnings);
  int wheels = 0;
  double fastest_m_s = 0.0;
  for (Measurement measurement; source.next(measurement);) {
    const auto* sample = std::get_if<WheelSample>(&measurement);
    if (sample == nullptr) continue;
    ++wheels;
    fastest_m_s = std::max(fastest_m_s, sample->forward_velocity_m_s);
  }
  EXPECT_NEAR(wheels, 80, 3);
  EXPECT_GT(fastest_m_s, 0.5);
  EXPECT_LT(fastest_m_s, 2.5);
}

TEST_F(SimulateCommand, SameSeedSameBytesOtherSeedOtherBytes) {
  ASSERT_EQ(simulate("a", "--duration 2 --seed 4").code, 0);
  ASSERT_EQ(simulate("b", "--duration 2 --seed 4").code, 0);
  ASSERT_EQ(simulate("c", "--duration 2 --seed 5").code, 0);
  for (const std::string& file : all_files) {
    EXPECT_FALSE(bytes("a", file).empty()) << file;
    EXPECT_TRUE(bytes("a", file) == bytes("b", file)) << file;
    if (file != "platform.yaml") {
      EXPECT_FALSE(bytes("a", file) == bytes("c", file)) << file;
    }
  }
  // No other files remain.
  int files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_ / "a")) ++files;
  EXPECT_EQ(files, 7);
}

TEST_F(SimulateCommand, OnlyWritesWhatIsAskedForWithTheBytesOfTheWhole) {
  ASSERT_EQ(simulate("whole", "--duration 2").code, 0);
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"log", {"log.bag", "truth.tum", "reality.yaml", "platform.yaml"}},
      {"cloud", {"cloud.pcd", "platform.yaml"}},
      {"survey,cloud", {"survey.bag", "survey.tum", "cloud.pcd", "platform.yaml"}}};
  for (const auto& [only, files] : cases) {
    const ProgramResult result = simulate(only, "--duration 2 --only " + only);
    ASSERT_EQ(result.code, 0) << result.errors;
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_ / only)) ++count;
    EXPECT_EQ(count, files.size()) << only;
    for (const std::string& file : files) EXPECT_TRUE(bytes(only, file) == bytes("whole", file)) << only << " " << file;
  }
}

TEST_F(SimulateCommand, SceneIsDrivenAmongAndLeftOutOfTheCloudMapUnlessNamedThere) {
  ASSERT_EQ(simulate("bare", "--duration 2").code, 0);
  ASSERT_EQ(simulate("busy", "--duration 2 --scene busy").code, 0);
  ASSERT_EQ(simulate("usual", "--duration 2 --set sequences.short.scene=busy").code, 0);
  ASSERT_EQ(simulate("away", "--duration 2 --set sequences.short.scene=busy --scene none").code, 0);
  ASSERT_EQ(simulate("surveyed", "--only cloud --set cloud.scene=busy").code, 0);
  EXPECT_TRUE(bytes("bare", "cloud.pcd") == bytes("busy", "cloud.pcd"));
  EXPECT_FALSE(bytes("bare", "cloud.pcd") == bytes("surveyed", "cloud.pcd"));
  EXPECT_TRUE(bytes("bare", "truth.tum") == bytes("busy", "truth.tum"));
  for (const std::string& file : all_files) {
    EXPECT_TRUE(bytes("busy", file) == bytes("usual", file)) << file;
    EXPECT_TRUE(bytes("bare", file) == bytes("away", file)) << file;
  }
  for (const char* file : {"log.bag", "survey.bag", "survey.tum"})
    EXPECT_FALSE(bytes("bare", file) == bytes("busy", file)) << file;
}

TEST_F(SimulateCommand, GradeExactIsTheDefaultToTheByte) {
  ASSERT_EQ(simulate("default", "--duration 2").code, 0);
  ASSERT_EQ(simulate("exact", "--duration 2 --reality exact").code, 0);
  ASSERT_EQ(simulate("key", "--duration 2 --set reality=rough --reality exact").code, 0);
  for (const std::string& file : all_files) {
    EXPECT_TRUE(bytes("default", file) == bytes("exact", file)) << file;
    EXPECT_TRUE(bytes("default", file) == bytes("key", file)) << file;
  }
  const Platform platform = load_platform((folder_ / "exact" / "platform.yaml").string());
  EXPECT_EQ(platform.suite.calibration.lidar.rotation_sigma_deg, 0.0);
  EXPECT_EQ(platform.suite.calibration.magnetometers.offset_sigma_ut, 0.0);
}

TEST_F(SimulateCommand, AGradeChangesEveryFileTheSameWayOnAnyNumberOfThreads) {
  ASSERT_EQ(simulate("exact", "--duration 2").code, 0);
  const ProgramResult result = simulate("field", "--duration 2 --reality field --threads 1");
  ASSERT_EQ(result.code, 0) << result.errors;
  ASSERT_EQ(simulate("again", "--duration 2 --reality field --threads 2").code, 0);
  ASSERT_EQ(simulate("maps", "--reality field --only cloud,survey").code, 0);
  for (const std::string& file : all_files) {
    EXPECT_TRUE(bytes("field", file) == bytes("again", file)) << file;
    EXPECT_FALSE(bytes("field", file) == bytes("exact", file)) << file;
  }
  for (const char* file : {"cloud.pcd", "survey.bag", "survey.tum"})
    EXPECT_TRUE(bytes("field", file) == bytes("maps", file)) << file;
  const Platform platform = load_platform((folder_ / "field" / "platform.yaml").string());
  EXPECT_EQ(platform.suite.calibration.lidar.rotation_sigma_deg, 0.3);
  EXPECT_EQ(platform.suite.lidar.T_imu_lidar.position,
            load_platform((folder_ / "exact" / "platform.yaml").string()).suite.lidar.T_imu_lidar.position);
  EXPECT_NE(bytes("field", "reality.yaml").find("grade: field"), std::string::npos);
  EXPECT_NE(bytes("field", "truth.tum").find("displaced"), std::string::npos);
}

TEST_F(SimulateCommand, SetChangesTheWorldAndItsPlatform) {
  ASSERT_EQ(simulate("loud", "--duration 2 --set sensors.magnetometers.noise_ut=5").code, 0);
  const Platform platform = load_platform((folder_ / "loud" / "platform.yaml").string());
  EXPECT_EQ(platform.suite.magnetometers[0].noise_ut, 5.0);
}

TEST_F(SimulateCommand, WrongCallsAreOneClearLineAndCode2) {
  struct Case {
    const char* options;
    const char* expected_text;
  };
  for (const Case& wrong : {Case{"--sequence 9", "short"}, Case{"--set sensors.lidar.row=3", "rows"},
                            Case{"--set sensors.lidar.rows=no", "rows"}, Case{"--set nonsense", "nonsense"},
                            Case{"--scene quiet", "busy"}, Case{"--only logs", "logs"}}) {
    const ProgramResult result = simulate("wrong", wrong.options);
    EXPECT_EQ(result.code, 2) << wrong.options;
    EXPECT_NE(result.errors.find(wrong.expected_text), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  }
  const ProgramResult missing = run_lodestone("simulate /no/such/world.yaml --out " + (folder_ / "x").string());
  EXPECT_EQ(missing.code, 2);
  EXPECT_NE(missing.errors.find("/no/such/world.yaml"), std::string::npos);
}

TEST_F(SimulateCommand, ADriveWithoutAScanIsRefusedBeforeAnythingIsWritten) {
  const ProgramResult result = simulate("short", "--duration 0.05");
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors,
              ::testing::HasSubstr("--duration: expected at least one scan of the LiDAR, 0.1 s, found 0.05 s"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "short"));
}

TEST_F(SimulateCommand, HelpShowsExamples) {
  const ProgramResult help = run_lodestone("simulate --help");
  EXPECT_EQ(help.code, 0);
  EXPECT_NE(help.output.find("lodestone simulate tunnel --out"), std::string::npos);
  EXPECT_NE(help.output.find("lodestone simulate warehouse --out"), std::string::npos);
}

}  // namespace
}  // namespace lodestone
