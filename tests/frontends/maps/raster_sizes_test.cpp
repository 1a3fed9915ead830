// Sizes stated in a TIFF are not trusted; memory for pages and empty tiles is bounded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "core/error.h"
#include "frontends/maps/raster_file.h"
#include "frontends/maps/raster_writer.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A TIFF written byte by byte; its only page may announce any sizes.
struct CraftedTiff {
  std::uint32_t columns = 0, rows = 0;
  std::uint32_t tile = 0;  ///< a side; 0: one strip
  std::uint16_t compression = COMPRESSION_ADOBE_DEFLATE;
  std::uint32_t announced = 0;  ///< bytes of each tile

  void write(const std::string& path, const std::string& data) const {
    std::string text("II*\0", 4);
    const auto put16 = [&text](std::uint16_t value) { text.append(reinterpret_cast<const char*>(&value), 2); };
    const auto put32 = [&text](std::uint32_t value) { text.append(reinterpret_cast<const char*>(&value), 4); };
    put32(8 + static_cast<std::uint32_t>(data.size()));
    text += data;
    std::vector<std::array<std::uint32_t, 2>> tags{{256, columns}, {257, rows}, {258, 32}, {259, compression},
                                                   {262, 1},       {277, 1},    {284, 1},  {339, SAMPLEFORMAT_IEEEFP}};
    if (tile > 0) {
      tags.insert(tags.end(), {{322, tile}, {323, tile}, {324, 8}, {325, announced}});
    } else {
      tags.insert(tags.end(), {{273, 8}, {278, rows}, {279, announced}});
    }
    std::sort(tags.begin(), tags.end());
    put16(static_cast<std::uint16_t>(tags.size()));
    for (const auto& [tag, value] : tags) {
      put16(static_cast<std::uint16_t>(tag));
      put16(TIFF_LONG);
      put32(1);
      put32(value);
    }
    put32(0);
    std::ofstream(path, std::ios::binary) << text;
  }
};

/// 1000 floats of one value, packed.
std::string packed_floats() {
  const std::vector<float> values(1000, 1.0F);
  std::string packed(1000, '\0');
  auto size = static_cast<uLongf>(packed.size());
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(values.data()), 4000);
  packed.resize(size);
  return packed;
}

TEST(RasterSizes, AnnouncedSizesAreNotBelieved) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "raster.tif";
  const std::string data = packed_floats();
  const auto size = static_cast<std::uint32_t>(data.size());
  const auto error = [&](const CraftedTiff& crafted) {
    crafted.write(path, data);
    return message_of<InputError>([&] { const RasterFile file(path); });
  };
  EXPECT_THAT(error({1U << 22U, 1U << 22U, 0, COMPRESSION_ADOBE_DEFLATE, size}),
              AllOf(HasSubstr("raster.tif: is damaged: page 1 announces tiles of 4194304 x 4194304 pixels"),
                    HasSubstr("has only " + std::to_string(size) + " bytes; copy the complete file")));
  EXPECT_THAT(error({40000, 40000, 40000, COMPRESSION_ADOBE_DEFLATE, size}),
              HasSubstr("tiles of 40000 x 40000 pixels (6400000000 bytes)"));
  EXPECT_THAT(error({128, 128, 128, COMPRESSION_NONE, size}), HasSubstr("(65536 bytes), one of which has only"));
  EXPECT_THAT(error({2048, 2048, 2048, COMPRESSION_LZW, size}), HasSubstr("(16777216 bytes), one of which has only"));
  // Memory is bounded for any stated compression of a tile, and for missing tiles.
  EXPECT_THAT(error({1U << 15U, 1U << 15U, 1U << 15U, COMPRESSION_ADOBE_DEFLATE, 0}),
              HasSubstr("save the file in smaller tiles"));
  EXPECT_THAT(error({4096, 4096, 16, COMPRESSION_ADOBE_DEFLATE, size}),
              HasSubstr("announce 65536 tiles, but the file has"));

  CraftedTiff{16, 62, 0, COMPRESSION_ADOBE_DEFLATE, size}.write(path, data);  // 992 of the 1000 values
  EXPECT_EQ(RasterFile(path).read(0, {15, 61, 1, 1})(0), 1.0F);
}

