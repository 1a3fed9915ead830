// Real scans of a handheld LiDAR in two maps from different scans of the same place, with default options.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdio>
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

}  // namespace
}  // namespace lodestone
