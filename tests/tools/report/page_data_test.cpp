// Data of a report's page: thinning, rasters, buckets, safe text.
#include "tools/report/page_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.h"
#include "tests/tools/program_runner.h"
#include "tools/markup.h"
#include "tools/report/cloud_thinning.h"
#include "tools/report/field_raster.h"
#include "tools/report/time_buckets.h"

namespace lodestone {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(TimeBuckets, KeepEveryScanWhereThereIsRoom) {
  const TimeBuckets buckets({10, 20, 30}, 3);
  EXPECT_EQ(buckets.width(), 1U);
  EXPECT_THAT(buckets.times(), ElementsAre(10, 20, 30));
  EXPECT_THAT(buckets.summarize({10, 20, 30}, {1.0, 2.0, 3.0}, Summary::largest), ElementsAre(1.0, 2.0, 3.0));
}

TEST(TimeBuckets, NeverLoseAnExtreme) {
  std::vector<Time> stamps;
  std::vector<double> values;
  for (int i = 0; i < 1003; ++i) {
    stamps.push_back(100 * i);
    values.push_back(i == 617 ? 9.0 : i == 618 ? -9.0 : std::sin(i));
  }
  const TimeBuckets buckets(stamps, 50);
  EXPECT_LE(buckets.size(), 50U);
  EXPECT_EQ(buckets.times().size(), buckets.size());
  EXPECT_EQ(buckets.times().back(), stamps.back());
  const auto largest = buckets.summarize(stamps, values, Summary::largest);
  const auto smallest = buckets.summarize(stamps, values, Summary::smallest);
  EXPECT_EQ(*std::max_element(largest.begin(), largest.end()), 9.0);
  EXPECT_EQ(*std::min_element(smallest.begin(), smallest.end()), -9.0);
  EXPECT_EQ(buckets.summarize(stamps, values, Summary::last).back(), values.back());
}

TEST(TimeBuckets, LeaveOpenWhatOneEstimatorDidNotReach) {
  const TimeBuckets buckets({10, 20, 30, 40}, 4);
  const auto values = buckets.summarize({10, 30, 35}, {1.0, 3.0, 7.0}, Summary::largest);
  EXPECT_EQ(values[0], 1.0);
  EXPECT_TRUE(std::isnan(values[1]));
  EXPECT_EQ(values[2], 3.0);
  EXPECT_TRUE(std::isnan(values[3]));
}

std::vector<Eigen::Vector3f> plate(int side, float spacing) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) points.emplace_back(spacing * i, spacing * j, 0.0F);
  }
  return points;
}

TEST(CloudThinning, StaysBelowItsLimitAndSpreadsOverTheSite) {
  const auto cloud = plate(300, 0.05F);
  CloudThinning thinning({-1.0, 20.0, -1.0, 20.0}, 1000, 0.05);
  thinning.add(cloud);
  EXPECT_LE(thinning.points().size(), 1000U);
  EXPECT_GT(thinning.points().size(), 300U);
  std::set<std::pair<int, int>> quarters;
  for (const Eigen::Vector3f& point : thinning.points()) quarters.insert({point.x() > 7.5F, point.y() > 7.5F});
  EXPECT_EQ(quarters.size(), 4U);
}

TEST(CloudThinning, DoesNotDependOnThePieces) {
  const auto cloud = plate(200, 0.05F);
  CloudThinning whole({-1.0, 20.0, -1.0, 20.0}, 700, 0.05);
  whole.add(cloud);
  CloudThinning pieces({-1.0, 20.0, -1.0, 20.0}, 700, 0.05);
  for (std::size_t i = 0; i < cloud.size(); i += 777) {
    pieces.add(std::span(cloud).subspan(i, std::min<std::size_t>(777, cloud.size() - i)));
  }
  EXPECT_EQ(whole.points(), pieces.points());
}

TEST(CloudThinning, LeavesOutWhatIsFarFromTheDrive) {
  CloudThinning thinning({0.0, 1.0, 0.0, 1.0}, 1000, 0.01);
  thinning.add(plate(100, 0.05F));
  for (const Eigen::Vector3f& point : thinning.points()) EXPECT_LE(point.head<2>().maxCoeff(), 1.0F);
  EXPECT_EQ(thinning.points().size(), 21U * 21U);
}

/// |B| rises by 1 µT per metre along x and by 3 along y; one node has no field.
MagneticMap slope() {
  FieldGrid grid;
  grid.resolution_m = 0.5;
  grid.columns = 21;
  grid.rows = 11;
  grid.origin = {-2.0, 3.0};
  grid.heights_m = {0.2};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const bool hole = row == 5 && column == 5;
      nodes.emplace_back(0.0F, 0.0F, hole ? NAN : 40.0F + 0.5F * column + 1.5F * row, 0.1F);
    }
  }
  return MagneticMap(grid, nodes, 5.0);
}

