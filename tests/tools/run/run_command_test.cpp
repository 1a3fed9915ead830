// `lodestone run` as called by users, on a log of a robot that stands in a room for three seconds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "frontends/configuration/platform.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tests/tools/program_runner.h"
#include "tools/simulate/bag_recorder.h"
#include "tools/simulate/cloud_map.h"
#include "tools/writers/csv_table.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

constexpr Time kBegin = 1'700'000'000'000'000'000;
constexpr double kDuration = 3.0;
const Vector3 kRoom{8.0, 6.0, 3.0};  // metres; the robot stands in its middle

/// Intersection of a ray from the middle of the room with its walls.
Vector3 wall_along(const Vector3& direction) {
  return direction * (0.5 * kRoom.array() / direction.array().abs()).minCoeff();
}

LidarScan scan_at(Time start) {
  LidarScan scan;
  scan.start = start;
  for (int column = 0; column < 512; ++column) {
    for (int row = 0; row < 16; ++row) {
      const double azimuth = 2.0 * 3.14159265358979 * column / 512.0 + 1e-3;
      const double elevation = 0.05 * (row - 7.5);
      const Vector3 ray{std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                        std::sin(elevation)};
      LidarPoint point;
      point.position = wall_along(ray).cast<float>();
      point.ring = static_cast<std::uint16_t>(row);
      point.offset_ns = column * 190'000;
      scan.points.push_back(point);
    }
  }
  scan.end = start + 511 * 190'000;
  return scan;
}

std::vector<Eigen::Vector3f> room_cloud() {
  std::vector<Eigen::Vector3f> cloud;
  const Vector3 half = 0.5 * kRoom;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (double a = -half(u); a <= half(u); a += 0.07) {
      for (double b = -half(v); b <= half(v); b += 0.07) {
        for (const double side : {-1.0, 1.0}) {
          Eigen::Vector3f point;
          point(axis) = static_cast<float>(side * half(axis));
          point(u) = static_cast<float>(a);
          point(v) = static_cast<float>(b);
          cloud.push_back(point);
        }
      }
    }
  }
  return cloud;
}

class RunCommand : public testing::Test {
 protected:
  void SetUp() override {
    Platform platform;
    platform.name = "standing";
    save_platform(platform, path("platform.yaml"));
    write_point_cloud(path("cloud.pcd"), room_cloud());
    simulation::BagRecorder recorder(path("log.bag"), {platform.lidar.topic, platform.imu.topic, {}});
    Trajectory truth;
    Time next_scan = kBegin + from_seconds(0.05);
    for (Time time = kBegin; time <= kBegin + from_seconds(kDuration); time += from_seconds(0.005)) {
      recorder.write(ImuSample{time, Vector3::Zero(), {0.0, 0.0, platform.suite.gravity_m_s2}});
      truth.push_back({time, Pose{}});
      if (time >= next_scan + from_seconds(0.1)) {
        recorder.write(scan_at(next_scan));
        next_scan += from_seconds(0.1);
      }
    }
    recorder.close();
    write_tum(path("truth.tum"), truth);
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::string call(const std::string& options) const {
    return "run " + path("log.bag") + " --platform " + path("platform.yaml") + " --cloud " + path("cloud.pcd") +
           " --out " + path("out") + " " + options;
  }

  TemporaryFolder folder_;
};

TEST_F(RunCommand, WritesTheContractsFilesAndTheTable) {
  const ProgramResult result = run_lodestone(call("--estimator smoother,lidar-inertial --initial-pose-from " +
                                                  path("truth.tum") + " --truth " + path("truth.tum")));
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("ATE m"));
  EXPECT_THAT(result.output, HasSubstr("LiDAR-inertial"));
  const std::filesystem::path out = folder_ / "out";
  for (const char* name : {"smoother", "lidar-inertial"}) {
    for (const char* file :
         {"trajectory.tum", "causal.tum", "covariance.csv", "diagnostics.csv", "errors.csv", "summary.json"}) {
      EXPECT_TRUE(std::filesystem::exists(out / name / file)) << name << "/" << file;
    }
    const auto summary = nlohmann::json::parse(content_of(out / name / "summary.json"));
    EXPECT_EQ(summary["estimator"], name);
    EXPECT_GE(summary["scans"], 25);
    EXPECT_TRUE(summary["success"].get<bool>());
    EXPECT_LT(summary["ate_m"].get<double>(), 0.02);
  }
  EXPECT_EQ(nlohmann::json::parse(content_of(out / "summary.json"))["status"], "done");
  for (const std::string picture : {"map", "error", "distribution"}) {
    for (const char* ending : {".png", ".pdf", ".svg"}) {
      EXPECT_TRUE(std::filesystem::exists(out / "pictures" / (picture + ending))) << picture << ending;
    }
  }
  // The effective configuration is itself a configuration.
  EXPECT_EQ(run_lodestone(call("--config " + (out / "config.yaml").string())).code, 0);
}

