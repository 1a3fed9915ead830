#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>

#include "frontends/configuration/platform.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tests/estimators/calibration/simulated_array.h"
#include "tests/tools/program_runner.h"
#include "tools/report/json_file.h"

namespace lodestone {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::SimulatedArray;

/// A log of CSV files of an array that was turned by hand, and its platform file.
class CalibrateCommand : public ::testing::Test {
 protected:
  CalibrateCommand() : array_(2), log_(folder_ / "log"), platform_(folder_ / "platform.yaml") {
    array_.motion = testing::tumbling;
    array_.field = testing::uniform_field;
    array_.duration_s = 25.0;
    array_.truth[0].hard_iron_ut = Vector3(12.0, -7.0, 4.0);
    array_.truth[1].hard_iron_ut = Vector3(-3.0, 9.0, -15.0);
    array_.truth[1].distortion(0, 1) = 0.04;
    array_.run();
    std::filesystem::create_directories(log_);
    write_log();
    write_platform();
  }

  void write_platform() const {
    Platform platform = load_platform(std::string(LODESTONE_SOURCE_DIR) + "/config/platforms/scout_os32.yaml");
    platform.imu.topic = "/imu";
    platform.suite.magnetometers = array_.suite.magnetometers;
    platform.magnetometers = {{"/m0"}, {"/m1"}};
    save_platform(platform, platform_.string());
  }

  void write_log() const {
    std::ofstream imu(log_ / "imu.csv");
    imu << "time_ns,gyroscope_x_rad_s,gyroscope_y_rad_s,gyroscope_z_rad_s,accelerometer_x_m_s2,accelerometer_y_m_s2,"
           "accelerometer_z_m_s2\n"
        << std::setprecision(9);
    const Time begin = from_seconds(1000.0);
    for (const ImuSample& sample : array_.imu) {
      const Vector3& w = sample.angular_velocity;
      imu << begin + sample.time << "," << w.x() << "," << w.y() << "," << w.z() << ",0,0,9.8\n";
    }
    for (std::size_t j = 0; j < 2; ++j) {
      std::ofstream file(log_ / ("m" + std::to_string(j) + ".csv"));
      file << "time_ns,field_x_ut,field_y_ut,field_z_ut\n" << std::setprecision(9);
      for (const MagneticArraySample& sample : array_.samples) {
        const Vector3& field = *sample.field_ut[j];
        file << begin + sample.time << "," << field.x() << "," << field.y() << "," << field.z() << "\n";
      }
    }
  }

  std::string call(const std::string& rest) const {
    return "calibrate magnetometers " + log_.string() + " --platform " + platform_.string() + " " + rest;
  }

  TemporaryFolder folder_;
  SimulatedArray array_;
  std::filesystem::path log_, platform_;
};

TEST_F(CalibrateCommand, WritesAPlatformThatNeedsNoFurtherCalibration) {
  const std::filesystem::path out = folder_ / "calibrated" / "platform.yaml";
  const ProgramResult first = run_lodestone(call("--set max_moments=300 --out " + out.string()));
  ASSERT_EQ(first.code, 0) << first.errors;
  EXPECT_THAT(first.output,
              HasSubstr("all magnetometers alike: scale along all axes together: not determined by this motion"));
  const Platform calibrated = load_platform(out.string());
  for (std::size_t j = 0; j < 2; ++j) {
    EXPECT_LT((calibrated.magnetometers[j].hard_iron_ut - array_.truth[j].hard_iron_ut).cwiseAbs().maxCoeff(), 0.3);
  }
  const nlohmann::ordered_json json = read_json(out.parent_path() / "calibration.json");
  EXPECT_EQ(json["reference"], "array");
  EXPECT_EQ(json["held"].size(), 1U);
  EXPECT_GT(json["magnetometers"][0]["residual_before_ut"], 5.0);
  EXPECT_LT(json["magnetometers"][0]["residual_after_ut"], 1.0);
  EXPECT_EQ(json["magnetometers"][1]["parameters"].size(), 12U);
  // What is printed is what is written.
  EXPECT_EQ(json["magnetometers"][0]["parameters"]["hard_iron_x_ut"]["change"],
            calibrated.magnetometers[0].hard_iron_ut.x());
  EXPECT_THAT(first.output, HasSubstr(fmt::format(" {:.2f} ± ", calibrated.magnetometers[0].hard_iron_ut.x())));
  EXPECT_THAT(first.output, Not(HasSubstr("does not determine hard iron")));

  // The reader applies the calibration: a second calibration of the same log starts from the result of the first.
  const std::filesystem::path again = folder_ / "again" / "platform.yaml";
  const ProgramResult second = run_lodestone("calibrate magnetometers " + log_.string() + " --platform " +
                                             out.string() + " --set max_moments=300 --out " + again.string());
  ASSERT_EQ(second.code, 0) << second.errors;
  const nlohmann::ordered_json after = read_json(again.parent_path() / "calibration.json");
  EXPECT_NEAR(after["magnetometers"][0]["residual_before_ut"], json["magnetometers"][0]["residual_after_ut"], 0.05);
  const Platform twice = load_platform(again.string());
  for (std::size_t j = 0; j < 2; ++j) {
    EXPECT_LT((twice.magnetometers[j].hard_iron_ut - calibrated.magnetometers[j].hard_iron_ut).norm(), 0.1);
  }
}

TEST_F(CalibrateCommand, NamesTheHardIronThatALogDeterminesLessAccuratelyThanThePlatformFileStates) {
  array_.motion = [](double t) { return Pose{Quaternion::Identity(), Vector3(0.2 * t, 0.0, 0.0)}; };
  array_.imu.clear();
  array_.samples.clear();
  array_.run();
  write_log();
  const ProgramResult result = run_lodestone(call("--set max_moments=100"));
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("this log does not determine hard iron x, y, z: sigma up to "));
}

