// `lodestone evaluate` as called by users.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

/// Results of evo 1.36.5 (matching window 0.01 s).
class EvaluateOracle : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = data_folder() / "trajectories";
    if (!std::filesystem::exists(folder_ / "fr2_desk_ORB.txt")) {
      GTEST_SKIP() << "no recorded trajectories in " << folder_ << "; set LODESTONE_DATA";
    }
  }

  nlohmann::json evaluate(const std::string& estimate, const std::string& truth, const std::string& options) const {
    const ProgramResult result = run_lodestone("evaluate " + (folder_ / estimate).string() + " " +
                                               (folder_ / truth).string() + " --json " + options);
    EXPECT_EQ(result.code, 0) << result.errors;
    return nlohmann::json::parse(result.output);
  }

  static double rmse(const nlohmann::json& json, const char* relation) { return json["relations"][relation]["rmse"]; }

  std::filesystem::path folder_;
};

TEST_F(EvaluateOracle, AbsoluteErrors) {
  const auto plain = evaluate("fr2_desk_ORB.txt", "fr2_desk_groundtruth.txt", "");
  EXPECT_NEAR(rmse(plain, "translation"), 3.173994, 1e-6);
  const auto aligned =
      evaluate("fr2_desk_ORB.txt", "fr2_desk_groundtruth.txt", "--align se3 --relation translation,angle");
  EXPECT_EQ(aligned["pairs"], 2174);
  EXPECT_NEAR(rmse(aligned, "translation"), 0.008119, 1e-6);
  EXPECT_NEAR(rmse(aligned, "angle"), 0.989036, 1e-6);
  EXPECT_EQ(aligned["relations"].size(), 2U);
  const auto mono = evaluate("fr2_desk_ORB_kf_mono.txt", "fr2_desk_groundtruth.txt", "--align sim3");
  EXPECT_EQ(mono["pairs"], 118);
  EXPECT_NEAR(rmse(mono, "translation"), 0.007729, 1e-6);
}

TEST_F(EvaluateOracle, RelativeErrors) {
  const auto frame = evaluate("fr2_desk_ORB.txt", "fr2_desk_groundtruth.txt", "--relation rpe,rpe-angle");
  EXPECT_NEAR(rmse(frame, "rpe"), 0.003490, 1e-6);
  EXPECT_NEAR(rmse(frame, "rpe-angle"), 0.280519, 1e-6);
  const auto metre =
      evaluate("fr2_desk_ORB.txt", "fr2_desk_groundtruth.txt", "--relation rpe --delta 1 --delta-unit metres");
  EXPECT_NEAR(rmse(metre, "rpe"), 0.011673, 1e-6);
}

TEST_F(EvaluateOracle, EurocTruth) {
  const char* truth = "V102_groundtruth.csv";
  EXPECT_NEAR(rmse(evaluate("V102.txt", truth, "--align se3"), "translation"), 0.091727, 1e-6);
  EXPECT_NEAR(rmse(evaluate("V102.txt", truth, "--align sim3"), "translation"), 0.083841, 1e-6);
  EXPECT_NEAR(rmse(evaluate("V102.txt", truth, "--align origin"), "translation"), 0.153679, 1e-6);
}

class EvaluateCommand : public testing::Test {
 protected:
  void SetUp() override {
    write("truth.tum", "0.0 0 0 0 0 0 0 1\n1.0 1 0 0 0 0 0 1\n2.0 2 0 0 0 0 0 1\n3.0 3 0 0 0 0 0 1\n");
    write("estimate.tum", "0.5 0.5 0.3 0 0 0 0 1\n1.5 1.5 0.3 0 0 0 0 1\n");
  }

  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string both() const { return "evaluate " + path("estimate.tum") + " " + path("truth.tum") + " "; }

  TemporaryFolder folder_;
};

TEST_F(EvaluateCommand, InterpolatesTheTruthWhenAsked) {
  expect_refused(both(), "check that both use one clock, or widen --max-difference (now 0.01 s)");
  // Ground truth at 1 Hz is too sparse for interpolation.
  expect_refused(both() + "--interpolate",
                 "check that both use one clock, and that the ground truth has a pose every 0.25 s\n");
  std::string dense;
  for (int i = 0; i <= 300; ++i) dense += std::to_string(0.01 * i) + " " + std::to_string(0.01 * i) + " 0 0 0 0 0 1\n";
  write("truth.tum", dense);
  write("estimate.tum", "0.505 0.505 0.3 0 0 0 0 1\n1.505 1.505 0.3 0 0 0 0 1\n");
  const ProgramResult result = run_lodestone(both() + "--interpolate --json");
  ASSERT_EQ(result.code, 0) << result.errors;
  EXPECT_NEAR(nlohmann::json::parse(result.output)["relations"]["translation"]["max"].get<double>(), 0.3, 1e-12);
}

TEST_F(EvaluateCommand, TheFolderOfTheErrorsIsCreatedOrTheirPathIsNamed) {
  write("estimate.tum", "1.0 1 0 0 0 0 0 1\n2.0 2 0 0 0 0 0 1\n");
  EXPECT_EQ(run_lodestone(both() + "--errors " + path("new/errors.csv")).code, 0);
  EXPECT_TRUE(std::filesystem::exists(path("new/errors.csv")));
  expect_refused(both() + "--errors " + path("truth.tum/errors.csv"),
                 "cannot create the folder: Not a directory; choose "
                 "another path");
}

