#include "frontends/maps/point_cloud_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "core/error.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::lodestone::testing::write_text;
using ::testing::HasSubstr;

std::string pcd_header(const std::string& fields, int points) {
  const std::string n = std::to_string(points);
  std::string sizes;
  std::string types;
  std::string counts;
  for (std::size_t i = 0; i < 1 + static_cast<std::size_t>(std::count(fields.begin(), fields.end(), ' ')); ++i) {
    sizes += " 4";
    types += " F";
    counts += " 1";
  }
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS " + fields + "\nSIZE" + sizes + "\nTYPE" + types + "\nCOUNT" + counts +
         "\nWIDTH " + n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA ascii\n";
}

std::string cloud_error(const std::string& path) {
  WarningLog warnings;
  return message_of<InputError>([&] { read_point_cloud(path, warnings); });
}

TEST(PointCloudFile, ReadsBackWhatItWrote) {
  const TemporaryFolder folder;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 1000; ++i)
    points.emplace_back(0.1F * static_cast<float>(i), -3.0F, 1e-3F * static_cast<float>(i));
  write_point_cloud(folder / "map.pcd", points);
  WarningLog warnings;
  EXPECT_EQ(read_point_cloud(folder / "map.pcd", warnings), points);
  EXPECT_TRUE(warnings.entries().empty());
  EXPECT_THAT(message_of<InputError>([&] { write_point_cloud(folder / "absent/map.pcd", points); }),
              HasSubstr("cannot be written"));
}

TEST(PointCloudFile, ReadsAsciiWithFurtherFieldsAndCountsNan) {
  const TemporaryFolder folder;
  write_text(folder / "map.pcd", pcd_header("intensity z y x", 3) + "9 3 2 1\n9 nan 2 1\n9 6 5 4\n");
  WarningLog warnings;
  const auto points = read_point_cloud(folder / "map.pcd", warnings);
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(points[1], Eigen::Vector3f(4, 5, 6));
  EXPECT_EQ(warnings.count("cloud.nan_points"), 1);
}

