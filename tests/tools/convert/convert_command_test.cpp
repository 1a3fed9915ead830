// `lodestone convert` as called by users: the results of a run do not depend on the format of its log.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "frontends/logs/open_log.h"
#include "frontends/logs/ros1/bag_writer.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

class ConvertCommand : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void expect_done(const std::string& arguments) const {
    const ProgramResult result = run_lodestone(arguments);
    ASSERT_EQ(result.code, 0) << arguments << "\n" << result.errors;
  }
  /// The files of a run on the log, without diagnostics.csv, which contains wall times.
  std::vector<std::string> run(const std::string& log) const {
    const std::string out = path("run-of-" + log);
    expect_done("run " + path(log) + " --platform " + path("platform.yaml") + " --cloud " + path("cloud.pcd") +
                " --initial-pose-from " + path("truth.tum") + " --out " + out + " --estimator smoother,ieskf");
    std::vector<std::string> files;
    for (const char* name : {"smoother", "ieskf"}) {
      for (const char* file : {"trajectory.tum", "causal.tum", "covariance.csv"}) {
        files.push_back(content_of(std::filesystem::path(out) / name / file));
      }
    }
    return files;
  }

  TemporaryFolder folder_;
};

TEST_F(ConvertCommand, ARunGivesTheSameBytesFromEveryKindOfLog) {
  expect_done("simulate " LODESTONE_SOURCE_DIR
              "/config/worlds/tunnel.yaml --only log,cloud --duration 4 "
              "--set sensors.lidar.rows=16 --set sensors.lidar.columns=256 --out " +
              path(""));
  const std::vector<std::string> expected = run("log.bag");
  ASSERT_GT(expected.front().size(), 1000U);
  expect_done("convert " + path("log.bag") + " --out " + path("log.mcap"));
  expect_done("convert " + path("log.bag") + " --out " + path("log.db3"));
  expect_done("convert " + path("log.mcap") + " --out " + path("again") + " --format bag --compression none");
  for (const char* log : {"log.mcap", "log.db3", "again"}) EXPECT_TRUE(run(log) == expected) << log;
  const std::string call = "convert " + path("log.bag") + " --to 1 --out " + path("log.mcap");
  const std::string before = content_of(path("log.mcap"));
  expect_refused(call, "--out " + path("log.mcap") + ": the file exists");
  EXPECT_TRUE(content_of(path("log.mcap")) == before);
  expect_done(call + " --force");
}

TEST_F(ConvertCommand, RefusesInOneLine) {
  std::ofstream(path("text.bag")) << "no log";
  expect_refused("convert " + path("absent.bag") + " --out " + path("a.mcap"), "there is no such file");
  expect_refused("convert " + path("text.bag") + " --out " + path("a.mcap"), "is not a log");
  expect_refused("convert " + path("text.bag") + " --out " + path("a.txt"), "expected bag, db3, mcap");
  expect_refused("convert " + path("text.bag") + " --out " + path("a.db3") + " --compression lz4",
                 "this format supports none, zstd");
  expect_refused("convert " + path("text.bag") + " --out " + path("text.bag"), "which the results would overwrite");
  EXPECT_FALSE(std::filesystem::exists(path("a.mcap")));
}

TEST_F(ConvertCommand, TwoPartsOfALogAreTheWhole) {
  expect_done("simulate " LODESTONE_SOURCE_DIR
              "/config/worlds/tunnel.yaml --only log --duration 3 "
              "--set sensors.lidar.rows=16 --set sensors.lidar.columns=256 --out " +
              path(""));
  const auto messages = [this](const std::string& options, const std::string& out) {
    const ProgramResult result = run_lodestone("convert " + path("log.bag") + " --out " + path(out) + options);
    EXPECT_EQ(result.code, 0) << result.errors;
    return std::stoi(result.output.substr(result.output.find(": ") + 2));
  };
  const int whole = messages("", "whole.mcap"), first = messages(" --to 1.5", "first.mcap"),
            second = messages(" --from 1.5", "second.mcap");
  EXPECT_EQ(first + second, whole);
  EXPECT_NEAR(first, whole / 2, whole / 20);
  EXPECT_LT(messages(" --from 1 --to 1.1", "short.mcap"), whole / 10);
  expect_refused("convert " + path("log.bag") + " --from 99 --out " + path("a.mcap"),
                 "--from 99 is after the log's end");
  expect_refused("convert " + path("log.bag") + " --from -1 --out " + path("a.mcap"), "--from: expected seconds");
  expect_refused("convert " + path("log.bag") + " --from 2 --to 1 --out " + path("a.mcap"),
                 "--to: expected seconds, more than --from");
}

