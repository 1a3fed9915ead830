// A site in the coordinates of a country: with --origin, maps, truth and initial pose are read from there, and the run
// is the one of the same site with its own origin.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/point_cloud_file.h"
#include "tests/tools/program_runner.h"
#include "tests/tools/run/office_world.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

constexpr const char* kOrigin = " --origin 432000.25,4583000.5,87 ";
const Vector3 origin_m(432000.25, 4583000.5, 87.0);

class GeoreferencedRun : public testing::Test {
 protected:
  void SetUp() override {
    std::string world = office_world;
    const std::string sensors = "sensors:\n";
    world.insert(world.find(sensors) + sensors.size(),
                 "  magnetometer_mounts:\n    - {name: front, position_m: [0.3, 0.25, -0.08]}\n"
                 "    - {name: rear, position_m: [-0.3, -0.25, -0.08]}\n");
    std::ofstream(folder_ / "office.yaml") << world;
    expect_done("simulate " + path("office.yaml") + " --only log,cloud --out " + path("site"));
    expect_done("map magnetic " + path("site/log.bag") + " --trajectory " + path("site/truth.tum") + " --platform " +
                path("site/platform.yaml") + " --out " + path("site/field.yaml"));
    for (const auto& [from, to] : {std::pair("cloud.pcd", "cloud.ply"), std::pair("field.yaml", "field.yaml"),
                                   std::pair("truth.tum", "truth.tum")}) {
      std::filesystem::create_directory(folder_ / "country");
      expect_done("shift " + path("site/") + from + kOrigin + "--back --out " + path("country/") + to);
    }
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  void expect_done(const std::string& arguments) const {
    const ProgramResult result = run_lodestone(arguments);
    ASSERT_EQ(result.code, 0) << arguments << "\n" << result.errors;
  }

  /// A call with the log and platform of the site and maps of `folder`.
  std::string call(const std::string& command, const std::string& folder, const std::string& cloud) const {
    return command + " " + path("site/log.bag") + " --platform " + path("site/platform.yaml") + " --cloud " +
           path(folder + cloud) + " --magnetic " + path(folder + "/field.yaml") + " --initial-pose-from " +
           path(folder + "/truth.tum");
  }

  TemporaryFolder folder_;
};

TEST_F(GeoreferencedRun, HasTheTrajectoryOfTheSiteAndThatOfTheCountry) {
  const std::string estimators = " --estimator smoother,ndt ";
  expect_done(call("run", "site", "/cloud.pcd") + estimators + "--truth " + path("site/truth.tum") + " --out " +
              path("near"));
  expect_done(call("run", "country", "/cloud.ply") + kOrigin + estimators + "--truth " + path("country/truth.tum") +
              " --out " + path("far"));
  for (const std::string name : {"smoother", "ndt"}) {
    const Trajectory near = read_tum(path("near/" + name + "/trajectory.tum"));
    const Trajectory far = read_tum(path("far/" + name + "/trajectory.tum"));
    const Trajectory country = read_tum(path("far/" + name + "/georeferenced.tum"));
    ASSERT_EQ(near.size(), far.size());
    ASSERT_EQ(country.size(), far.size());
    for (std::size_t i = 0; i < near.size(); ++i) {
      EXPECT_LT((near[i].pose.position - far[i].pose.position).norm(), 1e-4) << name;
      EXPECT_LT((country[i].pose.position - far[i].pose.position - origin_m).norm(), 2e-6) << name;
    }
    EXPECT_FALSE(std::filesystem::exists(path("near/" + name + "/georeferenced.tum")));
  }
  const auto summary = nlohmann::json::parse(content_of(path("far/summary.json")));
  EXPECT_EQ(summary.at("call").at("origin_m"), nlohmann::json({432000.25, 4583000.5, 87.0}));
  EXPECT_LT(summary.at("estimators").at("smoother").at("ate_m").get<double>(), 0.05);

  expect_done("evaluate " + path("far/smoother/georeferenced.tum") + " " + path("country/truth.tum"));
  expect_refused("evaluate " + path("far/smoother/trajectory.tum") + " " + path("country/truth.tum"),
                 "is georeferenced");
  expect_done("export " + path("far") + " --estimator smoother --to euroc --out " + path("country.csv"));
  const Trajectory exported = read_trajectory(path("country.csv"));
  const Trajectory written = read_tum(path("far/smoother/georeferenced.tum"));
  ASSERT_EQ(exported.size(), written.size());
  EXPECT_LT((exported.back().pose.position - written.back().pose.position).norm(), 2e-6);
}

TEST_F(GeoreferencedRun, WithoutItsOriginIsRefusedWithOne) {
  const ProgramResult refused =
      run_lodestone("run " + path("site/log.bag") + " --platform " + path("site/platform.yaml") + " --cloud " +
                    path("country/cloud.ply") + " --out " + path("none"));
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.errors, HasSubstr("give --origin 432000,4583000,0"));
  EXPECT_FALSE(std::filesystem::exists(path("none")));
  expect_refused(call("run", "country", "/cloud.ply") + " --origin 1,2,nan --out " + path("none"), "finite");
}

