#include "frontends/maps/magnetic_map_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiffio.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

class MagneticMapFile : public ::testing::Test {
 protected:
  MagneticMapFile() {
    yaml_ = (folder_.path() / "field.yaml").string();
    image_ = (folder_.path() / "field.tif").string();
  }

  static MagneticMap map(std::vector<double> heights = {0.1, 0.37}) {
    FieldGrid grid{0.07, {-3.14, 0.1 + 0.2}, 37, 21, std::move(heights)};
    std::mt19937_64 generator(1);
    std::normal_distribution<float> normal;
    std::vector<Eigen::Vector4f> nodes(37 * 21 * grid.heights_m.size());
    for (auto& node : nodes) {
      node = {30 * normal(generator), normal(generator), -45 + normal(generator), std::abs(normal(generator))};
    }
    nodes[5].setConstant(std::nanf(""));
    nodes[400].setConstant(std::nanf(""));
    return {grid, nodes, 0.1 + 0.7};
  }

  std::string error() const {
    try {
      read_magnetic_map(yaml_);
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    return "no error";
  }

  void replace(const std::string& from, const std::string& to) const {
    std::string text = read_text_file(yaml_);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_text_file(yaml_, text.replace(at, from.size(), to));
  }

  testing::TemporaryFolder folder_;
  std::string yaml_;
  std::string image_;
};

TEST_F(MagneticMapFile, ReadsBackTheSameBits) {
  const MagneticMap written = map();
  write_magnetic_map(written, {{"survey", "a \"quoted\" name"}, {"samples", "12"}}, yaml_);
  const MagneticMap read = read_magnetic_map(yaml_);
  EXPECT_EQ(read.grid().resolution_m, written.grid().resolution_m);
  EXPECT_EQ(read.grid().origin, written.grid().origin);
  EXPECT_EQ(read.grid().heights_m, written.grid().heights_m);
  EXPECT_EQ(read.max_sigma_ut(), written.max_sigma_ut());
  EXPECT_EQ(read.errors().correlation_m, 0.0);
  EXPECT_EQ(read.errors().sigma_shares, Vector3::Ones());
  EXPECT_LT(read.errors().height_sigma_m, 0.0);
  const auto a = written.nodes();
  const auto b = read.nodes();
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])), 0);
  // No other files remain in the folder.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), std::filesystem::directory_iterator()),
            2);
}

TEST_F(MagneticMapFile, KeepsWhatTheMapKnowsOfItsErrors) {
  const FieldGrid grid{0.1, {0.0, 0.0}, 3, 2, {0.1}};
  const std::vector<Eigen::Vector4f> nodes(6, {20.0F, 0.0F, -40.0F, 0.5F});
  write_magnetic_map(MagneticMap(grid, nodes, 2.0, {0.31, {1.2, 1.1, 0.57}, 0.013}), {}, yaml_);
  const FieldMapErrors errors = read_magnetic_map(yaml_).errors();
  EXPECT_EQ(errors.correlation_m, 0.31);
  EXPECT_EQ(errors.sigma_shares, Vector3(1.2, 1.1, 0.57));
  EXPECT_EQ(errors.height_sigma_m, 0.013);
  replace("sigma_shares: [1.2, 1.1, 0.57]", "sigma_shares: [1.2, 1.1]");
  EXPECT_THAT(error(), ::testing::HasSubstr("sigma_shares"));
  replace("sigma_shares: [1.2, 1.1]", "sigma_shares: [1.2, 0, 1.1]");
  EXPECT_THAT(error(), ::testing::HasSubstr("three positive numbers"));
  replace("sigma_shares: [1.2, 0, 1.1]", "sigma_shares: [1.2, 1.1, 0.57]");
  replace("height_sigma_m: 0.013", "height_sigma_m: -0.013");
  EXPECT_THAT(error(), ::testing::HasSubstr("not negative"));
}

TEST_F(MagneticMapFile, SaysWhatIsWrong) {
  using ::testing::HasSubstr;
  EXPECT_THAT(error(), HasSubstr("field.yaml"));  // missing
  write_magnetic_map(map(), {}, yaml_);
  EXPECT_EQ(error(), "no error");
  replace("heights_m: [0.1, 0.37]", "heights_m: [0.1]");
  EXPECT_THAT(error(), HasSubstr("expected 4 pages"));
  replace("heights_m: [0.1]", "heights_m: [0.4, 0.37]");
  EXPECT_THAT(error(), HasSubstr("increasing"));
  replace("heights_m: [0.4, 0.37]", "heigths_m: [0.1, 0.37]");
  EXPECT_THAT(error(), HasSubstr("heights_m"));
  replace("heigths_m", "heights_m");
  replace("unit: microtesla", "unit: tesla");
  EXPECT_THAT(error(), HasSubstr("expected microtesla"));
  replace("unit: tesla", "unit: microtesla");
  replace("resolution_m: 0.07", "resolution_m: -1");
  EXPECT_THAT(error(), HasSubstr("positive"));
  replace("resolution_m: -1", "resolution_m: 0.07");
  EXPECT_EQ(error(), "no error");
  const std::string whole = read_text_file(image_);
  write_text_file(image_, "no picture");
  EXPECT_THAT(error(), HasSubstr("is not a readable TIFF"));
  write_text_file(image_, whole.substr(0, whole.size() / 2));
  EXPECT_THAT(error(), HasSubstr("field.tif"));
  std::filesystem::remove(image_);
  EXPECT_THAT(error(), HasSubstr("no such file"));
}

/// Maps of earlier versions and of other programs: strips, no compression, no georeference.
TEST_F(MagneticMapFile, ReadsImagesInStripsToTheSameBits) {
  const MagneticMap written = map();
  write_magnetic_map(written, {}, yaml_);
  const FieldGrid& grid = written.grid();
  TIFF* file = TIFFOpen(image_.c_str(), "w");
  for (int page = 0; page < 8; ++page) {
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, grid.columns);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, grid.rows);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 32);
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 5);
    for (int row = 0; row < grid.rows; ++row) {
      std::vector<float> values;
      for (int column = 0; column < grid.columns; ++column) {
        values.push_back(written.node(page / 4, grid.rows - 1 - row, column)[page % 4]);
      }
      TIFFWriteScanline(file, values.data(), static_cast<std::uint32_t>(row), 0);
    }
    TIFFWriteDirectory(file);
  }
  TIFFClose(file);
  const auto a = written.nodes();
  const auto b = read_magnetic_map(yaml_).nodes();
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])), 0);
}

TEST_F(MagneticMapFile, RefusesAFolderThatIsNotThere) {
  EXPECT_THROW(write_magnetic_map(map(), {}, (folder_.path() / "absent" / "field.yaml").string()), InputError);
  EXPECT_THROW(write_magnetic_map(map(), {}, (folder_.path() / "field.tif").string()), InputError);
}

}  // namespace
}  // namespace lodestone