TEST_F(ConvertCommand, APartSaysWhatWasLatchedBeforeIt) {
  TopicInfo fixed;
  fixed.name = "/tf_static";
  fixed.type = "tf2_msgs/TFMessage";
  fixed.md5 = "94810edda583a504dfda3829e70d7eec";
  fixed.definition = "geometry_msgs/TransformStamped[] transforms\n";
  TopicInfo moving = fixed;
  moving.name = "/tf";
  const Publisher latching{"/robot", true}, plain{"/robot", false};
  const std::vector<std::uint8_t> bytes(4);
  {
    ros1::BagWriter writer(path("log.bag"), Codec::none);
    writer.write(fixed, {from_seconds(100.0), 0, bytes.data(), bytes.size(), &latching});
    for (int i = 0; i < 10; ++i) writer.write(moving, {from_seconds(100.0 + i), 0, bytes.data(), bytes.size(), &plain});
    writer.close();
  }
  const ProgramResult result = run_lodestone("convert " + path("log.bag") + " --from 5 --out " + path("part.bag"));
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr(": 6 messages of"));
  EXPECT_THAT(result.output, HasSubstr("1 of these are latched messages"));
  WarningLog warnings;
  const auto part = open_log(path("part.bag"), warnings);
  for (const TopicInfo& topic : part->topics()) EXPECT_EQ(topic.begin, from_seconds(105.0)) << topic.name;
  EXPECT_EQ(part->topics().size(), 2U);
}

TEST_F(ConvertCommand, ManyPartsAreReadWhereTheShellAllowsFewFiles) {
  expect_done("simulate " LODESTONE_SOURCE_DIR
              "/config/worlds/tunnel.yaml --only log --duration 2 "
              "--set sensors.lidar.rows=8 --set sensors.lidar.columns=64 --out " +
              path(""));
  std::filesystem::create_directory(path("parts"));
  for (int i = 0; i < 20; ++i) {
    expect_done("convert " + path("log.bag") + " --from " + std::to_string(0.1 * i) + " --to " +
                std::to_string(0.1 * (i + 1)) + " --out " + path("parts/" + std::to_string(i) + ".bag"));
  }
  const std::string call = "bash -c 'ulimit -S -n 16; exec " LODESTONE_PROGRAM " convert " + path("parts") + " --out " +
                           path("whole.bag") + " >/dev/null'";
  EXPECT_EQ(std::system(call.c_str()), 0);
  for (const int files : {6, 8, 12, 30}) {
    const std::string few = "bash -c 'ulimit -n " + std::to_string(files) + "; exec " LODESTONE_PROGRAM " convert " +
                            path("parts") + " --out " + path("a.bag") + " 2>" + path("err") + "'";
    if (std::system(few.c_str()) == 0) continue;  // enough descriptors: parts are opened one after the other
    const std::string line = content_of(path("err"));
    EXPECT_THAT(line, ::testing::HasSubstr("raise the limit (ulimit -n)")) << files;
    EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << line;
  }
  EXPECT_GT(std::filesystem::file_size(path("whole.bag")), 100'000U);
}

TEST_F(ConvertCommand, AFullDiskIsOneLineAndLeavesNothing) {
  expect_done("simulate " LODESTONE_SOURCE_DIR
              "/config/worlds/tunnel.yaml --only log --duration 2 "
              "--set sensors.lidar.rows=16 --set sensors.lidar.columns=256 --out " +
              path(""));
  ASSERT_GT(std::filesystem::file_size(path("log.bag")), 100'000U);
  std::filesystem::create_directory(path("full"));
  for (const char* out : {"full/a.bag --compression none", "full/b.bag --compression lz4", "full/c.mcap",
                          "full/d.mcap --compression none", "full/e.db3", "full/f.db3 --compression zstd"}) {
    // A limit on file sizes (48 KiB) simulates a full disk.
    const std::string command = "ulimit -f 48; exec " LODESTONE_PROGRAM " convert " + path("log.bag") + " --out " +
                                path(out) + " >/dev/null 2>" + path("err");
    const int status = std::system(("bash -c \"" + command + "\"").c_str());
    ASSERT_TRUE(WIFEXITED(status)) << out;
    EXPECT_EQ(WEXITSTATUS(status), 2) << out;
    const std::string line = content_of(path("err"));
    EXPECT_THAT(line, ::testing::HasSubstr("free disk space or choose another path")) << out;
    EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << line;
    EXPECT_TRUE(std::filesystem::is_empty(path("full"))) << out;
  }
}

}  // namespace
}  // namespace lodestone