TEST_F(GeoreferencedRun, CheckComparesWithTheSameMaps) {
  const ProgramResult result = run_lodestone(call("check", "country", "/cloud.ply") + kOrigin);
  EXPECT_EQ(result.code, 0) << result.output;
  EXPECT_EQ(result.output.find("start.off"), std::string::npos) << result.output;
}

TEST_F(GeoreferencedRun, ProposesPosesThatItAccepts) {
  Pose start = read_tum(path("country/truth.tum")).front().pose;
  const std::string right = pose_text(start);
  start.position.x() += 0.8;
  const std::string maps = "check " + path("site/log.bag") + " --platform " + path("site/platform.yaml") + " --cloud " +
                           path("country/cloud.ply") + kOrigin + "--initial-pose \"";
  const ProgramResult off = run_lodestone(maps + pose_text(start) + "\"");
  const std::string set = "set --initial-pose \"";
  const std::size_t begin = off.output.find(set);
  ASSERT_NE(begin, std::string::npos) << off.output;
  const std::string proposed = off.output.substr(begin + set.size(), right.size());
  EXPECT_EQ(proposed.substr(0, 4), right.substr(0, 4)) << off.output;
  const ProgramResult accepted = run_lodestone(maps + right + "\"");
  EXPECT_EQ(accepted.output.find(set), std::string::npos) << accepted.output;
}

TEST_F(GeoreferencedRun, TrajectoriesInOtherCoordinatesAreRefused) {
  const std::string far = call("run", "country", "/cloud.ply") + kOrigin + "--out " + path("none") + " --truth ";
  expect_refused(far + path("site/truth.tum"), "correct --origin, or omit it");
  const std::string near = call("run", "site", "/cloud.pcd") + " --out " + path("none") + " --truth ";
  expect_refused(near + path("country/truth.tum"), "give an origin at the site with --origin x,y,z");
}

TEST_F(GeoreferencedRun, ACloudMapIsBuiltInTheCoordinatesOfItsTrajectory) {
  const std::string drive = "map cloud " + path("site/log.bag") + " --platform " + path("site/platform.yaml");
  expect_done(drive + " --trajectory " + path("site/truth.tum") + " --out " + path("near.pcd"));
  expect_done(drive + " --trajectory " + path("country/truth.tum") + kOrigin + " --out " + path("far.ply"));
  WarningLog warnings;
  const auto near = read_point_cloud(path("near.pcd"), warnings);
  const auto far = read_point_cloud(path("far.ply"), warnings, origin_m);
  // Poses are rounded to a micrometre: a point at the edge of a voxel may change sides.
  EXPECT_NEAR(static_cast<double>(far.size()), static_cast<double>(near.size()), 0.001 * near.size());
  Eigen::Vector3d mean_near = Vector3::Zero(), mean_far = Vector3::Zero();
  for (const Eigen::Vector3f& point : near) mean_near += point.cast<double>() / static_cast<double>(near.size());
  for (const Eigen::Vector3f& point : far) mean_far += point.cast<double>() / static_cast<double>(far.size());
  EXPECT_LT((mean_near - mean_far).norm(), 0.01);
  expect_refused(drive + " --trajectory " + path("country/truth.tum") + " --out " + path("none.pcd"), "--origin");
  expect_refused(drive + " --trajectory " + path("country/truth.tum") + kOrigin + "--out " + path("none.pcd"), ".ply");
}

}  // namespace
}  // namespace lodestone