TEST_F(RunCommand, GivesTheSameBitsOnOneAndTwoThreads) {
  ASSERT_EQ(run_lodestone(call("--threads 1")).code, 0);
  const std::string best = content_of(folder_ / "out/smoother/trajectory.tum");
  const std::string covariance = content_of(folder_ / "out/smoother/covariance.csv");
  ASSERT_EQ(run_lodestone(call("--threads 2")).code, 0);
  EXPECT_EQ(content_of(folder_ / "out/smoother/trajectory.tum"), best);
  EXPECT_EQ(content_of(folder_ / "out/smoother/covariance.csv"), covariance);
}

TEST_F(RunCommand, RefusesWrongCallsInOneLine) {
  expect_refused(call("--estimator smother"), "did you mean 'smoother'?");
  expect_refused(call("--estimator smoother,smoother"), "named twice");
  expect_refused(call("--truth " + path("nowhere.tum")), "nowhere.tum");
  expect_refused(call("--config " + path("nowhere.yaml")), "nowhere.yaml");
  expect_refused(call("--set no.such.key=3"), "unknown key");
  expect_refused(call("--initial-pose '1 2 3'"), "--initial-pose");
  expect_refused(call("--initial-pose '900 2 3 0 0 0 1'"), "this map has no plane");
  expect_refused(call("--initial-pose auto"), "no certain initial pose");  // the bare room is symmetric
  expect_refused(call("--initial-pose 1 2 3 0 0 0 1"), "put a pose in quotes");
  EXPECT_FALSE(std::filesystem::exists(path("out"))) << "a refused call leaves nothing half-written";
  expect_refused(call("--max-range -3"), "--max-range");
  expect_refused(call("--threads 0"), "--threads");
  const std::string rest = " --platform " + path("platform.yaml") + " --out " + path("out");
  expect_refused("run " + path("nowhere.bag") + rest + " --cloud " + path("cloud.pcd"), "nowhere.bag");
  expect_refused("run " + path("truth.tum") + rest + " --cloud " + path("cloud.pcd"), "truth.tum");
  expect_refused("run " + path("log.bag") + rest + " --cloud " + path("nowhere.pcd"), "nowhere.pcd");
  const std::string whole = content_of(folder_ / "log.bag");
  // Only the head of the bag; bags that are cut later are read up to the cut (CutBagTest).
  std::ofstream(folder_ / "cut.bag", std::ios::binary) << whole.substr(0, 1000);
  expect_refused("run " + path("cut.bag") + rest + " --cloud " + path("cloud.pcd"), "cut.bag");
  expect_refused("run " + path("log.bag") + rest + " --magnetic " + path("nowhere.yaml"), "nowhere.yaml");
  expect_refused("run " + path("log.bag") + rest, "--magnetic");
  expect_refused("run " + path("log.bag") + rest + " --initial-pose auto --magnetic " + path("nowhere.yaml"),
                 "--cloud");
  EXPECT_EQ(run_lodestone("run").code, 2);
  EXPECT_EQ(run_lodestone(call("--refine whole")).code, 2);
}

TEST_F(RunCommand, LogAndOutputAreLookedAtBeforeTheMaps) {
  const std::string rest = " --platform " + path("platform.yaml") + " --cloud " + path("nowhere.pcd") + " --out ";
  std::ofstream(folder_ / "text.bag") << "no log";
  expect_refused("run " + path("text.bag") + rest + path("out"), "text.bag: is not a log");
  std::ofstream(folder_ / "file") << "x";
  expect_refused("run " + path("log.bag") + rest + path("file") + "/deep/out",
                 "file is not a folder; choose another --out");
  Trajectory other = read_trajectory(path("truth.tum"));
  for (StampedPose& pose : other) pose.time += from_seconds(1000.0);
  write_tum(path("other.tum"), other);
  expect_refused(
      "run " + path("log.bag") + rest + path("out") + " --truth " + path("other.tum"),
      "other.tum: no time in common with the log: it spans 1700001000.000000000 s to 1700001003.000000000 s");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  expect_refused("run " + path("log.bag") + rest + path("out"), "nowhere.pcd");
}

