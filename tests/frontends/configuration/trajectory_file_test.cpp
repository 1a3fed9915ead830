#include "frontends/configuration/trajectory_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "frontends/configuration/kitti_trajectory.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::lodestone::testing::write_text;
using ::testing::HasSubstr;

Time stamp(const std::string& text) {
  Time time = -1;
  EXPECT_TRUE(parse_stamp(text, time)) << text;
  return time;
}

TEST(Stamp, IsExactToTheNanosecond) {
  EXPECT_EQ(stamp("1403715529.112143517"), 1403715529112143517);
  EXPECT_EQ(stamp("1.403715529112143517e+09"), 1403715529112143517);
  EXPECT_EQ(stamp("1311868164.363181"), 1311868164363181000);
  EXPECT_EQ(stamp("12"), 12'000'000'000);
  EXPECT_EQ(stamp("0.0000000005"), 1);
  EXPECT_EQ(stamp("0.00000000049"), 0);
  EXPECT_EQ(stamp("-1.5"), -1'500'000'000);
  EXPECT_EQ(stamp("5e-9"), 5);
  Time time = 0;
  // The last texts: the exponents, and the difference of two exponents, overflow.
  for (const char* wrong : {"", ".", "-", "1.2.3", "12s", "nan", "1e", "99999999999999999999", "1e2147483647",
                            "1e-2147483648", "9223372036.8547758075", "9223372036", "-4000000000.000000001"}) {
    EXPECT_FALSE(parse_stamp(wrong, time)) << wrong;
  }
  for (const Time exact : {Time{0}, Time{1}, Time{-1}, Time{1403715529112143517}, farthest_time, -farthest_time}) {
    EXPECT_EQ(stamp(format_stamp(exact)), exact);
  }
}

TEST(TrajectoryFile, EurocAndKittiAreReadBack) {
  const TemporaryFolder folder;
  Trajectory trajectory;
  for (int i = 0; i < 50; ++i) {
    trajectory.push_back({1'700'000'000'000'000'001 + i * 99'999'999LL,
                          {so3::exp(Vector3(0.01 * i, -0.2, 0.1 * i)), Vector3(1.0 / 3.0 * i, -123.456789, 1e-7)}});
  }
  write_text(folder / "poses.csv", euroc_text(trajectory));
  write_text(folder / "marked.csv", "\xEF\xBB\xBF" + euroc_text(trajectory));  // as spreadsheets do
  write_text(folder / "poses.kitti", kitti_text(trajectory));
  write_text(folder / "times.txt", kitti_times_text(trajectory));
  EXPECT_TRUE(is_kitti_file(folder / "poses.kitti"));
  EXPECT_FALSE(is_kitti_file(folder / "poses.csv"));
  EXPECT_FALSE(is_kitti_file(folder / "absent"));
  for (const Trajectory& back : {read_trajectory(folder / "poses.csv"), read_trajectory(folder / "marked.csv"),
                                 read_kitti(folder / "poses.kitti", folder / "times.txt")}) {
    ASSERT_EQ(back.size(), trajectory.size());
    for (std::size_t i = 0; i < back.size(); ++i) {
      EXPECT_EQ(back[i].time, trajectory[i].time);
      EXPECT_LT(back[i].pose.boxminus(trajectory[i].pose).norm(), 1e-6);
    }
  }
  EXPECT_THAT(message_of<InputError>([&] { read_trajectory(folder / "poses.kitti"); }),
              HasSubstr("is in KITTI's format (12 numbers in each line), which has no times"));
}

TEST(TrajectoryFile, ReadsBackWhatItWrote) {
  const TemporaryFolder folder;
  Trajectory trajectory;
  for (int i = 0; i < 50; ++i) {
    trajectory.push_back({1'700'000'000'000'000'001 + i * 99'999'999LL,
                          {so3::exp(Vector3(0.01 * i, -0.2, 0.1 * i)), Vector3(1.0 / 3.0 * i, -123.456789012, 1e-7)}});
  }
  write_tum(folder / "a.tum", trajectory, "poses T_map_imu at scan ends\nt x y z qx qy qz qw");
  const Trajectory back = read_tum(folder / "a.tum");
  ASSERT_EQ(back.size(), trajectory.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].time, trajectory[i].time);
    EXPECT_LT(back[i].pose.boxminus(trajectory[i].pose).norm(), 1e-6);
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "a.tum"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.tum.part"));
  EXPECT_THAT(message_of<InputError>([&] { write_tum(folder / "absent/a.tum", trajectory); }),
              HasSubstr("cannot be written"));
}

TEST(TrajectoryFile, NamesTheLineThatIsWrong) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.tum";
  const auto error = [&](const std::string& text) {
    write_text(path, text);
    return message_of<InputError>([&] { read_trajectory(path); });
  };
  const std::string good = "1.0 0 0 0 0 0 0 1\n";
  EXPECT_THAT(error("# comment, with a comma\n" + good + "2.0 0 0 0 0 0 1\n"), HasSubstr("a.tum:3: expected 8 values"));
  EXPECT_THAT(error(good + "2.0 0 zero 0 0 0 0 1\n"), HasSubstr("a.tum:2: 'zero' is no finite number"));
  EXPECT_THAT(error(good + "2.0 0 nan 0 0 0 0 1\n"), HasSubstr("a.tum:2: 'nan' is no finite number"));
  EXPECT_THAT(error("2..0 0 0 0 0 0 0 1\n"), HasSubstr("a.tum:1: '2..0' is no stamp"));
  EXPECT_THAT(error(good + "0.5 0 0 0 0 0 0 1\n"),
              HasSubstr("a.tum:2: the stamp 0.500000000 goes back from 1.000000000"));
  EXPECT_THAT(error("1.0 0 0 0 0 0 0 0.5\n"), HasSubstr("quaternion"));
  EXPECT_THAT(error("# nothing\n\n"), HasSubstr("holds no poses"));
  EXPECT_THAT(error("#t,x\n1.5,0,0,0,1,0,0,0\n"), HasSubstr("a.tum:2: '1.5' is no stamp in whole nanoseconds"));
  EXPECT_THAT(error("-9223372036 0 0 0 0 0 0 1\n"),
              HasSubstr("a.tum:1: '-9223372036' is no stamp in seconds within 127 years"));
  EXPECT_THAT(error("-9223372036854775808,0,0,0,1,0,0,0\n"),
              HasSubstr("is no stamp in whole nanoseconds within 127 years"));
  EXPECT_THAT(message_of<InputError>([&] { read_tum(folder / "absent.tum"); }), HasSubstr("there is no such file"));
}

TEST(TrajectoryFile, ReadsRealFilesOfBothKinds) {
  LODESTONE_REAL_DATA(truth_path, "trajectories/V102_groundtruth.csv");
  LODESTONE_REAL_DATA(estimate_path, "trajectories/V102.txt");
  const Trajectory truth = read_trajectory(truth_path);
  ASSERT_FALSE(truth.empty());
  EXPECT_EQ(truth.front().time, 1403715524907143168);
  EXPECT_NEAR(truth.front().pose.position.x(), 0.515356, 1e-12);
  EXPECT_NEAR(truth.front().pose.rotation.w(), 0.161996, 1e-6);
  const Trajectory estimate = read_trajectory(estimate_path);
  EXPECT_EQ(estimate.front().time, 1403715529112143517);
  EXPECT_NEAR(estimate.front().pose.rotation.x(), 0.81321, 1e-4);
}

}  // namespace
}  // namespace lodestone