TEST(PointCloudFile, ACountrysCoordinatesAreRefusedAndAFewFarOnesDropped) {
  const TemporaryFolder folder;
  const Eigen::Vector3f far(463012.0F, 5254871.0F, 480.0F);
  write_point_cloud(folder / "country.pcd", std::vector<Eigen::Vector3f>(10, far));
  EXPECT_THAT(cloud_error(folder / "country.pcd"),
              ::testing::AllOf(HasSubstr("country.pcd: the origin is far away, a point is at (463012, 5254871, 480) m"),
                               HasSubstr("give --origin 463000,5255000,0")));
  write_point_cloud(folder / "few.pcd", {{1, 2, 3}, {1e20F, 0, 0}, {0, -3e9F, 0}, {4, 5, 6}, far});
  WarningLog warnings;
  EXPECT_EQ(read_point_cloud(folder / "few.pcd", warnings), (std::vector<Eigen::Vector3f>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(warnings.count("cloud.far_points"), 3);
  write_point_cloud(folder / "absurd.pcd", {{1e20F, 0, 0}});
  EXPECT_THAT(cloud_error(folder / "absurd.pcd"), HasSubstr("no finite points within 10,000 km"));
}

TEST(PointCloudFile, AnnouncedSizesAreNotBelieved) {
  const TemporaryFolder folder;
  std::string many = pcd_header("x y z", 2);  // a point of 400 kB
  many.replace(many.find("ascii"), 5, "binary").replace(many.find("COUNT 1 1 1"), 11, "COUNT 1 1 99998");
  std::string points(2 * 400'000, '\0');
  const float second[3] = {1, 2, 3};
  std::memcpy(points.data() + 400'000, second, 12);
  write_text(folder / "many.pcd", many + points);
  WarningLog warnings;
  EXPECT_EQ(read_point_cloud(folder / "many.pcd", warnings), (std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 2, 3}}));
  // PCL would read the fields again, with another size per point than the allocated one.
  write_text(folder / "twice.pcd", pcd_header("x y z", 2) + "\n# values\nFIELDS-1 0 0\n1 2 3\n4 5 6\n");
  EXPECT_THAT(cloud_error(folder / "twice.pcd"), HasSubstr("a line FIELDS after the line DATA"));
  // PCL would treat the blank line as the end of the header, and read points outside the allocated memory.
  write_text(folder / "blank.pcd", "\r\n" + pcd_header("x y z", 2) + "1 2 3\n4 5 6\n");
  EXPECT_THAT(cloud_error(folder / "blank.pcd"), HasSubstr("a blank line in the header"));
  std::string bomb = pcd_header("x y z", 75'000'000);
  bomb.replace(bomb.find("ascii"), 5, "binary_compressed");
  const std::uint32_t sizes[2] = {100, 900'000'000};
  bomb.append(reinterpret_cast<const char*>(sizes), 8).append(100, '\xff');
  write_text(folder / "bomb.pcd", bomb);
  EXPECT_THAT(cloud_error(folder / "bomb.pcd"), HasSubstr("it announces 900000000 bytes, packed in 108"));
}

TEST(PointCloudFile, MoreTextThanPclCountsIsRefusedWithTheWayToBinary) {
  const TemporaryFolder folder;
  // 4 GiB and one point, which would overwrite the first.
  write_text(folder / "map.pcd", pcd_header("x y z", 357'913'942) + "1 2 3\n");
  EXPECT_THAT(cloud_error(folder / "map.pcd"),
              ::testing::AllOf(HasSubstr("map.pcd: 357913942 points of 12 bytes as text, of which at most 357913941"),
                               HasSubstr("as binary PCD or as PLY")));
  write_text(folder / "map.pcd", pcd_header("x y z", 357'913'941) + "1 2 3\n");
  EXPECT_THAT(cloud_error(folder / "map.pcd"), HasSubstr("is cut off"));
}

TEST(PointCloudFile, ReadsCompressedPcd) {
  const TemporaryFolder folder;
  // LZF with literals only: length minus one, then the bytes. Compressed files store each field contiguously.
  const float columns[6] = {1, 4, 2, 5, 3, 6};
  const std::uint32_t sizes[2] = {25, 24};
  std::string text = pcd_header("x y z", 2);
  text.replace(text.find("ascii"), 5, "binary_compressed");
  text.append(reinterpret_cast<const char*>(sizes), 8).append(1, 23).append(reinterpret_cast<const char*>(columns), 24);
  write_text(folder / "map.pcd", text);
  WarningLog warnings;
  EXPECT_EQ(read_point_cloud(folder / "map.pcd", warnings),
            (std::vector<Eigen::Vector3f>{Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(4, 5, 6)}));
}

TEST(PointCloudFile, ReadsPlyByItsContentNotItsName) {
  const TemporaryFolder folder;
  write_text(folder / "map.pcd",
             "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
             "end_header\n1 2 3\n4 5 6\n");
  WarningLog warnings;
  EXPECT_EQ(read_point_cloud(folder / "map.pcd", warnings).size(), 2U);
}

/// A PLY of two points with numbers of `kind` and other elements: colours before, a list of faces after.
template <class Number>
std::string binary_ply(const std::string& kind, bool big_endian) {
  std::string text = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                     "_endian 1.0\ncomment made elsewhere\nelement vertex 2\nproperty uchar red\nproperty uchar "
                     "green\nproperty uchar blue\nproperty uchar "
                     "alpha\nproperty " +
                     kind + " x\nproperty " + kind + " y\nproperty " + kind +
                     " z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof(value));
    if (big_endian) std::reverse(bytes.begin(), bytes.end());
    text += bytes;
  };
  for (int i = 0; i < 2; ++i) {
    text += "\x7F\x10\x20\xFF";
    for (int axis = 1; axis <= 3; ++axis) put(static_cast<Number>(3 * i + axis) + Number(0.5));
  }
  text += '\x03';
  for (const int index : {0, 1, 0}) put(index);
  return text;
}

TEST(PointCloudFile, ReadsBinaryPlyOfEitherByteOrderAndBothKindsOfNumbers) {
  const TemporaryFolder folder;
  const std::vector<Eigen::Vector3f> expected{Eigen::Vector3f(1.5F, 2.5F, 3.5F), Eigen::Vector3f(4.5F, 5.5F, 6.5F)};
  for (const bool big_endian : {false, true}) {
    for (const bool doubles : {false, true}) {
      SCOPED_TRACE(std::string(big_endian ? "big" : "little") + (doubles ? " double" : " float"));
      const std::string text =
          doubles ? binary_ply<double>("double", big_endian) : binary_ply<float>("float", big_endian);
      std::ofstream(folder / "map.ply", std::ios::binary) << text;
      WarningLog warnings;
      EXPECT_EQ(read_point_cloud(folder / "map.ply", warnings), expected);
      std::ofstream(folder / "cut.ply", std::ios::binary) << text.substr(0, text.size() - 30);
      EXPECT_THAT(cloud_error(folder / "cut.ply"), HasSubstr("cannot be read"));
    }
  }
}

TEST(PointCloudFile, TheWriterNeedsAKnownEndingAndDoublesForAnOrigin) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { PointCloudWriter(folder / "map.xyz"); }),
              HasSubstr("expected a name ending in .pcd or .ply, found '.xyz'"));
  EXPECT_THAT(message_of<InputError>([&] { PointCloudWriter(folder / "map.pcd", Vector3(1.0, 0.0, 0.0)); }),
              HasSubstr("ending in .ply"));
  { PointCloudWriter(folder / "abandoned.pcd").add(std::vector<Eigen::Vector3f>{{1, 2, 3}}); }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(PointCloudFile, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  EXPECT_THAT(cloud_error(folder / "absent.pcd"), HasSubstr("there is no such file"));
  EXPECT_THAT(cloud_error(folder.path().string()), HasSubstr("expected a PCD, PLY or LAS file, found a folder"));
  write_text(folder / "zero.pcd", "");
  EXPECT_THAT(cloud_error(folder / "zero.pcd"), HasSubstr("the file is empty (0 bytes)"));
  write_text(folder / "text.pcd", "hello\n");
  EXPECT_THAT(cloud_error(folder / "text.pcd"), HasSubstr("is no PCD, PLY or LAS file"));
  write_text(folder / "empty.pcd", pcd_header("x y z", 0));
  EXPECT_THAT(cloud_error(folder / "empty.pcd"), HasSubstr("has no points"));
  write_point_cloud(folder / "none.pcd", {});
  EXPECT_THAT(cloud_error(folder / "none.pcd"), HasSubstr("has no points"));
  write_text(folder / "nan.pcd", pcd_header("x y z", 1) + "nan nan nan\n");
  EXPECT_THAT(cloud_error(folder / "nan.pcd"), HasSubstr("no finite points"));
  write_text(folder / "flat.pcd", pcd_header("x y", 1) + "1 2\n");
  EXPECT_THAT(cloud_error(folder / "flat.pcd"), HasSubstr("no field 'z'; the file has x, y"));
  write_point_cloud(folder / "cut.pcd", std::vector<Eigen::Vector3f>(1000, Eigen::Vector3f::Ones()));
  const auto whole = std::filesystem::file_size(folder / "cut.pcd");
  std::filesystem::resize_file(folder / "cut.pcd", whole - 12 * 400 - 1);
  EXPECT_THAT(cloud_error(folder / "cut.pcd"),
              HasSubstr("cut.pcd: is cut off: the header announces 1000 points of 12 bytes, but 599 "
                        "points (7199 bytes) follow; copy or write it again"));
  write_text(folder / "cut_text.pcd", pcd_header("x y z", 5) + "1 2 3\n4 5 6\n\n7 8 9");
  EXPECT_THAT(cloud_error(folder / "cut_text.pcd"),
              HasSubstr("the header announces 5 points, but 3 lines of values follow"));
  write_text(folder / "platform.yaml", "name: robot\nlidar: {topic: /points}\nimu: {topic: /imu}\nmagnetometers: []\n");
  EXPECT_THAT(cloud_error(folder / "platform.yaml"), HasSubstr("this looks like a platform file"));
  write_text(folder / "cut.ply", "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n");
  EXPECT_THAT(cloud_error(folder / "cut.ply"), HasSubstr("cannot be read"));
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\nproperty float y\n";
  write_text(folder / "huge.ply", header + "property float z\nend_header\n" + std::string(1200, '?'));
  EXPECT_THAT(cloud_error(folder / "huge.ply"), HasSubstr("ends too early"));
  write_text(folder / "flat.ply", header + "property uchar red\nend_header\n");
  EXPECT_THAT(cloud_error(folder / "flat.ply"), HasSubstr("no field 'z'; the file has x, y, red"));
  write_text(
      folder / "whole.ply",
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\nend_header\n1 2 3\n");
  EXPECT_THAT(cloud_error(folder / "whole.ply"),
              HasSubstr("whole.ply: the field 'x' is not a floating-point number; write x, y and z as floats"));
  write_text(folder / "whole.pcd",
             "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE I I I\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
             "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n");
  EXPECT_THAT(cloud_error(folder / "whole.pcd"),
              HasSubstr("whole.pcd: the field 'x' is not a floating-point number; write x, y and z as floats"));
}

TEST(PointCloudFile, ReadsRealMaps) {
  WarningLog warnings;
  LODESTONE_REAL_DATA(map, "lidar/ouster_map.ply");
  EXPECT_EQ(read_point_cloud(map, warnings).size(), 155000U);
  LODESTONE_REAL_DATA(source, "lidar/source.ply");
  EXPECT_GT(read_point_cloud(source, warnings).size(), 10000U);
}

}  // namespace
}  // namespace lodestone