TEST(FieldRaster, IsTheMapAndComesBackFromDisk) {
  const MagneticMap map = slope();
  const PlanRaster raster = strength_raster(map, 0.2, {-100.0, 100.0, -100.0, 100.0}, 1'000'000);
  ASSERT_EQ(raster.values.cols, 21);
  ASSERT_EQ(raster.values.rows, 11);
  EXPECT_NEAR(raster.values(2, 3), 40.0 + 1.5 + 3.0, 1e-4);
  EXPECT_TRUE(std::isnan(raster.values(5, 5)));
  const TemporaryFolder folder;
  write_raster(raster, folder / "field.png");
  const PlanRaster back = read_raster(folder / "field.png");
  ASSERT_EQ(back.values.cols, raster.values.cols);
  ASSERT_EQ(back.values.rows, raster.values.rows);
  EXPECT_DOUBLE_EQ(back.x_m, -2.0);
  EXPECT_DOUBLE_EQ(back.y_m, 3.0);
  for (int row = 0; row < raster.values.rows; ++row) {
    for (int column = 0; column < raster.values.cols; ++column) {
      const float value = raster.values(row, column);
      if (std::isnan(value)) {
        EXPECT_TRUE(std::isnan(back.values(row, column))) << row << " " << column;
      } else {
        EXPECT_NEAR(back.values(row, column), value, 0.0051) << row << " " << column;
      }
    }
  }
  std::ofstream(folder / "other.png") << "no picture";
  EXPECT_THROW(read_raster(folder / "other.png"), InputError);
}

TEST(FieldRaster, IsCutToTheDriveAndNoLargerThanAsked) {
  const MagneticMap map = slope();
  const PlanRaster cut = strength_raster(map, 0.2, {0.0, 2.0, 4.0, 5.0}, 1'000'000);
  EXPECT_EQ(cut.values.cols, 5);
  EXPECT_EQ(cut.values.rows, 3);
  EXPECT_DOUBLE_EQ(cut.x_m, 0.0);
  EXPECT_TRUE(strength_raster(map, 0.2, {100.0, 200.0, 0.0, 1.0}, 1000).empty());
  const PlanRaster whole = strength_raster(map, 0.2, {-100.0, 100.0, -100.0, 100.0}, 1'000'000);
  const PlanRaster coarse = coarsened(whole, 60);
  EXPECT_LE(coarse.values.total(), 66U);
  // On a slope, the mean of neighbours is the value at their middle.
  EXPECT_NEAR(coarse.values(0, 0), 40.0 + (coarse.x_m + 2.0) + 3.0 * (coarse.y_m - 3.0), 1e-3);
}

TEST(PageData, EncodesAsTheStandardSays) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string("\xff\xfe\x00", 3)), "//4A");
  EXPECT_EQ(data_uri("image/png", "foo"), "data:image/png;base64,Zm9v");
}

TEST(PageData, CannotLeaveItsScriptElement) {
  const nlohmann::ordered_json json = {{"name", "</script><script>alert(1)</script><!--"}, {"bytes", "a\xff"}};
  const std::string text = escape_script(json);
  EXPECT_THAT(text, Not(HasSubstr("<")));
  EXPECT_EQ(nlohmann::ordered_json::parse(text)["name"], json["name"]);
  EXPECT_EQ(escape_html("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
}

TEST(PageData, RoundsAndSaysWhatIsNoNumber) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(rounded({1.23456789, 1234567.0, 0.0, NAN, infinity}, 4).dump(), "[1.235,1235000,0,null,null]");
  EXPECT_EQ(rounded({infinity}, 4, 1e6).dump(), "[1000000.0]");
  EXPECT_EQ(with_decimals({100.12345, -0.0004}, 3).dump(), "[100.123,0]");
}

/// The list of licences is complete, and no file contains the address of a registry.
TEST(PagePackages, AreListedPinnedAndOfNoPlace) {
  const std::filesystem::path source = LODESTONE_SOURCE_DIR;
  const std::string lock = content_of(source / "tools/report/page/package-lock.json");
  EXPECT_THAT(lock, Not(HasSubstr("http")));
  const auto json = nlohmann::json::parse(lock);
  const std::string list = content_of(source / "third_party/npm_packages.txt");
  for (const auto& [name, range] : json["packages"][""]["devDependencies"].items()) {
    const auto& entry = json["packages"]["node_modules/" + name];
    EXPECT_EQ(entry["version"], range) << name << " is not pinned";
    EXPECT_FALSE(entry["integrity"].get<std::string>().empty());
    EXPECT_EQ(entry["license"], "MIT");
    EXPECT_THAT(list, testing::ContainsRegex(name + " +\\| " + range.get<std::string>() + " +\\| MIT"));
  }
}

}  // namespace
}  // namespace lodestone
