#include "frontends/maps/magnetic_difference_file.h"

#include <fmt/format.h>

#include <filesystem>

#include "frontends/configuration/text_file.h"
#include "frontends/configuration/yaml_text.h"
#include "frontends/maps/raster_writer.h"

namespace lodestone {
namespace {

constexpr int difference_pages = 4;
constexpr int tile = 64;

}  // namespace

void write_magnetic_difference(const MagneticDifference& difference, const std::string& first,
                               const std::string& second, const std::string& yaml_path) {
  const std::filesystem::path image = std::filesystem::path(yaml_path).replace_extension(".tif");
  const FieldGrid& grid = difference.grid;
  std::vector<std::string> names;
  for (const double height : grid.heights_m) {
    for (const char* name : {"dB_x", "dB_y", "dB_z", "|dB|"})
      names.push_back(fmt::format("{} at {:g} m, uT", name, height));
  }
  const RasterLayout layout{{grid.columns, grid.rows}, grid.resolution_m, grid.origin};
  write_raster(image, layout, tile, names, [&](int page, const cv::Rect& window, cv::Mat1f& values) {
    bool any = false;
    for (const DifferencePiece& piece : difference.pieces) {
      const cv::Rect part = window & cv::Rect(piece.column, piece.row, piece.columns, piece.rows);
      for (int row = part.y; row < part.br().y; ++row) {
        for (int column = part.x; column < part.br().x; ++column) {
          const Eigen::Vector4f& node = piece.at(page / difference_pages, row - piece.row, column - piece.column);
          const int component = page % difference_pages;
          values(row - window.y, column - window.x) = component < 3 ? node[component] : node.head<3>().norm();
          any = true;
        }
      }
    }
    return any;
  });
  std::string text =
      "# Difference of two magnetic maps, second minus first. Pages of the image: dB_x, dB_y, dB_z, |dB| of each "
      "layer, "
      "float32.\n"
      "# A pixel is a node; the image's first row has the largest y; origin_m is the centre of the lower left pixel.\n";
  text += fmt::format("first: {}\nsecond: {}\nresolution_m: {}\norigin_m: [{}, {}]\nheights_m: [{}]\n",
                      quoted_yaml(first), quoted_yaml(second), grid.resolution_m, grid.origin.x(), grid.origin.y(),
                      fmt::join(grid.heights_m, ", "));
  text += fmt::format("unit: microtesla\nframe: map\nimage: {}\n", quoted_yaml(image.filename().string()));
  write_text_file(yaml_path, text);
}

}  // namespace lodestone
