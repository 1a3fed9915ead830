#include "frontends/maps/raster_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "core/error.h"
#include "frontends/maps/raster_writer.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

class Raster : public ::testing::Test {
 protected:
  Raster() : path_(folder_.path() / "raster.tif") {}

  static float value(int page, int row, int column) {
    return (row + 2 * column + page) % 11 == 0
               ? std::nanf("")
               : static_cast<float>(1000 * page + row) + 1e-3F * static_cast<float>(column);
  }

  void write(const RasterLayout& layout, int tile, int pages) const {
    write_raster(path_, layout, tile, std::vector<std::string>(static_cast<std::size_t>(pages), "page"),
                 [](int page, const cv::Rect& window, cv::Mat1f& values) {
                   for (int row = 0; row < window.height; ++row) {
                     for (int column = 0; column < window.width; ++column) {
                       values(row, column) = value(page, window.y + row, window.x + column);
                     }
                   }
                   return true;
                 });
  }

  std::string error() const {
    try {
      const RasterFile file(path_.string());
      file.read(0, {{0, 0}, file.size()});
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  testing::TemporaryFolder folder_;
  std::filesystem::path path_;
};

TEST_F(Raster, AnyWindowReadsBackTheBits) {
  std::mt19937 generator(1);
  for (const int tile : {16, 48}) {
    write({{101, 67}, 0.1, {3.0, 4.0}}, tile, 3);
    const RasterFile file(path_.string(), 10000);  // a cache that is almost empty
    ASSERT_EQ(file.size(), cv::Size(101, 67));
    ASSERT_EQ(file.pages(), 3);
    for (int i = 0; i < 300; ++i) {
      const int column = static_cast<int>(generator() % 101);
      const int row = static_cast<int>(generator() % 67);
      const cv::Rect window(column, row, 1 + static_cast<int>(generator() % (101U - column)),
                            1 + static_cast<int>(generator() % (67U - row)));
      const int page = static_cast<int>(generator() % 3);
      const cv::Mat1f values = file.read(page, window);
      for (int r = 0; r < window.height; ++r) {
        for (int c = 0; c < window.width; ++c) {
          const float expected = value(page, row + r, column + c);
          ASSERT_EQ(std::memcmp(&values(r, c), &expected, 4), 0) << page << r << c;
        }
      }
    }
  }
}

TEST_F(Raster, TheFirstRowOfTheFileHasTheLargestYAndItsPlaceIsThere) {
  write({{20, 30}, 0.5, {3.0, 4.0}}, 16, 1);
  TIFF* file = TIFFOpen(path_.c_str(), "r");
  ASSERT_NE(file, nullptr);
  std::vector<float> tile(16 * 16);
  ASSERT_GT(TIFFReadEncodedTile(file, 0, tile.data(), 16 * 16 * 4), 0);
  EXPECT_EQ(tile[1], value(0, 29, 1));
  std::uint16_t count = 0;
  const double* numbers = nullptr;
  ASSERT_EQ(TIFFGetField(file, 33922, &count, &numbers), 1);
  ASSERT_EQ(count, 6);
  EXPECT_DOUBLE_EQ(numbers[3], 2.75);               // half a pixel left of the first node
  EXPECT_DOUBLE_EQ(numbers[4], 4.0 + 14.5 + 0.25);  // half a pixel above the last
  ASSERT_EQ(TIFFGetField(file, 33550, &count, &numbers), 1);
  EXPECT_DOUBLE_EQ(numbers[0], 0.5);
  TIFFClose(file);
}

TEST_F(Raster, WhatIsEmptyTakesNextToNothing) {
  const RasterLayout layout{{3000, 3000}, 0.1, {0.0, 0.0}};  // 300 x 300 m, 36 MB a page
  write_raster(path_, layout, 64, {"one"}, [](int, const cv::Rect& window, cv::Mat1f& values) {
    if (window.x != 640 || window.y > 64) return false;
    values(0) = 7.0F;
    return true;
  });
  EXPECT_LT(std::filesystem::file_size(path_), 300000U);
  const RasterFile file(path_.string());
  EXPECT_TRUE(std::isnan(file.read(0, {1500, 1500, 1, 1})(0)));
}

TEST_F(Raster, SaysWhatIsWrong) {
  using ::testing::HasSubstr;
  EXPECT_THAT(error(), HasSubstr("no such file"));
  std::ofstream(path_) << "no picture";
  EXPECT_THAT(error(), HasSubstr("is not a readable TIFF"));
  write({{300, 300}, 0.1, {0, 0}}, 16, 2);
  EXPECT_EQ(error(), "no error");
  // If pixels are missing, the message contains that the file is cut off, its expected size, and its actual size.
  const auto whole = std::filesystem::file_size(path_);
  for (const std::uintmax_t kept : {whole - whole / 50, whole * 3 / 4, whole / 2, whole / 10}) {
    write({{300, 300}, 0.1, {0, 0}}, 16, 2);
    std::filesystem::resize_file(path_, kept);
    EXPECT_THAT(error(), HasSubstr("raster.tif: is cut off")) << kept << " of " << whole;
    EXPECT_THAT(error(), HasSubstr(std::to_string(kept) + " bytes; copy the complete file, or write it again"))
        << kept << " of " << whole;
  }

  TIFF* file = TIFFOpen(path_.c_str(), "w");
  std::uint8_t row[8] = {};
  for (const int tag : {TIFFTAG_IMAGEWIDTH, TIFFTAG_IMAGELENGTH, TIFFTAG_BITSPERSAMPLE})
    TIFFSetField(file, static_cast<std::uint32_t>(tag), 8);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  for (std::uint32_t i = 0; i < 8; ++i) TIFFWriteScanline(file, row, i, 0);
  TIFFClose(file);
  EXPECT_THAT(error(), HasSubstr("page 1 is not float32"));
  EXPECT_THROW(write_raster(folder_.path() / "absent" / "raster.tif", {{20, 30}, 0.5, {3.0, 4.0}}, 16, {"one"},
                            [](int, const cv::Rect&, cv::Mat1f&) { return false; }),
               InputError);
}

}  // namespace
}  // namespace lodestone