/// Tiles, or strips, some of which are missing.
void write_in_pieces(const std::string& path, std::uint32_t columns, std::uint32_t rows, std::uint32_t tile,
                     std::uint32_t strip_rows, const std::vector<std::uint32_t>& pieces) {
  TIFF* file = TIFFOpen(path.c_str(), "w");
  ASSERT_NE(file, nullptr);
  TIFFSetField(file, TIFFTAG_IMAGEWIDTH, columns);
  TIFFSetField(file, TIFFTAG_IMAGELENGTH, rows);
  TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 32);
  TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  if (tile > 0) {
    TIFFSetField(file, TIFFTAG_TILEWIDTH, tile);
    TIFFSetField(file, TIFFTAG_TILELENGTH, tile);
  } else {
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, strip_rows);
  }
  for (const std::uint32_t piece : pieces) {
    const std::uint32_t piece_rows = tile > 0 ? tile : std::min(strip_rows, rows - piece * strip_rows);
    std::vector<float> values(static_cast<std::size_t>(tile > 0 ? tile : columns) * piece_rows,
                              static_cast<float>(10 + piece));
    const auto bytes = static_cast<tmsize_t>(values.size() * sizeof(float));
    const auto write = tile > 0 ? TIFFWriteEncodedTile : TIFFWriteEncodedStrip;
    EXPECT_EQ(write(file, piece, values.data(), bytes), bytes);
  }
  TIFFClose(file);
}

TEST(RasterSizes, AbsentTilesAndAShortLastStripAreRead) {
  const testing::TemporaryFolder folder;
  const std::string path = folder / "raster.tif";
  write_in_pieces(path, 48, 16, 16, 0, {1});
  cv::Mat1f values = RasterFile(path).read(0, {0, 0, 48, 16});
  for (int i = 0; i < 48 * 16; ++i) {
    const bool there = i % 48 >= 16 && i % 48 < 32;
    ASSERT_TRUE(there ? values(i) == 11.0F : std::isnan(values(i))) << i << ": " << values(i);
  }
  write_in_pieces(path, 5, 10, 0, 4, {0, 1, 2});
  values = RasterFile(path).read(0, {0, 0, 5, 10});
  for (int row = 0; row < 10; ++row) EXPECT_EQ(values(row, 2), row < 2 ? 12.0F : row < 6 ? 11.0F : 10.0F) << row;
}

TEST(RasterSizes, ManyPagesTakeFewFiles) {
  const auto open_files = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  const testing::TemporaryFolder folder;
  constexpr int pages = 1200;  // 300 heights
  const auto value = [](int page, int row, int column) {
    return static_cast<float>(10000 * page + 100 * row + column);
  };
  write_raster(folder / "raster.tif", {{40, 20}, 0.1, {0.0, 0.0}}, 16, std::vector<std::string>(pages, "page"),
               [&](int page, const cv::Rect& window, cv::Mat1f& values) {
                 for (int row = 0; row < window.height; ++row) {
                   for (int column = 0; column < window.width; ++column) {
                     values(row, column) = value(page, window.y + row, window.x + column);
                   }
                 }
                 return true;
               });
  const auto before = open_files();
  const RasterFile file(folder / "raster.tif", 10000);  // a cache that is almost empty
  EXPECT_LE(open_files() - before, 16);
  ASSERT_EQ(file.pages(), pages);
  std::mt19937 generator(3);
  for (int i = 0; i < 5000; ++i) {
    const int page = static_cast<int>(generator() % pages);
    const int row = static_cast<int>(generator() % 20U), column = static_cast<int>(generator() % 40U);
    ASSERT_EQ(file.read(page, {column, row, 1, 1})(0), value(page, row, column));
  }
}

}  // namespace
}  // namespace lodestone