TEST_F(CalibrateCommand, TheSameLogGivesTheSameBytes) {
  for (const char* name : {"first", "second"}) {
    const std::string out = (folder_ / name / "platform.yaml").string();
    ASSERT_EQ(run_lodestone(call("--set max_moments=100 --out " + out)).code, 0);
  }
  EXPECT_EQ(content_of(folder_ / "first" / "platform.yaml"), content_of(folder_ / "second" / "platform.yaml"));
  EXPECT_EQ(content_of(folder_ / "first" / "calibration.json"), content_of(folder_ / "second" / "calibration.json"));
}

/// The same array, level and in a field that has grown by a fifth since the survey.
class CalibrateInAChangedFieldCommand : public CalibrateCommand {
 protected:
  CalibrateInAChangedFieldCommand() {
    array_ = SimulatedArray(2);
    for (MagnetometerModel& model : array_.suite.magnetometers) model.T_imu_mag.position.z() = 0.0;
    array_.motion = [](double t) {
      return Pose{so3::exp(Vector3(0.0, 0.0, 0.3 * t)),
                  Vector3(1.2 * std::sin(0.3 * t), -1.2 * std::cos(0.3 * t), 0.2)};
    };
    array_.field = [](const Vector3& place) { return Vector3(1.2 * testing::field_with_steel(place)); };
    array_.duration_s = 30.0;
    array_.run();
    write_log();
    write_platform();
    Trajectory trajectory = array_.trajectory;
    for (StampedPose& pose : trajectory) pose.time += from_seconds(1000.0);
    write_tum((folder_ / "truth.tum").string(), trajectory);
    FieldGrid grid;
    grid.resolution_m = 0.1;
    grid.origin = Eigen::Vector2d(-2.0, -2.0);
    grid.columns = grid.rows = 41;
    grid.heights_m = {0.2};
    std::vector<Eigen::Vector4f> nodes;
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Vector3 field =
            testing::field_with_steel({grid.origin.x() + 0.1 * column, grid.origin.y() + 0.1 * row, 0.2});
        nodes.emplace_back(field.x(), field.y(), field.z(), 0.3);
      }
    }
    write_magnetic_map(MagneticMap(grid, nodes, 10.0), {}, (folder_ / "field.yaml").string());
  }
};

TEST_F(CalibrateInAChangedFieldCommand, SaysThatTheMapIsStaleAndLeavesTheMagnetometersAsTheyAre) {
  const std::filesystem::path out = folder_ / "calibrated" / "platform.yaml";
  const ProgramResult result =
      run_lodestone(call("--set max_moments=300 --magnetic " + (folder_ / "field.yaml").string() + " --trajectory " +
                         (folder_ / "truth.tum").string() + " --out " + out.string()));
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("common to all magnetometers: the map is stale, survey it again"));
  EXPECT_THAT(result.output, HasSubstr("not changed, because the change is below two standard deviations"));
  EXPECT_THAT(result.output, HasSubstr("all magnetometers alike: scale along all axes together"));
  const Platform calibrated = load_platform(out.string());
  for (const MagnetometerMessageLayout& layout : calibrated.magnetometers) {
    EXPECT_EQ(layout.hard_iron_ut, Vector3::Zero());
    EXPECT_EQ(layout.soft_iron_correction, Matrix3::Identity());
  }
  const nlohmann::ordered_json json = read_json(out.parent_path() / "calibration.json");
  EXPECT_EQ(json["field_change"]["map_as_a_whole"], true);
  const double scale_sigma = json["field_change"]["scale_sigma"];
  EXPECT_NEAR(json["field_change"]["scale"], 1.2, 2.0 * scale_sigma);
  EXPECT_LT(scale_sigma, 0.1);
  EXPECT_GT(json["field_change"]["difference_rms_ut"], 5.0);
  const std::string places = content_of(out.parent_path() / "field_change.csv");
  EXPECT_THAT(places, ::testing::StartsWith("x_m,y_m,z_m,moments,difference_x_ut,"));
  EXPECT_EQ(static_cast<std::size_t>(std::count(places.begin(), places.end(), '\n')),
            json["field_change"]["places"].get<std::size_t>() + 1);
  // Without a map, this file does not exist.
  const std::string again = call("--set max_moments=100 --out " + out.string());
  expect_refused(again, "--out " + out.string() + ": the file exists; choose another name, or set --force");
  const std::string other = call("--set max_moments=100 --out " + (out.parent_path() / "other.yaml").string());
  expect_refused(other, "calibration.json: the file exists");
  EXPECT_EQ(content_of(out.parent_path() / "field_change.csv"), places);
  ASSERT_EQ(run_lodestone(again + " --force").code, 0);
  EXPECT_FALSE(std::filesystem::exists(out.parent_path() / "field_change.csv"));
}

TEST_F(CalibrateCommand, EachMistakeIsOneLineAndCodeTwo) {
  expect_refused(call("--magnetic field.yaml"), "--trajectory");
  expect_refused(call("--trajectory truth.tum"), "--magnetic");
  expect_refused(call("--out platform.txt"), ".yaml");
  expect_refused(call("--set hard_iron_sigma_t=3"), "did you mean 'hard_iron_sigma_ut'");
  expect_refused(call("--set min_gain=2"), "min_gain");
  expect_refused("calibrate magnetometers " + (folder_ / "absent").string() + " --platform " + platform_.string(),
                 "absent");
  expect_refused(
      call("--magnetic " + (folder_ / "absent.yaml").string() + " --trajectory " + (folder_ / "absent.tum").string()),
      "absent.tum");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "calibrated"));
}

}  // namespace
}  // namespace lodestone
