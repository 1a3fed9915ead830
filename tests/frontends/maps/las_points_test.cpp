// LAS files, written byte by byte as the specification lays them out (ASPRS LAS 1.4 R15).
#include "frontends/maps/las_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/error.h"
#include "frontends/maps/point_cloud_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tests/frontends/logs/test_files.h"
#include "tests/frontends/maps/las_file.h"

namespace lodestone {
namespace {

using ::lodestone::testing::LasFile;
using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::lodestone::testing::write_text;
using ::testing::HasSubstr;

class LasPointsTest : public ::testing::Test {
 protected:
  std::string file(const LasFile& las) const {
    const std::string path = folder_ / "map.las";
    write_text(path, las.bytes());
    return path;
  }
  std::string error(const LasFile& las) const {
    const std::string path = file(las);
    return message_of<InputError>([&] {
      WarningLog warnings;
      read_point_cloud(path, warnings);
    });
  }

  TemporaryFolder folder_;
};

TEST_F(LasPointsTest, PositionsAreScaledAndOffset) {
  LasFile las;
  las.announced = 2;
  las.offset = Vector3(10.0, -20.0, 0.5);
  las.add(1000, 2000, 3000);
  las.add(-1, std::numeric_limits<std::int32_t>::min() / 1000, 0);
  LasPoints points(file(las));
  EXPECT_EQ(points.count(), 2U);
  Vector3 position;
  ASSERT_TRUE(points.next(position));
  EXPECT_TRUE(position.isApprox(Vector3(11.0, -18.0, 3.5), 1e-15));
  ASSERT_TRUE(points.next(position));
  EXPECT_TRUE(position.isApprox(Vector3(9.999, -20.0 - 2147.483, 0.5), 1e-12));
  EXPECT_FALSE(points.next(position));
}

TEST_F(LasPointsTest, EveryPointFormatHasItsPositionsAndMarks) {
  const std::size_t least[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  for (int format = 0; format <= 10; ++format) {
    LasFile las;
    las.format = format;
    las.minor = format < 6 ? 2 : 4;
    las.point_bytes = least[format] + 3;  // programs append bytes of their own
    las.announced = format < 6 ? 5 : 0;
    las.announced_long = format < 6 ? 0 : 5;
    const bool is_long = format >= 6;
    las.add(1000, 0, 0, is_long ? 0 : 2, 2);          // ground
    las.add(2000, 0, 0, is_long ? 0 : 7, 7);          // low noise
    las.add(3000, 0, 0, is_long ? 0 : 2 | 0x40, 18);  // formats 0 to 5: a key point; others: high noise
    las.add(4000, 0, 0, is_long ? 0x04 : 0x82, 2);    // withheld
    las.add(5000, 0, 0, is_long ? 0x08 : 0x22, 2);    // overlap; synthetic
    WarningLog warnings;
    std::vector<Eigen::Vector3f> expected{{1, 0, 0}, {5, 0, 0}};
    if (!is_long) expected.insert(expected.begin() + 1, {3, 0, 0});
    EXPECT_EQ(read_point_cloud(file(las), warnings), expected) << format;
    EXPECT_EQ(warnings.count("cloud.marked_points"), 5 - static_cast<int>(expected.size()));
  }
}

TEST_F(LasPointsTest, TheOriginIsSubtractedBeforePositionsBecomeFloats) {
  LasFile las;
  las.scale = 0.0001;
  las.offset = Vector3(432'000.0, 4'583'000.0, 0.0);
  las.announced = 1;
  las.add(12'345, 67'891, 23'456);
  const std::string path = file(las);
  EXPECT_THAT(error(las),
              ::testing::AllOf(HasSubstr("the origin is far away"), HasSubstr("give --origin 432000,4583000,0")));
  WarningLog warnings;
  const auto points = read_point_cloud(path, warnings, Vector3(432'000.0, 4'583'000.0, 0.0));
  ASSERT_EQ(points.size(), 1U);
  EXPECT_TRUE(points[0].isApprox(Eigen::Vector3f(1.2345F, 6.7891F, 2.3456F), 1e-6F));
  // A PLY with doubles takes the position there and back.
  PointCloudWriter writer(folder_ / "back.ply", Vector3(432'000.0, 4'583'000.0, 0.0));
  writer.add(points);
  writer.commit();
  EXPECT_EQ(read_point_cloud(folder_ / "back.ply", warnings, Vector3(432'000.0, 4'583'000.0, 0.0)), points);
}

TEST_F(LasPointsTest, AnnouncedSizesAreNotBelieved) {
  LasFile las;
  las.add(1, 2, 3);
  las.announced = 2;
  EXPECT_THAT(error(las), HasSubstr("announces 2 points of 20 bytes, but 1 points follow"));
  las.minor = 4;
  las.announced = 0;
  las.announced_long = std::uint64_t{1} << 60;
  EXPECT_THAT(error(las), HasSubstr("points follow"));
  las.announced_long = 0;
  EXPECT_THAT(error(las), HasSubstr("has no points"));
}

TEST_F(LasPointsTest, WrongHeadersAreRefused) {
  LasFile good;
  good.announced = 1;
  good.add(1, 2, 3);
  WarningLog warnings;
  ASSERT_EQ(read_point_cloud(file(good), warnings).size(), 1U);
  LasFile las = good;
  las.format = 0x80;
  EXPECT_THAT(error(las), ::testing::AllOf(HasSubstr("is compressed (LAZ)"), HasSubstr("laszip -i")));
  las = good;
  las.minor = 5;
  EXPECT_THAT(error(las), HasSubstr("expected LAS 1.0 to 1.4, found version 1.5"));
  las = good;
  las.format = 11;
  EXPECT_THAT(error(las), HasSubstr("point format from 0 to 10, found 11"));
  las = good;
  las.point_bytes = 19;
  EXPECT_THAT(error(las), HasSubstr("points of 19 bytes are too small"));
  for (const double scale : {0.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    las = good;
    las.scale = scale;
    EXPECT_THAT(error(las), HasSubstr("scales and offsets are not finite"));
  }
  write_text(folder_ / "short.las", good.bytes().substr(0, 200));
  EXPECT_THAT(message_of<InputError>([&] { LasPoints(folder_ / "short.las"); }), HasSubstr("the header is cut off"));
}

}  // namespace
}  // namespace lodestone