TEST_F(RunCommand, WithoutAPoseToCompareThereIsNoPictureOfErrors) {
  const Time second = from_seconds(1.0);
  write_tum(path("sparse.tum"), Trajectory{{kBegin - second, Pose{}}, {kBegin + from_seconds(kDuration) + second, {}}});
  const ProgramResult result = run_lodestone(call("--initial-pose '0 0 0 0 0 0 1' --truth " + path("sparse.tum")));
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("run.truth (1 x): " + path("sparse.tum") + " spans "));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/pictures/map.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/pictures/error.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/pictures/distribution.png"));
}

TEST_F(RunCommand, ResultsDoNotTakeThePlaceOfWhatItReads) {
  namespace fs = std::filesystem;
  fs::create_directories(folder_ / "out/smoother");
  fs::create_directories(folder_ / "out/checkpoint");
  fs::create_directories(folder_ / "log");
  for (const char* name : {"out/smoother/trajectory.tum", "out/summary.json"})
    fs::copy(folder_ / "truth.tum", folder_ / name);
  const std::string truth = content_of(folder_ / "truth.tum");
  for (const char* given : {"--truth ", "--initial-pose-from "}) {
    for (const char* name : {"out/smoother/trajectory.tum", "out/../out/summary.json"}) {
      expect_refused(call(given + path(name)), "is among the files that --out");
      EXPECT_EQ(content_of(folder_ / name), truth);
    }
  }
  fs::copy(folder_ / "log.bag", folder_ / "log/log.bag");
  const std::string maps = " --platform " + path("platform.yaml") + " --cloud " + path("cloud.pcd");
  for (const char* out : {"log", "log/deep/out"}) {
    expect_refused("run " + path("log") + maps + " --out " + path(out), "is in the folder of the log");
  }
  EXPECT_FALSE(fs::exists(folder_ / "log/deep"));
  // A run removes only its own recordings. This folder is that of a killed run.
  std::ofstream(folder_ / "out/checkpoint/call.json") << "[]";
  std::ofstream(folder_ / "out/checkpoint/model.pt") << "weeks of work";
  std::ofstream(folder_ / "out/checkpoint/smoother.estimates") << "of old";
  expect_refused(call(""), "model.pt: no run wrote this file");
  EXPECT_EQ(content_of(folder_ / "out/checkpoint/model.pt"), "weeks of work");
}

TEST_F(RunCommand, AMagneticMapIsForMagnetometers) {
  const FieldGrid grid{0.5, {-1.0, -1.0}, 5, 5, {0.0}};
  write_magnetic_map(
      MagneticMap(grid, std::vector<Eigen::Vector4f>(25, Eigen::Vector4f(20.0F, 0.0F, -40.0F, 0.5F)), 2.0), {},
      path("field.yaml"));
  expect_refused(call("--magnetic " + path("field.yaml")),
                 "platform.yaml: there are no magnetometers, but --magnetic requires them");
}

TEST_F(RunCommand, FilesOfAnotherKindAreCalledWhatTheyAre) {
  const std::string log = "run " + path("log.bag") + " --out " + path("out");
  expect_refused(log + " --platform " + path("cloud.pcd") + " --cloud " + path("cloud.pcd"),
                 "cloud.pcd: expected a platform file; this looks like a point cloud (PCD, PLY or LAS)");
  expect_refused(log + " --platform " + path("platform.yaml") + " --cloud " + path("platform.yaml"),
                 "this looks like a platform file");
  expect_refused(log + " --platform " + path("platform.yaml") + " --magnetic " + path("platform.yaml"),
                 "expected a magnetic map's YAML; this looks like a platform file");
  expect_refused("run " + path("cloud.pcd") + " --out " + path("out") + " --platform " + path("platform.yaml") +
                     " --cloud " + path("cloud.pcd"),
                 "cloud.pcd: is not a log");
  expect_refused(call("--truth " + path("log.bag")), "expected a trajectory (TUM or EuRoC csv); this looks like a log");
}

