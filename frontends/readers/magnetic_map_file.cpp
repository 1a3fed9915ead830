#include "frontends/readers/magnetic_map_file.h"

#include <fmt/format.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/error.h"
#include "frontends/configuration/configuration_node.h"
#include "frontends/readers/text_file.h"

namespace lodestone {
namespace {

constexpr int pages_per_layer = 4;
constexpr const char* unit = "microtesla";

/// OpenCV logs what it also reports by its result; the user gets one line, ours.
class QuietOpenCv {
 public:
  QuietOpenCv() : before_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {}
  ~QuietOpenCv() { cv::utils::logging::setLogLevel(before_); }

 private:
  cv::utils::logging::LogLevel before_;
};

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') result += '\\';
    result += letter == '\n' ? ' ' : letter;
  }
  return result + "\"";
}

std::vector<cv::Mat> pages_of(const MagneticMap& map) {
  const FieldGrid& grid = map.grid();
  const int layers = static_cast<int>(grid.heights_m.size());
  std::vector<cv::Mat> pages;
  for (int layer = 0; layer < layers; ++layer) {
    for (int page = 0; page < pages_per_layer; ++page) pages.emplace_back(grid.rows, grid.columns, CV_32FC1);
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Eigen::Vector4f node = map.node(layer, row, column);
        for (int page = 0; page < pages_per_layer; ++page) {
          pages[layer * pages_per_layer + page].at<float>(grid.rows - 1 - row, column) = node[page];
        }
      }
    }
  }
  return pages;
}

void write_image(const std::vector<cv::Mat>& pages, const std::filesystem::path& path) {
  const std::filesystem::path aside = path.parent_path() / ("." + path.stem().string() + ".part.tif");
  std::error_code code;
  bool written = false;
  try {
    const QuietOpenCv quiet;
    written = cv::imwrite(aside.string(), pages, {cv::IMWRITE_TIFF_COMPRESSION, 1});
  } catch (const cv::Exception&) {
  }
  if (written) std::filesystem::rename(aside, path, code);
  if (!written || code) {
    std::filesystem::remove(aside, code);
    throw InputError(path.string() + ": cannot be written; does the folder exist, and is there room on the disk?");
  }
}

std::vector<cv::Mat> read_image(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) {
    throw InputError(path + ": there is no such file, though the map's yaml names it as its image");
  }
  std::vector<cv::Mat> pages;
  bool good = false;
  try {
    const QuietOpenCv quiet;
    good = cv::imreadmulti(path, pages, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
  }
  if (!good || pages.empty()) throw InputError(path + ": is no readable TIFF; write the map again");
  return pages;
}

double positive(const ConfigurationNode& node) {
  const double value = node.as_double();
  if (!(value > 0.0)) node.fail("expected a positive number");
  return value;
}

}  // namespace

void write_magnetic_map(const MagneticMap& map, const Provenance& provenance, const std::string& yaml_path) {
  const std::filesystem::path image = std::filesystem::path(yaml_path).replace_extension(".tif");
  if (image == std::filesystem::path(yaml_path)) {
    throw InputError(yaml_path + ": expected a name ending in .yaml; the image beside it takes .tif");
  }
  const FieldGrid& grid = map.grid();
  std::string heights;
  for (const double height : grid.heights_m) heights += (heights.empty() ? "" : ", ") + fmt::format("{}", height);
  std::string text =
      "# Ambient magnetic field on a grid. Pages of the image: B_x, B_y, B_z, sigma of each layer, float32.\n"
      "# A pixel is a node; the image's first row has the largest y; origin_m is the centre of the lower left pixel.\n";
  text += fmt::format("resolution_m: {}\norigin_m: [{}, {}]\nheights_m: [{}]\nunit: {}\nframe: map\n", grid.resolution_m,
                      grid.origin.x(), grid.origin.y(), heights, unit);
  text += fmt::format("max_sigma_ut: {}\nimage: {}\n", map.max_sigma_ut(), quoted(image.filename().string()));
  text += provenance.empty() ? "provenance: {}\n" : "provenance:\n";
  for (const auto& [name, value] : provenance) text += "  " + name + ": " + quoted(value) + "\n";
  write_image(pages_of(map), image);
  write_text_file(yaml_path, text);
}

MagneticMap read_magnetic_map(const std::string& yaml_path) {
  const ConfigurationNode node = ConfigurationNode::load(yaml_path);
  node.refuse_keys_other_than(
      {"resolution_m", "origin_m", "heights_m", "unit", "frame", "max_sigma_ut", "image", "provenance"});
  if (const std::string found = node.at("unit").as_string(); found != unit) {
    node.at("unit").fail(fmt::format("expected {}, found '{}'; convert the image to {}", unit, found, unit));
  }
  if (const std::string found = node.at("frame").as_string(); found != "map") {
    node.at("frame").fail("expected map, found '" + found + "'; the field's components must be along the map's axes");
  }
  FieldGrid grid;
  grid.resolution_m = positive(node.at("resolution_m"));
  const std::vector<double> origin = node.at("origin_m").as_doubles(2);
  grid.origin = {origin[0], origin[1]};
  grid.heights_m = node.at("heights_m").as_doubles();
  if (grid.heights_m.empty()) node.at("heights_m").fail("expected at least one height");
  for (std::size_t i = 1; i < grid.heights_m.size(); ++i) {
    if (!(grid.heights_m[i] > grid.heights_m[i - 1])) node.at("heights_m").fail("expected increasing heights");
  }
  const double max_sigma = positive(node.at("max_sigma_ut"));

  const std::string image =
      (std::filesystem::path(yaml_path).parent_path() / node.at("image").as_string()).string();
  const std::vector<cv::Mat> pages = read_image(image);
  const std::size_t expected = pages_per_layer * grid.heights_m.size();
  if (pages.size() != expected) {
    throw InputError(fmt::format("{}: expected {} pages (B_x, B_y, B_z, sigma for each of {} heights in {}), found {}",
                                 image, expected, grid.heights_m.size(), yaml_path, pages.size()));
  }
  grid.columns = pages[0].cols;
  grid.rows = pages[0].rows;
  for (std::size_t i = 0; i < pages.size(); ++i) {
    if (pages[i].type() != CV_32FC1) {
      throw InputError(fmt::format("{}: page {} is not float32 with one channel; save it as 32-bit grey", image, i + 1));
    }
    if (pages[i].cols != grid.columns || pages[i].rows != grid.rows) {
      throw InputError(fmt::format("{}: page {} has {} x {} pixels, page 1 has {} x {}; all must be of one size", image,
                                   i + 1, pages[i].cols, pages[i].rows, grid.columns, grid.rows));
    }
  }
  if (grid.columns < 2 || grid.rows < 2) {
    throw InputError(fmt::format("{}: {} x {} pixels; a map needs at least two a side", image, grid.columns, grid.rows));
  }
  std::vector<Eigen::Vector4f> nodes;
  nodes.reserve(static_cast<std::size_t>(grid.columns) * grid.rows * grid.heights_m.size());
  for (std::size_t layer = 0; layer < grid.heights_m.size(); ++layer) {
    const cv::Mat* page = &pages[layer * pages_per_layer];
    for (int row = grid.rows - 1; row >= 0; --row) {
      for (int column = 0; column < grid.columns; ++column) {
        nodes.emplace_back(page[0].at<float>(row, column), page[1].at<float>(row, column),
                           page[2].at<float>(row, column), page[3].at<float>(row, column));
      }
    }
  }
  return MagneticMap(grid, nodes, max_sigma);
}

}  // namespace lodestone
