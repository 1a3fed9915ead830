// `lodestone shift` as called by users: what is shifted to the site and back is what it was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/point_cloud_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

constexpr const char* kOrigin = " --origin 432000.25,4583000.5,87 ";
const Vector3 origin_m(432000.25, 4583000.5, 87.0);

class ShiftCommand : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void expect_done(const std::string& arguments) const {
    const ProgramResult result = run_lodestone(arguments);
    ASSERT_EQ(result.code, 0) << arguments << "\n" << result.errors;
  }

  TemporaryFolder folder_;
};

TEST_F(ShiftCommand, ACloudGoesToTheCountryAndBack) {
  const std::vector<Eigen::Vector3f> points{{1.25F, -2.5F, 0.125F}, {100.0625F, 7.0F, -3.0F}};
  write_point_cloud(path("site.pcd"), points);
  expect_done("shift " + path("site.pcd") + kOrigin + "--back --out " + path("country.ply"));
  WarningLog warnings;
  const Vector3 near = origin_m - Vector3(1000.0, 0.0, 0.0);
  EXPECT_EQ(read_point_cloud(path("country.ply"), warnings, near)[0], Eigen::Vector3f(1001.25F, -2.5F, 0.125F));
  expect_done("shift " + path("country.ply") + kOrigin + "--out " + path("new/again.pcd"));
  EXPECT_EQ(content_of(path("new/again.pcd")), content_of(path("site.pcd")));
  expect_refused("shift " + path("site.pcd") + kOrigin + "--back --out " + path("country.pcd"), "ending in .ply");
}

TEST_F(ShiftCommand, ATrajectoryKeepsTenthsOfAMillimetreAtACountrysCoordinates) {
  const std::vector<std::string> lines{"1700000000.123456789 1.23456789 -0.5 0.25 0 0 0.6 0.8",
                                       "1700000000.223456789 2.34567891 -0.75 0.5 0 0 0 1"};
  std::ofstream(path("site.tum")) << lines[0] << "\n" << lines[1] << "\n";
  expect_done("shift " + path("site.tum") + kOrigin + "--back --out " + path("country.tum"));
  const Trajectory country = read_tum(path("country.tum"));
  EXPECT_NEAR(country[0].pose.position.y(), 4583000.0, 1e-6);
  expect_done("shift " + path("country.tum") + kOrigin + "--out " + path("again.tum"));
  const Trajectory expected = read_tum(path("site.tum"));
  const Trajectory again = read_tum(path("again.tum"));
  ASSERT_EQ(again.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(again[i].time, expected[i].time);
    EXPECT_LT((again[i].pose.position - expected[i].pose.position).norm(), 1e-6);
    EXPECT_LT(again[i].pose.rotation.angularDistance(expected[i].pose.rotation), 1e-8);
  }
}

TEST_F(ShiftCommand, AMagneticMapKeepsItsFieldAndProvenance) {
  FieldGrid grid;
  grid.resolution_m = 0.2;
  grid.columns = 3;
  grid.rows = 2;
  grid.heights_m = {0.5, 1.0};
  std::vector<Eigen::Vector4f> nodes;
  for (int i = 0; i < 12; ++i) nodes.emplace_back(static_cast<float>(i), 20.0F, -40.0F, 0.5F);
  nodes[8].setConstant(std::numeric_limits<float>::quiet_NaN());
  FieldMapErrors errors;
  errors.correlation_m = 0.3;
  errors.height_sigma_m = 0.02;
  write_magnetic_map(MagneticMap(grid, nodes, 2.0, errors), {{"made_by", "a test"}}, path("site.yaml"));
  expect_done("shift " + path("site.yaml") + kOrigin + "--back --out " + path("country.yaml"));
  const MagneticMap country = read_magnetic_map(path("country.yaml"));
  EXPECT_EQ(country.grid().origin, Eigen::Vector2d(432000.25, 4583000.5));
  EXPECT_EQ(country.grid().heights_m, (std::vector<double>{87.5, 88.0}));
  EXPECT_EQ(country.errors().correlation_m, 0.3);
  EXPECT_EQ(country.errors().height_sigma_m, 0.02);
  const MagneticMap site = read_magnetic_map(path("site.yaml"));
  const Vector3 place(0.1, 0.1, 0.6);
  const auto here = site.query(place, FieldInterpolation::bilinear);
  const auto there = country.query(place + origin_m, FieldInterpolation::bilinear);
  ASSERT_TRUE(here && there);
  EXPECT_LT((here->field_ut - there->field_ut).norm(), 1e-6);
  EXPECT_FALSE(country.query(origin_m + Vector3(0.3, 0.1, 0.6), FieldInterpolation::bilinear).has_value());
  const std::string yaml = content_of(path("country.yaml"));
  EXPECT_THAT(
      yaml, testing::AllOf(testing::HasSubstr("made_by"), testing::HasSubstr("a test"), testing::HasSubstr("shifted")));
  expect_done("shift " + path("country.yaml") + kOrigin + "--out " + path("again.yaml"));
  EXPECT_EQ(read_magnetic_map(path("again.yaml")).grid().origin, Eigen::Vector2d::Zero());
  EXPECT_EQ(read_magnetic_map(path("again.yaml")).grid().heights_m, site.grid().heights_m);
}

TEST_F(ShiftCommand, RefusesInOneLine) {
  std::ofstream(path("site.tum")) << "1 0 0 0 0 0 0 1\n";
  std::ofstream(path("platform.yaml")) << "imu: {}\nlidar: {}\nmagnetometers: []\n";
  expect_refused("shift " + path("absent.tum") + kOrigin + "--out " + path("a.tum"),
                 "absent.tum: there is no such file");
  expect_refused("shift " + path("platform.yaml") + kOrigin + "--out " + path("a.tum"),
                 "expected a cloud map, a magnetic map's YAML or a trajectory; this looks like a platform file");
  expect_refused("shift " + path("site.tum") + " --origin 1,2 --out " + path("a.tum"), "--origin");
  expect_refused("shift " + path("site.tum") + " --origin 1,nan,2 --out " + path("a.tum"), "three finite numbers");
  expect_refused("shift " + path("site.tum") + kOrigin + "--out " + path("a.csv"), ".tum");
  std::ofstream(path("mine.tum")) << "2 0 0 0 0 0 0 1\n";
  expect_refused("shift " + path("site.tum") + kOrigin + "--out " + path("mine.tum"), "mine.tum: the file exists");
  EXPECT_EQ(content_of(path("mine.tum")), "2 0 0 0 0 0 0 1\n");
  expect_done("shift " + path("site.tum") + kOrigin + "--force --out " + path("mine.tum"));
  expect_refused("shift " + path("site.tum") + kOrigin + "--out " + path("site.tum"), "site.tum");
  EXPECT_FALSE(std::filesystem::exists(path("a.tum")));
}

}  // namespace
}  // namespace lodestone
