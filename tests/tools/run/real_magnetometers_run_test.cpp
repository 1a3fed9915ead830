// Real magnetometers of AaltoML's robot on the map of two other drives, with default options.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "frontends/configuration/trajectory_file.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

struct RealDrive {
  const char* name;
  double ambiguous_s;  // from the beginning, in which two places a metre apart fit for ten seconds
  const char* estimator;
  const char* duration_s;
};

class RealMagnetometers : public ::testing::TestWithParam<RealDrive> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(data_ / "run_4")) GTEST_SKIP() << "no data in " << data_ << "; set LODESTONE_DATA";
  }

  const std::filesystem::path data_ = data_folder() / "magnetic" / "aalto_logs";
  const TemporaryFolder folder_;
};

// A window that follows one place is lost on both drives. On the first, the robot leaves the map for 25 s. On the
// second, a magnetometer has drifted by 13 µT.
TEST_P(RealMagnetometers, AreEnoughToStayAtTheRightPlace) {
  const RealDrive& drive = GetParam();
  const std::string in = data_.string() + "/", log = in + drive.name, out = folder_.path().string() + "/";
  const std::string platform = " --platform " + in + "platform.yaml ";
  ASSERT_EQ(run_lodestone("convert " + log + " --to " + drive.duration_s + " --out " + out + "log.bag").code, 0);
  ASSERT_EQ(run_lodestone("map magnetic " + in + "survey_2_3 --trajectory " + in + "survey_2_3.tum" + platform +
                          "--out " + out + "field.yaml")
                .code,
            0);
  const ProgramResult result =
      run_lodestone("run " + out + "log.bag --magnetic " + out + "field.yaml" + platform + "--initial-pose-from " +
                    log + ".tum --truth " + log + ".tum --estimator " + drive.estimator + " --out " + out + "run");
  EXPECT_TRUE(result.code == 0 || result.code == 3) << result.errors;  // 3: lost for a part of the log, and said so
  const Trajectory truth = read_trajectory(log + ".tum");
  const std::string folder = out + "run/" + drive.estimator;
  const Trajectory found = read_trajectory(folder + "/trajectory.tum");
  int wrong = 0, wrong_later = 0, later = 0;  // by more than half a metre; after the ambiguous part
  double squared_later_m2 = 0.0;
  for (const StampedPose& one : found) {
    const std::optional<Pose> at = interpolate(truth, one.time, from_seconds(1.0));
    ASSERT_TRUE(at);
    const double error_m = (one.pose.position - at->position).head<2>().norm();
    wrong += error_m > 0.5 ? 1 : 0;
    if (to_seconds(one.time - truth.front().time) < drive.ambiguous_s) continue;
    wrong_later += error_m > 0.5 ? 1 : 0;
    squared_later_m2 += error_m * error_m;
    ++later;
  }
  const auto summary = nlohmann::json::parse(content_of(folder + "/summary.json"));
  const double share = static_cast<double>(found.size()) / summary["scans"].get<double>();
  std::printf("%s, %s: ATE %.3f m, %d scans wrong, %.0f %% reported\n", drive.name, drive.estimator,
              summary["ate_m"].get<double>(), wrong, 100.0 * share);
  EXPECT_LT(summary["ate_m"].get<double>(), 0.3);
  EXPECT_LT(wrong, 0.1 * static_cast<double>(found.size()));
  EXPECT_LT(std::sqrt(squared_later_m2 / later), 0.2);
  EXPECT_LT(wrong_later, 0.02 * later);
  EXPECT_GT(share, 0.8);
}

std::string name_of(const ::testing::TestParamInfo<RealDrive>& one) {
  std::string name = std::string(one.param.name) + "_" + one.param.estimator;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// Long tests. The smoother takes the mixture's time and its own.
INSTANTIATE_TEST_SUITE_P(Drives, RealMagnetometers,
                         ::testing::Values(RealDrive{"run_4", 25.0, "magnetic-mixture", "1000"},
                                           RealDrive{"run_5", 0.0, "magnetic-mixture", "1000"},
                                           RealDrive{"run_4", 25.0, "smoother", "100"},
                                           RealDrive{"run_5", 0.0, "smoother", "100"}),
                         name_of);

}  // namespace
}  // namespace lodestone
