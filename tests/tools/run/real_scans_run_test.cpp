// Real scans of a handheld LiDAR in two maps from different scans of the same place, with default options.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>

#include "core/geometry/trajectory.h"
#include "frontends/configuration/trajectory_file.h"
#include "tests/tools/program_runner.h"
#include "tools/writers/covariance_file.h"

namespace lodestone {
namespace {

struct RealRun {
  Trajectory poses;
  std::vector<StampedCovariance> covariances;
  double smoother_ate_m = 0.0;
  double filter_ate_m = 0.0;
};

class RealScans : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(data_ / "log")) GTEST_SKIP() << "no data in " << data_ << "; set LODESTONE_DATA";
  }

  RealRun run(const std::string& map) const {
    const std::string out = (folder_ / map).string();
    const ProgramResult result = run_lodestone(
        "run " + (data_ / "log").string() + " --platform " + (data_ / "platform.yaml").string() + " --cloud " +
        (data_ / map).string() + " --initial-pose-from " + (data_ / "poses.tum").string() + " --truth " +
        (data_ / "poses.tum").string() + " --estimator smoother,lidar-inertial --out " + out);
    EXPECT_EQ(result.code, 0) << result.errors;
    const auto ate = [&](const std::string& estimator) {
      return nlohmann::json::parse(content_of(out + "/" + estimator + "/summary.json"))["ate_m"].get<double>();
    };
    return {read_trajectory(out + "/smoother/trajectory.tum"), read_covariances(out + "/smoother/covariance.csv"),
            ate("smoother"), ate("lidar-inertial")};
  }

  /// The log with those of its scans that `keeps` says, by their number.
  std::string log_with(const std::function<bool(int)>& keeps) const {
    const std::filesystem::path log = folder_ / "log";
    std::filesystem::create_directories(log / "points");
    std::filesystem::create_symlink(std::filesystem::absolute(data_ / "log/imu.csv"), log / "imu.csv");
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(data_ / "log/points")) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (int i = 0; i < static_cast<int>(files.size()); ++i) {
      if (!keeps(i)) continue;
      const std::filesystem::path& file = files[static_cast<std::size_t>(i)];
      std::filesystem::create_symlink(std::filesystem::absolute(file), log / "points" / file.filename());
    }
    return log.string();
  }

  const std::filesystem::path data_ = data_folder() / "real_scans";
  const TemporaryFolder folder_;
};

TEST_F(RealScans, TheSmootherTracksThemAndTwoMapsDifferByWhatItsCovariancesSay) {
  const RealRun a = run("map_a.pcd");
  const RealRun b = run("map_b.pcd");
  for (const RealRun* made : {&a, &b}) {
    std::printf("ATE: smoother %.4f m, filter %.4f m\n", made->smoother_ate_m, made->filter_ate_m);
    EXPECT_LT(made->smoother_ate_m, 0.03);
    EXPECT_LT(made->smoother_ate_m, 1.05 * made->filter_ate_m);
  }
  ASSERT_EQ(a.poses.size(), b.poses.size());
  // Odd scans are in neither map. Both runs share the noise of the scan and, because calibration is estimated, the
  // error of the calibration. Their covariances contain both errors; their difference contains neither.
  double position = 0.0;
  double rotation = 0.0;
  int scans = 0;
  for (std::size_t k = 1; k < a.poses.size(); k += 2, ++scans) {
    const Vector6 difference = a.poses[k].pose.boxminus(b.poses[k].pose);
    const Matrix6 covariance = a.covariances[k].covariance + b.covariances[k].covariance;
    const Vector3 turn = difference.head<3>();
    const Vector3 shift = difference.tail<3>();
    rotation += turn.dot(covariance.topLeftCorner<3, 3>().ldlt().solve(turn)) / 3.0;
    position += shift.dot(covariance.bottomRightCorner<3, 3>().ldlt().solve(shift)) / 3.0;
  }
  std::printf("NEES of the difference: position %.2f, rotation %.2f\n", position / scans, rotation / scans);
  EXPECT_GT(position / scans, 0.1);
  EXPECT_LT(position / scans, 2.0);
  // The covariance of the rotation is dominated by calibration: the LiDAR's mounting and the IMU's axes.
  EXPECT_LT(rotation / scans, 2.0);
}

/// After seconds without scans, the IMU alone leaves the place uncertain by more than a registration can correct. The
/// gap begins in the 60th or 100th of the 176 scans, two a second. After 20 s the robot is lost and must be found.
class GapOfRealScans : public RealScans, public ::testing::WithParamInterface<std::pair<int, int>> {};

TEST_P(GapOfRealScans, LeavesNoWrongPlaceBehind) {
  const int first = GetParam().first;
  const int after = first + GetParam().second;
  const std::string log = log_with([=](int scan) { return scan < first || scan >= after; });
  const std::string poses = (data_ / "poses.tum").string();
  const std::string out = (folder_ / "run").string();
  const ProgramResult result =
      run_lodestone("run " + log + " --platform " + (data_ / "platform.yaml").string() + " --cloud " +
                    (data_ / "map_b.pcd").string() + " --initial-pose-from " + poses + " --truth " + poses +
                    " --estimator smoother --set smoother.refine=batch --out " + out);
  EXPECT_TRUE(result.code == 0 || result.code == 3) << result.errors;
  const auto stages = nlohmann::json::parse(content_of(out + "/smoother/summary.json"))["stages"];
  for (const std::string& stage : {"smoothed", "batch"}) {
    const double nees = stages[stage]["nees_position"].get<double>();
    std::printf("%s: ATE %.3f m, NEES of position %.2f\n", stage.c_str(), stages[stage]["ate_m"].get<double>(), nees);
    EXPECT_LT(nees, 4.0);
  }
  if (result.code == 0) EXPECT_LT(stages["batch"]["ate_m"].get<double>(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Gaps, GapOfRealScans,
                         ::testing::Values(std::pair{60, 10}, std::pair{60, 20}, std::pair{100, 20},
                                           std::pair{60, 40}));

/// A person walks on while the log begins. Scans are half a second apart, so that the robot is 0.7 m further at the
/// second one.
class StartAmongRealScans : public RealScans, public ::testing::WithParamInterface<int> {};

TEST_P(StartAmongRealScans, IsFoundInMotion) {
  const std::string out = (folder_ / "run").string();
  const ProgramResult result = run_lodestone(
      "run " + log_with([](int scan) { return scan >= GetParam(); }) + " --platform " +
      (data_ / "platform.yaml").string() + " --cloud " + (data_ / "map_b.pcd").string() +
      " --initial-pose auto --truth " + (data_ / "poses.tum").string() + " --estimator smoother,ieskf --out " + out);
  EXPECT_EQ(result.code, 0) << result.errors;
  for (const std::string& estimator : {"smoother", "ieskf"}) {
    const auto summary = nlohmann::json::parse(content_of(out + "/" + estimator + "/summary.json"));
    std::printf("%s: ATE %.3f m\n", estimator.c_str(), summary["ate_m"].get<double>());
    EXPECT_LT(summary["ate_m"].get<double>(), estimator == "smoother" ? 0.04 : 0.1);
  }
}

INSTANTIATE_TEST_SUITE_P(Scans, StartAmongRealScans, ::testing::Values(40, 70, 100));

}  // namespace
}  // namespace lodestone
