// `lodestone check --cloud` measures the cloud map: a sparse, thick, doubled or ragged one is warned of, a clean one
// not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "frontends/maps/point_cloud_file.h"
#include "tests/tools/check/check_site.h"
#include "tools/check/check_report.h"

namespace lodestone {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A floor of 24 × 24 m, 500 points a square metre, of which `doubled` lies 5 cm higher once more.
std::vector<Eigen::Vector3f> floor_cloud(double sigma_m, double doubled = 0.0, double per_m2 = 500.0) {
  constexpr double kSize_m = 24.0;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.11, sigma_m);
  std::uniform_real_distribution<double> along(0.0, kSize_m);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < static_cast<int>(per_m2 * kSize_m * kSize_m); ++i) {
    const Eigen::Vector3f point = Eigen::Vector3d(along(random), along(random), noise(random)).cast<float>();
    points.push_back(point);
    if (point.x() < kSize_m * doubled) points.emplace_back(along(random) * doubled, point.y(), point.z() + 0.05);
  }
  return points;
}

std::vector<std::string> kinds(const std::vector<Eigen::Vector3f>& points) {
  std::vector<std::string> found;
  for (const Finding& one : check_cloud({measure_cloud(points, {})}, {}, "site.pcd")) {
    EXPECT_EQ(one.severity, Severity::warning);
    EXPECT_THAT(one.seen, HasSubstr("site.pcd"));
    EXPECT_FALSE(one.change.empty());
    found.push_back(one.kind);
  }
  return found;
}

TEST(CloudChecks, ACleanMapRaisesNothing) {
  EXPECT_THAT(kinds(floor_cloud(0.005)), IsEmpty());
  EXPECT_THAT(kinds(floor_cloud(0.01, 0.02)), IsEmpty());
}

TEST(CloudChecks, EachFaultHasItsFinding) {
  EXPECT_THAT(kinds(floor_cloud(0.018)), ElementsAre("cloud.thick"));
  EXPECT_THAT(kinds(floor_cloud(0.006, 0.1)), ElementsAre("cloud.doubled"));
  EXPECT_THAT(kinds(floor_cloud(0.005, 0.0, 40.0)), ElementsAre("cloud.sparse"));
  std::vector<Eigen::Vector3f> bushes = floor_cloud(0.005);
  for (const Eigen::Vector3f& point : floor_cloud(0.3, 0.0, 2000.0))
    bushes.emplace_back(point + Eigen::Vector3f(30, 0, 2));
  EXPECT_THAT(kinds(bushes), ElementsAre("cloud.off_planes"));
}

TEST(CloudChecks, OfALargeCloudCubesAreMeasured) {
  const std::vector<Eigen::Vector3f> points = floor_cloud(0.006, 0.5);
  write_point_cloud(site().file("large.pcd"), points);
  PlaneMapOptions options;
  const CloudMeasurement whole = measure_cloud_file(site().file("large.pcd"), options);
  options.tile_above_points = 250000;
  const CloudMeasurement part = measure_cloud_file(site().file("large.pcd"), options);
  EXPECT_EQ(part.points, static_cast<std::int64_t>(points.size()));
  EXPECT_EQ(part.high_m, whole.high_m);
  EXPECT_LE(part.quality.points, 250000);
  ASSERT_GT(part.quality.points, 0);
  EXPECT_NEAR(part.quality.median_thickness_m, whole.quality.median_thickness_m, 0.0003);
}

TEST(CloudChecks, TheReportHasTheFigures) {
  CheckCall call = site().call();
  call.seconds = 2.0;
  const CheckResult result = check_log(call);
  ASSERT_TRUE(result.cloud.has_value());
  EXPECT_THAT(check_text(result), HasSubstr("thickness of surfaces, median, mm"));
  write_check_json(site().file("cloud.json"), result);
  const auto json = nlohmann::json::parse(content_of(site().file("cloud.json")));
  EXPECT_EQ(json["cloud"]["points"].get<std::size_t>(), site().cloud().size());
  EXPECT_LT(json["cloud"]["doubled_share"].get<double>(), 0.05);
  EXPECT_GT(json["cloud"]["on_planes_share"].get<double>(), 0.5);
}

}  // namespace
}  // namespace lodestone
