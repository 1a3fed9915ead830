#include "frontends/maps/magnetic_map_file.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "frontends/configuration/configuration_node.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/yaml_text.h"
#include "frontends/maps/raster_file.h"
#include "frontends/maps/raster_writer.h"

namespace lodestone {
namespace {

constexpr int pages_per_layer = 4;
constexpr const char* unit = "microtesla";

/// The nodes of a map, read from its file.
class RasterNodes final : public FieldNodes {
 public:
  explicit RasterNodes(std::unique_ptr<const RasterFile> file) : file_(std::move(file)) {}

  bool read(int layer, int row, int column, int rows, int columns, Eigen::Vector4f* nodes) const override {
    for (int page = pages_per_layer - 1; page >= 0; --page) {  // sigma first: nodes without sigma have no field
      const cv::Mat1f values = file_->read(layer * pages_per_layer + page, {column, row, columns, rows});
      bool any = false;
      for (std::size_t i = 0; i < values.total(); ++i) {
        nodes[i][page] = values(static_cast<int>(i));
        any = any || std::isfinite(nodes[i][page]);
      }
      if (!any) return false;
    }
    return true;
  }

 private:
  std::unique_ptr<const RasterFile> file_;
};

void write_image(const MagneticMap& map, int tile, const std::filesystem::path& path) {
  const FieldGrid& grid = map.grid();
  std::vector<std::string> names;
  for (const double height : grid.heights_m) {
    for (const char* name : {"B_x", "B_y", "B_z", "sigma"})
      names.push_back(fmt::format("{} at {:g} m, uT", name, height));
  }
  const RasterLayout layout{{grid.columns, grid.rows}, grid.resolution_m, grid.origin};
  write_raster(path, layout, tile, names, [&](int page, const cv::Rect& window, cv::Mat1f& values) {
    bool any = false;
    for (int row = 0; row < window.height; ++row) {
      for (int column = 0; column < window.width; ++column) {
        float& value = values(row, column);
        value = map.node(page / pages_per_layer, window.y + row, window.x + column)[page % pages_per_layer];
        any = any || std::isfinite(value);
      }
    }
    return any;
  });
}

double positive(const ConfigurationNode& node) {
  const double value = node.as_double();
  if (!(value > 0.0)) node.fail("expected a positive number");
  return value;
}

}  // namespace

void write_magnetic_map(const MagneticMap& map, const Provenance& provenance, const std::string& yaml_path, int tile) {
  const std::filesystem::path image = std::filesystem::path(yaml_path).replace_extension(".tif");
  if (image == std::filesystem::path(yaml_path)) {
    throw InputError(yaml_path + ": expected a name ending in .yaml; .tif is the ending of the image");
  }
  const FieldGrid& grid = map.grid();
  std::string text =
      "# Ambient magnetic field on a grid. Pages of the image: B_x, B_y, B_z, sigma of each layer, float32.\n"
      "# A pixel is a node; the image's first row has the largest y; origin_m is the centre of the lower left pixel.\n";
  text += fmt::format("resolution_m: {}\norigin_m: [{}, {}]\nheights_m: [{}]\nunit: {}\nframe: map\n",
                      grid.resolution_m, grid.origin.x(), grid.origin.y(), fmt::join(grid.heights_m, ", "), unit);
  text += fmt::format("max_sigma_ut: {}\nimage: {}\n", map.max_sigma_ut(), quoted_yaml(image.filename().string()));
  const FieldMapErrors& errors = map.errors();
  if (errors.correlation_m > 0.0) text += fmt::format("error_correlation_m: {}\n", errors.correlation_m);
  if (!errors.sigma_shares.isOnes(0.0)) {
    const Vector3& shares = errors.sigma_shares;
    text += fmt::format("sigma_shares: [{}, {}, {}]\n", shares.x(), shares.y(), shares.z());
  }
  if (errors.height_sigma_m >= 0.0) text += fmt::format("height_sigma_m: {}\n", errors.height_sigma_m);
  text += provenance.empty() ? "provenance: {}\n" : "provenance:\n";
  for (const auto& [name, value] : provenance) text += "  " + name + ": " + quoted_yaml(value) + "\n";
  write_image(map, tile, image);
  write_text_file(yaml_path, text);
}

namespace {

std::string image_beside(const std::string& yaml_path, const ConfigurationNode& node) {
  return (std::filesystem::path(yaml_path).parent_path() / node.at("image").as_string()).string();
}

double rounded(double value_m) {
  return std::round(value_m * 1e6) / 1e6 + 0.0;
}

void subtract(const Vector3& origin_m, FieldGrid& grid) {
  grid.origin = Eigen::Vector2d(rounded(grid.origin.x() - origin_m.x()), rounded(grid.origin.y() - origin_m.y()));
  for (double& height : grid.heights_m) height = rounded(height - origin_m.z());
}

}  // namespace

std::string image_of_magnetic_map(const std::string& yaml_path) {
  return image_beside(yaml_path, ConfigurationNode::load(yaml_path));
}

MagneticMap read_magnetic_map(const std::string& yaml_path, std::size_t max_bytes, const Vector3& origin_m) {
  const std::string ending = std::filesystem::path(yaml_path).extension().string();
  if (ending == ".csv" || ending == ".txt" || ending == ".tsv") {
    throw InputError(yaml_path + ": expected a magnetic map's YAML; convert this table with `lodestone map import`");
  }
  require_kind(yaml_path, SeemingKind::magnetic_map, "a magnetic map's YAML");
  const ConfigurationNode node = ConfigurationNode::load(yaml_path);
  node.refuse_keys_other_than({"resolution_m", "origin_m", "heights_m", "unit", "frame", "max_sigma_ut",
                               "error_correlation_m", "sigma_shares", "height_sigma_m", "image", "provenance"});
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
  if (!origin_m.isZero(0.0)) subtract(origin_m, grid);
  const double max_sigma = positive(node.at("max_sigma_ut"));
  FieldMapErrors errors;
  if (const ConfigurationNode* correlation = node.find("error_correlation_m")) {
    errors.correlation_m = positive(*correlation);
  }
  if (const ConfigurationNode* shares = node.find("sigma_shares")) {
    errors.sigma_shares = Vector3(shares->as_doubles(3).data());
    if (!(errors.sigma_shares.minCoeff() > 0.0)) shares->fail("expected three positive numbers");
  }
  if (const ConfigurationNode* sigma = node.find("height_sigma_m")) {
    errors.height_sigma_m = sigma->as_double();
    if (!(errors.height_sigma_m >= 0.0)) sigma->fail("expected a number that is not negative");
  }

  const std::string image = image_beside(yaml_path, node);
  std::error_code code;
  if (!std::filesystem::is_regular_file(image, code)) {
    throw InputError(image + ": there is no such file, but the map's YAML names this image; copy it there");
  }
  auto file = std::make_unique<const RasterFile>(image);
  const std::size_t expected = pages_per_layer * grid.heights_m.size();
  if (static_cast<std::size_t>(file->pages()) != expected) {
    throw InputError(fmt::format("{}: expected {} pages (B_x, B_y, B_z, sigma for each of {} heights in {}), found {}",
                                 image, expected, grid.heights_m.size(), yaml_path, file->pages()));
  }
  grid.columns = file->size().width;
  grid.rows = file->size().height;
  if (grid.columns < 2 || grid.rows < 2) {
    throw InputError(
        fmt::format("{}: {} x {} pixels; a map requires at least two pixels per side", image, grid.columns, grid.rows));
  }
  return MagneticMap(grid, std::make_shared<RasterNodes>(std::move(file)), max_sigma, max_bytes, errors);
}

std::string heights_text(const FieldGrid& grid) {
  const std::vector<double>& heights_m = grid.heights_m;
  if (heights_m.size() == 1) return fmt::format("at {:.3f} m height", heights_m.front());
  return fmt::format("{} layers from {:.3f} to {:.3f} m height", heights_m.size(), heights_m.front(), heights_m.back());
}

}  // namespace lodestone