TEST_F(EvaluateCommand, ReportsNeesOfACovarianceFile) {
  write("truth.tum", "0.5 0.5 0 0 0 0 0 1\n1.5 1.5 0 0 0 0 0 1\n");
  // Sigma 0.1 m and an error of 0.3 m along y: 9 over 6 degrees of freedom.
  const std::string upper = "1e-4,0,0,0,0,0,1e-4,0,0,0,0,1e-4,0,0,0,0.01,0,0,0.01,0,0.01\n";
  write("covariance.csv", "t_s\n0.500000000," + upper + "1.500000000," + upper);
  const std::string nees = "--covariance " + path("covariance.csv");
  const ProgramResult result = run_lodestone(both() + "--json " + nees);
  ASSERT_EQ(result.code, 0) << result.errors;
  const auto json = nlohmann::json::parse(result.output)["nees"];
  EXPECT_NEAR(json["pose"].get<double>(), 1.5, 1e-9);
  EXPECT_NEAR(json["position"].get<double>(), 3.0, 1e-9);
  EXPECT_NEAR(json["rotation"].get<double>(), 0.0, 1e-9);
  EXPECT_THAT(run_lodestone(both() + nees).output, HasSubstr("NEES"));
  expect_refused(both() + nees + " --align origin", "--align");
  write("covariance.csv", "t_s\n0.5,1,2,3\n");
  expect_refused(both() + nees, "covariance.csv:2");
}

TEST_F(EvaluateCommand, ReadsKittiWithTimes) {
  // Rows of 3x4 matrices; the second pose is turned by 90 degrees about z.
  write("estimate.kitti", "1 0 0 0.5 0 1 0 0.3 0 0 1 0\n0 -1 0 1.5 1 0 0 0.3 0 0 1 0\n");
  write("truth.tum", "0.5 0.5 0 0 0 0 0 1\n1.5 1.5 0 0 0 0 0.707106781 0.707106781\n");
  write("times.txt", "5.0e-1\n1.5\n");
  const std::string call = "evaluate " + path("estimate.kitti") + " " + path("truth.tum");
  const ProgramResult result = run_lodestone(call + " --json --times " + path("times.txt"));
  ASSERT_EQ(result.code, 0) << result.errors;
  const auto json = nlohmann::json::parse(result.output);
  EXPECT_EQ(json["pairs"], 2);
  EXPECT_NEAR(json["relations"]["translation"]["max"].get<double>(), 0.3, 1e-9);
  EXPECT_LT(json["relations"]["angle"]["max"].get<double>(), 1e-4);

  expect_refused(call, "estimate.kitti: is in KITTI's format (12 numbers in each line), which has no times");
  expect_refused(call, "--times FILE");
  expect_refused("evaluate " + path("truth.tum") + " " + path("truth.tum") + " --times " + path("times.txt"),
                 "omit --times");
  write("times.txt", "0.5\n");
  expect_refused(call + " --times " + path("times.txt"), "has 1 stamps, but");
  write("times.txt", "0.5\n0.4\n");
  expect_refused(call + " --times " + path("times.txt"), "times.txt:2: the stamp 0.400000000 goes back");
  write("estimate.kitti", "1 0 0 0.5 0 1 0 0.3 0 0 2 0\n");
  write("times.txt", "0.5\n");
  expect_refused(call + " --times " + path("times.txt"), "estimate.kitti:1: the first three columns are no rotation");
}

TEST_F(EvaluateCommand, RefusesWhatItCannotCompare) {
  write("estimate.tum", "1.0 1 0 0 0 0 0 1\n2.0 2 0 0 0 0 0 1\n3.0 3 0 0 0 0 0 1\n");
  expect_refused("evaluate " + path("nowhere.tum") + " " + path("truth.tum"), "nowhere.tum");
  expect_refused(both() + "--align sim4", "did you mean 'sim3'?");
  expect_refused(both() + "--relation translaton", "did you mean 'translation'?");
  expect_refused(both() + "--delta-unit meters", "did you mean 'metres'?");
  expect_refused(both() + "--delta 0.5", "--delta");
  expect_refused(both() + "--align se3", "one line");
  expect_refused(both() + "--relation rpe --delta 50", "no segment of 50 frames");
  EXPECT_EQ(run_lodestone("evaluate").code, 2);
}

TEST_F(EvaluateCommand, WritesErrorsOverTime) {
  write("estimate.tum", "1.0 1 0.25 0 0 0 0 1\n");
  ASSERT_EQ(run_lodestone(both() + "--errors " + path("errors.csv")).code, 0);
  EXPECT_EQ(content_of(folder_ / "errors.csv"), "t_s,translation_m,angle_deg,heading_deg\n1.000000000,0.25,0,0\n");
}

TEST(EvaluateHelp, ShowsTwoExamples) {
  const ProgramResult result = run_lodestone("evaluate --help");
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.output, HasSubstr("Examples"));
}

}  // namespace
}  // namespace lodestone