TEST_F(RunCommand, ThePlatformFileItWritesBeginsTheNextRun) {
  const std::string start = " --initial-pose-from " + path("truth.tum");
  ASSERT_EQ(run_lodestone(call("--estimator smoother,ieskf --max-range 30" + start)).code, 0);
  const std::string written = path("out/smoother/platform.yaml");
  EXPECT_FALSE(std::filesystem::exists(path("out/ieskf/platform.yaml"))) << "ieskf estimates no calibration";
  EXPECT_THAT(content_of(written), testing::StartsWith("# From " + path("platform.yaml")));
  const Platform given = load_platform(path("platform.yaml"));
  const Platform calibrated = load_platform(written);
  EXPECT_EQ(calibrated.suite.lidar.max_range_m, given.suite.lidar.max_range_m) << "--max-range is of the call alone";
  const CsvTable table(path("out/smoother/calibration.csv"));
  const std::vector<std::string> parameters = table.texts("parameter");
  const std::vector<double> estimates = table.numbers("estimate"), sigmas = table.numbers("sigma");
  const Vector3 shift = calibrated.suite.lidar.T_imu_lidar.position - given.suite.lidar.T_imu_lidar.position;
  const std::vector<std::string> sensors = table.texts("sensor");
  const auto first = static_cast<std::size_t>(std::find(sensors.begin(), sensors.end(), "lidar") - sensors.begin());
  ASSERT_GE(parameters.size(), first + 7U);
  double largest = 0.0;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(parameters[first + 3 + i], std::string("shift_") + "xyz"[i]);
    EXPECT_NEAR(shift[i], estimates[first + 3 + i], 1e-5 * std::abs(estimates[first + 3 + i]) + 1e-12);
    largest = std::max(largest, sigmas[first + 3 + i]);
  }
  EXPECT_EQ(parameters[first + 6], "clock");
  EXPECT_NEAR(calibrated.lidar.clock_offset_s, estimates[first + 6], 1e-5 * std::abs(estimates[first + 6]) + 1e-12);
  EXPECT_NEAR(calibrated.suite.calibration.lidar.translation_sigma_m, largest, 1e-5 * largest);
  const std::string again = "run " + path("log.bag") + " --platform " + written + " --cloud " + path("cloud.pcd");
  EXPECT_EQ(run_lodestone(again + " --out " + path("again") + start).code, 0);
  expect_refused(again + " --out " + path("out") + start, "is among the files");
  // Results of another estimator's run are deleted.
  ASSERT_EQ(run_lodestone(call("--estimator ieskf" + start)).code, 0);
  EXPECT_FALSE(std::filesystem::exists(written));
  EXPECT_FALSE(std::filesystem::exists(path("out/smoother/calibration.csv")));
}

TEST_F(RunCommand, NothingOfAnEarlierRunStaysBesideTheNewResults) {
  const std::string start = " --initial-pose-from " + path("truth.tum");
  ASSERT_EQ(run_lodestone(call("--estimator smoother,lidar-inertial --truth " + path("truth.tum") + start)).code, 0);
  const std::filesystem::path out = folder_ / "out";
  ASSERT_TRUE(std::filesystem::exists(out / "pictures/error.png"));
  std::ofstream(out / "lidar-inertial/notes.txt") << "mine";
  std::ofstream(out / "pictures/mine.png") << "mine";
  std::filesystem::create_directories(out / "ieskf/summary.json");  // a folder of this name is not a result file
  ASSERT_EQ(run_lodestone(call("--estimator smoother --max-range 30" + start)).code, 0);
  EXPECT_FALSE(std::filesystem::exists(out / "lidar-inertial/trajectory.tum"));
  EXPECT_FALSE(std::filesystem::exists(out / "smoother/errors.csv"));
  EXPECT_FALSE(std::filesystem::exists(out / "pictures/error.png"));
  EXPECT_TRUE(std::filesystem::exists(out / "smoother/trajectory.tum"));
  EXPECT_EQ(content_of(out / "lidar-inertial/notes.txt"), "mine");
  EXPECT_EQ(content_of(out / "pictures/mine.png"), "mine");
  EXPECT_TRUE(std::filesystem::exists(out / "ieskf/summary.json"));
  const auto call_of = nlohmann::json::parse(content_of(out / "summary.json"))["call"];
  EXPECT_EQ(call_of["max_range_m"], 30.0);
  EXPECT_EQ(call_of["estimators"], nlohmann::json({"smoother"}));
  EXPECT_EQ(call_of["log"], path("log.bag"));
  // A failed run leaves existing files unchanged.
  expect_refused(call("--estimator smoother --initial-pose '900 2 3 0 0 0 1'"), "this map has no plane");
  EXPECT_TRUE(std::filesystem::exists(out / "smoother/trajectory.tum"));
}

/// Files of a run's folder with the same bytes on every call: all but machine times and leftovers.
std::map<std::string, std::string> results_in(const std::filesystem::path& folder) {
  std::map<std::string, std::string> results;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!entry.is_regular_file() || name.find(".partial-") != std::string::npos) continue;
    const bool bytes =
        entry.path().extension() == ".tum" || name == "covariance.csv" || name == "errors.csv" || name == "config.yaml";
    if (bytes) results[std::filesystem::relative(entry.path(), folder).string()] = content_of(entry.path());
    if (entry.path().extension() == ".json") {
      EXPECT_FALSE(nlohmann::json::parse(content_of(entry.path()), nullptr, false).is_discarded()) << entry.path();
    }
  }
  return results;
}

TEST_F(RunCommand, KilledAtAnyMomentItLeavesTheOldFileOrTheNewOne) {
  const std::string common = "--initial-pose '0 0 0 0 0 0 1' --truth " + path("truth.tum");
  const std::string other =
      "--initial-pose '0.03 0 0 0 0 0 1' --set smoother.window_s=0.5 --truth " + path("truth.tum");
  ASSERT_EQ(run_lodestone(call(other)).code, 0);
  const auto wanted = results_in(folder_ / "out");
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(run_lodestone(call(common)).code, 0);
  const auto whole = std::chrono::steady_clock::now() - begin;
  const auto old = results_in(folder_ / "out");
  ASSERT_NE(old.at("smoother/trajectory.tum"), wanted.at("smoother/trajectory.tum"));
  std::mt19937_64 random(1);
  int seen_new = 0;
  for (int i = 0; i < 20; ++i) {
    const pid_t child = fork();
    if (child == 0) {
      const std::string command = "exec " LODESTONE_PROGRAM " " + call(other) + " >/dev/null 2>&1";
      execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    std::this_thread::sleep_for(whole * static_cast<double>(random() % 1000) / 1000.0);
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    for (const auto& [name, content] : results_in(folder_ / "out")) {
      EXPECT_TRUE(content == old.at(name) || content == wanted.at(name)) << name;
      if (content == wanted.at(name) && content != old.at(name)) ++seen_new;
    }
  }
  RecordProperty("new_files_seen", seen_new);
  ASSERT_EQ(run_lodestone(call(other)).code, 0);
  EXPECT_EQ(results_in(folder_ / "out"), wanted);
}

TEST_F(RunCommand, AFullDiskIsOneLineAndLeavesNothingHalfWritten) {
  // A limit on file sizes simulates a full disk.
  const TemporaryFolder folder;
  const std::string command =
      "ulimit -f 4; exec " LODESTONE_PROGRAM " " + call("") + " >/dev/null 2>" + (folder / "err").string();
  const int status = std::system(("bash -c \"" + command + "\"").c_str());
  EXPECT_EQ(WEXITSTATUS(status), 2);
  EXPECT_THAT(content_of(folder / "err"), HasSubstr("File too large"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(RunCommand, AFolderThatCannotBeWrittenIsOneLine) {
  std::ofstream(folder_ / "file") << "x";
  expect_refused("run " + path("log.bag") + " --platform " + path("platform.yaml") + " --cloud " + path("cloud.pcd") +
                     " --out " + path("file") + "/out",
                 path("file") + "/out");
}

TEST(RunHelp, ShowsExamplesAndEveryOption) {
  const ProgramResult help = run_lodestone("run --help");
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.output, HasSubstr("Examples"));
  const ProgramResult options = run_lodestone("run --list-options");
  EXPECT_EQ(options.code, 0);
  EXPECT_THAT(options.output, HasSubstr(" = "));
}

}  // namespace
}  // namespace lodestone
